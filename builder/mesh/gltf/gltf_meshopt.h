// EXT_meshopt_compression, what gltfpack writes (and KHR_meshopt_compression, as far as it says the same): the bytes of
// a buffer view, decoded as a whole by meshoptimizer.
//
// The decoders run in this process, unlike Draco's: their author promises that they are safe with hostile bytes, and
// fuzzes them; they allocate nothing, and take time in proportion to what they write. The rules for sizes that they
// assert are checked here first.
#pragma once

#include <string>
#include <string_view>

#include "builder/mesh/gltf/gltf_document.h"
#include "builder/mesh/gltf/json_fields.h"

namespace vcp {

/// Reads the extension of a buffer view where it has one. Reports to the check of `fields`: a member that is missing or
/// breaks the extension's rules, bytes outside their buffer, another size than the view's. `where` and `check` are
/// those of `fields`.
void readGltfMeshopt(const JsonFields& fields, const std::string& where, JsonCheck& check,
                     const std::vector<GltfBuffer>& buffers, GltfView& view);

/// Returns whether all views together are at most 64 times the buffers that they are decoded from, as they are where no
/// bytes are shared.
bool meshoptIsInProportion(const GltfDocument& document);

/// Decodes `bytes`, those that `from` names; the result has count * stride bytes. Nothing is allocated beyond what so
/// many bytes can become. Errors, without file and element: InvalidInput (damaged, truncated, too short for the count),
/// Unsupported (a later version of the format).
Result<std::string> decodeMeshopt(const GltfMeshopt& from, std::string_view bytes);

}  // namespace vcp
