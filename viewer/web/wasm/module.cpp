// What a worker of the browser calls: one dataset, drawn by the host's caster in the calling thread.
//
// Numbers cross as doubles, which hold every size of a file below 2^53. A call that can fail returns a negative number
// then, and vcp_error() the line that says why.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <iterator>
#include <limits>
#include <memory>
#include <string>

#include "octree/dataset_reader.h"
#include "render/frame_setup.h"
#include "render/host_renderer.h"
#include "viewer/web/wasm/fetched_bytes.h"

#define EXPORT(name) extern "C" __attribute__((export_name(#name)))

namespace {

using namespace vcp;

constexpr int kFailed = -1, kDone = 0, kMissing = 1;
constexpr uint64_t kFetchedBytes = 8u << 20;

/// What is open.
struct Opened {
    std::shared_ptr<FetchedBytes> bytes;
    std::shared_ptr<const Dataset> dataset;
    std::unique_ptr<HostRenderer> renderer;
    uint64_t budgetBytes = 0;
    FrameRequest request;
    UpdateResult update;
    Picture picture;
    std::vector<float> depth;
    std::vector<Stretch> missing;
    std::string error;
    double numbers[32] = {};
} opened;

int fail(const Error& error) {
    opened.error = error.line();
    return kFailed;
}

Result<void> start(Dataset dataset) {
    opened.dataset = std::make_shared<const Dataset>(std::move(dataset));
    VCP_TRY_ASSIGN(opened.renderer, HostRenderer::create({.budgetBytes = opened.budgetBytes}));
    std::vector<PlacedDataset> datasets(1);
    datasets[0].dataset = opened.dataset;
    datasets[0].source = std::make_shared<FilePageSource>(opened.bytes, opened.dataset);
    return opened.renderer->open(std::move(datasets), {});
}

}  // namespace

EXPORT(vcp_alloc) void* vcp_alloc(size_t bytes) { return std::malloc(bytes); }
EXPORT(vcp_free) void vcp_free(void* memory) { std::free(memory); }
EXPORT(vcp_error) const char* vcp_error() { return opened.error.c_str(); }

/// Begins with a file of `size` bytes, of which nothing is known. `name`: as messages have it.
EXPORT(vcp_begin) void vcp_begin(double size, const char* name, double budgetBytes) {
    opened = {};
    opened.budgetBytes = uint64_t(budgetBytes);
    opened.bytes = std::make_shared<FetchedBytes>(uint64_t(size), name, kFetchedBytes);
}

EXPORT(vcp_supply) void vcp_supply(double offset, const std::byte* bytes, size_t count) {
    opened.bytes->supply(uint64_t(offset), {bytes, bytes + count});
}

/// Returns kMissing until header and directory have come.
EXPORT(vcp_open) int vcp_open() {
    auto dataset = readDatasetStart(*opened.bytes);
    if (!dataset) return dataset.error().code == ErrorCode::Cancelled ? kMissing : fail(dataset.error());
    if (const auto started = start(*std::move(dataset)); !started) return fail(started.error());
    return kDone;
}

/// Returns how many stretches of the file were missing since the last call.
EXPORT(vcp_missing) int vcp_missing() {
    opened.missing = opened.bytes->takeMissing();
    return int(opened.missing.size());
}
EXPORT(vcp_missing_offset) double vcp_missing_offset(int i) { return double(opened.missing[size_t(i)].offset); }
EXPORT(vcp_missing_bytes) double vcp_missing_bytes(int i) { return double(opened.missing[size_t(i)].bytes); }

/// Returns the box (lowest corner, highest corner), cell, levels, triangles, largest certified error of the finest
/// surface, whether there are colours, and pages.
EXPORT(vcp_info) const double* vcp_info() {
    const FileHeader& header = opened.dataset->header;
    double* to = opened.numbers;
    for (int axis = 0; axis < 3; ++axis) to[axis] = header.boundsMin[axis], to[3 + axis] = header.boundsMax[axis];
    to[6] = header.cell;
    to[7] = header.levels;
    to[8] = double(header.triangles);
    to[9] = header.certifiedErrorMax;
    to[10] = opened.dataset->hasColour() ? 1 : 0;
    to[11] = double(header.pages);
    return opened.numbers;
}

/// Sets what is to be drawn: eye, forward, up (three numbers each), vertical field of view, width, height, error in
/// pixels, ShadingMode, shadows, rays of ambient occlusion, background at the top and at the bottom (three each),
/// direction towards the light in the camera's axes (right, up, back), whether there is a section, its normal (three)
/// and offset.
EXPORT(vcp_look) void vcp_look(const double* from) {
    FrameRequest& request = opened.request;
    request.camera.eye = {from[0], from[1], from[2]};
    request.camera.forward = {from[3], from[4], from[5]};
    request.camera.up = {from[6], from[7], from[8]};
    request.camera.verticalFov = from[9];
    request.width = uint32_t(from[10]);
    request.height = uint32_t(from[11]);
    request.errorPixels = from[12];
    request.shading.mode = ShadingMode(int(from[13]));
    request.shading.shadows = from[14] != 0;
    request.shading.occlusionRays = uint32_t(from[15]);
    request.shading.backgroundTop = {from[16], from[17], from[18]};
    request.shading.backgroundBottom = {from[19], from[20], from[21]};
    request.shading.lightDirection = {from[22], from[23], from[24]};
    request.sections.clear();
    if (from[25] != 0) request.sections.push_back({{from[26], from[27], from[28]}, from[29]});
    request.sectionCaps = from[25] != 0 ? Caps::Closed : Caps::None;
}

/// Takes in pages that have come. Returns bits: 1 a picture can be drawn, 2 settled, 4 awaits rays, 8 the cut changed.
/// vcp_numbers() are then: error in pixels, bytes resident, pages missing, pages in the cut, failures, 1 where the
/// budget limits.
EXPORT(vcp_update) int vcp_update() {
    auto update = opened.renderer->update(opened.request);
    if (!update) return fail(update.error());
    opened.update = *std::move(update);
    const UpdateResult& now = opened.update;
    if (!now.problems.empty()) opened.error = now.problems.front().line();
    const double numbers[] = {
        now.errorPixels,      double(now.residentBytes), double(now.pagesMissing),   double(now.pagesInCut),
        double(now.failures), now.relaxed ? 1.0 : 0.0,   double(now.problems.size())};
    std::copy(std::begin(numbers), std::end(numbers), opened.numbers);
    return int(now.drawable) + 2 * int(now.settled) + 4 * int(now.awaitsRays) + 8 * int(now.changed);
}
EXPORT(vcp_numbers) const double* vcp_numbers() { return opened.numbers; }

/// Draws the cut of the last update, a ray a pixel.
EXPORT(vcp_render) int vcp_render() {
    if (const auto drawn = opened.renderer->render(opened.request); !drawn) return fail(drawn.error());
    auto depth = opened.renderer->readDepth();
    if (!depth) return fail(depth.error());
    opened.depth = *std::move(depth);
    return kDone;
}

/// Adds a sample to each pixel. Returns how many there are; 0 where the picture cannot go on.
EXPORT(vcp_refine) int vcp_refine() {
    const auto samples = opened.renderer->refine();
    return samples ? int(*samples) : fail(samples.error());
}

/// Returns the picture, RGBA8, row by row from the upper left; null where there is none.
EXPORT(vcp_picture) const uint8_t* vcp_picture() {
    auto picture = opened.renderer->readPicture();
    if (!picture) return nullptr;
    opened.picture = *std::move(picture);
    return opened.picture.rgba.data();
}
/// Returns distances along the unit rays, world units; infinite where nothing is hit.
EXPORT(vcp_depth) const float* vcp_depth() { return opened.depth.data(); }

/// Finds what a pixel of the last picture shows. Returns 1 where something is hit; vcp_numbers() are then its place,
/// its depth, and by how much the surface that is drawn may be off there (both in world units).
EXPORT(vcp_pick) int vcp_pick(int x, int y) {
    const FrameRequest& request = opened.request;
    const float depth = opened.depth[size_t(y) * request.width + size_t(x)];
    if (!(depth < std::numeric_limits<float>::infinity())) return 0;
    const PixelHit hit = pixelHit(request, {uint32_t(x), uint32_t(y)}, double(depth), {});
    const double pixel = hit.depth * 2 * std::tan(request.camera.verticalFov / 2) / request.height;
    const double error = std::max(opened.update.errorPixels * pixel, opened.dataset->header.certifiedErrorMax);
    const double numbers[] = {hit.position.x, hit.position.y, hit.position.z, hit.depth, error};
    std::copy(std::begin(numbers), std::end(numbers), opened.numbers);
    return 1;
}
