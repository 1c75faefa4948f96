#include "builder/spill/journal.h"

#include <unistd.h>
#include <cerrno>
#include <span>
#include <sstream>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <xxhash.h>

#include "octree/io/durable_file.h"

namespace vcp {

namespace {

std::string hashed(const std::string& text) { return fmt::format("{:016x}", XXH3_64bits(text.data(), text.size())); }

/// Returns the whole journal; nothing where there is none.
Result<std::string> contentOf(const TempFolder& folder) {
    VCP_TRY_ASSIGN(const auto file, folder.open(kJournalName));
    std::string text;
    if (file < 0) return text;
    std::vector<char> part(size_t{1} << 16);
    ssize_t n = 0;
    while ((n = ::read(file, part.data(), part.size())) > 0 || (n < 0 && errno == EINTR))
        if (n > 0) text.append(part.data(), size_t(n));
    const int code = errno;
    ::close(file);
    if (n < 0) return systemError(folder.path() / kJournalName, "cannot be read", code);
    return text;
}

}  // namespace

Journal::~Journal() {
    if (file_ >= 0) ::close(file_);
}

Result<nlohmann::json> Journal::read(const TempFolder& folder) {
    nlohmann::json all;
    VCP_TRY_ASSIGN(const auto text, contentOf(folder));
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) {
        if (line.size() < 18) continue;
        const std::string said = line.substr(17);
        if (line.compare(0, 16, hashed(said)) != 0 || line[16] != ' ') continue;
        const auto fields = nlohmann::json::parse(said, nullptr, false);
        if (fields.is_object()) all.update(fields);
    }
    return all;
}

Result<void> Journal::open(const TempFolder& folder) {
    auto file = folder.open(kJournalName);
    if (file && *file < 0) file = folder.create(kJournalName);
    if (!file) return file.error();
    file_ = *file;
    if (::lseek(file_, 0, SEEK_END) < 0) return systemError(folder.path() / kJournalName, "cannot be read", errno);
    return {};
}

Result<void> Journal::record(const TempFolder& folder, const nlohmann::json& fields) {
    const std::filesystem::path path = folder.path() / kJournalName;
    const bool isNew = file_ < 0;
    if (isNew) VCP_TRY(open(folder));
    const std::string text = fields.dump();
    // The line break in front ends a line that an interruption cut off.
    const std::string line = fmt::format("{}{} {}\n", isNew ? "\n" : "", hashed(text), text);
    VCP_TRY(appendAll(file_, std::as_bytes(std::span(line)), path, kWhenTempIsFull));
    if (::fdatasync(file_) != 0) return systemError(path, "cannot be made durable", errno, kWhenTempIsFull);
    if (!active_) VCP_TRY(folder.sync());
    active_ = true;
    return {};
}

}  // namespace vcp
