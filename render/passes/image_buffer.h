// The images of a file on the device (render/pages/image_words.h).
#pragma once

#include "octree/image/image_set.h"
#include "render/vulkan/device.h"

namespace vcp {

/// Returns the most bytes of images that shaders of a device can address.
uint64_t mostImageBytes(const Device& device);

/// Copies images to the device, as many as shaders can address (ImageSet::shrinkTo), and waits for it. Errors: Device;
/// Limit, where they could not address the tables.
Result<Buffer> uploadImages(Device& device, const ImageSet& images);

}  // namespace vcp
