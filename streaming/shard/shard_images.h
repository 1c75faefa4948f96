// The images of a dataset as a shard has them.
#pragma once

#include <cstdint>
#include <vector>

#include "octree/dataset_reader.h"
#include "octree/image/image_tables.h"
#include "octree/io/byte_reader.h"
#include "octree/io/result.h"
#include "octree/vcp_writer.h"

namespace vcp {

/// Tables of a section of images, and the stored bytes of its tiles. Offsets of tiles are not set.
struct ShardImages {
    ImageTables tables;
    std::vector<std::vector<std::byte>> tiles;
};

/// Returns the images of a file with the levels of one tile each, so that shards beside the first one can be looked at
/// by themselves: coordinates of images do not depend on their size. Errors: readImageTables's, Io.
Result<ShardImages> coarseImages(const ByteReader& reader, const FileHeader& header);

/// Appends all images of a file to a shard. Errors: readImageTables's, Io.
Result<void> appendImages(const ByteReader& reader, const FileHeader& header, VcpWriter& shard);

}  // namespace vcp
