#include <algorithm>
#include <memory>

#include <fmt/format.h>

#include "builder/builder.h"

namespace vcp {

Result<void> Builder::openJournal() {
    TempFolder& folder = space_.folder();
    if (!folder.exists()) return {};
    VCP_TRY(folder.take());
    if (options_.resume) {
        VCP_TRY_ASSIGN(const auto journal, Journal::read(folder));
        // Whatever the journal says, it shows earlier work.
        isResumed_ = !journal.is_null();
        VCP_TRY_ASSIGN(done_, recordedFrom(journal, folder.path() / kJournalName));
    }
    if (!isResumed_) {
        folder.clear();
        return {};
    }
    if (done_.build != buildFingerprint(options_))
        return Error{.code = ErrorCode::Usage,
                     .message = "the unfinished build here is of other inputs or options; build again from the start",
                     .file = folder.path().string()};
    for (const SideFile& each : done_.sideFiles)
        if (fileStamp(each.path) != each.stamp)
            return Error{.code = ErrorCode::Usage,
                         .message = fmt::format("was changed since the unfinished build in {} read it; build "
                                                "again from the start",
                                                folder.path().string()),
                         .file = each.path.string()};
    return {};
}

Result<void> Builder::checkpoint(const char* stage, size_t bin, bool always) {
    if (!always && meter_.seconds() - lastCheckpoint_ < options_.checkpointSeconds) return {};
    VCP_TRY(space_.folder().take());
    VCP_TRY_ASSIGN(auto fields, files_.sync());
    fields.update({{"stage", stage}, {"pass", pass_}, {"bin", bin}});
    if (!journal_.active())
        fields.update({{"build", buildFingerprint(options_)},
                       {"measures", jsonOf(measures_)},
                       {"side files", jsonOf(report_.sideFiles)}});
    if (!partitionRecorded_ && files_.current) {
        fields["partition"] = plan_.finest.first();
        fields["parted"] = plan_.pages.parted();
        fields["levels less"] = levelsLess_;
        fields["pages"] = finestPages_;
        partitionRecorded_ = true;
    }
    VCP_TRY(journal_.record(space_.folder(), fields));
    lastCheckpoint_ = meter_.seconds();
    return {};
}

Result<void> Builder::resumeMeasures() {
    measures_ = done_.measures;
    report_.sideFiles = done_.sideFiles;
    if (done_.stage != "read") return {};
    files_.soup = std::make_unique<Soup>(space_, memory_.bufferBytes);
    VCP_TRY(files_.reopen(done_, space_));
    return reactivate(kReadingShare);
}

Result<void> Builder::reactivate(double done) {
    meter_.beginAt(done);
    return journal_.record(space_.folder(), {{"resumed", true}});
}

Result<void> Builder::resumeBins() {
    levelsLess_ = done_.levelsLess;
    VCP_TRY_ASSIGN(plan_, planLevels(options_, measures_, levelsLess_));
    plan_.setPages(plan_.frame, FinestPages(plan_.gridOf(plan_.levels() - 1), done_.parted));
    setUpLevels();
    plan_.finest = PagePartition(done_.partition);
    finestPages_ = done_.pages;
    VCP_TRY(planForPages());
    partitionRecorded_ = true;
    pass_ = done_.pass;
    firstBin_ = done_.bin;
    if (pass_ >= 0) openPass();
    openImages(done_.files.images.size());
    if (done_.files.bins.contains("textures")) openTextures();
    VCP_TRY(files_.reopen(done_, space_));
    if (firstBin_ >= std::max<size_t>(binsOfPass(), 1))
        return Error{.code = ErrorCode::InvalidInput,
                     .message = "names a bin that there is not; build again from the start",
                     .file = (space_.folder().path() / kJournalName).string()};
    return reactivate(pass_ < 0 ? 1 - kWritingShare : fractionAt(firstBin_));
}

}  // namespace vcp
