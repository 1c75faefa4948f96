#include "builder/journal.h"

#include <cerrno>
#include <fcntl.h>
#include <fstream>
#include <system_error>
#include <unistd.h>

#include <fmt/format.h>
#include <xxhash.h>

#include "builder/temp_space.h"

namespace vcp {

namespace {

std::string hashed(const std::string& text) { return fmt::format("{:016x}", XXH3_64bits(text.data(), text.size())); }

Error ioError(const std::filesystem::path& file, const char* what) {
    return {.code = ErrorCode::Io, .message = std::string(what) + ": " + std::generic_category().message(errno), .file = file.string()};
}

}  // namespace

Journal::~Journal() {
    if (file_ >= 0) ::close(file_);
}

Result<nlohmann::json> Journal::read(const std::filesystem::path& folder) {
    nlohmann::json all;
    std::ifstream file(folder / kJournalName);
    for (std::string line; std::getline(file, line);) {
        if (line.size() < 18) continue;
        const std::string text = line.substr(17);
        if (line.compare(0, 16, hashed(text)) != 0 || line[16] != ' ') continue;
        const auto fields = nlohmann::json::parse(text, nullptr, false);
        if (fields.is_object()) all.update(fields);
    }
    return all;
}

Result<void> Journal::record(const std::filesystem::path& folder, const nlohmann::json& fields) {
    const std::filesystem::path path = folder / kJournalName;
    const bool isNew = file_ < 0;
    if (isNew) file_ = ::open(path.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0666);
    if (file_ < 0) return ioError(path, "cannot be opened");
    const std::string text = fields.dump();
    // The line break in front ends a line that an interruption tore.
    const std::string line = fmt::format("{}{} {}\n", isNew ? "\n" : "", hashed(text), text);
    for (size_t at = 0; at < line.size();) {
        const ssize_t n = ::write(file_, line.data() + at, line.size() - at);
        if (n < 0 && errno == EINTR) continue;
        if (n <= 0) return ioError(path, "write failed");
        at += static_cast<size_t>(n);
    }
    if (::fdatasync(file_) != 0) return ioError(path, "cannot be made durable");
    if (active_) return {};
    const int fd = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (fd < 0) return ioError(folder, "cannot open the folder");
    active_ = ::fsync(fd) == 0 || errno == EINVAL;
    const int code = errno;
    ::close(fd);
    errno = code;
    return active_ ? Result<void>() : Result<void>(ioError(folder, "cannot make the folder durable"));
}

}  // namespace vcp
