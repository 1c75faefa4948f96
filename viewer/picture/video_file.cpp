#include "viewer/picture/video_file.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <string>
#include <vector>

#include <fcntl.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fmt/format.h>

#include "octree/io/file_descriptor.h"

extern char** environ;

namespace vcp {

namespace fs = std::filesystem;

namespace {

constexpr const char* kProgram = "ffmpeg";
constexpr int kOutput = 3;  // the descriptor that ffmpeg writes the file by

/// Returns ffmpeg's arguments. The colours of pictures are sRGB; those of videos are marked as BT.709.
std::vector<std::string> argumentsFor(OutputKind kind, const VideoFormat& format) {
    std::vector<std::string> all{kProgram, "-hide_banner", "-nostdin", "-loglevel", "error", "-y"};
    const auto add = [&](std::initializer_list<std::string> more) { all.insert(all.end(), more); };
    add({"-f", "rawvideo", "-pix_fmt", "rgba", "-video_size", fmt::format("{}x{}", format.width, format.height)});
    add({"-framerate", std::to_string(format.framesPerSecond), "-i", "pipe:0"});
    add({"-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2,scale=out_color_matrix=bt709:out_range=tv"});
    add({"-pix_fmt", "yuv420p", "-colorspace", "bt709", "-color_primaries", "bt709", "-color_trc", "bt709"});
    if (kind == OutputKind::Mp4)
        add({"-c:v", "libx264", "-crf", "18", "-movflags", "+faststart", "-f", "mp4"});
    else
        add({"-c:v", "libvpx-vp9", "-crf", "24", "-b:v", "0", "-row-mt", "1", "-f", "webm"});
    all.push_back(fmt::format("/dev/fd/{}", kOutput));
    return all;
}

Error noEncoder(const fs::path& path) {
    return {.code = ErrorCode::Unsupported, .message = kNoVideoEncoder, .file = path.string()};
}

}  // namespace

bool isVideoPath(const fs::path& path) {
    const auto kind = outputKindOf(path);
    return kind == OutputKind::Mp4 || kind == OutputKind::Webm;
}

bool hasVideoEncoder() {
    const char* folders = std::getenv("PATH");
    for (std::string_view rest = folders ? folders : ""; !rest.empty();) {
        const std::string_view folder = rest.substr(0, rest.find(':'));
        rest.remove_prefix(std::min(rest.size(), folder.size() + 1));
        if (::access((fs::path(folder) / kProgram).c_str(), X_OK) == 0) return true;
    }
    return false;
}

struct VideoFile::Encoder {
    explicit Encoder(OutputFile given) : output(std::move(given)) {}
    ~Encoder() {
        if (process <= 0) return;
        ::kill(process, SIGKILL);
        ::waitpid(process, nullptr, 0);
    }

    OutputFile output;
    FileDescriptor frames;  ///< a socket: its other end may go without a signal
    FileDescriptor said;    ///< what ffmpeg writes to its standard error
    pid_t process = 0;
    uint64_t frameBytes = 0, bytes = 0;

    Result<void> start(const std::vector<std::string>& arguments);
    /// Waits for ffmpeg to end; it must have read all. Returns its error.
    Result<void> end();

    [[nodiscard]] Error error(ErrorCode code, std::string message) const {
        return {.code = code, .message = std::move(message), .file = output.path().string()};
    }
    [[nodiscard]] std::string lastLineSaid() const;
};

Result<void> VideoFile::Encoder::start(const std::vector<std::string>& arguments) {
    int ends[2];
    if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0)
        return error(ErrorCode::Io, std::string("no pipe to ffmpeg: ") + std::strerror(errno));
    frames = FileDescriptor(ends[0]);
    const FileDescriptor input(ends[1]);
    said = FileDescriptor(::memfd_create("ffmpeg", MFD_CLOEXEC));
    if (!said.isOpen()) return error(ErrorCode::Io, std::string("no memory for ffmpeg: ") + std::strerror(errno));

    // Descriptors that are in each other's place are moved out of the way first: 3 may be any of ours.
    const FileDescriptor file(::fcntl(output.descriptor(), F_DUPFD_CLOEXEC, 10));
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, input.number(), STDIN_FILENO);
    posix_spawn_file_actions_adddup2(&actions, said.number(), STDOUT_FILENO);
    posix_spawn_file_actions_adddup2(&actions, said.number(), STDERR_FILENO);
    posix_spawn_file_actions_adddup2(&actions, file.number(), kOutput);
    // Ctrl-C is ours to answer: a group of its own keeps it from ffmpeg.
    posix_spawnattr_t attributes;
    posix_spawnattr_init(&attributes);
    posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP);
    std::vector<char*> texts;
    for (const std::string& each : arguments) texts.push_back(const_cast<char*>(each.c_str()));
    texts.push_back(nullptr);
    const int failed = ::posix_spawnp(&process, kProgram, &actions, &attributes, texts.data(), environ);
    posix_spawn_file_actions_destroy(&actions);
    posix_spawnattr_destroy(&attributes);
    if (failed == 0) return {};
    process = 0;
    if (failed == ENOENT) return noEncoder(output.path());
    return error(ErrorCode::Io, std::string("ffmpeg cannot be started: ") + std::strerror(failed));
}

std::string VideoFile::Encoder::lastLineSaid() const {
    std::array<char, 4096> text{};
    const off_t size = ::lseek(said.number(), 0, SEEK_END);
    const off_t from = std::max<off_t>(0, size - off_t(text.size()));
    const ssize_t read = ::pread(said.number(), text.data(), text.size(), from);
    std::string_view lines(text.data(), size_t(std::max<ssize_t>(read, 0)));
    while (!lines.empty() && (lines.back() == '\n' || lines.back() == '\r')) lines.remove_suffix(1);
    const size_t begin = lines.find_last_of("\r\n");
    return std::string(begin == std::string_view::npos ? lines : lines.substr(begin + 1));
}

Result<void> VideoFile::Encoder::end() {
    frames = FileDescriptor();
    int status = 0;
    pid_t ended = 0;
    do ended = ::waitpid(process, &status, 0);
    while (ended < 0 && errno == EINTR);
    process = 0;
    // Where a disk is full, ffmpeg says so and ends as if all were well.
    const std::string line = lastLineSaid();
    if (ended > 0 && WIFEXITED(status) && WEXITSTATUS(status) == 0 && line.empty()) return {};
    return error(ErrorCode::Io, "ffmpeg failed" + (line.empty() ? std::string() : ": " + line));
}

VideoFile::VideoFile(std::unique_ptr<Encoder> encoder) : encoder_(std::move(encoder)) {}
VideoFile::~VideoFile() = default;

Result<std::unique_ptr<VideoFile>> VideoFile::create(const fs::path& path, const VideoFormat& format,
                                                     const OutputRules& rules) {
    const auto usage = [&](ErrorCode code, const char* what) {
        return Error{.code = code, .message = what, .file = path.string()};
    };
    if (!isVideoPath(path)) return usage(ErrorCode::Unsupported, "is neither .mp4 nor .webm");
    constexpr uint32_t kLargest = 16384;
    if (format.width < 1 || format.height < 1 || format.width > kLargest || format.height > kLargest)
        return usage(ErrorCode::Usage, "a video has 1 to 16384 pixels a side");
    if (format.framesPerSecond < 1 || format.framesPerSecond > 240)
        return usage(ErrorCode::Usage, "a video has 1 to 240 frames a second");
    if (!hasVideoEncoder()) return noEncoder(path);
    const OutputKind kind = *outputKindOf(path);
    VCP_TRY_ASSIGN(auto output, OutputFile::create(path, kind, rules));
    auto encoder = std::make_unique<Encoder>(std::move(output));
    encoder->frameBytes = uint64_t{4} * format.width * format.height;
    VCP_TRY(encoder->start(argumentsFor(kind, format)));
    return std::unique_ptr<VideoFile>(new VideoFile(std::move(encoder)));
}

Result<void> VideoFile::add(std::span<const uint8_t> rgba) {
    Encoder& e = *encoder_;
    e.bytes += rgba.size();
    while (!rgba.empty()) {
        const ssize_t sent = ::send(e.frames.number(), rgba.data(), rgba.size(), MSG_NOSIGNAL);
        if (sent < 0 && errno == EINTR) continue;
        if (sent <= 0) {
            // It went away: it says why.
            const auto ended = e.end();
            return ended ? e.error(ErrorCode::Io, "ffmpeg ended before the video did") : ended;
        }
        rgba = rgba.subspan(size_t(sent));
    }
    return {};
}

Result<void> VideoFile::finish() {
    Encoder& e = *encoder_;
    if (e.bytes == 0 || e.bytes % e.frameBytes != 0) return e.error(ErrorCode::Usage, "rows of a frame are missing");
    VCP_TRY(e.end());
    return e.output.commit();
}

}  // namespace vcp
