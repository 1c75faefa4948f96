#include "builder/build.h"

#include <algorithm>
#include <utility>
#if defined(__GLIBC__)
#include <malloc.h>
#endif

#include <fmt/format.h>

#include "builder/builder.h"
#include "builder/dataset_assembly.h"
#include "builder/mesh/open_mesh.h"

namespace vcp {

Result<BuildReport> Builder::run() {
    auto built = caught([this] { return stages(); });
    if (built) {
        space_.folder().remove();
        finishReport();
        return report_;
    }
    Error error = built.error();
    const bool mayPass = error.code == ErrorCode::Cancelled || error.code == ErrorCode::Io,
               needsMore = error.code == ErrorCode::Limit && (files_.current || !files_.surfaces.empty());
    const bool hasWork = journal_.active() || isResumed_;
    if (hasWork && isOfTempFiles(error)) {
        // Once the disk is repaired, it may give back what was written after all.
        error.message += fmt::format(" (until then what there is stays in {})", space_.folder().path().string());
    } else if (!hasWork || !(mayPass || needsMore)) {
        if (error.code != ErrorCode::Usage) space_.folder().remove();
        if (error.code == ErrorCode::Cancelled) error.message = "cancelled; nothing was written";
    } else {
        error.message += fmt::format("; the same build, resumed{}, goes on from here, or delete {}",
                                     needsMore ? " with that memory" : "", space_.folder().path().string());
    }
    if (error.file.empty()) error.file = options_.output.string();
    return error;
}

bool Builder::isOfTempFiles(const Error& error) const {
    return error.code == ErrorCode::InvalidInput &&
           std::filesystem::path(error.file).parent_path() == space_.folder().path();
}

template <class Work>
Result<void> Builder::caught(const Work& work) {
    try {
        return work();
    } catch (const std::bad_alloc&) {
        return Error{.code = ErrorCode::Limit,
                     .message = "the system has no more memory to give; use a smaller memory cap, or fewer threads"};
    }
}

Result<void> Builder::stages() {
    VCP_TRY_ASSIGN(claim_, OutputClaim::take(options_.output));
    // A wrong output is found before an hour's work, not after it.
    VCP_TRY(checkOutput(options_.output, OutputKind::Dataset, rules()));
    VCP_TRY(checkTempFolder());
    VCP_TRY(openJournal());
    const std::string& stage = done_.stage;
    if (stage.empty())
        VCP_TRY(read());
    else
        VCP_TRY(resumeMeasures());
    warnOfWideCells();
    if (stage.empty() || stage == "read")
        VCP_TRY(deal());
    else
        VCP_TRY(resumeBins());
    for (; pass_ >= 0; --pass_) VCP_TRY(runPass());
    return write();
}

bool Builder::progress(const std::string& stage, double fraction) {
    const double withImages = fraction * (1 - imagesShare_) + imagesDone_;
    return meter_.report(stage,
                         {.fraction = withImages, .triangles = measures_.triangles, .tempBytes = space_.diskBytes()});
}

OutputRules Builder::rules() const {
    OutputRules rules{.overwrite = options_.overwrite, .inputs = options_.inputs};
    for (const SideFile& each : report_.sideFiles) rules.inputs.push_back(each.path);
    return rules;
}

Result<void> Builder::checkTempFolder() const {
    for (const auto& input : options_.inputs)
        if (isSameFile(input.parent_path().empty() ? "." : input.parent_path(), space_.folder().path()))
            return Error{
                .code = ErrorCode::Usage,
                .message = "lies in the folder of this build's temporary files; move it, or choose another output",
                .file = input.string()};
    return {};
}

void Builder::releaseMemory() {
#if defined(__GLIBC__)
    malloc_trim(0);
#endif
}

Result<void> Builder::write() {
    VCP_TRY(joinParts());
    FileHeader header = headerOf(plan_, measures_, hasColour(), meshParts_->counts);
    std::vector<JoinedSpools> levels(files_.spools.size());
    for (size_t i = 0; i < levels.size(); ++i) levels[i].add(files_.spools[i]);
    const PageSpool* const images = files_.images.empty() ? nullptr : &files_.images.front();
    const auto report = [this](double part) { return progress("writing", 1 - kWritingShare + kWritingShare * part); };
    VCP_TRY_ASSIGN(report_.fileBytes, arena_.execute([&] {
        return assembleDataset(levels, header, options_.output, rules(), images, report);
    }));
    describe(header, report_);
    report_.cutTriangles = measures_.cutTriangles;
    progress("done", 1);
    return {};
}

void Builder::finishReport() {
    report_.peakRssBytes = peakRssBytes();
    report_.tempBytes = space_.peakDiskBytes();
    report_.seconds = meter_.seconds();
    report_.isResumed = isResumed_;
}

std::filesystem::path tempFolderOf(const BuildOptions& options) {
    std::filesystem::path name = options.output.filename();
    name += ".build";
    return (options.temp.empty() ? options.output.parent_path() : options.temp) / name;
}

Result<BuildReport> buildOctree(const BuildOptions& options) {
    if (options.inputs.empty()) return Error{.code = ErrorCode::Usage, .message = "no input mesh given"};
    if (keepsImages(options) && options.error > 0)
        return Error{.code = ErrorCode::Usage,
                     .message = "images lie on the mesh's own triangles; leave out the error that allows others"};
    VCP_TRY_ASSIGN(const auto memory, memoryOf(options));
    BuildOptions expanded = options;
    VCP_TRY_ASSIGN(expanded.inputs, expandInputs(options.inputs));
    auto built = Builder(expanded, memory, threadsOf(options), tempFolderOf(expanded)).run();
    if (built || !built.error().file.empty() || built.error().code == ErrorCode::Cancelled) return built;
    Error error = built.error();
    error.file = options.inputs.front().string();
    return error;
}

}  // namespace vcp
