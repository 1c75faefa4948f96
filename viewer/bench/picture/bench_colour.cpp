#include "viewer/bench/picture/bench_colour.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "builder/stream/colour_difference.h"
#include "builder/stream/colour_encoding.h"
#include "render/picture.h"
#include "viewer/bench/picture/colour_models.h"
#include "viewer/bench/picture/flip.h"
#include "viewer/bench/picture/mesh_colour_picture.h"
#include "viewer/bench/picture/settled_drawing.h"
#include "viewer/bench/rays/bench_cameras.h"
#include "viewer/bench/rays/bench_model.h"
#include "viewer/bench/report/bench_folder.h"

namespace vcp {

namespace {

/// A pixel is within a silhouette where all its rays meet the mesh, and images cut out less than half of it.
constexpr float kLeastOpacity = 0.5f;

/// Decoded texels that an image of the mesh may have, as bytes: those of the largest that is built.
constexpr uint64_t kMostImageBytes = uint64_t{4} << 30;

struct DrawnColours {
    SurfaceColours picture;
    PictureCost cost;
};

/// What draws the pictures of one model.
class ColourMethod {
public:
    virtual ~ColourMethod() = default;
    [[nodiscard]] virtual std::string name() const = 0;
    [[nodiscard]] virtual std::string knob() const = 0;
    [[nodiscard]] virtual std::string device() const = 0;
    /// Forgets what was read.
    virtual Result<void> startAnew() { return {}; }
    virtual Result<DrawnColours> draw(const FrameRequest& request) = 0;
    /// Returns the picture with what is in memory, before what it lacks is read; nothing of a method that reads
    /// nothing.
    virtual Result<std::optional<SurfaceColours>> drawUnread(const FrameRequest&) {
        return std::optional<SurfaceColours>();
    }
    uint64_t geometryBytes = 0, colourBytes = 0;
};

class RendererColours final : public ColourMethod {
public:
    explicit RendererColours(std::unique_ptr<SettledDrawing> drawing) : drawing_(std::move(drawing)) {}
    [[nodiscard]] std::string name() const override { return "certified"; }
    [[nodiscard]] std::string knob() const override { return drawing_->knob(); }
    [[nodiscard]] std::string device() const override { return drawing_->device(); }
    Result<void> startAnew() override { return drawing_->startAnew(); }

    Result<DrawnColours> draw(const FrameRequest& request) override {
        DrawnColours drawn;
        VCP_TRY_ASSIGN(drawn.cost, drawing_->draw(request));
        VCP_TRY_ASSIGN(drawn.picture, drawnPicture());
        return drawn;
    }
    Result<std::optional<SurfaceColours>> drawUnread(const FrameRequest& request) override {
        VCP_TRY(drawing_->drawUnread(request));
        VCP_TRY_ASSIGN(auto picture, drawnPicture());
        return std::optional(std::move(picture));
    }

private:
    [[nodiscard]] Result<SurfaceColours> drawnPicture() const {
        VCP_TRY_ASSIGN(const auto picture, drawing_->renderer().readPicture());
        VCP_TRY_ASSIGN(const auto depth, drawing_->renderer().readDepth());
        SurfaceColours colours({int(picture.width), int(picture.height)});
        for (size_t i = 0; i < depth.size(); ++i) {
            for (int channel = 0; channel < 3; ++channel)
                colours.light[i][channel] = lightOfByte()[picture.rgba[4 * i + size_t(channel)]];
            colours.coverage[i] = colours.opacity[i] = std::isfinite(depth[i]) ? 1.0f : 0.0f;
        }
        return colours;
    }

    std::unique_ptr<SettledDrawing> drawing_;
};

class EmbreeColours final : public ColourMethod {
public:
    EmbreeColours(std::string name, const MeshColourPicture& mesh, MeshColourPicture::Paint paint,
                  const BenchColourOptions& options)
        : name_(std::move(name)),
          mesh_(mesh),
          paint_(std::move(paint)),
          samples_(options.pictureSamples),
          repetitions_(options.repetitions) {}
    [[nodiscard]] std::string name() const override { return name_; }
    [[nodiscard]] std::string knob() const override { return fmt::format("samples {}", samples_ * samples_); }
    [[nodiscard]] std::string device() const override { return "CPU"; }

    Result<DrawnColours> draw(const FrameRequest& request) override {
        DrawnColours drawn;
        VCP_TRY_ASSIGN(const auto ms, medianCpuMs(repetitions_, [&]() -> Result<void> {
                           drawn.picture = mesh_.draw(request, samples_, paint_);
                           return {};
                       }));
        drawn.cost = {ms, geometryBytes + colourBytes, mesh_.bytes(), 0, 0};
        return drawn;
    }

private:
    std::string name_;
    const MeshColourPicture& mesh_;
    MeshColourPicture::Paint paint_;
    int samples_, repetitions_;
};

FrameRequest colourRequest(const Camera& camera, glm::ivec2 size) {
    FrameRequest request;
    request.camera = camera;
    request.width = uint32_t(size.x);
    request.height = uint32_t(size.y);
    request.shading.mode = ShadingMode::Unlit;
    return request;
}

ColourPicture encodedPicture(const SurfaceColours& colours) {
    ColourPicture picture{colours.size.x, colours.size.y, {}};
    picture.pixels.reserve(colours.light.size());
    for (const glm::dvec3& light : colours.light)
        picture.pixels.emplace_back(linearToSrgb(light.x), linearToSrgb(light.y), linearToSrgb(light.z));
    return picture;
}

bool isCovered(const SurfaceColours& picture, size_t pixel) {
    return picture.coverage[pixel] == 1 && picture.opacity[pixel] >= kLeastOpacity;
}

double meanOf(const std::vector<float>& values) {
    double sum = 0;
    for (const float value : values) sum += double(value);
    return values.empty() ? 0 : sum / double(values.size());
}

/// A row and the differences that its means and quantiles are of.
struct RowSum {
    BenchColourRow row;
    std::vector<float> differences;
    double flip = 0;
    bool isStep = false;  ///< after a dive's first
    std::vector<float> pops, changes, meshChanges;
};

/// Compares the pixels that both pictures cover.
void compare(const SurfaceColours& reference, SurfaceColours picture, RowSum& sum) {
    std::vector<size_t> compared;
    for (size_t i = 0; i < reference.light.size(); ++i)
        if (isCovered(reference, i) && picture.coverage[i] == 1)
            compared.push_back(i);
        else
            picture.light[i] = reference.light[i];  // what is not compared does not show beside its edge either
    const std::vector<double> flips = flip(encodedPicture(reference), encodedPicture(picture));
    for (const size_t i : compared) {
        sum.differences.push_back(float(colourDifference(reference.light[i], picture.light[i])));
        sum.flip += flips[i];
    }
}

/// What a step of a dive, or the one before, shows.
struct Step {
    SurfaceColours mesh;
    std::vector<SurfaceColours> pictures;  ///< of each method
};

/// Adds how the pixels that are covered throughout changed since the step before. `unread`: the step with what was in
/// memory.
void addChanges(const Step& before, const SurfaceColours& pictureBefore, const SurfaceColours& unread,
                const SurfaceColours& mesh, const SurfaceColours& picture, RowSum& sum) {
    sum.isStep = true;
    for (size_t i = 0; i < mesh.light.size(); ++i) {
        if (!isCovered(before.mesh, i) || !isCovered(mesh, i)) continue;
        if (pictureBefore.coverage[i] < 1 || unread.coverage[i] < 1 || picture.coverage[i] < 1) continue;
        sum.pops.push_back(float(colourDifference(unread.light[i], picture.light[i])));
        sum.changes.push_back(float(colourDifference(pictureBefore.light[i], picture.light[i])));
        sum.meshChanges.push_back(float(colourDifference(before.mesh.light[i], mesh.light[i])));
    }
}

class ColourBench {
public:
    explicit ColourBench(const BenchColourOptions& options) : o_(options), folder_(options.out) {}

    Result<BenchColourReport> run() {
        VCP_TRY(checkNames(o_.methods, colourMethodNames(), "method"));
        VCP_TRY(checkNames(o_.cameras, colourCameraNames(), "camera"));
        VCP_TRY(folder_.make());
        if (o_.models.empty()) {
            VCP_TRY_ASSIGN(o_.models, writeColourModels(folder_.path()));
        }
        for (size_t i = 0; i < o_.models.size(); ++i) {
            done_ = double(i) / double(o_.models.size());
            VCP_TRY(runModel(o_.models[i]));
        }
        return std::move(report_);
    }

private:
    Result<void> report(const std::string& what) const {
        if (!o_.progress || o_.progress(what, done_)) return {};
        return Error::cancelled();
    }

    Result<void> runModel(const std::filesystem::path& path) {
        MeshPaint paint;
        LoadOptions load;
        load.chunk = [&](size_t file, const MeshStream& stream, const MeshChunk& chunk) {
            paint.add(file, stream, chunk);
        };
        VCP_TRY_ASSIGN(const auto model, loadBenchModel(
                                             path, folder_.path(), o_.cell, o_.threads,
                                             [&](const std::string& what) { return report(what); }, load, o_.images));
        if (!paint.hasColour())
            return Error{.code = ErrorCode::Usage,
                         .message = "has no colour to compare; name a mesh with colours or textures",
                         .file = model->files.mesh.string()};
        paint.loadImages({.bytes = kMostImageBytes});
        report_.warnings.insert(report_.warnings.end(), paint.warnings().begin(), paint.warnings().end());
        VCP_TRY_ASSIGN(const auto mesh, MeshColourPicture::create(model->mesh, o_.threads));
        const MeshColourPicture::Paint textured = [&](uint64_t triangle, glm::dvec3 weights) {
            return paint.lightAt(model->mesh, triangle, weights);
        };
        VCP_TRY_ASSIGN(const auto methods, methodsOf(*model, *mesh, paint, textured));
        for (const std::string& camera : o_.cameras) VCP_TRY(runCamera(*model, *mesh, textured, methods, camera));
        return {};
    }

    using Methods = std::vector<std::unique_ptr<ColourMethod>>;

    Result<Methods> methodsOf(const BenchModel& model, const MeshColourPicture& mesh, const MeshPaint& paint,
                              const MeshColourPicture::Paint& textured) const {
        Methods methods;
        const uint64_t meshBytes = std::filesystem::file_size(model.files.mesh);
        for (const std::string& name : o_.methods) {
            if (name == "texture") {
                methods.push_back(std::make_unique<EmbreeColours>(name, mesh, textured, o_));
                methods.back()->geometryBytes = meshBytes;
                methods.back()->colourBytes = paint.storedBytes();
            } else if (name == "vertex") {
                const auto colours = std::make_shared<const VertexColours>(model.mesh, paint, o_.threads);
                methods.push_back(std::make_unique<EmbreeColours>(
                    name, mesh,
                    [colours](uint64_t triangle, glm::dvec3 weights) { return colours->lightAt(triangle, weights); },
                    o_));
                methods.back()->geometryBytes = meshBytes;
                methods.back()->colourBytes = colours->bytes();
            } else {
                VCP_TRY(addCertified(model, methods));
            }
        }
        return methods;
    }

    /// Returns errors in pixels, each with each colour error.
    [[nodiscard]] std::vector<std::pair<double, double>> knobs() const {
        std::vector<std::pair<double, double>> all;
        for (const double pixels : o_.errorPixels)
            for (const double colourError : o_.colourErrors) all.emplace_back(pixels, colourError);
        return all;
    }

    Result<void> addCertified(const BenchModel& model, Methods& methods) const {
        for (const auto& [pixels, colourError] : knobs()) {
            const auto samples = uint32_t(o_.pictureSamples * o_.pictureSamples);
            VCP_TRY_ASSIGN(auto drawing, SettledDrawing::create(model.files.vcp, {o_.device, pixels, samples,
                                                                                  o_.repetitions, colourError}));
            methods.push_back(std::make_unique<RendererColours>(std::move(drawing)));
            for (const PageEntry& page : model.cache->dataset().pages) {
                methods.back()->geometryBytes += page.storedBytes;
                methods.back()->colourBytes += page.colourStoredBytes;
            }
            methods.back()->colourBytes += model.cache->dataset().header.images.bytes;
        }
        return {};
    }

    /// Returns a camera, or the steps of a dive.
    [[nodiscard]] std::vector<Camera> camerasOf(const BenchModel& model, const std::string& name, int view) const {
        const FileHeader& header = model.cache->dataset().header;
        const CellGrid grid{{header.origin[0], header.origin[1], header.origin[2]}, header.cell};
        if (name == "dive") return diveCameras(*model.bvh, grid, o_.size, o_.diveSteps, view, o_.views);
        return {*benchCamera(name, *model.bvh, grid, o_.size, view, o_.views)};
    }

    /// Draws a camera's views with all methods: one after the other, so that the mesh's pictures are drawn once.
    Result<void> runCamera(const BenchModel& model, const MeshColourPicture& mesh,
                           const MeshColourPicture::Paint& textured, const Methods& methods, const std::string& name) {
        std::vector<RowSum> sums;
        std::vector<Camera> first;
        for (int view = 0; view < o_.views; ++view) {
            const std::vector<Camera> cameras = camerasOf(model, name, view);
            if (view == 0) first = cameras;
            sums.resize(cameras.size() * methods.size());
            for (const auto& method : methods) VCP_TRY(method->startAnew());
            Step before;
            for (size_t step = 0; step < cameras.size(); ++step) {
                const std::string named = name == "dive" ? fmt::format("dive-{}", step + 1) : name;
                const FrameRequest request = colourRequest(cameras[step], o_.size);
                VCP_TRY(report(fmt::format("{}: {}, the mesh", model.files.name, named)));
                Step now{mesh.draw(request, o_.samples, textured), {}};
                VCP_TRY(keepPicture(model, named, view, "mesh", now.mesh));
                for (size_t k = 0; k < methods.size(); ++k) {
                    VCP_TRY(report(
                        fmt::format("{}: {}, {} {}", model.files.name, named, methods[k]->name(), methods[k]->knob())));
                    RowSum& sum = sums[step * methods.size() + k];
                    sum.row.camera = named;
                    VCP_TRY(drawStep(*methods[k], request, before, now, sum));
                    VCP_TRY(keepPicture(model, named, view, methods[k]->name() + " " + methods[k]->knob(),
                                        now.pictures[k]));
                }
                before = std::move(now);
            }
        }
        for (size_t i = 0; i < sums.size(); ++i)
            report_.rows.push_back(finishedRow(sums[i], model, first[i / methods.size()]));
        return {};
    }

    /// Draws a picture with the next method, and adds it to `now` and to its row. `before`: the step before, if any.
    Result<void> drawStep(ColourMethod& method, const FrameRequest& request, const Step& before, Step& now,
                          RowSum& sum) const {
        const size_t number = now.pictures.size();
        std::optional<SurfaceColours> unread;
        if (!before.pictures.empty()) {
            VCP_TRY_ASSIGN(unread, method.drawUnread(request));
        }
        VCP_TRY_ASSIGN(auto drawn, method.draw(request));
        addCost(sum.row, method, drawn);
        compare(now.mesh, drawn.picture, sum);
        if (unread) addChanges(before, before.pictures[number], *unread, now.mesh, drawn.picture, sum);
        now.pictures.push_back(std::move(drawn.picture));
        return {};
    }

    void addCost(BenchColourRow& row, const ColourMethod& method, const DrawnColours& drawn) const {
        row.method = method.name();
        row.knob = method.knob();
        row.device = method.device();
        row.geometryBytes = method.geometryBytes;
        row.colourBytes = method.colourBytes;
        row.pixels += drawn.picture.light.size();
        row.cpuMs += drawn.cost.cpuMs / o_.views;
        row.bytesRead += drawn.cost.bytesRead / uint64_t(o_.views);
        row.residentBytes = std::max(row.residentBytes, drawn.cost.residentBytes);
        row.coarsestLevel = drawn.cost.coarsestLevel;
        row.finestLevel = std::max(row.finestLevel, drawn.cost.finestLevel);
    }

    /// `camera`: of the first view.
    [[nodiscard]] BenchColourRow finishedRow(RowSum& sum, const BenchModel& model, const Camera& camera) const {
        BenchColourRow row = sum.row;
        row.model = model.files.name;
        row.comparedPixels = sum.differences.size();
        const auto middle = model.bvh->nearestHit(camera.eye, camera.forward);
        row.cellPixels =
            middle ? model.cache->dataset().header.cell * o_.size.y / (2 * std::tan(camera.verticalFov / 2)) / middle->t
                   : 0;
        if (sum.isStep) {
            row.dive = DiveChange{meanOf(sum.pops), {}, meanOf(sum.changes), meanOf(sum.meshChanges)};
            if (!sum.pops.empty()) row.dive->pop = quantilesOf(std::move(sum.pops));
        }
        if (sum.differences.empty()) return row;
        row.differenceMean = meanOf(sum.differences);
        row.flipMean = sum.flip / double(sum.differences.size());
        row.difference = quantilesOf(std::move(sum.differences));
        return row;
    }

    Result<void> keepPicture(const BenchModel& model, const std::string& camera, int view, std::string method,
                             const SurfaceColours& colours) const {
        if (!o_.pictures || o_.out.empty()) return {};
        std::ranges::replace(method, ' ', '-');
        Picture picture{uint32_t(colours.size.x), uint32_t(colours.size.y), {}};
        for (const glm::dvec3& light : colours.light) {
            for (int channel = 0; channel < 3; ++channel) picture.rgba.push_back(toByte(linearToSrgb(light[channel])));
            picture.rgba.push_back(255);
        }
        const std::string name = fmt::format("{}_{}_{}_{}.png", model.files.name, camera, view, method);
        return writePng(picture, o_.out / name, {.inputs = o_.models});
    }

    BenchColourOptions o_;
    BenchFolder folder_;
    BenchColourReport report_;
    double done_ = 0;
};

}  // namespace

const std::vector<std::string>& colourCameraNames() {
    static const std::vector<std::string> names = {"whole", "half", "close", "dive"};
    return names;
}

const std::vector<std::string>& colourMethodNames() {
    static const std::vector<std::string> names = {"certified", "vertex", "texture"};
    return names;
}

Result<BenchColourReport> benchColour(const BenchColourOptions& options) { return ColourBench(options).run(); }

}  // namespace vcp
