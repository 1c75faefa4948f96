#include "viewer/bench/child_process.h"

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <utility>

#include <fcntl.h>
#include <poll.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

namespace vcp {

namespace {

constexpr int kPollMilliseconds = 100;
constexpr size_t kLongestComplaint = 4096;

// What the child sends: frames of a kind, a length and so many bytes.
enum class Frame : char { Progress = 'p', Value = 'v', Failure = 'e' };
constexpr size_t kFrameHeader = 1 + sizeof(uint64_t);

Error lastError(const std::string& what) { return {ErrorCode::Io, what + ": " + std::strerror(errno)}; }

/// One end of a pipe.
class Descriptor {
public:
    Descriptor() = default;
    explicit Descriptor(int number) : number_(number) {}
    Descriptor(Descriptor&& other) noexcept : number_(std::exchange(other.number_, -1)) {}
    Descriptor& operator=(Descriptor&& other) noexcept {
        std::swap(number_, other.number_);
        return *this;
    }
    ~Descriptor() { close(); }

    [[nodiscard]] int number() const { return number_; }
    void close() {
        if (number_ >= 0) ::close(number_);
        number_ = -1;
    }

private:
    int number_ = -1;
};

struct Pipe {
    Descriptor read, write;
};

Result<Pipe> makePipe() {
    int ends[2];
    if (::pipe2(ends, O_CLOEXEC) != 0) return lastError("no pipe to a child process");
    return Pipe{Descriptor(ends[0]), Descriptor(ends[1])};
}

bool writeAll(int descriptor, const std::string& bytes) {
    for (size_t done = 0; done < bytes.size();) {
        const ssize_t count = ::write(descriptor, bytes.data() + done, bytes.size() - done);
        if (count < 0 && errno == EINTR) continue;
        if (count < 0) return false;
        done += size_t(count);
    }
    return true;
}

template <class Number>
std::string bytesOf(Number number) {
    return {reinterpret_cast<const char*>(&number), sizeof(number)};
}

/// Takes a number from the front of `text`.
template <class Number>
Number takeNumber(std::string& text) {
    Number number{};
    std::memcpy(&number, text.data(), std::min(sizeof(number), text.size()));
    text.erase(0, sizeof(number));
    return number;
}

std::string takeText(std::string& text) {
    const auto size = takeNumber<uint64_t>(text);
    std::string taken = text.substr(0, size);
    text.erase(0, size);
    return taken;
}

std::string sized(const std::string& text) { return bytesOf<uint64_t>(text.size()) + text; }

std::string packed(const Error& error) {
    return bytesOf(error.code) + sized(error.message) + sized(error.file) + sized(error.element) +
           (error.byte ? bytesOf(*error.byte) : std::string());
}

Error unpacked(std::string text) {
    Error error;
    error.code = takeNumber<ErrorCode>(text);
    error.message = takeText(text);
    error.file = takeText(text);
    error.element = takeText(text);
    if (!text.empty()) error.byte = takeNumber<uint64_t>(text);
    return error;
}

[[noreturn]] void beChild(const ChildWork& work, int stop, int out) {
    // The child notices at its next report that the parent is gone, not by a signal.
    std::signal(SIGPIPE, SIG_IGN);
    const auto send = [&](Frame kind, const std::string& payload) {
        return writeAll(out, std::string(1, char(kind)) + sized(payload));
    };
    const auto report = [&](const std::string& what, double fraction) {
        pollfd asked{stop, POLLIN, 0};
        return ::poll(&asked, 1, 0) == 0 && send(Frame::Progress, bytesOf(fraction) + what);
    };
    const auto result = work(report);
    const bool told = result ? send(Frame::Value, *result) : send(Frame::Failure, packed(result.error()));
    ::_exit(told ? 0 : 1);
}

/// What the parent has received.
struct Heard {
    std::string bytes;  // bytes that are not yet a whole frame
    std::string what;
    double fraction = 0;
    std::optional<Result<std::string>> result;

    void take(const char* more, size_t count) {
        bytes.append(more, count);
        while (bytes.size() >= kFrameHeader) {
            uint64_t size = 0;
            std::memcpy(&size, bytes.data() + 1, sizeof(size));
            if (bytes.size() - kFrameHeader < size) return;
            std::string payload = bytes.substr(kFrameHeader, size);
            const auto kind = static_cast<Frame>(bytes[0]);
            bytes.erase(0, kFrameHeader + size);
            if (kind == Frame::Progress) {
                fraction = takeNumber<double>(payload);
                what = std::move(payload);
            } else if (kind == Frame::Value)
                result.emplace(std::move(payload));
            else
                result.emplace(unpacked(std::move(payload)));
        }
    }
};

/// Passes on what arrives until the other end is closed; keeps calling `goOn`, and calls `stop` once it returns false.
void listen(int from, const std::function<void(const char*, size_t)>& hear, const std::function<bool()>& goOn,
            const std::function<void()>& stop) {
    bool stopping = false;
    char buffer[4096];
    for (;;) {
        pollfd waiting{from, POLLIN, 0};
        if (::poll(&waiting, 1, kPollMilliseconds) > 0) {
            const ssize_t count = ::read(from, buffer, sizeof(buffer));
            if (count == 0 || (count < 0 && errno != EINTR)) return;
            if (count > 0) hear(buffer, size_t(count));
        }
        if (!stopping && !goOn()) {
            stopping = true;
            stop();
        }
    }
}

double seconds(const timeval& time) { return double(time.tv_sec) + 1e-6 * double(time.tv_usec); }

int waitFor(pid_t child, rusage& usage) {
    int status = 0;
    while (::wait4(child, &status, 0, &usage) < 0 && errno == EINTR) {
    }
    return status;
}

std::string firstLine(const std::string& text) { return text.substr(0, text.find('\n')); }

}  // namespace

Result<ChildOutcome> runInChild(const ChildWork& work, const ChildProgress& progress) {
    VCP_TRY_ASSIGN(auto out, makePipe());
    VCP_TRY_ASSIGN(auto stop, makePipe());
    const pid_t child = ::fork();
    if (child < 0) return lastError("no child process");
    if (child == 0) {
        out.read.close();
        stop.write.close();
        beChild(work, stop.read.number(), out.write.number());
    }
    out.write.close();
    stop.read.close();
    Heard heard;
    listen(
        out.read.number(), [&](const char* bytes, size_t count) { heard.take(bytes, count); },
        [&] { return !progress || progress(heard.what, heard.fraction); }, [&] { stop.write.close(); });
    rusage usage{};
    const int status = waitFor(child, usage);
    if (!heard.result) {
        if (WIFSIGNALED(status) && WTERMSIG(status) == SIGKILL)
            return Error{.code = ErrorCode::Limit,
                         .message = "the child process was killed; is there too little memory?"};
        return Error{.code = ErrorCode::Limit,
                     .message = "the child process ended without a result, with status " + std::to_string(status)};
    }
    if (!*heard.result) return heard.result->error();
    return ChildOutcome{**heard.result, seconds(usage.ru_utime) + seconds(usage.ru_stime),
                        uint64_t(usage.ru_maxrss) * 1024};
}

Result<void> runProgram(const std::vector<std::string>& arguments, const std::function<bool()>& progress) {
    VCP_TRY_ASSIGN(auto errors, makePipe());
    std::vector<char*> argv;
    for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
    argv.push_back(nullptr);
    const pid_t child = ::fork();
    if (child < 0) return lastError("no child process");
    if (child == 0) {
        ::dup2(::open("/dev/null", O_WRONLY | O_CLOEXEC), STDOUT_FILENO);
        ::dup2(errors.write.number(), STDERR_FILENO);
        ::execv(argv[0], argv.data());
        static_cast<void>(writeAll(STDERR_FILENO, std::string("cannot be started: ") + std::strerror(errno)));
        ::_exit(127);
    }
    errors.write.close();
    bool cancelled = false;
    std::string said;
    listen(
        errors.read.number(),
        [&](const char* bytes, size_t count) {
            if (said.size() < kLongestComplaint) said.append(bytes, count);
        },
        [&] { return !progress || progress(); },
        [&] {
            cancelled = true;
            ::kill(child, SIGTERM);
        });
    rusage usage{};
    const int status = waitFor(child, usage);
    if (cancelled) return Error::cancelled();
    if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return {};
    return Error{.code = ErrorCode::Io,
                 .message = said.empty() ? "failed without a word" : firstLine(said),
                 .file = arguments.front()};
}

}  // namespace vcp
