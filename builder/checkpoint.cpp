#include "builder/checkpoint.h"

#include <system_error>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <xxhash.h>

namespace vcp {

namespace {

using nlohmann::json;

// What the temporary files look like; a build does not go on where one of another version was.
constexpr int kTempVersion = 1;

json jsonOf(glm::dvec3 v) { return {v.x, v.y, v.z}; }
glm::dvec3 vectorFrom(const json& j) { return {j.at(0).get<double>(), j.at(1).get<double>(), j.at(2).get<double>()}; }

/// Those bins that there are, by the names that the journal gives them.
std::vector<std::pair<const char*, RawBins*>> binsOf(WorkFiles& files) {
    std::vector<std::pair<const char*, RawBins*>> bins;
    if (files.soup) bins = {{"floats", &files.soup->floats.raw()}, {"doubles", &files.soup->doubles.raw()}};
    if (files.current) bins.emplace_back("current", &files.current->raw());
    if (files.next) bins.emplace_back("next", &files.next->raw());
    if (files.waiting) bins.emplace_back("waiting", &files.waiting->raw());
    return bins;
}

}  // namespace

std::string buildFingerprint(const BuildOptions& options) {
    std::string text = fmt::format("{} {} {:a} {:a} {} {} {}", kTempVersion, kFileVersion, options.cell, options.error, options.errorIsRelative, static_cast<int>(options.colour), options.format);
    for (const auto& input : options.inputs) {
        std::error_code ignored;
        const auto size = std::filesystem::file_size(input, ignored);
        const auto time = std::filesystem::last_write_time(input, ignored);
        text += fmt::format("|{} {} {}", std::filesystem::absolute(input, ignored).string(), size, time.time_since_epoch().count());
    }
    return fmt::format("{:016x}", XXH3_64bits(text.data(), text.size()));
}

json jsonOf(const SoupMeasures& m) {
    return {{"min", jsonOf(m.boundsMin)}, {"max", jsonOf(m.boundsMax)}, {"area", m.area}, {"triangles", m.triangles}, {"degenerate", m.degenerateTriangles}, {"vertices", m.vertices}, {"vertex colours", m.hasVertexColours}, {"materials", m.hasMaterials}};
}

SoupMeasures measuresFrom(const json& j) {
    SoupMeasures m;
    m.boundsMin = vectorFrom(j.at("min"));
    m.boundsMax = vectorFrom(j.at("max"));
    m.area = j.at("area").get<double>();
    m.triangles = j.at("triangles").get<uint64_t>();
    m.degenerateTriangles = j.at("degenerate").get<uint64_t>();
    m.vertices = j.at("vertices").get<uint64_t>();
    m.hasVertexColours = j.at("vertex colours").get<bool>();
    m.hasMaterials = j.at("materials").get<bool>();
    return m;
}

Result<json> WorkFiles::sync() {
    json files = json::object(), pages = json::array();
    for (const auto& [name, bins] : binsOf(*this)) {
        VCP_TRY(bins->sync());
        files[name] = bins->bytes();
    }
    for (PageSpool& spool : spools) {
        if (spool.bytes() > 0) VCP_TRY(spool.sync());
        pages.push_back({spool.bytes(), spool.entries().size()});
    }
    return json{{"files", files}, {"spools", pages}};
}

Result<void> WorkFiles::reopen(const json& recorded, TempSpace& space) {
    std::vector<std::string> kept{kJournalName};
    std::vector<std::pair<RawBins*, uint64_t>> bins;
    for (const auto& [name, raw] : binsOf(*this))
        if (const uint64_t bytes = recorded.at("files").value(name, uint64_t{0}); bytes > 0) {
            bins.emplace_back(raw, bytes);
            kept.push_back(raw->fileName());
        }
    for (const PageSpool& spool : spools) kept.insert(kept.end(), {spool.pagesFile(), spool.directoryFile()});
    space.clear(kept);
    for (const auto& [raw, bytes] : bins) VCP_TRY(raw->reopen(bytes));
    for (size_t i = 0; i < spools.size(); ++i) {
        const json& pages = recorded.at("spools").at(i);
        if (const uint64_t bytes = pages.at(0).get<uint64_t>(); bytes > 0) VCP_TRY(spools[i].reopen(bytes, pages.at(1).get<uint64_t>()));
    }
    return {};
}

}  // namespace vcp
