// EXT_meshopt_compression, what gltfpack writes (and KHR_meshopt_compression, as far as it says the same): the bytes of
// a buffer view, decoded as a whole by meshoptimizer.
//
// The decoders run in this process, other than Draco's: their author promises that they are safe with hostile bytes,
// and fuzzes them; they allocate nothing, and take time in proportion to what they write. What they demand of sizes
// (and assert) is checked here first.
#pragma once

#include <string>
#include <string_view>

#include "builder/mesh/gltf/gltf_document.h"
#include "builder/mesh/gltf/json_fields.h"

namespace vcp {

/// Reads the extension of a buffer view where it has one. Goes to the check of `fields`: a member that is missing or
/// breaks the extension's rules, bytes outside their buffer, another size than the view's. `where` and `check` are
/// those of `fields`.
void readGltfMeshopt(const JsonFields& fields, const std::string& where, JsonCheck& check,
                     const std::vector<GltfBuffer>& buffers, GltfView& view);

/// Are all views together at most 64 times the buffers that they are decoded from, as they are where no bytes are
/// shared?
bool meshoptIsInProportion(const GltfDocument& document);

/// `bytes` are those that `from` names; the outcome has count * stride. Nothing is allocated for more than as many
/// bytes can become. Errors, without file and element: InvalidInput (damaged, truncated, too short for the count),
/// Unsupported (a later version of the format).
Result<std::string> decodeMeshopt(const GltfMeshopt& from, std::string_view bytes);

}  // namespace vcp
