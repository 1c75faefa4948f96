// Writes scene files (scene_file.h).
#include <numbers>

#include <glm/gtc/quaternion.hpp>
#include <nlohmann/json.hpp>

#include "streaming/web_address.h"
#include "viewer/scene/scene_file.h"

namespace vcp {

namespace {

using OrderedJson = nlohmann::ordered_json;

OrderedJson triple(glm::dvec3 v) { return OrderedJson::array({v.x, v.y, v.z}); }

OrderedJson datasetJson(const SceneDataset& dataset) {
    const Similarity& placement = dataset.placement;
    OrderedJson json{{"file", isHttpUrl(dataset.file) ? addressWithoutUser(dataset.file) : dataset.file}};
    if (placement.translation != glm::dvec3(0)) json["translate"] = triple(placement.translation);
    if (const double angle = glm::angle(placement.rotation); angle != 0)
        json["rotate"] = {{"axis", triple(glm::axis(placement.rotation))}, {"degrees", angle * 180 / std::numbers::pi}};
    if (placement.scale != 1) json["scale"] = placement.scale;
    if (dataset.colour) json["colour"] = OrderedJson::array({dataset.colour->r, dataset.colour->g, dataset.colour->b});
    if (dataset.opacity != 1) json["opacity"] = dataset.opacity;
    return json;
}

OrderedJson surfaceJson(const MesoSurfaceDescription& surface) {
    const MesoSurfaceDescription usual;
    OrderedJson json;
    if (surface.displacement.empty())
        json["asset"] = surface.asset;
    else
        json["displacement"] = surface.displacement;
    const auto put = [&](const char* key, const auto& value, const auto& unwritten) {
        if (value != unwritten) json[key] = value;
    };
    put("surface", surface.base, usual.base);
    put("subdivide", surface.subdivide, usual.subdivide);
    put("tiles", surface.tiles, usual.tiles);
    put("height", surface.heightScale, usual.heightScale);
    put("offset", surface.offset, usual.offset);
    put("filter", surface.withFilter, usual.withFilter);
    if (surface.place != usual.place) json["translate"] = triple(surface.place);
    if (!surface.path.points.empty()) {
        for (const glm::dvec3& point : surface.path.points) json["path"].push_back(triple(point));
        put("seconds", surface.path.seconds, usual.path.seconds);
    }
    put("scale", surface.scale, usual.scale);
    if (surface.up != usual.up) json["up"] = "y";
    if (surface.colour != usual.colour)
        json["colour"] = OrderedJson::array({surface.colour.r, surface.colour.g, surface.colour.b});
    put("texture", surface.colourTexture, usual.colourTexture);
    put("normal_texture", surface.normalTexture, usual.normalTexture);
    json["method"] = surface.method.name;
    put("cell", surface.cell, usual.cell);
    put("error", surface.errorPixels, usual.errorPixels);
    put("grid", surface.method.cells, usual.method.cells);
    const meso::Cones cones = surface.method.cones, usualCones = usual.method.cones;
    if (cones.azimuth != usualCones.azimuth || cones.elevation != usualCones.elevation)
        json["cones"] = OrderedJson::array({cones.azimuth, cones.elevation});
    put("steps", surface.method.steps, usual.method.steps);
    put("refinements", surface.method.refinements, usual.method.refinements);
    put("rank", surface.method.rank, usual.method.rank);
    if (surface.method.directions != usual.method.directions)
        json["directions"] = OrderedJson::array({surface.method.directions.x, surface.method.directions.y});
    put("curvatures", surface.method.curvatures.samples, usual.method.curvatures.samples);
    put("curvature", surface.method.curvatures.most, usual.method.curvatures.most);
    put("base", surface.withBase, usual.withBase);
    put("far", surface.withFar, usual.withFar);
    put("transfer", surface.withTransfer, usual.withTransfer);
    put("base_transfer", surface.withBaseTransfer, usual.withBaseTransfer);
    return json;
}

OrderedJson annotationJson(const Annotation& annotation) {
    OrderedJson json{{"position", triple(annotation.position)}};
    if (!annotation.title.empty()) json["title"] = annotation.title;
    if (!annotation.text.empty()) json["text"] = annotation.text;
    return json;
}

/// Names of files need not be UTF-8; JSON must.
std::string dumped(const OrderedJson& json) { return json.dump(-1, ' ', false, OrderedJson::error_handler_t::replace); }

/// Makes a text of the keys, each with what it has in a line of its own.
class SceneText {
public:
    void add(const char* key, const OrderedJson& value) {
        text_ += (text_.empty() ? "  \"" : ",\n  \"") + std::string(key) + "\": " + dumped(value);
    }
    template <class Items, class ToJson>
    void addList(const char* key, const Items& items, const ToJson& toJson) {
        if (items.empty()) return;
        std::string list;
        for (const auto& item : items) list += (list.empty() ? "\n    " : ",\n    ") + dumped(toJson(item));
        text_ += (text_.empty() ? "  \"" : ",\n  \"") + std::string(key) + "\": [" + list + "\n  ]";
    }
    [[nodiscard]] std::string take() const { return "{\n" + text_ + "\n}\n"; }

private:
    std::string text_;
};

}  // namespace

std::string annotationsToJson(const std::vector<Annotation>& annotations) {
    OrderedJson list = OrderedJson::array();
    for (const Annotation& each : annotations) list.push_back(annotationJson(each));
    return dumped(list);
}

std::string sceneToJson(const SceneFile& scene) {
    SceneText text;
    text.addList("datasets", scene.datasets, datasetJson);
    text.addList("mesostructure", scene.surfaces, surfaceJson);
    if (!scene.lights.empty()) {
        OrderedJson lights = OrderedJson::array();
        for (const DirectedLight& light : scene.lights) {
            OrderedJson json{{"direction", triple(light.direction)}, {"follows_camera", light.followsCamera}};
            if (light.strength != 1) json["strength"] = light.strength;
            lights.push_back(std::move(json));
        }
        text.add("lights", lights);
    }
    if (const auto& environment = scene.environment) {
        OrderedJson json{{"source", environment->source}};
        if (environment->turn != 0) json["turn_degrees"] = environment->turn;
        if (environment->strength != 1) json["strength"] = environment->strength;
        text.add("environment", json);
    }
    if (scene.camera) text.add("camera", OrderedJson::parse(cameraToJson(*scene.camera)));
    text.addList("sections", scene.sections, [](const SectionPlane& plane) {
        return OrderedJson{{"normal", triple(plane.normal)}, {"offset", plane.offset}};
    });
    if (scene.sectionCaps != Caps::None)
        text.add("caps", scene.sectionCaps == Caps::All ? OrderedJson("all") : OrderedJson(true));
    text.addList("annotations", scene.annotations, annotationJson);
    return text.take();
}

}  // namespace vcp
