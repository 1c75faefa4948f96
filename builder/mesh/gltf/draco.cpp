#include "builder/mesh/gltf/draco.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include "builder/mesh/gltf/draco_child.h"
#include "builder/stream/chunk_room.h"

namespace vcp {
namespace {

constexpr uint64_t kLeastSeconds = 8;
constexpr uint64_t kSecondsPerMiB = 2;
constexpr size_t kMostMessage = 4096;

uint64_t addressSpaceBytes() {
    uint64_t pages = 0;
    if (std::FILE* const file = std::fopen("/proc/self/statm", "re")) {
        unsigned long value = 0;
        if (std::fscanf(file, "%lu", &value) == 1) pages = value;
        std::fclose(file);
    }
    return pages * uint64_t(::sysconf(_SC_PAGESIZE));
}

void limit(decltype(RLIMIT_AS) what, uint64_t value) {
    rlimit bounds{};
    ::getrlimit(what, &bounds);
    bounds.rlim_cur = std::min<rlim_t>(bounds.rlim_max, value);
    bounds.rlim_max = bounds.rlim_cur;
    ::setrlimit(what, &bounds);
}

// Runs in the child: sets its limits, and signals as a plain program has them. It lives no longer than its parent.
void confine(uint64_t memoryBytes, uint64_t seconds, pid_t parent) {
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (::getppid() != parent) ::_exit(1);
    for (const int signal : {SIGSEGV, SIGBUS, SIGABRT, SIGFPE, SIGILL, SIGPIPE, SIGTERM}) ::signal(signal, SIG_DFL);
    ::signal(SIGINT, SIG_IGN);  // the parent decides when to stop
    limit(RLIMIT_CORE, 0);
    limit(RLIMIT_CPU, seconds);
    limit(RLIMIT_AS, addressSpaceBytes() + memoryBytes);
    // What the C library prints before it aborts does not help the reader of one clear line.
    const int nothing = ::open("/dev/null", O_WRONLY | O_CLOEXEC);
    if (nothing >= 0) ::dup2(nothing, STDERR_FILENO);
}

class DracoStream final : public MeshStream {
public:
    DracoStream(std::string name, std::string element, uint64_t fileBytes, uint64_t memoryBytes)
        : name_(std::move(name)),
          element_(std::move(element)),
          memoryBytes_(memoryBytes),
          seconds_(kLeastSeconds + kSecondsPerMiB * (fileBytes >> 20)) {
        info_.format = "Draco";
        info_.fileBytes = fileBytes;
    }
    DracoStream(const DracoStream&) = delete;
    DracoStream& operator=(const DracoStream&) = delete;
    ~DracoStream() override {
        if (pipe_ >= 0) ::close(pipe_);
        if (child_ > 0) {
            ::kill(child_, SIGKILL);
            while (::waitpid(child_, nullptr, 0) < 0 && errno == EINTR) {
            }
        }
    }

    Result<void> begin(const DracoBytes& bytes, const DracoSelection& selection) {
        VCP_TRY(startChild(bytes, selection));
        VCP_TRY(receive(&reply_, sizeof reply_));
        if (reply_.failed > 0) return childError();
        info_.vertices = reply_.vertices;
        info_.faces = reply_.faces;
        info_.hasColour = reply_.hasColour != 0;
        return {};
    }

    [[nodiscard]] const MeshInfo& info() const override { return info_; }
    [[nodiscard]] uint64_t bytesRead() const override { return info_.fileBytes; }

    Result<bool> next(MeshChunk& chunk) override {
        chunk.clear();
        while (hasRoom(chunk) && face_ < reply_.faces) {
            if (vertex_ < reply_.vertices)
                VCP_TRY(receiveVertices(chunk));
            else
                VCP_TRY(receiveFaces(chunk));
        }
        return !isEmpty(chunk);
    }

private:
    static constexpr uint64_t kBatch = 4096;

    Error error(ErrorCode code, std::string message) const {
        return {code, std::move(message), name_, element_, std::nullopt};
    }

    Result<void> startChild(const DracoBytes& bytes, const DracoSelection& selection) {
        int ends[2];
        if (::pipe2(ends, O_CLOEXEC) != 0) return systemError("no pipe to the Draco decoder");
        const pid_t parent = ::getpid();
        child_ = ::fork();
        if (child_ == 0) {
            ::close(ends[0]);
            confine(memoryBytes_, seconds_, parent);
            runDracoChild(bytes, selection, ends[1]);
        }
        ::close(ends[1]);
        pipe_ = ends[0];
        if (child_ < 0) return systemError("the Draco decoder cannot be started");
        return {};
    }

    Error systemError(const std::string& what) const {
        return error(ErrorCode::Io, what + ": " + std::generic_category().message(errno));
    }

    // Reads from the child; waits no longer than twice the time that it may compute.
    Result<void> receive(void* to, size_t bytes) {
        char* p = static_cast<char*>(to);
        while (bytes > 0) {
            pollfd ready{pipe_, POLLIN, 0};
            const int some = ::poll(&ready, 1, int(std::min<uint64_t>(2 * seconds_, 1'000'000) * 1000));
            if (some < 0 && errno == EINTR) continue;
            if (some == 0)
                return error(ErrorCode::Limit, fmt::format("the Draco decoder sent nothing for {} s", 2 * seconds_));
            const ssize_t got = ::read(pipe_, p, bytes);
            if (got < 0 && errno == EINTR) continue;
            if (got < 0) return systemError("the pipe of the Draco decoder cannot be read");
            if (got == 0) return deathOfChild();
            p += got;
            bytes -= size_t(got);
        }
        return {};
    }

    Error deathOfChild() {
        int status = 0;
        while (::waitpid(child_, &status, 0) < 0 && errno == EINTR) {
        }
        child_ = -1;
        if (WIFSIGNALED(status) && (WTERMSIG(status) == SIGXCPU || WTERMSIG(status) == SIGKILL))
            return error(ErrorCode::Limit,
                         fmt::format("the Draco decoder needed more than {} s or {} MiB and was stopped", seconds_,
                                     memoryBytes_ >> 20));
        if (WIFSIGNALED(status))
            return error(
                ErrorCode::InvalidInput,
                fmt::format("the Draco decoder crashed (signal {}); the data are damaged, or need more than {} MiB",
                            WTERMSIG(status), memoryBytes_ >> 20));
        return error(ErrorCode::InvalidInput, "the Draco decoder ended early; the data are damaged");
    }

    Error childError() {
        const auto code = std::min(reply_.failed - 1, uint32_t(ErrorCode::Limit));
        std::string message(std::min<size_t>(reply_.messageBytes, kMostMessage), '\0');
        if (const auto done = receive(message.data(), message.size()); !done) return done.error();
        std::ranges::replace(message, '\n', ' ');
        return error(static_cast<ErrorCode>(code), message);
    }

    Result<void> receiveVertices(MeshChunk& chunk) {
        std::vector<DracoVertex> batch(std::min(kBatch, reply_.vertices - vertex_));
        VCP_TRY(receive(batch.data(), batch.size() * sizeof(DracoVertex)));
        for (const DracoVertex& v : batch) {
            if (!std::isfinite(v.position[0]) || !std::isfinite(v.position[1]) || !std::isfinite(v.position[2]))
                return error(ErrorCode::InvalidInput,
                             fmt::format("the position of vertex {} is not finite (NaN or infinite)", vertex_));
            chunk.positions.emplace_back(v.position[0], v.position[1], v.position[2]);
            if (info_.hasColour) chunk.colours.push_back(v.colour);
            if (reply_.hasNormals) chunk.normals.push_back(v.normal);
            ++vertex_;
        }
        return {};
    }

    Result<void> receiveFaces(MeshChunk& chunk) {
        std::vector<DracoFace> batch(std::min(kBatch, reply_.faces - face_));
        VCP_TRY(receive(batch.data(), batch.size() * sizeof(DracoFace)));
        for (const DracoFace& f : batch) {
            const auto& v = f.vertex;
            if (std::max({v[0], v[1], v[2]}) >= reply_.vertices)
                return error(ErrorCode::InvalidInput, fmt::format("face {} names a vertex that does not exist", face_));
            chunk.triangles.push_back({v[0], v[1], v[2]});
            if (reply_.hasUv)
                chunk.uvs.push_back({glm::vec2(f.uv[0][0], f.uv[0][1]), glm::vec2(f.uv[1][0], f.uv[1][1]),
                                     glm::vec2(f.uv[2][0], f.uv[2][1])});
            ++face_;
        }
        return {};
    }

    std::string name_;
    std::string element_;
    MeshInfo info_;
    uint64_t memoryBytes_;
    uint64_t seconds_;
    DracoReply reply_;
    pid_t child_ = -1;
    int pipe_ = -1;
    uint64_t vertex_ = 0;
    uint64_t face_ = 0;
};

}  // namespace

bool looksLikeDraco(std::string_view start) { return start.starts_with("DRACO"); }

Result<std::unique_ptr<MeshStream>> decodeDraco(const DracoBytes& bytes, uint64_t compressedBytes,
                                                const DracoSelection& selection, uint64_t memoryBytes, std::string name,
                                                std::string element) {
    auto stream = std::make_unique<DracoStream>(std::move(name), std::move(element), compressedBytes, memoryBytes);
    VCP_TRY(stream->begin(bytes, selection));
    return std::unique_ptr<MeshStream>(std::move(stream));
}

Result<std::unique_ptr<MeshStream>> openDraco(ByteSource source, uint64_t memoryBytes) {
    const auto everything = [&]() -> Result<std::string> {
        std::string all;
        while (!source.atEnd()) {
            VCP_TRY_ASSIGN(const auto window, source.window());
            all += window;
            source.advance(window.size());
        }
        return all;
    };
    return decodeDraco(everything, source.fileBytes(), {}, memoryBytes, source.name(), "");
}

}  // namespace vcp
