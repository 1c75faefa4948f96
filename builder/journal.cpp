#include "builder/journal.h"

#include <cerrno>
#include <fcntl.h>
#include <fstream>
#include <span>
#include <unistd.h>

#include <fmt/format.h>
#include <xxhash.h>

#include "builder/temp_space.h"
#include "octree/durable_file.h"

namespace vcp {

namespace {

std::string hashed(const std::string& text) { return fmt::format("{:016x}", XXH3_64bits(text.data(), text.size())); }

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
    if (file_ < 0) return systemError(path, "cannot be opened", errno, kWhenTempIsFull);
    const std::string text = fields.dump();
    // The line break in front ends a line that an interruption tore.
    const std::string line = fmt::format("{}{} {}\n", isNew ? "\n" : "", hashed(text), text);
    VCP_TRY(appendAll(file_, std::as_bytes(std::span(line)), path, kWhenTempIsFull));
    if (::fdatasync(file_) != 0) return systemError(path, "cannot be made durable", errno, kWhenTempIsFull);
    if (!active_) VCP_TRY(syncFolder(folder));
    active_ = true;
    return {};
}

}  // namespace vcp
