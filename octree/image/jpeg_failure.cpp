#include "octree/image/jpeg_failure.h"

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

}  // namespace vcp
