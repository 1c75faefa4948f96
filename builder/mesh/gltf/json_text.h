// JSON read from a ByteSource, with limits on what it may become.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "builder/stream/byte_source.h"
#include "octree/io/result.h"

namespace vcp {

/// Reads exactly `bytes` bytes, or up to the end for ByteSource::kUnknownSize. Errors: InvalidInput with byte, Limit
/// (more than `textLimit` bytes, 4 million values, or 256 levels), Io.
Result<nlohmann::json> readJson(ByteSource& source, uint64_t bytes, uint64_t textLimit);

}  // namespace vcp
