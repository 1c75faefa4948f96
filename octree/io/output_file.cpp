#include "octree/io/output_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>
#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <cstring>
#include <utility>

#include <fmt/format.h>

#include "octree/io/durable_file.h"

namespace vcp {

namespace fs = std::filesystem;

namespace {

constexpr size_t kStartBytes = 512;
constexpr int kMostPartials = 99, kMostLinks = 40;

struct KindName {
    OutputKind kind;
    const char* extension;
    const char* words;
};
constexpr KindName kKinds[] = {
    {OutputKind::Dataset, ".vcp", "a dataset"},  {OutputKind::Asset, ".meso", "a mesostructure asset"},
    {OutputKind::Png, ".png", "a PNG"},          {OutputKind::Pfm, ".pfm", "a PFM"},
    {OutputKind::JsonText, ".json", "JSON"},     {OutputKind::Svg, ".svg", "an SVG"},
    {OutputKind::Text, ".csv", "text"},          {OutputKind::Text, ".md", "text"},
    {OutputKind::Ply, ".ply", "a PLY mesh"},     {OutputKind::Obj, ".obj", "an OBJ mesh"},
    {OutputKind::Stl, ".stl", "an STL mesh"},    {OutputKind::Glb, ".glb", "a GLB"},
    {OutputKind::Dxf, ".dxf", "a DXF"},          {OutputKind::Mp4, ".mp4", "an MP4 video"},
    {OutputKind::Webm, ".webm", "a WebM video"},
};

const char* wordsFor(OutputKind kind) {
    return std::find_if(std::begin(kKinds), std::end(kKinds), [&](const KindName& each) { return each.kind == kind; })
        ->words;
}

/// Whether the triangles behind the first 84 bytes, as many as are there whole, have the two bytes of zero at their
/// end.
bool looksLikeBinaryStl(std::span<const std::byte> start) {
    constexpr size_t kHeader = 84, kTriangle = 50;
    if (start.size() < kHeader + kTriangle) return false;
    for (size_t end = kHeader + kTriangle; end <= start.size(); end += kTriangle)
        if (start[end - 2] != std::byte(0) || start[end - 1] != std::byte(0)) return false;
    return true;
}

/// Whether a file that begins so may be somebody's own, of which there is no other: a mesh without what ours say at
/// their beginning (mesh_format.cpp, base_file.cpp, make_scan).
bool isOriginal(OutputKind kind, std::span<const std::byte> start) {
    constexpr OutputKind kMeshes[] = {OutputKind::Ply, OutputKind::Obj, OutputKind::Stl, OutputKind::Glb};
    constexpr std::string_view kOurs[] = {"certified_distance", "vcp", "procedural"};
    const std::string_view text(reinterpret_cast<const char*>(start.data()), start.size());
    const auto isSaid = [&](std::string_view word) { return text.find(word) != std::string_view::npos; };
    return std::ranges::find(kMeshes, kind) != std::end(kMeshes) && std::ranges::none_of(kOurs, isSaid);
}

/// Datasets and assets are marked: their header is written last, so that a mark can stand in its place until then.
bool isMarked(OutputKind kind) { return kind == OutputKind::Dataset || kind == OutputKind::Asset; }

Error ioError(const fs::path& file, std::string message) {
    return {.code = ErrorCode::Io, .message = std::move(message), .file = file.string()};
}

/// Reads the first bytes of a file that is open.
std::vector<std::byte> startOf(int descriptor) {
    std::vector<std::byte> start(kStartBytes);
    size_t got = 0;
    while (got < start.size()) {
        const ssize_t n = ::pread(descriptor, start.data() + got, start.size() - got, off_t(got));
        if (n < 0 && errno == EINTR) continue;
        if (n <= 0) break;
        got += size_t(n);
    }
    start.resize(got);
    return start;
}

const char* wordsFor(mode_t mode) {
    return S_ISDIR(mode)                    ? "a folder"
           : S_ISCHR(mode) || S_ISBLK(mode) ? "a device"
           : S_ISFIFO(mode)                 ? "a pipe"
           : S_ISSOCK(mode)                 ? "a socket"
                                            : "no regular file";
}

/// Checks that what lies at `target` may be replaced.
Result<void> checkReplaced(const fs::path& output, const fs::path& target, OutputKind kind, const OutputRules& rules) {
    struct stat there {};
    if (::lstat(target.c_str(), &there) != 0)
        return errno == ENOENT ? Result<void>() : systemError(output, "cannot write here", errno);
    if (S_ISDIR(there.st_mode)) return ioError(output, "is a folder; give a file name");
    if (!S_ISREG(there.st_mode))
        return ioError(output, fmt::format("is {}, which is not replaced; give a file name{}", wordsFor(there.st_mode),
                                           isMarked(kind) ? "" : ", or - for standard output"));
    for (const fs::path& input : rules.inputs)
        if (isSameFile(target, input))
            return ioError(output,
                           input == output
                               ? std::string("is an input, which is never written over; give another name")
                               : fmt::format("is the file {}, which is read; give another name", input.string()));
    if (rules.overwrite || there.st_size == 0) return {};
    if ((there.st_mode & (S_IWUSR | S_IWGRP | S_IWOTH)) == 0)
        return ioError(output, "is write-protected; give another name, or ask for overwriting");
    const FileDescriptor file(::open(target.c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC));
    if (!file.isOpen()) return systemError(output, "is there, and cannot be looked into", errno);
    const auto start = startOf(file.number());
    if (!beginsLike(kind, start))
        return ioError(
            output, fmt::format("is there and is not {}; give another name, or ask for overwriting", wordsFor(kind)));
    if (isOriginal(kind, start))
        return ioError(output, fmt::format("is there and is {} that vcp did not write; give another name, or ask for "
                                           "overwriting",
                                           wordsFor(kind)));
    return {};
}

/// Removes what an interrupted writer left under that name. Errors: Io (another writer holds it).
Result<bool> removeLeftover(const fs::path& output, const fs::path& partial) {
    const FileDescriptor file(::open(partial.c_str(), O_RDWR | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC));
    if (!file.isOpen()) return false;
    struct stat there {};
    const bool isOurs = ::fstat(file.number(), &there) == 0 && S_ISREG(there.st_mode) && there.st_nlink == 1;
    const std::vector<std::byte> start = isOurs ? startOf(file.number()) : std::vector<std::byte>();
    const bool isLeft =
        start.size() >= kPartialMark.size() && std::memcmp(start.data(), kPartialMark.data(), kPartialMark.size()) == 0;
    const NameLock lock = isLeft ? lockName(file.number(), partial) : NameLock::Gone;
    if (lock == NameLock::Taken) ::unlink(partial.c_str());
    if (lock == NameLock::Held) return ioError(output, "another build is writing this file");
    return lock == NameLock::Taken;
}

struct Partial {
    fs::path name;
    FileDescriptor file;
};

/// Creates a new file beside `target`, held by this process.
Result<Partial> createPartial(const fs::path& output, const fs::path& target, bool isMarked) {
    for (int number = 1; number <= kMostPartials; ++number) {
        fs::path name = target;
        name += number == 1 ? ".partial" : fmt::format(".partial.{}", number);
        if (isMarked) {
            VCP_TRY(removeLeftover(output, name));
        }
        FileDescriptor file(::open(name.c_str(), O_RDWR | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0666));
        if (!file.isOpen() && errno == EEXIST) continue;
        if (!file.isOpen()) return systemError(output, "cannot write here", errno);
        if (lockName(file.number(), name) == NameLock::Taken) return Partial{std::move(name), std::move(file)};
        return ioError(output, "another build is writing this file");
    }
    fs::path first = target;
    first += ".partial";
    return ioError(first,
                   fmt::format("is there, and {} more beside it; remove those that are not needed", kMostPartials - 1));
}

}  // namespace

std::optional<OutputKind> outputKindOf(const fs::path& path) {
    std::string extension = path.extension().string();
    std::transform(extension.begin(), extension.end(), extension.begin(),
                   [](unsigned char letter) { return std::tolower(letter); });
    for (const KindName& each : kKinds)
        if (extension == each.extension) return each.kind;
    return std::nullopt;
}

bool beginsLike(OutputKind kind, std::span<const std::byte> start) {
    const std::string_view text(reinterpret_cast<const char*>(start.data()), start.size());
    const auto firstOf = [&](std::string_view any) {
        const size_t at = text.find_first_not_of(" \t\r\n");
        return at == std::string_view::npos || any.find(text[at]) != std::string_view::npos;
    };
    switch (kind) {
        case OutputKind::Dataset:
            return text.starts_with("VCP\r\n\x1a\n");
        case OutputKind::Asset:
            return text.starts_with("VCPmeso\n");
        case OutputKind::Png:
            return text.starts_with("\x89PNG\r\n\x1a\n");
        case OutputKind::Pfm:
            return text.starts_with("Pf\n") || text.starts_with("PF\n");
        case OutputKind::JsonText:
            return firstOf("{[");
        case OutputKind::Svg:
            return text.starts_with("<svg") || text.starts_with("<?xml");
        case OutputKind::Text:
            return text.find('\0') == std::string_view::npos && !text.starts_with("ply");
        case OutputKind::Ply:
            return text.starts_with("ply\n") || text.starts_with("ply\r");
        case OutputKind::Obj:
            return text.find('\0') == std::string_view::npos && firstOf("#vofgsum");
        case OutputKind::Stl:
            return text.starts_with("solid") || looksLikeBinaryStl(start);
        case OutputKind::Glb:
            return text.starts_with("glTF");
        case OutputKind::Dxf:
            return text.starts_with("999") || text.starts_with("  0") || text.starts_with("0\n");
        case OutputKind::Mp4:
            return text.size() >= 8 && text.substr(4, 4) == "ftyp";
        case OutputKind::Webm:
            return text.starts_with("\x1a\x45\xdf\xa3");
    }
    return false;
}

bool isSameFile(const fs::path& a, const fs::path& b) {
    struct stat first {
    }, second{};
    return ::stat(a.c_str(), &first) == 0 && ::stat(b.c_str(), &second) == 0 && first.st_dev == second.st_dev &&
           first.st_ino == second.st_ino;
}

Result<fs::path> linkTarget(const fs::path& path) {
    fs::path at = path;
    for (int links = 0; links < kMostLinks; ++links) {
        std::error_code failed;
        if (!fs::is_symlink(fs::symlink_status(at, failed))) return at;
        const fs::path next = fs::read_symlink(at, failed);
        if (failed) return ioError(path, "cannot follow the link: " + failed.message());
        at = next.is_absolute() ? next : at.parent_path() / next;
    }
    return ioError(path, "is a link that leads nowhere");
}

Result<void> checkOutput(const fs::path& output, OutputKind kind, const OutputRules& rules) {
    if (output == "-" && !isMarked(kind)) return {};
    const auto file = OutputFile::create(output, kind, rules);
    return file ? Result<void>() : file.error();
}

Result<OutputFile> OutputFile::create(const fs::path& output, OutputKind kind, const OutputRules& rules) {
    OutputFile made(output, kind, rules);
    if (output == "-") {
        if (isMarked(kind))
            return ioError(
                "standard output",
                fmt::format("cannot take {}, which is not written front to back; give a file name", wordsFor(kind)));
        made.file_ = FileDescriptor(::fcntl(STDOUT_FILENO, F_DUPFD_CLOEXEC, 3));
        if (!made.file_.isOpen()) return systemError("standard output", "cannot be written", errno);
        return made;
    }
    VCP_TRY_ASSIGN(made.target_, linkTarget(output));
    VCP_TRY(checkReplaced(output, made.target_, kind, rules));
    VCP_TRY_ASSIGN(auto partial, createPartial(output, made.target_, isMarked(kind)));
    made.partial_ = std::move(partial.name);
    made.file_ = std::move(partial.file);
    if (isMarked(kind)) VCP_TRY(made.write(0, std::as_bytes(std::span(kPartialMark))));
    return made;
}

OutputFile::OutputFile(OutputFile&& other) noexcept
    : output_(std::move(other.output_)),
      target_(std::move(other.target_)),
      partial_(std::exchange(other.partial_, {})),
      kind_(other.kind_),
      rules_(std::move(other.rules_)),
      file_(std::move(other.file_)) {}

OutputFile::~OutputFile() { close(); }

void OutputFile::close() {
    file_ = FileDescriptor();
    if (!partial_.empty()) ::unlink(partial_.c_str());
    partial_.clear();
}

Result<void> OutputFile::write(uint64_t offset, std::span<const std::byte> bytes) {
    return writeAll(file_.number(), offset, bytes, output_);
}

Result<void> OutputFile::append(std::span<const std::byte> bytes) { return appendAll(file_.number(), bytes, output_); }

Result<void> OutputFile::sync() {
    if (!partial_.empty() && ::fsync(file_.number()) != 0)
        return systemError(output_, "cannot make the file durable", errno);
    return {};
}

Result<void> OutputFile::commit() {
    VCP_TRY(sync());
    if (partial_.empty()) {
        close();
        return {};
    }
    VCP_TRY(checkReplaced(output_, target_, kind_, rules_));
    // The new file takes over the permissions of the file that it replaces.
    struct stat there {};
    if (::stat(target_.c_str(), &there) == 0) static_cast<void>(::fchmod(file_.number(), there.st_mode & 0777));
    if (::rename(partial_.c_str(), target_.c_str()) != 0)
        return systemError(output_, "cannot rename the finished file", errno);
    partial_.clear();
    close();
    if (auto synced = syncFolder(target_.parent_path()); !synced) {
        Error late = synced.error();
        late.message += "; " + output_.string() + " is complete, but a power failure may undo its name";
        return late;
    }
    return {};
}

Result<void> writeFile(const fs::path& output, OutputKind kind, std::span<const std::byte> bytes,
                       const OutputRules& rules) {
    VCP_TRY_ASSIGN(auto file, OutputFile::create(output, kind, rules));
    VCP_TRY(file.append(bytes));
    return file.commit();
}

Result<void> writeFile(const fs::path& output, OutputKind kind, std::string_view text, const OutputRules& rules) {
    std::string lines(text);
    if (!lines.ends_with('\n')) lines += '\n';
    return writeFile(output, kind, std::as_bytes(std::span(lines)), rules);
}

}  // namespace vcp
