// One primitive of a glTF mesh as a MeshStream, in the coordinates of its mesh.
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "builder/mesh/gltf/gltf_accessor.h"
#include "builder/stream/mesh_stream.h"

namespace vcp {

/// Reads vertices first, then triangles. Where a primitive has more vertices than corners (many may share one large
/// accessor), only the range that its indices name is read. It has colours where the primitive has COLOR_0, as stored
/// colours (sRGB); normals where it has NORMAL; texture coordinates, as stored, where the primitive names an accessor
/// for them. Not for primitives that Draco compressed. `document` and `buffers` must outlive the stream, which does not
/// fill its info(). Errors: InvalidInput (index out of range, not finite), Io; without file where `buffers` cannot know
/// it.
Result<std::unique_ptr<MeshStream>> openGltfPrimitive(const GltfDocument& document, GltfBuffers& buffers,
                                                      const GltfPrimitive& primitive,
                                                      const std::filesystem::path& tempFolder);
/// Returns whether it would be read as the range of its indices.
bool isRange(const GltfDocument& document, const GltfPrimitive& primitive);

}  // namespace vcp
