// What a worker of the browser calls. Of the workers of one scan, the first holds the pages: it reads them, chooses the
// cut, and casts; the others cast from copies of the pages that their bands of a picture need.
//
// Numbers cross as doubles, which hold every size of a file below 2^53. A call that can fail returns a negative number
// then, and vcp_error() the line that says why.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <iterator>
#include <limits>
#include <memory>
#include <optional>
#include <string>

#include <glm/vector_relational.hpp>

#include "octree/dataset_reader.h"
#include "render/environment_light.h"
#include "render/frame_setup.h"
#include "render/host_drawing.h"
#include "render/pages/host_page_memory.h"
#include "render/pages/image_words.h"
#include "render/pixel_samples.h"
#include "render/renderer_options.h"
#include "render/residencies.h"
#include "viewer/web/wasm/band_caster.h"
#include "viewer/web/wasm/fetched_bytes.h"
#include "viewer/web/wasm/gpu_frame.h"
#include "viewer/web/wasm/image_copies.h"
#include "viewer/web/wasm/jpeg_tiles.h"
#include "viewer/web/wasm/page_copies.h"
#include "viewer/web/wasm/tile_source.h"

#define EXPORT(name) extern "C" __attribute__((export_name(#name)))

namespace {

using namespace vcp;

constexpr int kFailed = -1, kDone = 0, kMissing = 1;
constexpr uint64_t kFetchedBytes = 8u << 20, kUploadBytes = 4u << 20;
// What is read of a section of images first, and the most that its tables may be: fetched bytes have room for them.
constexpr uint64_t kImagesLead = 64u << 10, kMostTableBytes = 6u << 20;
constexpr uint32_t kTableAttempts = 4;

/// What a worker that holds no pages must know of the scan.
struct Lead {
    FileHeader header;
    PageEntry root;
    uint64_t hasColour;
};

/// A JPEG tile for the browser to decode.
struct WantedTile {
    uint32_t id, width, height, bytes, address;
};

/// Words in the memory of the module.
struct PartOfWords {
    uint32_t address, words;
};

/// What WebGL draws the frame with that was begun last.
struct GpuFrame {
    PoolMirror mirror;
    std::vector<MirroredRows> rows;
    std::vector<frame::TableRecord> table;
    uint64_t version = 0;  // of the table
    frame::FrameConstants constants;
    std::vector<uint32_t> background;
    std::shared_ptr<const ImageSet> images;
    ImageWords words;
    std::vector<PartOfWords> parts;
};

/// How far the images of the file have come: nothing of them is read before a page is drawn that shows some.
enum class Images : uint8_t { Awaited, Shown, GivenUp };

/// What is open.
struct Opened {
    std::string name;   // of file 0
    uint64_t size = 0;  // of it
    std::shared_ptr<FetchedBytes> fetched;
    std::shared_ptr<FetchedDataset> bytes;  // null until file 0 has begun to come
    std::shared_ptr<const Dataset> dataset;
    bool hasColour = false;
    std::vector<PlacedDataset> datasets;       // one, in the worker that holds the pages
    std::vector<PlacedResidency> placed;       // that of it
    uint64_t budgetBytes = 0, imageBytes = 0;  // of all, and of images in it
    Images images = Images::GivenUp;
    uint32_t tableFailures = 0;
    double errorPixels = 0;  // of the last update
    PagesNeeded needed;
    PageCopies copies;
    ImageCopies imageCopies;
    FrameRequest request;
    SelectionView view;           // of the sample begun last
    uint64_t cut = 0, pages = 0;  // numbers of the picture's cut, and of its pages alone
    BandCaster caster;
    GpuFrame gpu;
    BandsSaid heard;
    std::vector<CutRecord> records;
    std::vector<TileRecord> tiles;
    std::vector<std::byte> tables;
    std::vector<JpegTiles::Wanted> jpegs;
    WantedTile jpeg;
    std::vector<double> said;
    Lead lead;
    std::vector<Stretch> missing;
    std::string error;
    double numbers[32] = {};
} opened;

int fail(const Error& error) {
    opened.error = error.line();
    return kFailed;
}

Residency& residency() { return *opened.placed.front().residency; }

Result<void> start(Dataset dataset) {
    opened.dataset = std::make_shared<const Dataset>(std::move(dataset));
    VCP_TRY(checkBudget(opened.budgetBytes));
    VCP_TRY(checkHostDraws(*opened.dataset, opened.bytes->name()));
    opened.datasets.resize(1);
    opened.datasets[0].dataset = opened.dataset;
    opened.datasets[0].source = std::make_shared<TileSource>(opened.bytes, opened.dataset);
    if (opened.dataset->hasImages()) {
        opened.images = Images::Awaited;
        opened.imageBytes = budgetOfImages(opened.budgetBytes);
    }
    const RendererOptions options{.budgetBytes = opened.budgetBytes - opened.imageBytes, .uploadBytes = kUploadBytes};
    VCP_TRY_ASSIGN(opened.placed, openResidencies(hostPageMemory(), options, opened.datasets));
    opened.errorPixels = std::numeric_limits<double>::infinity();
    opened.hasColour = residency().hasColour();
    return {};
}

/// Errors: Cancelled, until header and directory have come.
Result<void> openDataset() {
    if (!opened.bytes) {
        VCP_TRY_ASSIGN(opened.bytes, FetchedDataset::open(opened.fetched, opened.size, opened.name));
    }
    VCP_TRY_ASSIGN(auto dataset, readDatasetStart(*opened.bytes));
    return start(std::move(dataset));
}

/// Whether some page that is drawn has triangles with images.
bool drawsImages() {
    const std::vector<CutPage> cut = cutPages(residency());
    return std::any_of(cut.begin(), cut.end(), [](const CutPage& page) {
        const auto geometry = page.bytes.first(page.entry.pageBytes), colours = page.bytes.subspan(geometry.size());
        return !viewOfChecked(geometry, colours).points.empty();
    });
}

/// Reads the tables of the images, and shows these from the next update on. Errors: Cancelled, where bytes have not
/// come; Limit, InvalidInput.
Result<void> showImages() {
    const ImagesPlace& place = opened.dataset->header.images;
    std::vector<std::byte> lead(std::min(place.bytes, kImagesLead));
    VCP_TRY(opened.bytes->read(place.offset, lead));
    opened.bytes->refuseBehind(place.offset + kMostTableBytes);
    auto found = findImages(opened.datasets, true, opened.imageBytes);
    opened.bytes->refuseBehind(UINT64_MAX);
    if (!found) return found.error();
    return sceneOf(opened.placed)->showImages(0, std::move(found->pieces[0]), found->mostBytes[0]);
}

/// Goes on with images that are awaited: until they are shown or given up, nothing is settled.
void awaitImages(UpdateResult& update) {
    update.settled = false;
    const auto shown = showImages();
    if (shown) opened.images = Images::Shown;
    if (shown || shown.error().code == ErrorCode::Cancelled) return;
    const ImagesPlace& place = opened.dataset->header.images;
    opened.bytes->distrust(place.offset, std::min(place.bytes, kMostTableBytes));
    if (shown.error().code == ErrorCode::InvalidInput && ++opened.tableFailures < kTableAttempts) return;
    opened.images = Images::GivenUp;
    update.problems.push_back(shown.error());
}

Result<UpdateResult> update() {
    VCP_TRY(checkRequest(opened.request));
    jpegTiles().beginWalk();
    const ShownResidency shown{&residency(), {}, &opened.errorPixels};
    VCP_TRY_ASSIGN(auto update, updateShown({&shown, 1}, opened.request));
    if (opened.images == Images::Awaited && drawsImages()) awaitImages(*update);
    return *std::move(update);
}

/// What a sample of the picture is cast with. Errors: Cancelled, where the cut is not the picture's any more; Usage.
Result<BandFrame> frameOf(uint32_t sample) {
    const uint64_t cut = residency().cutNumber();
    if (sample > 0 && cut != opened.cut) return Error::cancelled();
    opened.cut = cut;
    opened.pages = residency().pagesNumber();
    BandFrame frame{opened.request, opened.errorPixels, sample == 0 && residency().asksRays(),
                    sample == 0 && residency().listens(), residency().images()};
    if (sample > 0) VCP_TRY(checkRefinable(frame.request, sample));
    frame.request.sample = sample;
    return frame;
}

int notBegun(const Error& error) { return error.code == ErrorCode::Cancelled ? kDone : fail(error); }

/// What rays of a first sample said counts.
void endSample(BandsSaid said, bool asksRays, bool listens) {
    if (asksRays) {
        std::vector<SeenPages> seen;
        seen.push_back({&residency(), std::move(said.hit), opened.view, opened.pages});
        seeAll(std::move(seen));
    }
    if (listens) residency().hear(said.feedback, opened.view);
}

/// Begins a sample; vcp_numbers() are then what other workers begin it with.
int beginSample(const BandFrame& frame, std::vector<CutPage> cut) {
    const auto begun = opened.caster.begin(*opened.dataset, opened.hasColour, frame, std::move(cut));
    if (!begun) return fail(begun.error());
    opened.heard = {};
    opened.view = selectionView(frame.request);
    const double numbers[] = {double(BandCaster::rowsOf(frame.request)), frame.errorPixels, frame.asksRays ? 1.0 : 0.0,
                              frame.listens ? 1.0 : 0.0};
    std::copy(std::begin(numbers), std::end(numbers), opened.numbers);
    return int(BandCaster::bandsOf(frame.request));
}

/// Returns by how much the surface that is drawn may be off at a place, world units: the largest certified error of the
/// pages that are drawn around it, those of the finest surface at least.
double errorAt(glm::dvec3 place) {
    const Dataset& dataset = *opened.dataset;
    double error = dataset.header.certifiedErrorMax;
    for (const CutPage& page : cutPages(residency())) {
        // Slabs of neighbours are blended across a leaf.
        const double cell = dataset.cellOf(page.entry.level);
        const glm::dvec3 low = dataset.originOf(page.entry) - cell, high = low + dataset.edgeOf(page.entry) + 2 * cell;
        if (glm::all(glm::lessThanEqual(low, place)) && glm::all(glm::lessThanEqual(place, high)))
            error = std::max(error, double(page.entry.certifiedError));
    }
    return error;
}

}  // namespace

EXPORT(vcp_alloc) void* vcp_alloc(size_t bytes) { return std::malloc(bytes); }
EXPORT(vcp_free) void vcp_free(void* memory) { std::free(memory); }
EXPORT(vcp_error) const char* vcp_error() { return opened.error.c_str(); }

/// Begins with a file of `size` bytes, of which nothing is known. `name`: as messages have it.
EXPORT(vcp_begin) void vcp_begin(double size, const char* name, double budgetBytes) {
    opened = {};
    jpegTiles() = {};
    opened.budgetBytes = uint64_t(budgetBytes);
    opened.name = name;
    opened.size = uint64_t(size);
    opened.fetched = std::make_shared<FetchedBytes>(kFetchedBytes);
}

EXPORT(vcp_supply) void vcp_supply(double offset, const std::byte* bytes, size_t count) {
    opened.fetched->supply(uint64_t(offset), {bytes, bytes + count});
}

/// Says that the file with the byte at an offset cannot be had. `why`: a line for people.
EXPORT(vcp_lose) void vcp_lose(double offset, const char* why) { opened.fetched->lose(uint64_t(offset), why); }

/// Returns kMissing until header and directory have come.
EXPORT(vcp_open) int vcp_open() {
    const auto done = openDataset();
    if (done) return kDone;
    return done.error().code == ErrorCode::Cancelled ? kMissing : fail(done.error());
}

/// Returns the number of the file that has the byte at an offset of what is fetched; 0: that which was begun with.
EXPORT(vcp_file_at) int vcp_file_at(double offset) {
    return opened.bytes ? int(opened.bytes->fileAt(uint64_t(offset))) : 0;
}
/// Returns the name of a file, which lies beside file 0; empty for file 0 itself.
EXPORT(vcp_file_name) const char* vcp_file_name(int number) {
    return opened.bytes ? opened.bytes->fileNamed(uint64_t(number)).c_str() : "";
}
/// Returns where the bytes of a file begin in what is fetched.
EXPORT(vcp_file_begin) double vcp_file_begin(int number) { return double(uint64_t(number) * kFileSpan); }

/// Returns how many stretches of the file were missing since the last call.
EXPORT(vcp_missing) int vcp_missing() {
    opened.missing = opened.fetched->takeMissing();
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

/// Lights by the environment before `number`, or by the light alone where it is 0.
void setEnvironment(Shading& shading, size_t number, glm::vec3 up) {
    static std::array<std::optional<EnvironmentLight>, kEnvironmentNames.size()> lights;
    shading.environment.reset();
    if (number == 0 || number > lights.size()) return;
    auto& light = lights[number - 1];
    if (!light) light = environmentNamed(kEnvironmentNames[number - 1]);
    shading.environment = light;
    shading.environment->up = up;
}

/// Sets what is to be drawn: eye, forward, up (three numbers each), vertical field of view, width, height, error in
/// pixels, ShadingMode, shadows, rays of ambient occlusion, background at the top and at the bottom (three each),
/// direction towards the light in the camera's axes (right, up, back), whether there is a section, its normal (three)
/// and offset, 0 or 1 + the number of an environment (kEnvironmentNames) in place of the light, the axis that
/// points up (three), whether materials' channels are shown, and the colour error that may be seen.
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
    request.colourError = colourErrorIn(request.shading.mode, from[35]);
    request.shading.shadows = from[14] != 0;
    request.shading.occlusionRays = uint32_t(from[15]);
    request.shading.backgroundTop = {from[16], from[17], from[18]};
    request.shading.backgroundBottom = {from[19], from[20], from[21]};
    request.shading.channels = from[34] != 0;
    request.shading.lightDirection = {from[22], from[23], from[24]};
    setEnvironment(request.shading, size_t(from[30]), {from[31], from[32], from[33]});
    request.sections.clear();
    if (from[25] != 0) request.sections.push_back({{from[26], from[27], from[28]}, from[29]});
    request.sectionCaps = from[25] != 0 ? Caps::Closed : Caps::None;
}

/// Takes in pages that have come. Returns bits: 1 a picture can be drawn, 2 settled, 4 awaits rays, 8 the cut changed.
/// vcp_numbers() are then: error in pixels, bytes resident, pages missing, pages in the cut, failures, 1 where the
/// budget limits, the number of problems, of which vcp_error() is the first, and the pixels of the widest slabs whose
/// colours are off.
EXPORT(vcp_update) int vcp_update() {
    const auto updated = update();
    if (!updated) return fail(updated.error());
    const UpdateResult& now = *updated;
    if (!now.problems.empty()) opened.error = now.problems.front().line();
    const double numbers[] = {
        now.errorPixels,      double(now.residentBytes), double(now.pagesMissing),    double(now.pagesInCut),
        double(now.failures), now.relaxed ? 1.0 : 0.0,   double(now.problems.size()), now.colourPixels};
    std::copy(std::begin(numbers), std::end(numbers), opened.numbers);
    return int(now.drawable) + 2 * int(now.settled) + 4 * int(now.awaitsRays) + 8 * int(now.changed);
}
EXPORT(vcp_numbers) const double* vcp_numbers() { return opened.numbers; }

/// Begins a sample of the view: 0 draws the cut of the last update anew, others add to it. Returns the number of its
/// bands, 0 where the cut is not the picture's any more. vcp_numbers() are then: rows of a band, error in pixels,
/// whether rays are asked which pages they hit, and where.
EXPORT(vcp_begin_sample) int vcp_begin_sample(int sample) {
    const auto frame = frameOf(uint32_t(sample));
    return frame ? beginSample(*frame, cutPages(residency())) : notBegun(frame.error());
}

/// Casts a band of the sample.
EXPORT(vcp_cast) void vcp_cast(int band) { opened.caster.cast(uint32_t(band)); }
/// Returns the colours of the band cast last, RGBA8, row by row: the mean of its samples.
EXPORT(vcp_colours) const uint32_t* vcp_colours() { return opened.caster.colours().data(); }
/// Returns its distances along the unit rays, world units; infinite where nothing is hit.
EXPORT(vcp_depth) const float* vcp_depth() { return opened.caster.depth().data(); }

/// Writes down what the rays of the bands cast here said, for vcp_hear(). Returns how many numbers it is.
EXPORT(vcp_said) int vcp_said() {
    const BandsSaid said = opened.caster.said();
    std::vector<double>& to = opened.said;
    to = {double(said.hit.byCamera.size()), double(said.hit.byLight.size()), double(said.feedback.hits.size())};
    to.insert(to.end(), said.hit.byCamera.begin(), said.hit.byCamera.end());
    to.insert(to.end(), said.hit.byLight.begin(), said.hit.byLight.end());
    for (size_t i = 0; i < said.feedback.hits.size(); ++i) {
        const auto& [page, place, ray] = said.feedback.hits[i];
        to.insert(to.end(), {double(page), double(place.x), double(place.y), double(place.z), double(ray),
                             said.feedback.passed[i].nearness});
    }
    return int(to.size());
}
EXPORT(vcp_said_numbers) const double* vcp_said_numbers() { return opened.said.data(); }

/// Takes in what rays of other bands said.
EXPORT(vcp_hear) void vcp_hear(const double* from) {
    const double* next = from + 3;
    BandsSaid said;
    for (int i = 0; i < int(from[0]); ++i) said.hit.byCamera.push_back(uint64_t(*next++));
    for (int i = 0; i < int(from[1]); ++i) said.hit.byLight.push_back(uint64_t(*next++));
    for (int i = 0; i < int(from[2]); ++i, next += 6) {
        said.feedback.hits.push_back(
            {uint64_t(next[0]), {int(next[1]), int(next[2]), int(next[3])}, uint32_t(next[4])});
        said.feedback.passed.push_back({uint64_t(next[0]), next[5]});
    }
    opened.heard.add(said);
}

/// All bands of sample 0 are cast and heard: what their rays said counts.
EXPORT(vcp_end_sample) void vcp_end_sample(int asksRays, int listens) {
    BandsSaid said = opened.caster.said();
    said.add(opened.heard);
    endSample(std::move(said), asksRays != 0, listens != 0);
}

/// Returns GpuConstants of the view.
EXPORT(vcp_gpu_kind) const double* vcp_gpu_kind() {
    const GpuConstants constants = gpuConstants(opened.request, residency());
    opened.numbers[0] = constants.colour, opened.numbers[1] = constants.sections, opened.numbers[2] = constants.light;
    return opened.numbers;
}

/// Begins a sample that WebGL draws, as vcp_begin_sample() does. Returns 1; 0 where the cut is not the picture's any
/// more. vcp_numbers() are then: the number of vcp_gpu_rows(), the rows that the texture of the pool must have, and
/// will have at most, records of the table, a number of the table, whether rays are asked which pages they hit, and
/// where, and a number of the images, 0 where none are shown.
EXPORT(vcp_gpu_begin) int vcp_gpu_begin(int sample) {
    const auto frame = frameOf(uint32_t(sample));
    if (!frame) return notBegun(frame.error());
    GpuFrame& gpu = opened.gpu;
    opened.view = selectionView(frame->request);
    gpu.rows = gpu.mirror.rowsToCopy(residency());
    if (gpu.table.empty() || gpu.version != residency().version()) gpu.table = residency().table();
    gpu.version = residency().version();
    gpu.constants = frameConstants(frame->request, opened.dataset.get(), 1, opened.hasColour, frame->errorPixels);
    gpu.constants.partRows = frame->request.height;
    gpu.background = backgroundRows(frame->request);
    const double numbers[] = {double(gpu.rows.size()),
                              double(gpu.mirror.rows()),
                              double(opened.budgetBytes / kPoolUnitBytes),
                              double(gpu.table.size()),
                              double(residency().version()),
                              frame->asksRays ? 1.0 : 0.0,
                              frame->listens ? 1.0 : 0.0,
                              residency().images() ? 1.0 + double(residency().imagesVersion()) : 0.0};
    std::copy(std::begin(numbers), std::end(numbers), opened.numbers);
    return 1;
}
EXPORT(vcp_gpu_rows) const MirroredRows* vcp_gpu_rows() { return opened.gpu.rows.data(); }
EXPORT(vcp_gpu_table) const frame::TableRecord* vcp_gpu_table() { return opened.gpu.table.data(); }
EXPORT(vcp_gpu_constants) const frame::FrameConstants* vcp_gpu_constants() { return &opened.gpu.constants; }
EXPORT(vcp_gpu_constants_bytes) int vcp_gpu_constants_bytes() { return sizeof(frame::FrameConstants); }
/// The picture's background, RGBA8 of each row.
EXPORT(vcp_gpu_background) const uint32_t* vcp_gpu_background() { return opened.gpu.background.data(); }
/// Prepares the words of the images (ImageWords). Returns of how many vcp_gpu_image_parts() they are.
EXPORT(vcp_gpu_images) int vcp_gpu_images() {
    GpuFrame& gpu = opened.gpu;
    gpu.images = residency().images();
    gpu.words = imageWords(*gpu.images);
    gpu.parts.clear();
    const auto add = [&](std::span<const uint32_t> words) {
        gpu.parts.push_back({uint32_t(reinterpret_cast<uintptr_t>(words.data())), uint32_t(words.size())});
    };
    add(gpu.words.tables);
    for (const std::span<const uint32_t> texels : gpu.words.texels) add(texels);
    return int(gpu.parts.size());
}
EXPORT(vcp_gpu_image_parts) const PartOfWords* vcp_gpu_image_parts() { return opened.gpu.parts.data(); }
/// They are copied: the images may go.
EXPORT(vcp_gpu_images_end) void vcp_gpu_images_end() {
    opened.gpu.images = nullptr, opened.gpu.words = {}, opened.gpu.parts = {};
}
/// The texture of the pool holds nothing any more.
EXPORT(vcp_gpu_forget) void vcp_gpu_forget() { opened.gpu.mirror.forget(); }
/// WebGL has drawn sample 0. `hits`, `marks`: as feedbackOf() and pagesMarked() take them.
EXPORT(vcp_gpu_end)
void vcp_gpu_end(const glm::uvec4* hits, int hitCount, const uint32_t* marks, int markCount) {
    BandsSaid said;
    const auto& table = opened.gpu.table;
    if (markCount > 0) said.hit = pagesMarked({marks, size_t(markCount)}, table, *opened.dataset, opened.request);
    if (hitCount > 0) said.feedback = feedbackOf({hits, size_t(hitCount)}, table, *opened.dataset, opened.request);
    endSample(std::move(said), markCount > 0, hitCount > 0);
}

/// Finds the pages that `count` rows of the picture from `first` on need, and the tiles of images. Returns how many
/// pages they are; vcp_records() are then their CutRecords, and vcp_tiles() as many TileRecords as it is said.
EXPORT(vcp_needed) int vcp_needed(int first, int count) {
    opened.records =
        opened.needed.of(*opened.dataset, opened.request, cutPages(residency()), uint32_t(first), uint32_t(count));
    opened.tiles = tilesNeeded(residency(), selectionView(opened.request), opened.records);
    return int(opened.records.size());
}
EXPORT(vcp_records) const CutRecord* vcp_records() { return opened.records.data(); }
EXPORT(vcp_tiles) const TileRecord* vcp_tiles() { return opened.tiles.data(); }
EXPORT(vcp_tiles_count) int vcp_tiles_count() { return int(opened.tiles.size()); }

/// Returns the tables of images, materials and their channels for vcp_follow_images(). Precondition: images are shown.
EXPORT(vcp_tables) const std::byte* vcp_tables() {
    const ImageTables& tables = (*opened.datasets[0].source->images())->tables();
    opened.tables = ImageTables{tables.images, tables.materials, tables.channels, {}}.stored();
    return opened.tables.data();
}
EXPORT(vcp_tables_bytes) int vcp_tables_bytes() { return int(opened.tables.size()); }

/// Returns how many JPEGs are for the browser to decode since the last call.
EXPORT(vcp_jpegs) int vcp_jpegs() {
    opened.jpegs = jpegTiles().takeWanted();
    return int(opened.jpegs.size());
}
EXPORT(vcp_jpeg) const WantedTile* vcp_jpeg(int i) {
    const auto& [id, size, bytes] = opened.jpegs[size_t(i)];
    opened.jpeg = {id, size.x, size.y, uint32_t(bytes.size()), uint32_t(uintptr_t(bytes.data()))};
    return &opened.jpeg;
}
/// Takes in the texels of a JPEG, RGBA8; none: it cannot be decoded.
EXPORT(vcp_put_jpeg) void vcp_put_jpeg(int id, const uint32_t* texels, int count) {
    jpegTiles().put(uint32_t(id), {texels, size_t(count)});
}

/// Returns what other workers must know of the scan, and how many bytes it is.
EXPORT(vcp_lead) const Lead* vcp_lead() {
    opened.lead = {opened.dataset->header, opened.dataset->pages[0], opened.hasColour ? 1u : 0u};
    return &opened.lead;
}
EXPORT(vcp_lead_bytes) int vcp_lead_bytes() { return sizeof(Lead); }

/// Begins in a worker that holds no pages.
EXPORT(vcp_follow) void vcp_follow(const Lead* lead) {
    opened = {};
    auto dataset = std::make_shared<Dataset>();
    dataset->header = lead->header;
    dataset->pages.push_back(lead->root);
    opened.dataset = std::move(dataset);
    opened.hasColour = lead->hasColour != 0;
}
/// Returns where to put the copy of a page.
EXPORT(vcp_room) std::byte* vcp_room(double page, int bytes) {
    return opened.copies.room(uint64_t(page), uint32_t(bytes));
}
EXPORT(vcp_drop) void vcp_drop(double page) { opened.copies.drop(uint64_t(page)); }
/// Begins with images there, of which nothing was copied. `tables`: as vcp_tables() returns them.
EXPORT(vcp_follow_images) void vcp_follow_images(const std::byte* tables) {
    const ImagesPlace& place = opened.dataset->header.images;
    const auto* const images = reinterpret_cast<const ImageRow*>(tables);
    const auto* const materials = reinterpret_cast<const MaterialRow*>(images + place.images);
    const auto* const channels = reinterpret_cast<const ChannelRow*>(materials + place.materials);
    opened.imageCopies = ImageCopies({{images, images + place.images},
                                      {materials, materials + place.materials},
                                      {channels, channels + place.channels},
                                      {}});
}
EXPORT(vcp_tile_room) std::byte* vcp_tile_room(double number) { return opened.imageCopies.room(uint32_t(number)); }
EXPORT(vcp_tile_drop) void vcp_tile_drop(double number) { opened.imageCopies.drop(uint32_t(number)); }
/// Does vcp_begin_sample with a cut of pages, and tiles of images, that were copied.
EXPORT(vcp_begin_copied)
int vcp_begin_copied(const CutRecord* records, int count, const TileRecord* tiles, int tileCount, int sample,
                     double errorPixels, int asksRays, int listens) {
    auto cut = opened.copies.cutOf({records, size_t(count)});
    if (!cut) return fail(cut.error());
    const auto images = opened.imageCopies.setOf({tiles, size_t(tileCount)});
    if (!images) return fail(images.error());
    BandFrame frame{opened.request, errorPixels, asksRays != 0, listens != 0, *images};
    frame.request.sample = uint32_t(sample);
    return beginSample(frame, *std::move(cut));
}

/// Finds what a pixel of the view shows. Returns 1 where something is hit; vcp_numbers() are then its place, its depth,
/// and by how much the surface that is drawn may be off there (both in world units).
EXPORT(vcp_pick) int vcp_pick(int x, int y) {
    const FrameRequest& request = opened.request;
    const float depth =
        depthAt(*opened.dataset, request, cutPages(residency()), opened.hasColour, uint32_t(x), uint32_t(y));
    if (!(depth < std::numeric_limits<float>::infinity())) return 0;
    const PixelHit hit = pixelHit(request, {uint32_t(x), uint32_t(y)}, double(depth), {});
    const double numbers[] = {hit.position.x, hit.position.y, hit.position.z, hit.depth, errorAt(hit.position)};
    std::copy(std::begin(numbers), std::end(numbers), opened.numbers);
    return 1;
}
