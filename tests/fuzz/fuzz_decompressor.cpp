// Whatever gzip and zstd files hold: decompressed or refused, and the same in any steps.
#include <optional>

#include "tests/fuzz/mesh_fuzz.h"
#include "tests/support/piped_bytes.h"

namespace {

constexpr size_t kMost = 4 << 20;

std::optional<std::string> drained(std::string_view bytes, size_t step, size_t window) {
    auto source = vcp::test::piped(bytes, step, window);
    if (!source) return std::nullopt;
    std::string all;
    while (all.size() < kMost) {
        const auto view = source->window();
        if (!view) return std::nullopt;
        if (source->atEnd()) return all;
        all += *view;
        source->advance(view->size());
    }
    all.resize(kMost);
    return all;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    const std::string_view bytes(reinterpret_cast<const char*>(data), size);
    // A large one that fails late may, or may not, fail within what is read.
    const auto whole = drained(bytes, 1 << 20, 1 << 16), cut = drained(bytes, 3, 1 << 10);
    if (whole && whole->size() < kMost) vcp::fuzz::require(cut == whole, "steps do not change what comes out");
    return 0;
}
