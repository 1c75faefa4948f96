#include "octree/io/output_claim.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>
#include <algorithm>
#include <array>
#include <cerrno>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "octree/io/durable_file.h"
#include "octree/io/output_file.h"

namespace vcp {

namespace {

namespace fs = std::filesystem;

constexpr std::string_view kMark = "vcp process ";
constexpr std::string_view kOn = " on ";

std::string thisMachine() {
    std::array<char, 256> name{};
    return ::gethostname(name.data(), name.size() - 1) == 0 ? name.data() : "";
}

/// Whether an error says that the disk is full or failing, so that the output could not be written either.
bool isOfDisk(int error) { return error == ENOSPC || error == EDQUOT || error == EIO; }

/// Returns what the file says, at most 511 bytes.
std::string textOf(int file) {
    std::array<char, 511> text{};
    const ssize_t bytes = ::pread(file, text.data(), text.size(), 0);
    return {text.data(), size_t(std::max<ssize_t>(bytes, 0))};
}

/// Whether a file is one that a claim made, or has just begun to make.
bool isOurs(int file) {
    struct stat status {};
    if (::fstat(file, &status) != 0 || !S_ISREG(status.st_mode) || status.st_nlink != 1) return false;
    const std::string text = textOf(file);
    return text.empty() || text.starts_with(kMark);
}

/// Returns who says so: "process 4711", or "process 4711 on HOST" where that is another machine.
std::string holderOf(int file) {
    std::string text = textOf(file);
    if (!text.starts_with(kMark)) return "another process";
    text = "process " + text.substr(kMark.size(), text.find('\n') - kMark.size());
    const size_t on = text.find(kOn);
    if (on != std::string::npos && text.substr(on + kOn.size()) == thisMachine()) text.resize(on);
    return text;
}

Result<void> write(int file, const fs::path& name) {
    if (::ftruncate(file, 0) != 0) return systemError(name, "cannot be written", errno);
    const std::string text = fmt::format("{}{}{}{}\n", kMark, ::getpid(), kOn, thisMachine());
    return writeAll(file, 0, std::as_bytes(std::span(text)), name);
}

}  // namespace

Result<OutputClaim> OutputClaim::take(const fs::path& output) {
    const auto target = linkTarget(output);
    std::error_code failed;
    const auto there = target ? fs::symlink_status(*target, failed) : fs::file_status();
    if (!target || !target->has_filename() || output == "-") return OutputClaim();
    if (fs::exists(there) && !fs::is_regular_file(there)) return OutputClaim();
    OutputClaim made;
    fs::path name = *target;
    name += ".lock";
    for (;;) {
        made.file_ = FileDescriptor(::open(name.c_str(), O_RDWR | O_CREAT | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC, 0666));
        const int file = made.file_.number(), why = errno;
        if (!made.file_.isOpen() && isOfDisk(why)) return systemError(name, "cannot be created", why);
        if (!made.file_.isOpen() || !isOurs(file)) return OutputClaim();
        const NameLock lock = lockName(file, name);
        if (lock == NameLock::Gone) continue;
        if (lock == NameLock::Held)
            return Error{.code = ErrorCode::Io,
                         .message = fmt::format("{} is building this file; wait for it, or choose another output",
                                                holderOf(file)),
                         .file = output.string()};
        made.name_ = std::move(name);
        VCP_TRY(write(file, made.name_));
        return made;
    }
}

OutputClaim::OutputClaim(OutputClaim&& other) noexcept
    : name_(std::exchange(other.name_, {})), file_(std::move(other.file_)) {}

OutputClaim& OutputClaim::operator=(OutputClaim&& other) noexcept {
    std::swap(name_, other.name_);
    std::swap(file_, other.file_);
    return *this;
}

OutputClaim::~OutputClaim() {
    if (!name_.empty()) ::unlink(name_.c_str());
}

}  // namespace vcp
