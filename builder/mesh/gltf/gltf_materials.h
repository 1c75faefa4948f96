// The materials of a glTF file, with the textures and images of their base colour and of what is beside it.
#pragma once

#include <span>
#include <vector>

#include "builder/mesh/gltf/gltf_document.h"
#include "builder/mesh/gltf/json_fields.h"

namespace vcp {

/// Fills in images and materials of `document`, whose buffers and views were read. An error in a texture becomes a
/// warning; an error in the JSON itself goes to `check`.
void readGltfMaterials(const Json& json, GltfDocument& document, JsonCheck& check);

/// Returns the materials of a document as others know them. `images`: those of the document.
std::vector<Material> materialsOf(const GltfDocument& document, std::span<const ImageSource> images);

}  // namespace vcp
