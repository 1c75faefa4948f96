// Scene files: several datasets and surfaces with mesostructure, each in its place, light, camera and section planes,
// in JSON. docs/scenes.md has the schema and an example.
//
// Unknown keys are errors, so that a misspelt one is not passed over. Errors name the file, the line and the key.
#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "octree/io/result.h"
#include "render/view/renderer.h"
#include "viewer/annotation/annotations.h"
#include "viewer/camera/orbit_camera.h"
#include "viewer/scene/meso_scene.h"

namespace vcp {

struct SceneDataset {
    std::string file;  ///< a .vcp or its address, or a mesh
    Similarity placement;
    ScenePlace from = {};
    std::optional<glm::vec3> colour = {};  ///< encoded, as the screen has it; none: its own
    float opacity = 1;
};

/// Surroundings whose light falls on a scene.
struct EnvironmentChoice {
    std::string source;  ///< one of kEnvironmentNames, or a picture (.hdr, .exr)
    float turn = 0;      ///< degrees, as EnvironmentLight
    float strength = 1;  ///< 0 to kStrongestEnvironment

    /// Whether the source is a picture.
    [[nodiscard]] bool isFile() const;

    bool operator==(const EnvironmentChoice&) const = default;
};

struct SceneFile {
    std::vector<SceneDataset> datasets;  ///< at least one, or a surface
    std::vector<MesoSurfaceDescription> surfaces;
    std::vector<DirectedLight> lights;  ///< at most kMostLights; none: the usual one, or that of the environment
    std::optional<EnvironmentChoice> environment;
    std::optional<OrbitCamera> camera;
    std::vector<SectionPlane> sections;  ///< at most kMostSections
    Caps sectionCaps = Caps::None;
    std::vector<Annotation> annotations;  ///< at most kMostAnnotations
};

/// A scene has at most so many datasets.
constexpr size_t kMostSceneDatasets = 256;
/// A scene has at most so many annotations, their titles and texts at most so many bytes.
constexpr size_t kMostAnnotations = 1000;
constexpr size_t kLongestTitle = 200, kLongestText = 2000;

/// Returns the looks of datasets that are not shown as they are.
std::vector<DatasetLook> looksOf(const SceneFile& scene);

/// Returns the files that a scene names: datasets and meshes without addresses, assets, bases, textures, surroundings.
std::vector<std::filesystem::path> filesOf(const SceneFile& scene);

/// Does similarityFromMatrix, within what a scene may have: translations of at most 1e12, scales from 1e-9 to 1e9.
/// Errors: Usage.
Result<Similarity> scenePlacement(std::span<const double, 16> rows);

/// Whether a name stands for a scene file: it ends in .json.
bool isSceneName(const std::string& name);

/// Relative files are taken from `folder`. `name` stands for the file in errors. May be hostile. Errors: InvalidInput.
Result<SceneFile> sceneFromJson(std::string_view text, const std::string& name, const std::filesystem::path& folder);

/// Returns the scene as sceneFromJson reads it, indented, with all that differs from what is usual. Names of files
/// stand in it as they are in the scene; addresses lose user and password.
std::string sceneToJson(const SceneFile& scene);

/// Returns the list as a scene's "annotations" has it, and reads one. May be hostile. Errors: InvalidInput.
std::string annotationsToJson(const std::vector<Annotation>& annotations);
Result<std::vector<Annotation>> annotationsFromJson(std::string_view text, const std::string& name);

/// Does sceneFromJson of a file of at most 1 MiB. Errors: also Io, Limit.
Result<SceneFile> readScene(const std::filesystem::path& path);

}  // namespace vcp
