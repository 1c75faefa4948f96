#include "builder/parts/part_plan.h"

#include <fcntl.h>
#include <unistd.h>
#include <array>
#include <cerrno>
#include <fstream>
#include <memory>

#include <fmt/format.h>
#include <xxhash.h>
#include <nlohmann/json.hpp>

#include "builder/stream/side_file.h"
#include "octree/io/durable_file.h"
#include "octree/io/file_descriptor.h"
#include "octree/io/output_file.h"
#include "octree/vcp_file.h"

namespace vcp {

namespace {

using nlohmann::json;

struct FileContent {
    uint64_t hash = 0, bytes = 0;
};

Result<FileContent> contentOf(const std::filesystem::path& path) {
    const FileDescriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
    if (!file.isOpen()) return systemError(path, "cannot be opened", errno);
    const std::unique_ptr<XXH3_state_t, decltype(&XXH3_freeState)> state(XXH3_createState(), &XXH3_freeState);
    XXH3_64bits_reset(state.get());
    std::vector<char> piece(size_t{1} << 20);
    uint64_t bytes = 0;
    for (;;) {
        const ssize_t n = ::read(file.number(), piece.data(), piece.size());
        if (n == 0) return FileContent{XXH3_64bits_digest(state.get()), bytes};
        if (n < 0 && errno == EINTR) continue;
        if (n < 0) return systemError(path, "cannot be read", errno);
        XXH3_64bits_update(state.get(), piece.data(), size_t(n));
        bytes += uint64_t(n);
    }
}

Error damagedPlan(const std::filesystem::path& file) {
    return {
        .code = ErrorCode::InvalidInput, .message = "is not a whole plan; plan the build again", .file = file.string()};
}

json jsonOf(const PartPlan& plan) {
    const BuildOptions& o = plan.options;
    json inputs = json::array();
    for (const PlannedInput& each : plan.inputs)
        inputs.push_back(
            {{"path", each.path.string()}, {"stamp", each.stamp}, {"hash", each.hash}, {"bytes", each.bytes}});
    return {{"program", plan.program},
            {"parts", plan.parts},
            {"inputs", inputs},
            {"output", o.output.string()},
            {"overwrite", o.overwrite},
            {"format", o.format},
            {"cell", o.cell},
            {"origin", o.origin ? json{o.origin->x, o.origin->y, o.origin->z} : json()},
            {"colour", int(o.colour)},
            {"images", keepsImages(o)},
            {"image_quality", {o.imageQuality.finest.value_or(-1), o.imageQuality.coarser.value_or(-1)}},
            {"memory", o.memoryBytes},
            {"vertex_normals", int(o.vertexNormals)},
            {"allow_outside", o.allowOutside},
            {"masks", o.masks},
            {"channels", o.channels}};
}

PartPlan planFrom(const json& j) {
    PartPlan plan;
    plan.program = j.at("program").get<std::string>();
    plan.parts = j.at("parts").get<unsigned>();
    for (const json& each : j.at("inputs")) {
        plan.inputs.push_back({each.at("path").get<std::string>(), each.at("stamp").get<std::string>(),
                               each.at("hash").get<uint64_t>(), each.at("bytes").get<uint64_t>()});
        plan.options.inputs.push_back(plan.inputs.back().path);
    }
    plan.options.output = j.at("output").get<std::string>();
    plan.options.overwrite = j.at("overwrite").get<bool>();
    plan.options.format = j.at("format").get<std::string>();
    plan.options.cell = j.at("cell").get<double>();
    if (const json& origin = j.at("origin"); !origin.is_null())
        plan.options.origin = {origin.at(0).get<double>(), origin.at(1).get<double>(), origin.at(2).get<double>()};
    plan.options.colour = ColourChoice(j.at("colour").get<int>());
    plan.options.keepImages = j.at("images").get<bool>();
    const auto quality = j.at("image_quality").get<std::array<int, 2>>();
    if (quality[0] >= 0) plan.options.imageQuality.finest = quality[0];
    if (quality[1] >= 0) plan.options.imageQuality.coarser = quality[1];
    plan.options.vertexNormals = VertexNormals(j.at("vertex_normals").get<int>());
    plan.options.allowOutside = j.at("allow_outside").get<bool>();
    plan.options.masks = j.at("masks").get<bool>();
    plan.options.channels = j.at("channels").get<bool>();
    plan.options.memoryBytes = j.at("memory").get<uint64_t>();
    return plan;
}

}  // namespace

Result<std::string> programId() {
    VCP_TRY_ASSIGN(const auto content, contentOf("/proc/self/exe"));
    return fmt::format("{} {:016x}", VCP_VERSION, content.hash);
}

Result<std::vector<PlannedInput>> describeInputs(const std::vector<std::filesystem::path>& paths) {
    std::vector<PlannedInput> inputs;
    for (const auto& path : paths) {
        const std::string stamp = fileStamp(path);
        VCP_TRY_ASSIGN(const auto content, contentOf(path));
        inputs.push_back({path, stamp, content.hash, content.bytes});
    }
    return inputs;
}

PlannedInput describeSideFile(const SideFile& file) {
    const auto content = contentOf(file.path);
    return {file.path, file.stamp, content ? content->hash : 0, content ? content->bytes : 0};
}

Result<void> checkInput(const PlannedInput& input) {
    // A copy, or another machine's clock, changes the times alone: then the bytes decide.
    if (fileStamp(input.path) == input.stamp) return {};
    VCP_TRY_ASSIGN(const auto content, contentOf(input.path));
    if (content.hash == input.hash) return {};
    return Error{.code = ErrorCode::Usage,
                 .message = "was changed since the build was planned; plan it again",
                 .file = input.path.string()};
}

Result<void> writePlan(const PartPlan& plan, const std::filesystem::path& folder) {
    std::string text;
    try {
        text = jsonOf(plan).dump(2) + "\n";
    } catch (const json::exception&) {
        return Error{.code = ErrorCode::Usage,
                     .message = "the names of inputs and output must be UTF-8 to be planned in parts",
                     .file = plan.options.output.string()};
    }
    return writeFile(folder / kPlanName, OutputKind::JsonText, text);
}

Result<PartPlan> readPlan(const std::filesystem::path& folder) {
    const std::filesystem::path file = folder / kPlanName;
    std::ifstream stream(file);
    if (!stream) return systemError(file, "cannot be opened", errno);
    try {
        PartPlan plan = planFrom(json::parse(stream));
        if (plan.parts == 0 || plan.inputs.empty()) return damagedPlan(file);
        return plan;
    } catch (const json::exception&) {
        return damagedPlan(file);
    }
}

}  // namespace vcp
