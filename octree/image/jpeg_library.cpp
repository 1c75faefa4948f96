#include "octree/image/jpeg_library.h"

#include <cstdlib>

namespace vcp {

extern "C" {
static void vcpJpegFailed(j_common_ptr info) {
    auto* const failure = reinterpret_cast<JpegFailure*>(info->err);
    info->err->format_message(info, failure->message);
    std::longjmp(failure->back, 1);
}
static void vcpJpegSilent(j_common_ptr) {}
// A warning (truncated or damaged data) counts as damage. Traces have levels of 0 and more.
static void vcpJpegWarned(j_common_ptr info, int level) {
    if (level < 0) vcpJpegFailed(info);
}
}

JpegFailure::JpegFailure() {
    jpeg_std_error(&base);
    base.error_exit = vcpJpegFailed;
    base.emit_message = vcpJpegWarned;
    base.output_message = vcpJpegSilent;
}

// Three channels of at most 4 bytes a texel, their last blocks, and the tables.
JpegBytes::JpegBytes(glm::uvec2 size)
    : room_(size_t{12} * (size.x + 32) * (size.y + 32) + 4096), first_(room_.data()), count_(room_.size()) {}

JpegBytes::~JpegBytes() {
    if (first_ != room_.data()) std::free(first_);
}

void JpegBytes::receive(jpeg_compress_struct& jpeg) { jpeg_mem_dest(&jpeg, &first_, &count_); }

std::vector<std::byte> JpegBytes::written() const {
    const auto* const first = reinterpret_cast<const std::byte*>(first_);
    return {first, first + count_};
}

}  // namespace vcp
