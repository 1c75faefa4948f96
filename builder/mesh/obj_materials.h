// Holds what paints the faces of an OBJ file: its MTL files, the material in use, and its texture coordinates.
#pragma once

#include <array>
#include <filesystem>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "builder/mesh/mtl.h"
#include "builder/stream/coordinate_check.h"
#include "builder/stream/mesh_stream.h"
#include "builder/stream/spilled_array.h"

namespace vcp {

class ObjMaterials {
public:
    /// `path`: where the OBJ is, for the files beside it; empty or "-": there is no folder.
    ObjMaterials(const std::filesystem::path& path, const MeshOpenOptions& options);

    /// Takes the names after an `mtllib`. Called before begin(); after it they become a warning.
    void addLibrary(std::string_view names);

    /// Decides whether there are colours: an image, or several different Kd.
    void begin();

    [[nodiscard]] bool active() const { return active_; }
    /// Whether texture coordinates are of use, for colours or for masks.
    [[nodiscard]] bool hasImages() const { return hasImages_; }

    void use(std::string_view name);
    Result<void> addUv(double u, double v);
    [[nodiscard]] uint64_t uvCount() const { return uvs_.size(); }

    /// Paints the triangle that was just added to `chunk`. `uvs`: numbers from 0, or nothing.
    Result<void> paint(const std::array<std::optional<uint64_t>, 3>& uvs, MeshChunk& chunk);

    [[nodiscard]] std::span<const Material> materials() const { return materials_; }
    [[nodiscard]] std::span<const std::string> warnings() const { return warnings_; }
    [[nodiscard]] std::span<const SideFile> sideFiles() const { return sideFiles_; }

private:
    std::string file_;
    std::filesystem::path folder_;
    bool wanted_;
    bool allowOutside_;
    bool begun_ = false;
    bool active_ = false;
    bool hasImages_ = false;
    std::vector<MtlMaterial> read_;
    std::vector<Material> materials_;
    std::map<std::string, uint32_t, std::less<>> numbers_;
    std::vector<std::string> warnings_;
    std::vector<SideFile> sideFiles_;
    bool unknownNamed_ = false;
    uint32_t current_ = kNoMaterial;
    uint64_t painted_ = 0;  // triangles
    CoordinateCheck check_;
    SpilledArray<glm::vec2> uvs_;
};

}  // namespace vcp
