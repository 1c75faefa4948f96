#include "builder/parts/part_folder.h"

#include <unistd.h>
#include <array>
#include <cerrno>
#include <cstdio>
#include <random>

#include <fmt/format.h>

#include "builder/spill/journal.h"
#include "octree/io/durable_file.h"

namespace vcp {

namespace {

/// Returns what no other process calls its folder, on any machine.
std::string uniqueName() {
    std::random_device random;
    return fmt::format("{}-{:08x}{:08x}", ::getpid(), random(), random());
}

}  // namespace

std::filesystem::path PartName::folder() const { return plan / fmt::format("{}-{}", stage, number); }

std::string PartName::step() const { return fmt::format("{} {}", stage, number); }

bool isDone(const PartName& part) {
    std::error_code ignored;
    return std::filesystem::exists(part.folder() / kJournalName, ignored);
}

NewPart::NewPart(PartName part) : part_(std::move(part)), folder_(part_.folder()) {
    folder_ += fmt::format(".{}.partial", uniqueName());
}

NewPart::~NewPart() {
    if (isFinished_) return;
    // What was written is the process's own; where there is no space, nothing was.
    if (!space_) space_ = std::make_unique<TempSpace>(folder_, 0);
    if (space_->folder().isTaken() || (space_->folder().exists() && space_->folder().take())) space_->folder().remove();
}

TempSpace& NewPart::space(uint64_t memoryBytes) {
    if (!space_) space_ = std::make_unique<TempSpace>(folder_, memoryBytes);
    return *space_;
}

Result<void> NewPart::finish(const nlohmann::json& fields) {
    Journal journal;
    VCP_TRY(space_->folder().take());
    VCP_TRY(journal.record(space_->folder(), fields));
    return rename();
}

Result<void> NewPart::rename() {
    if (::rename(folder_.c_str(), part_.folder().c_str()) != 0) {
        const int code = errno;
        const bool isThere = (code == EEXIST || code == ENOTEMPTY) && isDone(part_);
        return isThere ? Result<void>() : systemError(part_.folder(), "cannot be given its name", code);
    }
    isFinished_ = true;
    return syncFolder(part_.plan);
}

Result<DonePart> openPart(const PartName& part) {
    if (!isDone(part))
        return Error{.code = ErrorCode::Usage,
                     .message = fmt::format("is not done; run the step \"{}\" of this plan first", part.step()),
                     .file = part.folder().string()};
    DonePart done{std::make_unique<TempSpace>(part.folder(), 0, FolderUse::Read), {}};
    VCP_TRY(done.space->folder().take());
    VCP_TRY_ASSIGN(done.fields, Journal::read(done.space->folder()));
    if (!done.fields.is_object()) return damagedTempFile(part.folder() / kJournalName);
    return done;
}

}  // namespace vcp
