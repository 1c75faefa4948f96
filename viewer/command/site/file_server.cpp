#include "viewer/command/site/file_server.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>
#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstring>
#include <list>
#include <optional>
#include <thread>
#include <vector>

#include <fmt/format.h>

#include "octree/io/durable_file.h"
#include "octree/io/file_descriptor.h"
#include "streaming/shard/shard_manifest.h"
#include "viewer/command/site/http_request.h"

namespace vcp {

namespace {

namespace fs = std::filesystem;

constexpr size_t kMostHead = 16 << 10;    // bytes of a request
constexpr size_t kMostConnections = 64;   // at once; others wait
constexpr int kTurnMs = 100;              // so often it is asked whether to stop
constexpr int kIdleTurns = 300;           // a connection that says nothing so long ends
constexpr size_t kMostDrained = 1 << 20;  // bytes
constexpr size_t kPiece = 256 << 10;      // bytes read and sent at once

std::string_view typeOf(const fs::path& file) {
    const std::string extension = file.extension().string();
    if (extension == ".html") return "text/html; charset=utf-8";
    if (extension == ".js" || extension == ".mjs") return "text/javascript; charset=utf-8";
    if (extension == ".css") return "text/css; charset=utf-8";
    if (extension == ".json") return "application/json";
    if (extension == ".wasm") return "application/wasm";
    if (extension == ".png") return "image/png";
    if (extension == ".svg") return "image/svg+xml";
    return "application/octet-stream";
}

class Connection {
public:
    Connection(const fs::path& folder, int socket, const std::atomic<bool>& stop)
        : folder_(folder), socket_(socket), stop_(stop) {}

    void serve() {
        while (const auto head = readHead()) {
            const auto [request, problem] = parseRequest(*head);
            if (problem ? !refuse(int(*problem), request) : !answer(request)) return;
            if (request.closes) return drain();
        }
    }

private:
    /// Waits for the socket; false where it is time to stop, or nothing came for long.
    [[nodiscard]] bool wait(short what) const {
        for (int turn = 0; turn < kIdleTurns && !stop_; ++turn) {
            pollfd socket{socket_.number(), what, 0};
            if (::poll(&socket, 1, kTurnMs) > 0) return true;
        }
        return false;
    }

    /// Reads what is still on its way, for a while: closing at once would take back the answer before it.
    void drain() const {
        ::shutdown(socket_.number(), SHUT_WR);
        char piece[4096];
        for (size_t read = 0; read < kMostDrained && wait(POLLIN);) {
            const ssize_t got = ::recv(socket_.number(), piece, sizeof piece, 0);
            if (got <= 0) return;
            read += size_t(got);
        }
    }

    /// Returns the head of the next request, an empty one where it is too long; nothing at the end.
    std::optional<std::string> readHead() {
        constexpr std::string_view kEnd = "\r\n\r\n";
        for (;;) {
            if (const size_t end = buffer_.find(kEnd); end != std::string::npos) {
                std::string head = buffer_.substr(0, end + kEnd.size());
                buffer_.erase(0, head.size());
                return head;
            }
            if (buffer_.size() > kMostHead) return std::string();
            if (!wait(POLLIN)) return std::nullopt;
            char piece[4096];
            const ssize_t got = ::recv(socket_.number(), piece, sizeof piece, 0);
            if (got < 0 && errno == EINTR) continue;
            if (got <= 0) return std::nullopt;
            buffer_.append(piece, size_t(got));
        }
    }

    [[nodiscard]] bool send(std::string_view bytes) const {
        while (!bytes.empty()) {
            if (!wait(POLLOUT)) return false;
            const ssize_t sent = ::send(socket_.number(), bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
            if (sent < 0 && (errno == EINTR || errno == EAGAIN)) continue;
            if (sent <= 0) return false;
            bytes.remove_prefix(size_t(sent));
        }
        return true;
    }

    bool refuse(int status, const HttpRequest& request, const std::string& more = {}) const {
        const std::string_view what = status == 404   ? "Not Found"
                                      : status == 405 ? "Method Not Allowed"
                                      : status == 416 ? "Range Not Satisfiable"
                                                      : "Bad Request";
        return send(fmt::format("HTTP/1.1 {} {}\r\nContent-Type: text/plain\r\n{}{}Content-Length: {}\r\n\r\n{}",
                                status, what, more, request.closes ? "Connection: close\r\n" : "", what.size(),
                                request.isHead ? std::string_view() : what));
    }

    /// Returns the file that a path names; nothing where there is none in the folder.
    [[nodiscard]] std::optional<fs::path> fileAt(const std::string& path) const {
        std::error_code failed;
        fs::path file = fs::canonical(folder_ / path.substr(1), failed);
        if (!failed && fs::is_directory(file, failed)) file = fs::canonical(file / "index.html", failed);
        if (failed || !fs::is_regular_file(file, failed)) return std::nullopt;
        const auto [inFolder, inFile] = std::mismatch(folder_.begin(), folder_.end(), file.begin(), file.end());
        if (inFolder != folder_.end()) return std::nullopt;
        return file;
    }

    bool answer(const HttpRequest& request) const {
        const auto path = fileAt(request.path);
        if (!path) return refuse(404, request);
        const FileDescriptor file(::open(path->c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK));
        struct stat info {};
        if (file.number() < 0 || ::fstat(file.number(), &info) != 0 || !S_ISREG(info.st_mode))
            return refuse(404, request);
        const auto size = uint64_t(info.st_size);
        const FileRange range = fileRange(request.range, size);
        if (range.kind == RangeKind::Unsatisfiable)
            return refuse(416, request, fmt::format("Content-Range: bytes */{}\r\n", size));
        const bool isPart = range.kind == RangeKind::Part;
        std::string head = fmt::format("HTTP/1.1 {}\r\nContent-Type: {}\r\nContent-Length: {}\r\n",
                                       isPart ? "206 Partial Content" : "200 OK", typeOf(*path), range.bytes.count);
        if (isPart)
            head += fmt::format("Content-Range: bytes {}-{}/{}\r\n", range.bytes.first,
                                range.bytes.first + range.bytes.count - 1, size);
        head += fmt::format("ETag: \"{:x}-{:x}-{:x}\"\r\n", size, info.st_mtim.tv_sec, info.st_mtim.tv_nsec);
        // A shard's name says what is in it.
        const char* const kept = isShardName(path->filename().string()) ? "max-age=31536000, immutable" : "no-cache";
        head += fmt::format("Accept-Ranges: bytes\r\nCache-Control: {}\r\nX-Content-Type-Options: nosniff\r\n", kept);
        if (request.closes) head += "Connection: close\r\n";
        return send(head + "\r\n") && (request.isHead || sendBody(file.number(), range.bytes));
    }

    [[nodiscard]] bool sendBody(int file, ByteStretch bytes) const {
        std::vector<char> piece(std::min<uint64_t>(kPiece, bytes.count));
        while (bytes.count > 0) {
            const ssize_t got =
                ::pread(file, piece.data(), std::min<uint64_t>(piece.size(), bytes.count), off_t(bytes.first));
            if (got < 0 && errno == EINTR) continue;
            if (got <= 0 || !send({piece.data(), size_t(got)})) return false;
            bytes.first += uint64_t(got);
            bytes.count -= uint64_t(got);
        }
        return true;
    }

    const fs::path& folder_;
    const FileDescriptor socket_;
    const std::atomic<bool>& stop_;
    std::string buffer_;
};

/// The threads of the connections.
class Connections {
public:
    ~Connections() {
        stop_ = true;
        for (auto& one : all_) one->thread.join();
    }
    void add(const fs::path& folder, int socket) {
        auto& one = all_.emplace_back(std::make_unique<One>());
        one->thread = std::thread([this, &folder, socket, &ended = one->ended] {
            Connection(folder, socket, stop_).serve();
            ended = true;
        });
    }
    /// Returns how many are left of them.
    size_t left() {
        all_.remove_if([](const std::unique_ptr<One>& one) {
            if (!one->ended) return false;
            one->thread.join();
            return true;
        });
        return all_.size();
    }

private:
    struct One {
        std::thread thread;
        std::atomic<bool> ended = false;
    };
    std::list<std::unique_ptr<One>> all_;
    std::atomic<bool> stop_ = false;
};

}  // namespace

Result<std::unique_ptr<FileServer>> FileServer::listen(const fs::path& folder, const std::string& address,
                                                       uint16_t port) {
    std::error_code failed;
    const fs::path root = fs::canonical(folder, failed);
    if (failed) return systemError(folder, "cannot be opened", failed.value());
    if (!fs::is_directory(root, failed))
        return Error{.code = ErrorCode::Usage, .message = "is no folder", .file = folder.string()};
    sockaddr_in at{};
    at.sin_family = AF_INET;
    at.sin_port = htons(port);
    if (::inet_pton(AF_INET, address.c_str(), &at.sin_addr) != 1)
        return Error{.code = ErrorCode::Usage, .message = "\"" + address + "\" is no IPv4 address"};
    FileDescriptor socket(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
    const int yes = 1;
    auto* const name = reinterpret_cast<sockaddr*>(&at);
    socklen_t bytes = sizeof at;
    if (socket.number() < 0 || ::setsockopt(socket.number(), SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes) != 0 ||
        ::bind(socket.number(), name, bytes) != 0 || ::listen(socket.number(), SOMAXCONN) != 0 ||
        ::getsockname(socket.number(), name, &bytes) != 0)
        return systemError(fmt::format("{}:{}", address, port), "cannot be listened at", errno,
                           "choose another --port");
    return std::unique_ptr<FileServer>(new FileServer(root, socket.release(), ntohs(at.sin_port)));
}

FileServer::~FileServer() { ::close(socket_); }

Result<void> FileServer::run(const std::function<bool()>& stop) {
    Connections connections;
    while (!stop()) {
        if (connections.left() >= kMostConnections) {
            ::poll(nullptr, 0, kTurnMs);
            continue;
        }
        pollfd socket{socket_, POLLIN, 0};
        if (::poll(&socket, 1, kTurnMs) <= 0) continue;
        const int connection = ::accept4(socket_, nullptr, nullptr, SOCK_CLOEXEC);
        if (connection >= 0) connections.add(folder_, connection);
    }
    return {};
}

}  // namespace vcp
