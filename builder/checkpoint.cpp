#include "builder/checkpoint.h"

#include <algorithm>
#include <functional>
#include <system_error>

#include <fmt/format.h>
#include <xxhash.h>

#include "builder/spill/journal.h"

namespace vcp {

namespace {

using nlohmann::json;

// Version of the temporary files; a build does not continue from another version's.
constexpr int kTempVersion = 20;

json jsonOf(glm::dvec3 v) { return {v.x, v.y, v.z}; }

/// Reads the journal's fields. A field that is missing or wrong is remembered, and read as zero.
class Fields {
public:
    explicit Fields(const json& object) : object_(object) {}

    [[nodiscard]] bool areWhole() const { return areWhole_; }
    void require(bool holds) { areWhole_ &= holds; }

    const json& at(const char* name) {
        static const json kNone;
        const auto found = object_.find(name);
        require(found != object_.end());
        return found != object_.end() ? *found : kNone;
    }
    std::string text(const char* name) { return textOf(at(name)); }
    bool truth(const char* name) {
        const json& j = at(name);
        require(j.is_boolean());
        return j.is_boolean() && j.get<bool>();
    }
    double number(const char* name) { return numberOf(at(name)); }
    uint64_t count(const char* name) { return countOf(at(name)); }
    glm::dvec3 vector(const char* name) {
        const json& j = list(name);
        require(j.size() == 3);
        return j.size() == 3 ? glm::dvec3(numberOf(j[0]), numberOf(j[1]), numberOf(j[2])) : glm::dvec3(0);
    }
    const json& list(const char* name) {
        static const json kEmpty = json::array();
        const json& j = at(name);
        require(j.is_array());
        return j.is_array() ? j : kEmpty;
    }
    const json& object(const char* name) {
        static const json kEmpty = json::object();
        const json& j = at(name);
        require(j.is_object());
        return j.is_object() ? j : kEmpty;
    }

    std::string textOf(const json& j) {
        require(j.is_string());
        return j.is_string() ? j.get<std::string>() : std::string();
    }
    double numberOf(const json& j) {
        require(j.is_number());
        return j.is_number() ? j.get<double>() : 0;
    }
    uint64_t countOf(const json& j) {
        require(j.is_number_unsigned());
        return j.is_number_unsigned() ? j.get<uint64_t>() : 0;
    }

private:
    const json& object_;
    bool areWhole_ = true;
};

SoupMeasures readMeasures(Fields& from) {
    SoupMeasures m;
    m.boundsMin = from.vector("min");
    m.boundsMax = from.vector("max");
    m.area = from.number("area");
    m.length = from.number("length");
    m.triangles = from.count("triangles");
    m.degenerateTriangles = from.count("degenerate");
    m.cutTriangles = from.count("cut");
    m.vertices = from.count("vertices");
    m.hasVertexColours = from.truth("vertex colours");
    m.hasMaterials = from.truth("materials");
    return m;
}

SoupMeasures measuresIn(Fields& all) {
    Fields from(all.object("measures"));
    const SoupMeasures m = readMeasures(from);
    const glm::dvec3 extent = m.boundsMax - m.boundsMin;
    all.require(from.areWhole() && std::min({extent.x, extent.y, extent.z}) >= 0 && m.area > 0 && m.length > 0 &&
                m.triangles > m.degenerateTriangles);
    return m;
}

/// Reads pairs of a path, which may have any bytes, and a stamp.
std::vector<SideFile> sideFilesFrom(Fields& all) {
    std::vector<SideFile> files;
    for (const json& pair : all.list("side files")) {
        const bool isPair = pair.is_array() && pair.size() == 2 && pair[0].is_array();
        all.require(isPair);
        if (!isPair) continue;
        std::string path;
        for (const json& byte : pair[0]) path += char(all.countOf(byte));
        files.emplace_back(path, all.textOf(pair[1]));
    }
    return files;
}

std::vector<std::pair<uint64_t, uint64_t>> spoolsFrom(Fields& all, const char* name) {
    std::vector<std::pair<uint64_t, uint64_t>> spools;
    for (const json& pages : all.list(name)) {
        const bool isPair = pages.is_array() && pages.size() == 2;
        all.require(isPair);
        if (isPair) spools.emplace_back(all.countOf(pages[0]), all.countOf(pages[1]));
    }
    return spools;
}

Recorded::Files filesFrom(Fields& all) {
    Recorded::Files files;
    for (const auto& [name, bytes] : all.object("files").items()) files.bins[name] = all.countOf(bytes);
    files.spools = spoolsFrom(all, "spools");
    files.surfaces = spoolsFrom(all, "surfaces");
    files.images = spoolsFrom(all, "images");
    return files;
}

/// Reads the fields that only the stage "levels" has.
void readLevels(Fields& all, Recorded& recorded) {
    for (const json& first : all.list("partition")) recorded.partition.push_back(all.countOf(first));
    const auto& bins = recorded.partition;
    all.require(!bins.empty() && bins[0] == 0 && std::is_sorted(bins.begin(), bins.end(), std::less_equal<>()));
    all.require(all.list("parted").size() < kMaxLevels);
    for (const json& codes : all.list("parted")) {
        all.require(codes.is_array());
        recorded.parted.emplace_back();
        for (const json& code : codes) recorded.parted.back().push_back(all.countOf(code));
    }
    const uint64_t levelsLess = all.count("levels less");
    all.require(levelsLess < kMaxLevels);
    recorded.levelsLess = uint32_t(std::min<uint64_t>(levelsLess, kMaxLevels));
    recorded.pages = all.count("pages");
    const json& pass = all.at("pass");
    const int levels = int(std::min<size_t>(recorded.files.spools.size(), kMaxLevels));
    const bool isPass = pass.is_number_integer() && pass >= -1 && pass <= levels;
    all.require(isPass);
    recorded.pass = isPass ? pass.get<int>() : 0;
    recorded.bin = all.count("bin");
}

/// Lists the bins that exist, by the names that the journal gives them.
std::vector<std::pair<const char*, RawBins*>> binsOf(WorkFiles& files) {
    std::vector<std::pair<const char*, RawBins*>> bins;
    if (files.soup) bins = {{"floats", &files.soup->floats.raw()}, {"doubles", &files.soup->doubles.raw()}};
    if (files.current) bins.emplace_back("current", &files.current->raw());
    if (files.next) bins.emplace_back("next", &files.next->raw());
    if (files.parts) bins.emplace_back("parts", &files.parts->raw());
    if (files.vertices) bins.emplace_back("vertices", &files.vertices->raw());
    if (files.textures) bins.emplace_back("textures", &files.textures->raw());
    if (files.waiting) bins.emplace_back("waiting", &files.waiting->raw());
    return bins;
}

/// Makes the first spools durable; returns the lengths of all, in bytes and entries. Those that are not needed count as
/// empty: they may be gone at any time.
Result<json> syncSpools(std::deque<PageSpool>& spools, size_t needed) {
    json lengths = json::array();
    for (size_t i = 0; i < spools.size(); ++i) {
        const bool isNeeded = i < needed && spools[i].bytes() > 0;
        if (isNeeded) VCP_TRY(spools[i].sync());
        lengths.push_back({isNeeded ? spools[i].bytes() : 0, isNeeded ? spools[i].entries().size() : 0});
    }
    return lengths;
}

using SpoolLengths = std::vector<std::pair<uint64_t, uint64_t>>;

/// Appends the names of the files of spools that are not empty.
void keepSpools(const std::deque<PageSpool>& spools, const SpoolLengths& lengths, std::vector<std::string>& kept) {
    for (size_t i = 0; i < spools.size(); ++i)
        if (lengths[i].first > 0) kept.insert(kept.end(), {spools[i].pagesFile(), spools[i].directoryFile()});
}

Result<void> reopenSpools(std::deque<PageSpool>& spools, const SpoolLengths& lengths) {
    for (size_t i = 0; i < spools.size(); ++i)
        if (const auto& [bytes, entries] = lengths[i]; bytes > 0) VCP_TRY(spools[i].reopen(bytes, entries));
    return {};
}

}  // namespace

std::string settingsText(const BuildOptions& options) {
    // How images are coded matters where some are kept.
    const ImageQuality quality = keepsImages(options) ? options.imageQuality : ImageQuality();
    std::string text =
        fmt::format("{} {:a} {:a} {} {} {} {} {} {} {} {} {} {}", kFileVersion, options.cell, options.error,
                    options.errorIsRelative, int(options.colour), int(options.coarseLeaves), keepsImages(options),
                    quality.finest.value_or(-1), quality.coarser.value_or(-1), int(options.vertexNormals),
                    options.masks, options.channels, options.format);
    if (options.allowOutside) text += " outside";
    if (options.origin) text += fmt::format(" {:a} {:a} {:a}", options.origin->x, options.origin->y, options.origin->z);
    return text;
}

std::string buildFingerprint(const BuildOptions& options) {
    std::string text = fmt::format("{} {}", kTempVersion, settingsText(options));
    for (const auto& input : options.inputs) {
        std::error_code ignored;
        const auto size = std::filesystem::file_size(input, ignored);
        const auto time = std::filesystem::last_write_time(input, ignored);
        text += fmt::format("|{} {} {}", std::filesystem::absolute(input, ignored).string(), size,
                            time.time_since_epoch().count());
    }
    return fmt::format("{:016x}", XXH3_64bits(text.data(), text.size()));
}

json jsonOf(const SoupMeasures& m) {
    return {{"min", jsonOf(m.boundsMin)}, {"max", jsonOf(m.boundsMax)}, {"area", m.area},
            {"length", m.length},         {"triangles", m.triangles},   {"degenerate", m.degenerateTriangles},
            {"cut", m.cutTriangles},      {"vertices", m.vertices},     {"vertex colours", m.hasVertexColours},
            {"materials", m.hasMaterials}};
}

std::optional<SoupMeasures> measuresFrom(const json& object) {
    Fields from(object);
    const SoupMeasures measures = readMeasures(from);
    return from.areWhole() ? std::optional(measures) : std::nullopt;
}

json jsonOf(const std::vector<SideFile>& files) {
    json pairs = json::array();
    for (const SideFile& each : files) pairs.push_back({bytesJson(each.path.native()), each.stamp});
    return pairs;
}

Result<Recorded> recordedFrom(const json& journal, const std::filesystem::path& file) {
    Recorded recorded;
    if (journal.is_null()) return recorded;
    Fields all(journal);
    recorded.stage = all.text("stage");
    recorded.build = all.text("build");
    all.require(recorded.stage == "read" || recorded.stage == "levels");
    recorded.measures = measuresIn(all);
    recorded.sideFiles = sideFilesFrom(all);
    recorded.files = filesFrom(all);
    if (recorded.stage == "levels") readLevels(all, recorded);
    if (all.areWhole()) return recorded;
    return Error{
        .code = ErrorCode::InvalidInput,
        .message = "some of what it should say is missing or wrong; check the disk, then build again from the start",
        .file = file.string()};
}

Result<json> WorkFiles::sync() {
    json files = json::object();
    for (const auto& [name, bins] : binsOf(*this)) {
        VCP_TRY(bins->sync());
        files[name] = bins->bytes();
    }
    VCP_TRY_ASSIGN(const auto pages, syncSpools(spools, spools.size()));
    VCP_TRY_ASSIGN(const auto cells, syncSpools(surfaces, neededSurfaces));
    VCP_TRY_ASSIGN(const auto pictures, syncSpools(images, images.size()));
    return json{{"files", files}, {"spools", pages}, {"surfaces", cells}, {"images", pictures}};
}

Result<void> WorkFiles::reopen(const Recorded& recorded, TempSpace& space) {
    const auto unlike = [&](const char* what) {
        return Error{.code = ErrorCode::InvalidInput,
                     .message = fmt::format("{}; build again from the start", what),
                     .file = (space.folder().path() / kJournalName).string()};
    };
    // What a pass makes, the next level's bins among it, is there from its first bin on.
    const bool isBegun = recorded.bin > 0, areVerticesMade = recorded.pass == int(spools.size());
    std::vector<std::string> kept{kJournalName};
    std::vector<std::pair<RawBins*, uint64_t>> bins;
    for (const auto& [name, raw] : binsOf(*this)) {
        const auto found = recorded.files.bins.find(name);
        const bool isMade = (next && raw == &next->raw()) || (waiting && raw == &waiting->raw()) ||
                            (vertices && raw == &vertices->raw() && areVerticesMade);
        const bool isNeeded = isBegun || !isMade;
        if (found == recorded.files.bins.end() && isNeeded) return unlike("does not say how long all files were");
        if (found == recorded.files.bins.end() || found->second == 0) continue;
        bins.emplace_back(raw, found->second);
        kept.push_back(raw->fileName());
    }
    if (recorded.files.spools.size() != spools.size() || recorded.files.surfaces.size() != surfaces.size() ||
        recorded.files.images.size() != images.size())
        return unlike("is of another number of levels");
    keepSpools(spools, recorded.files.spools, kept);
    keepSpools(surfaces, recorded.files.surfaces, kept);
    keepSpools(images, recorded.files.images, kept);
    space.folder().clear(kept);
    for (const auto& [raw, bytes] : bins) VCP_TRY(raw->reopen(bytes));
    VCP_TRY(reopenSpools(spools, recorded.files.spools));
    VCP_TRY(reopenSpools(images, recorded.files.images));
    return reopenSpools(surfaces, recorded.files.surfaces);
}

}  // namespace vcp
