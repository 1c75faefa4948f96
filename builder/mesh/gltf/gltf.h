// glTF 2.0, as JSON with its buffers beside it or in data URIs, and GLB, as a MeshStream.
//
// - The default scene is read: every triangle of every mesh, once for each node that shows it (and each instance
//   of EXT_mesh_gpu_instancing), moved by the transforms of the nodes, in doubles. Triangles, strips and fans;
//   points and lines are read over. Accessors of any component type, sparse ones too. Skins and morph targets
//   stay at rest.
// - Colours: COLOR_0 times the base colour of the material, which are linear in glTF and encoded here. The base
//   colours alone count where they differ; then, and where only some primitives have COLOR_0, the rest is white.
// - Images of the base colour: materials() carries them, with factors of 1, as they are in the vertex colours.
// - Nothing outside the folder of the file is opened, unless MeshOpenOptions::allowOutside says so.
// - KHR_draco_mesh_compression is decoded as draco.h says,
//   EXT_meshopt_compression as gltf_meshopt.h says.
// - Bounded memory: JSON with its data URIs up to 128 MiB; everything else by window, except that a view that
//   meshopt compressed is decoded as a whole, within MeshOpenOptions::decoderBytes, and then kept in a temporary
//   file. A GLB that is compressed, or comes through a pipe, is put into a temporary file first.
#pragma once

#include <filesystem>
#include <memory>
#include <string_view>

#include "builder/stream/byte_source.h"
#include "builder/stream/mesh_stream.h"

namespace vcp {

bool looksLikeGltf(std::string_view start);

/// Opens a glTF file. `source` stands at its start; `path` is where it was opened, for what lies beside it, or empty.
/// Errors: as readGltfDocument(), InvalidInput (GLB chunks, buffers, no triangles), Io, and those of Draco and
/// meshopt.
Result<std::unique_ptr<MeshStream>> openGltf(ByteSource source, const std::filesystem::path& path,
                                             const MeshOpenOptions& options);

}  // namespace vcp
