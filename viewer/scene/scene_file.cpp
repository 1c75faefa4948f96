#include "viewer/scene/scene_file.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <type_traits>

#include <fmt/format.h>
#include <glm/common.hpp>
#include <glm/exponential.hpp>
#include <glm/geometric.hpp>
#include <nlohmann/json.hpp>

#include "mesostructure/base/subdivision.h"
#include "mesostructure/solids.h"
#include "streaming/http_reader.h"
#include "viewer/camera/json_lines.h"
#include "viewer/camera/text_file.h"

namespace vcp {

namespace {

using Json = nlohmann::json;

constexpr size_t kLargestFile = 1 << 20;
constexpr size_t kMostSurfaces = 64;
constexpr size_t kMostPathPoints = 1000;                    // of a surface
constexpr double kShortestPath = 0.1, kLongestPath = 3600;  // seconds
constexpr int kDeepestScene = 16;
constexpr int kMostSteps = 4096;      // of relief mapping
constexpr int kMostRefinements = 64;  // of a step of relief mapping
// Tile edges that a displacement is high.
constexpr double kUsualDisplacement = 0.1;
constexpr double kSmallestCell = 0.25, kLargestCell = 1000;   // pixels, of remeshing
constexpr double kSmallestError = 0.05, kLargestError = 100;  // pixels, of remeshing
// Within this range double precision resolves a millimetre where units are metres, and more.
constexpr double kLargestNumber = 1e12, kLargestScale = 1e9;

bool isDeeperThan(const Json& json, int depth) {
    if (!json.is_structured()) return false;
    if (depth == 0) return true;
    return std::any_of(json.begin(), json.end(), [&](const Json& each) { return isDeeperThan(each, depth - 1); });
}

/// Takes a scene apart and remembers the first error.
class SceneReader {
public:
    SceneReader(const LinesOf& lines, const std::string& name, std::filesystem::path folder)
        : lines_(lines), name_(name), folder_(std::move(folder)) {}

    SceneFile scene(const Json& json) {
        SceneFile scene;
        if (!json.is_object()) return wrong("", "a scene must be a JSON object"), scene;
        onlyKeys(json, "",
                 {"datasets", "lights", "environment", "camera", "sections", "caps", "annotations", "mesostructure"});
        if (json.contains("mesostructure")) scene.surfaces = surfaces(json["mesostructure"]);
        if (!json.contains("datasets") && scene.surfaces.empty()) wrong("", "\"datasets\" is missing");
        const Json& datasets = json.value("datasets", Json::array());
        if (!datasets.is_array() || (datasets.empty() && scene.surfaces.empty()) ||
            datasets.size() > kMostSceneDatasets)
            wrong("/datasets", fmt::format("must be a list of 1 to {} datasets", kMostSceneDatasets));
        for (size_t i = 0; i < datasets.size() && !error_; ++i)
            scene.datasets.push_back(dataset(datasets[i], fmt::format("/datasets/{}", i)));
        if (json.contains("lights")) scene.lights = lights(json["lights"]);
        if (json.contains("environment")) scene.environment = environment(json["environment"]);
        if (json.contains("camera")) scene.camera = camera(json["camera"]);
        if (json.contains("sections")) scene.sections = sections(json["sections"]);
        if (json.contains("caps")) scene.sectionCaps = caps(json["caps"]);
        if (json.contains("annotations")) scene.annotations = annotations(json["annotations"]);
        return scene;
    }

    std::vector<Annotation> annotations(const Json& json) {
        std::vector<Annotation> all;
        if (!json.is_array() || json.size() > kMostAnnotations)
            return wrong("/annotations", fmt::format("must be a list of at most {}", kMostAnnotations)), all;
        for (size_t i = 0; i < json.size() && !error_; ++i) {
            const std::string at = fmt::format("/annotations/{}", i);
            if (!isObject(json[i], at)) return all;
            onlyKeys(json[i], at, {"position", "title", "text"});
            Annotation& made = all.emplace_back();
            if (json[i].contains("position"))
                made.position = triple(json[i]["position"], at + "/position");
            else
                wrong(at, "\"position\" is missing");
            if (json[i].contains("title")) made.title = lineOfText(json[i]["title"], at + "/title", kLongestTitle);
            if (json[i].contains("text")) made.text = lineOfText(json[i]["text"], at + "/text", kLongestText);
        }
        return all;
    }

    [[nodiscard]] const std::optional<Error>& error() const { return error_; }

private:
    void wrong(const std::string& at, const std::string& what) {
        if (error_) return;
        const std::string key = at.substr(at.rfind('/') + 1);
        const bool isKey =
            !key.empty() && !std::all_of(key.begin(), key.end(), [](char c) { return c >= '0' && c <= '9'; });
        error_ = Error{.code = ErrorCode::InvalidInput,
                       .message = isKey ? fmt::format("\"{}\" {}", key, what) : what,
                       .file = name_,
                       .element = fmt::format("line {}", lines_(at))};
    }

    void onlyKeys(const Json& object, const std::string& at, std::initializer_list<std::string_view> keys) {
        for (const auto& [key, value] : object.items())
            if (std::find(keys.begin(), keys.end(), key) == keys.end())
                wrong(at + "/" + key, fmt::format("is no key here; there are {}", fmt::join(keys, ", ")));
    }

    double number(const Json& value, const std::string& at) {
        if (!value.is_number()) return wrong(at, "must be a number"), 0;
        if (!(std::abs(value.get<double>()) <= kLargestNumber))
            return wrong(at, fmt::format("must be between -{0:g} and {0:g}", kLargestNumber)), 0;
        return value.get<double>();
    }

    bool flag(const Json& value, const std::string& at) {
        if (!value.is_boolean()) return wrong(at, "must be true or false"), false;
        return value.get<bool>();
    }

    Caps caps(const Json& value) {
        if (value == "all") return Caps::All;
        if (!value.is_boolean()) return wrong("/caps", "must be true or false, or \"all\""), Caps::None;
        return value.get<bool>() ? Caps::Closed : Caps::None;
    }

    glm::dvec3 triple(const Json& value, const std::string& at) {
        glm::dvec3 v(0);
        if (!value.is_array() || value.size() != 3) return wrong(at, "must be three numbers"), v;
        for (int i = 0; i < 3; ++i) {
            if (!value[size_t(i)].is_number()) return wrong(at, "must be three numbers"), v;
            v[i] = number(value[size_t(i)], at);
        }
        return v;
    }

    glm::dvec3 direction(const Json& object, const char* key, const std::string& at) {
        if (!object.contains(key)) return wrong(at, fmt::format("\"{}\" is missing", key)), glm::dvec3(1, 0, 0);
        const std::string there = at + "/" + key;
        const glm::dvec3 v = triple(object[key], there);
        const double largest = std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
        if (!(largest > 0)) return wrong(there, "must not be zero"), glm::dvec3(1, 0, 0);
        return v;
    }

    /// Makes a vector unit; it may have any length above zero.
    static glm::dvec3 unit(glm::dvec3 v) {
        return glm::normalize(v / std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)}));
    }

    bool isObject(const Json& value, const std::string& at) {
        if (!value.is_object()) wrong(at, "must be an object");
        return value.is_object();
    }

    SceneDataset dataset(const Json& json, const std::string& at) {
        SceneDataset made;
        if (!isObject(json, at)) return made;
        onlyKeys(json, at, {"file", "transform", "translate", "rotate", "scale", "colour", "opacity"});
        made.from = {name_, lines_(at + "/file"), "file"};
        if (!json.contains("file"))
            wrong(at, "\"file\" is missing");
        else if (!json["file"].is_string() || json["file"].get<std::string>().empty())
            wrong(at + "/file", "must be a file's name");
        else
            made.file = fileNamed(json["file"].get<std::string>());
        if (json.contains("colour")) made.colour = colour(json["colour"], at + "/colour");
        if (json.contains("opacity")) made.opacity = opacity(json["opacity"], at + "/opacity");
        if (json.contains("transform")) {
            for (const char* other : {"translate", "rotate", "scale"})
                if (json.contains(other)) wrong(at + "/" + other, "does not go with \"transform\"");
            made.placement = matrix(json["transform"], at + "/transform");
            return made;
        }
        if (json.contains("translate")) made.placement.translation = triple(json["translate"], at + "/translate");
        if (json.contains("rotate")) made.placement.rotation = rotation(json["rotate"], at + "/rotate");
        if (json.contains("scale")) made.placement.scale = scale(json["scale"], at + "/scale");
        return made;
    }

    std::vector<MesoSurfaceDescription> surfaces(const Json& json) {
        std::vector<MesoSurfaceDescription> all;
        if (!json.is_array() || json.empty() || json.size() > kMostSurfaces)
            return wrong("/mesostructure", fmt::format("must be a list of 1 to {} surfaces", kMostSurfaces)), all;
        for (size_t i = 0; i < json.size() && !error_; ++i)
            all.push_back(surface(json[i], fmt::format("/mesostructure/{}", i)));
        return all;
    }

    MesoSurfaceDescription surface(const Json& json, const std::string& at) {
        MesoSurfaceDescription made;
        made.method.name = "boxes";
        if (!isObject(json, at)) return made;
        onlyKeys(
            json, at,
            {"asset",       "surface",  "subdivide",      "tiles",  "height",       "translate",  "scale",    "up",
             "colour",      "texture",  "normal_texture", "method", "cell",         "grid",       "cones",    "steps",
             "refinements", "rank",     "directions",     "base",   "far",          "offset",     "filter",   "path",
             "seconds",     "transfer", "base_transfer",  "error",  "displacement", "curvatures", "curvature"});
        if (json.contains("displacement")) {
            if (json.contains("asset")) wrong(at + "/asset", "does not go with \"displacement\"");
            made.displacement = named(json["displacement"], at + "/displacement", [](const auto&) { return true; });
            made.method.name = kRemeshMethod, made.heightScale = kUsualDisplacement;
        } else if (!json.contains("asset")) {
            wrong(at, "\"asset\" or \"displacement\" is missing");
        } else {
            made.asset = assetNamed(json["asset"], at + "/asset");
        }
        made.from = {name_, lines_(at), {}};
        // A base that is not a name of a shape is a mesh.
        const auto bases = meso::baseSurfaceNames();
        const auto isMesh = [&](const std::string& name) { return std::ranges::find(bases, name) == bases.end(); };
        if (json.contains("surface")) made.base = named(json["surface"], at + "/surface", isMesh);
        if (json.contains("subdivide")) made.subdivide = times(json["subdivide"], at + "/subdivide");
        if (json.contains("tiles")) made.tiles = scale(json["tiles"], at + "/tiles");
        if (json.contains("height")) made.heightScale = scale(json["height"], at + "/height");
        if (json.contains("offset")) made.offset = number(json["offset"], at + "/offset");
        if (json.contains("filter")) made.withFilter = flag(json["filter"], at + "/filter");
        if (json.contains("translate")) made.place = triple(json["translate"], at + "/translate");
        if (json.contains("path")) made.path.points = path(json["path"], at + "/path");
        if (json.contains("path") && !json.contains("translate") && !error_) made.place = made.path.points.front();
        if (json.contains("seconds")) made.path.seconds = seconds(json["seconds"], at + "/seconds");
        if (json.contains("scale")) made.scale = scale(json["scale"], at + "/scale");
        if (json.contains("up")) made.up = upAxis(json["up"], at + "/up");
        if (json.contains("colour")) made.colour = colour(json["colour"], at + "/colour");
        const auto isPicture = [](const std::string&) { return true; };
        if (json.contains("texture")) made.colourTexture = named(json["texture"], at + "/texture", isPicture);
        if (json.contains("normal_texture"))
            made.normalTexture = named(json["normal_texture"], at + "/normal_texture", isPicture);
        if (json.contains("method")) made.method.name = methodNamed(json["method"], at + "/method");
        if (json.contains("cell")) made.cell = pixels(json["cell"], at + "/cell");
        if (json.contains("error")) made.errorPixels = allowedError(json["error"], at + "/error");
        if (json.contains("grid")) made.method.cells = whole(json["grid"], at + "/grid", meso::kMaxGridEdge);
        if (json.contains("cones")) made.method.cones = cones(json["cones"], at + "/cones");
        if (json.contains("steps")) made.method.steps = whole(json["steps"], at + "/steps", kMostSteps);
        if (json.contains("refinements"))
            made.method.refinements = whole(json["refinements"], at + "/refinements", kMostRefinements);
        if (json.contains("rank")) made.method.rank = upTo(json["rank"], at + "/rank", meso::kMostRank);
        if (json.contains("directions")) made.method.directions = directions(json["directions"], at + "/directions");
        if (json.contains("curvatures"))
            made.method.curvatures.samples = odd(json["curvatures"], at + "/curvatures", meso::kMostCurvatureSamples);
        if (json.contains("curvature")) made.method.curvatures.most = curvature(json["curvature"], at + "/curvature");
        if (json.contains("base")) made.withBase = flag(json["base"], at + "/base");
        if (json.contains("far")) made.withFar = flag(json["far"], at + "/far");
        if (json.contains("transfer")) made.withTransfer = flag(json["transfer"], at + "/transfer");
        if (json.contains("base_transfer")) made.withBaseTransfer = flag(json["base_transfer"], at + "/base_transfer");
        return made;
    }

    std::vector<glm::dvec3> path(const Json& json, const std::string& at) {
        std::vector<glm::dvec3> points;
        if (!json.is_array() || json.size() < 2 || json.size() > kMostPathPoints)
            return wrong(at, fmt::format("must be a list of 2 to {} points", kMostPathPoints)), points;
        for (size_t i = 0; i < json.size(); ++i) points.push_back(triple(json[i], fmt::format("{}/{}", at, i)));
        return points;
    }

    double seconds(const Json& json, const std::string& at) {
        const double time = number(json, at);
        if (!(time >= kShortestPath && time <= kLongestPath))
            wrong(at, fmt::format("must be from {} to {} seconds", kShortestPath, kLongestPath));
        return time;
    }

    /// Reads a name, or a file, which is relative to the scene's folder.
    template <class IsFile>
    std::string named(const Json& json, const std::string& at, IsFile isFile) {
        if (!json.is_string() || json.get<std::string>().empty())
            return wrong(at, "must be a name or a file's name"), std::string();
        const std::string name = json.get<std::string>();
        return isFile(name) ? fileNamed(name) : name;
    }

    std::string assetNamed(const Json& json, const std::string& at) {
        const std::string name = named(json, at, [](const std::string& file) { return file.ends_with(".meso"); });
        const auto isIn = [&](const auto& names) { return std::ranges::find(names, name) != names.end(); };
        if (!error_ && !name.ends_with(".meso") && !isIn(meso::heightFieldNames()) && !isIn(meso::solidNames()))
            wrong(at, fmt::format("must be an asset (.meso), a height field ({}) or a solid ({})",
                                  fmt::join(meso::heightFieldNames(), ", "), fmt::join(meso::solidNames(), ", ")));
        return name;
    }

    int upTo(const Json& json, const std::string& at, int most) {
        const double count = json.is_number() ? json.get<double>() : -1;
        if (!(count >= 0 && count <= most && count == std::floor(count)))
            return wrong(at, fmt::format("must be a whole number from 0 to {}", most)), 0;
        return int(count);
    }

    int times(const Json& json, const std::string& at) { return upTo(json, at, meso::kMostSubdivisions); }

    float opacity(const Json& json, const std::string& at) {
        const double part = number(json, at);
        if (!(part >= 0 && part <= 1)) wrong(at, "must be from 0 to 1");
        return float(part);
    }

    UpAxis upAxis(const Json& json, const std::string& at) {
        if (json != "y" && json != "z") wrong(at, "must be \"y\" or \"z\"");
        return json == "y" ? UpAxis::Y : UpAxis::Z;
    }

    glm::vec3 colour(const Json& json, const std::string& at) {
        const glm::dvec3 rgb = triple(json, at);
        if (glm::clamp(rgb, 0.0, 1.0) != rgb) wrong(at, "must be red, green and blue from 0 to 1");
        return rgb;
    }

    double pixels(const Json& json, const std::string& at) {
        const double edge = json.is_number() ? json.get<double>() : 0;
        if (!(edge >= kSmallestCell && edge <= kLargestCell))
            return wrong(at, fmt::format("must be from {:g} to {:g} pixels", kSmallestCell, kLargestCell)), 1;
        return edge;
    }

    double allowedError(const Json& json, const std::string& at) {
        const double most = json.is_number() ? json.get<double>() : -1;
        if (!(most == 0 || (most >= kSmallestError && most <= kLargestError)))
            return wrong(at, fmt::format("must be 0 or from {:g} to {:g} pixels", kSmallestError, kLargestError)), 0;
        return most;
    }

    std::string methodNamed(const Json& json, const std::string& at) {
        const auto names = surfaceMethodNames();
        const std::string name = json.is_string() ? json.get<std::string>() : std::string();
        if (std::ranges::find(names, name) == names.end())
            wrong(at, fmt::format("must be one of {}", fmt::join(names, ", ")));
        return name;
    }

    int whole(const Json& json, const std::string& at, int most) {
        if (!json.is_number_integer() || json < 1 || json > most)
            return wrong(at, fmt::format("must be a whole number from 1 to {}", most)), 1;
        return json.get<int>();
    }

    int odd(const Json& json, const std::string& at, int most) {
        const int count = whole(json, at, most);
        if (count % 2 == 0) wrong(at, fmt::format("must be an odd number from 1 to {}", most));
        return count;
    }

    double curvature(const Json& json, const std::string& at) {
        const double most = json.is_number() ? json.get<double>() : 0;
        if (!(most > 0 && most <= meso::kMostCurvature))
            wrong(at, fmt::format("must be above 0 and at most {:g} slab heights over a radius", meso::kMostCurvature));
        return most;
    }

    meso::Cones cones(const Json& json, const std::string& at) {
        if (!json.is_array() || json.size() != 2)
            return wrong(at, "must be two whole numbers: azimuths, elevations"), meso::Cones{};
        return {whole(json[0], at, meso::kMostAzimuths), whole(json[1], at, meso::kMostElevations)};
    }

    glm::ivec2 directions(const Json& json, const std::string& at) {
        if (!json.is_array() || json.size() != 2)
            return wrong(at, "must be two whole numbers: elevations, azimuths"), meso::MethodOptions().directions;
        return {whole(json[0], at, 64), whole(json[1], at, 64)};
    }

    [[nodiscard]] std::string fileNamed(const std::string& file) const {
        return isHttpUrl(file) || std::filesystem::path(file).is_absolute()
                   ? file
                   : (folder_ / file).lexically_normal().string();
    }

    double scale(const Json& value, const std::string& at) {
        if (value.is_array())
            return wrong(at, "must be one number: other scales along other axes are not supported"), 1;
        const double s = number(value, at);
        if (!error_ && !(s >= 1 / kLargestScale && s <= kLargestScale))
            return wrong(at, fmt::format("must be above 0, from {:g} to {:g}", 1 / kLargestScale, kLargestScale)), 1;
        return s;
    }

    glm::dquat rotation(const Json& json, const std::string& at) {
        if (!isObject(json, at)) return {1, 0, 0, 0};
        onlyKeys(json, at, {"axis", "degrees"});
        if (!json.contains("degrees")) wrong(at, "needs \"degrees\"");
        const glm::dvec3 axis = direction(json, "axis", at);
        const double degrees = json.contains("degrees") ? number(json["degrees"], at + "/degrees") : 0;
        return glm::angleAxis(std::remainder(degrees, 360) * std::numbers::pi / 180, unit(axis));
    }

    Similarity matrix(const Json& json, const std::string& at) {
        std::array<double, 16> rows{};
        bool good = json.is_array() && json.size() == 4;
        for (size_t i = 0; good && i < 16; ++i) {
            good = json[i / 4].is_array() && json[i / 4].size() == 4 && json[i / 4][i % 4].is_number();
            if (good) rows[i] = json[i / 4][i % 4].get<double>();
        }
        if (!good) return wrong(at, "must be four rows of four numbers"), Similarity{};
        const auto placement = scenePlacement(rows);
        if (!placement) return wrong(at, placement.error().message), Similarity{};
        return *placement;
    }

    std::vector<DirectedLight> lights(const Json& json) {
        std::vector<DirectedLight> all;
        if (!json.is_array() || json.size() > kMostLights)
            return wrong("/lights", fmt::format("must be a list of at most {} lights", kMostLights)), all;
        for (size_t i = 0; i < json.size() && !error_; ++i) {
            const std::string at = fmt::format("/lights/{}", i);
            if (!isObject(json[i], at)) return all;
            onlyKeys(json[i], at, {"direction", "follows_camera", "strength"});
            DirectedLight& made = all.emplace_back();
            made.direction = glm::vec3(unit(direction(json[i], "direction", at)));
            made.followsCamera =
                json[i].contains("follows_camera") && flag(json[i]["follows_camera"], at + "/follows_camera");
            if (json[i].contains("strength")) made.strength = strength(json[i]["strength"], at + "/strength");
        }
        return all;
    }

    std::optional<EnvironmentChoice> environment(const Json& json) {
        const std::string at = "/environment";
        if (!isObject(json, at)) return std::nullopt;
        onlyKeys(json, at, {"source", "turn_degrees", "strength"});
        EnvironmentChoice made;
        const auto isPicture = [](const std::string& name) { return EnvironmentChoice{name}.isFile(); };
        if (json.contains("source"))
            made.source = named(json["source"], at + "/source", isPicture);
        else
            wrong(at, "\"source\" is missing");
        if (isHttpUrl(made.source)) wrong(at + "/source", "must be a file on this machine, not an address");
        if (json.contains("turn_degrees")) made.turn = float(number(json["turn_degrees"], at + "/turn_degrees"));
        if (json.contains("strength"))
            made.strength = strength(json["strength"], at + "/strength", kStrongestEnvironment);
        return made;
    }

    float strength(const Json& value, const std::string& at, float most = kStrongestLight) {
        const double number = this->number(value, at);
        if (!(number >= 0 && number <= most)) wrong(at, fmt::format("must be from 0 to {:g}", most));
        return float(number);
    }

    std::optional<OrbitCamera> camera(const Json& json) {
        if (!isObject(json, "/camera")) return std::nullopt;
        const auto made = cameraFromJson(json.dump(), name_);
        if (made) return *made;
        // The field is named by the error: "\"target\"".
        std::string field = made.error().element;
        std::erase(field, '"');
        wrong(json.contains(field) ? "/camera/" + field : "/camera",
              json.contains(field) ? made.error().message : fmt::format("\"{}\" {}", field, made.error().message));
        return std::nullopt;
    }

    std::vector<SectionPlane> sections(const Json& json) {
        std::vector<SectionPlane> planes;
        if (!json.is_array() || json.size() > kMostSections)
            return wrong("/sections", fmt::format("must be a list of at most {} planes", kMostSections)), planes;
        for (size_t i = 0; i < json.size() && !error_; ++i) {
            const std::string at = fmt::format("/sections/{}", i);
            if (!isObject(json[i], at)) return planes;
            onlyKeys(json[i], at, {"normal", "offset"});
            if (!json[i].contains("offset")) wrong(at, "\"offset\" is missing");
            const glm::dvec3 normal = direction(json[i], "normal", at);
            if (!error_ && !(glm::length(normal) > 0)) wrong(at + "/normal", "is too short");
            planes.push_back({normal, json[i].contains("offset") ? number(json[i]["offset"], at + "/offset") : 0});
        }
        return planes;
    }

    std::string lineOfText(const Json& json, const std::string& at, size_t longest) {
        const auto isControl = [](char c) { return uint8_t(c) < 0x20 || c == 0x7f; };
        const std::string text = json.is_string() ? json.get<std::string>() : std::string();
        if (!json.is_string() || text.size() > longest || std::ranges::any_of(text, isControl))
            wrong(at, fmt::format("must be one line of text, of at most {} bytes", longest));
        return text;
    }

    const LinesOf& lines_;
    const std::string& name_;
    std::filesystem::path folder_;
    std::optional<Error> error_;
};

/// Finds where a text stops being JSON; numbers that no double can hold count as a mistake.
class FirstMistake : public nlohmann::detail::json_sax_acceptor<Json> {
public:
    bool parse_error(size_t byte, const std::string&, const Json::exception& e) {
        at = byte > 0 ? byte - 1 : 0;
        isNumber = dynamic_cast<const Json::out_of_range*>(&e) != nullptr;
        return false;
    }
    size_t at = 0;
    bool isNumber = false;
};

/// Returns the error; nothing where the text is JSON.
std::optional<Error> notJson(std::string_view text, const std::string& name) {
    FirstMistake mistake;
    if (Json::sax_parse(text, &mistake)) return std::nullopt;
    const size_t at = std::min(mistake.at, text.size());
    const auto line = 1 + std::count(text.begin(), text.begin() + std::ptrdiff_t(at), '\n');
    const char* what = mistake.isNumber ? "a number is out of range" : "the JSON breaks off or goes wrong here";
    return Error{.code = ErrorCode::InvalidInput,
                 .message = what,
                 .file = name,
                 .element = fmt::format("line {}", line),
                 .byte = at};
}

}  // namespace

Result<Similarity> scenePlacement(std::span<const double, 16> rows) {
    auto placement = similarityFromMatrix(rows);
    if (!placement) return placement;
    const glm::dvec3 far = glm::abs(placement->translation);
    if (std::max({far.x, far.y, far.z}) > kLargestNumber || placement->scale > kLargestScale ||
        placement->scale < 1 / kLargestScale)
        return Error{.code = ErrorCode::Usage,
                     .message = fmt::format("moves by more than {:g}, or scales by more than {:g} or less than {:g}",
                                            kLargestNumber, kLargestScale, 1 / kLargestScale)};
    return placement;
}

bool EnvironmentChoice::isFile() const {
    return std::ranges::find(kEnvironmentNames, source) == kEnvironmentNames.end();
}

std::vector<DatasetLook> looksOf(const SceneFile& scene) {
    std::vector<DatasetLook> looks;
    for (size_t i = 0; i < scene.datasets.size(); ++i) {
        const auto& [file, placement, from, colour, opacity] = scene.datasets[i];
        if (!colour && opacity == 1) continue;
        DatasetLook& look = looks.emplace_back(DatasetLook{.dataset = uint32_t(i), .colour = {}, .opacity = opacity});
        if (colour) look.colour = glm::pow(*colour, glm::vec3(2.2f));
    }
    return looks;
}

std::vector<std::filesystem::path> filesOf(const SceneFile& scene) {
    std::vector<std::filesystem::path> files;
    for (const SceneDataset& dataset : scene.datasets) files.emplace_back(dataset.file);
    for (const MesoSurfaceDescription& surface : scene.surfaces)
        for (const std::string& name :
             {surface.asset, surface.displacement, surface.base, surface.colourTexture, surface.normalTexture})
            if (!name.empty()) files.emplace_back(name);
    if (scene.environment && scene.environment->isFile()) files.emplace_back(scene.environment->source);
    return files;
}

bool isSceneName(const std::string& name) {
    return !isHttpUrl(name) && std::filesystem::path(name).extension() == ".json";
}

namespace {

/// Parses a text and has a SceneReader take it apart by `read`.
template <class Read>
auto readJson(std::string_view text, const std::string& name, const std::filesystem::path& folder, const Read& read)
    -> Result<std::invoke_result_t<Read, SceneReader&, const Json&>> {
    if (auto error = notJson(text, name)) return *std::move(error);
    const Json json = Json::parse(text);
    if (isDeeperThan(json, kDeepestScene))
        return Error{.code = ErrorCode::InvalidInput, .message = "not a scene: nested too deeply", .file = name};
    const LinesOf lines(text);
    if (lines.twice()) {
        const std::string& at = lines.twice()->first;
        return Error{.code = ErrorCode::InvalidInput,
                     .message = fmt::format("\"{}\" is there twice", at.substr(at.rfind('/') + 1)),
                     .file = name,
                     .element = fmt::format("line {}", lines.twice()->second)};
    }
    SceneReader reader(lines, name, folder);
    auto made = read(reader, json);
    if (reader.error()) return *reader.error();
    return made;
}

}  // namespace

Result<SceneFile> sceneFromJson(std::string_view text, const std::string& name, const std::filesystem::path& folder) {
    return readJson(text, name, folder, [](SceneReader& reader, const Json& json) { return reader.scene(json); });
}

Result<std::vector<Annotation>> annotationsFromJson(std::string_view text, const std::string& name) {
    return readJson(text, name, {}, [](SceneReader& reader, const Json& json) { return reader.annotations(json); });
}

Result<SceneFile> readScene(const std::filesystem::path& path) {
    VCP_TRY_ASSIGN(const auto text, readText(path, kLargestFile, "a scene file"));
    return sceneFromJson(text, path.string(), path.parent_path());
}

}  // namespace vcp
