#include "viewer/bench/picture/bench_picture.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <glm/geometric.hpp>

#include "render/picture.h"
#include "viewer/bench/picture/flip.h"
#include "viewer/bench/picture/mesh_picture.h"
#include "viewer/bench/picture/picture_difference.h"
#include "viewer/bench/picture/settled_drawing.h"
#include "viewer/bench/rays/analytic_models.h"
#include "viewer/bench/rays/bench_cameras.h"
#include "viewer/bench/rays/bench_model.h"
#include "viewer/bench/report/bench_folder.h"

namespace vcp {

namespace {

/// One frame of a camera's way, and its name in the report.
struct NamedCamera {
    std::string name;
    Camera camera;
};

struct DrawnPicture {
    LightPicture picture;
    PictureCost cost;
};

/// What draws the pictures of one model.
class PictureMethod {
public:
    virtual ~PictureMethod() = default;
    [[nodiscard]] virtual std::string name() const = 0;
    [[nodiscard]] virtual std::string knob() const { return ""; }
    [[nodiscard]] virtual std::string device() const = 0;
    /// Forgets what was read.
    virtual Result<void> startAnew() { return {}; }
    virtual Result<DrawnPicture> draw(const FrameRequest& request) = 0;
};

class RendererMethod final : public PictureMethod {
public:
    explicit RendererMethod(std::unique_ptr<SettledDrawing> drawing) : drawing_(std::move(drawing)) {}

    [[nodiscard]] std::string name() const override { return "certified"; }
    [[nodiscard]] std::string knob() const override { return drawing_->knob(); }
    [[nodiscard]] std::string device() const override { return drawing_->device(); }
    Result<void> startAnew() override { return drawing_->startAnew(); }

    Result<DrawnPicture> draw(const FrameRequest& request) override {
        DrawnPicture drawn;
        VCP_TRY_ASSIGN(drawn.cost, drawing_->draw(request));
        VCP_TRY(read(drawn.picture));
        return drawn;
    }

private:
    Result<void> read(LightPicture& light) {
        PictureRenderer& renderer = drawing_->renderer();
        VCP_TRY_ASSIGN(const auto picture, renderer.readPicture());
        VCP_TRY_ASSIGN(auto depth, renderer.readDepth());
        VCP_TRY_ASSIGN(auto normals, renderer.readNormals());
        light.size = {picture.width, picture.height};
        light.depth = std::move(depth);
        light.normals = std::move(normals);
        light.light.resize(light.depth.size());
        light.coverage.resize(light.depth.size());
        for (size_t i = 0; i < light.depth.size(); ++i) {
            light.light[i] = float(picture.rgba[4 * i]) / 255;
            light.coverage[i] = std::isfinite(light.depth[i]) ? 1.0f : 0.0f;
        }
        return {};
    }

    std::unique_ptr<SettledDrawing> drawing_;
};

class EmbreeMethod final : public PictureMethod {
public:
    EmbreeMethod(const MeshPicture& mesh, uint64_t meshBytes, int repetitions)
        : mesh_(mesh), meshBytes_(meshBytes), repetitions_(repetitions) {}
    [[nodiscard]] std::string name() const override { return "embree"; }
    [[nodiscard]] std::string device() const override { return "CPU"; }

    Result<DrawnPicture> draw(const FrameRequest& request) override {
        DrawnPicture drawn;
        VCP_TRY_ASSIGN(const auto ms, medianCpuMs(repetitions_, [&]() -> Result<void> {
                           drawn.picture = mesh_.draw(request, 1);
                           return {};
                       }));
        drawn.cost = {ms, meshBytes_, mesh_.bytes(), 0, 0};
        return drawn;
    }

private:
    const MeshPicture& mesh_;
    uint64_t meshBytes_;
    int repetitions_;
};

ColourPicture greyPicture(const LightPicture& light) {
    ColourPicture picture{light.size.x, light.size.y, {}};
    picture.pixels.reserve(light.light.size());
    for (const float value : light.light) picture.pixels.emplace_back(value);
    return picture;
}

/// The greatest, where views have quantiles of their own.
void takeWorse(Quantiles& all, const Quantiles& one) {
    all = {std::max(all.p50, one.p50), std::max(all.p95, one.p95), std::max(all.p99, one.p99),
           std::max(all.max, one.max)};
}

class PictureBench {
public:
    explicit PictureBench(const BenchPictureOptions& options) : o_(options), folder_(options.out) {}

    Result<BenchPictureReport> run() {
        VCP_TRY(checkNames(o_.methods, pictureMethodNames(), "method"));
        VCP_TRY(checkNames(o_.cameras, pictureCameraNames(), "camera"));
        VCP_TRY(folder_.make());
        if (o_.models.empty()) {
            VCP_TRY_ASSIGN(o_.models, writeAnalyticModels(folder_.path()));
            if (!(o_.cell > 0)) o_.cell = kAnalyticModelCell;
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
        VCP_TRY_ASSIGN(const auto model, loadBenchModel(path, folder_.path(), o_.cell, o_.threads,
                                                        [&](const std::string& what) { return report(what); }));
        const BenchModel& m = *model;
        VCP_TRY_ASSIGN(const auto mesh, MeshPicture::create(m.mesh, o_.threads));
        std::vector<std::unique_ptr<PictureMethod>> methods;
        for (const std::string& name : o_.methods) {
            if (name == "embree") {
                methods.push_back(
                    std::make_unique<EmbreeMethod>(*mesh, std::filesystem::file_size(m.files.mesh), o_.repetitions));
                continue;
            }
            for (const double pixels : o_.errorPixels) {
                VCP_TRY_ASSIGN(auto drawing, SettledDrawing::create(
                                                 m.files.vcp, {o_.device, pixels, o_.pictureSamples, o_.repetitions}));
                methods.push_back(std::make_unique<RendererMethod>(std::move(drawing)));
            }
        }
        for (const std::string& camera : o_.cameras) VCP_TRY(runCamera(m, *mesh, methods, camera));
        return {};
    }

    [[nodiscard]] std::vector<NamedCamera> camerasOf(const BenchModel& model, const std::string& name, int view) const {
        const FileHeader& header = model.cache->dataset().header;
        const CellGrid grid{{header.origin[0], header.origin[1], header.origin[2]}, header.cell};
        if (name != "dive") return {{name, *benchCamera(name, *model.bvh, grid, o_.size, view, o_.views)}};
        std::vector<NamedCamera> cameras;
        for (const Camera& camera : diveCameras(*model.bvh, grid, o_.size, o_.diveSteps, view, o_.views))
            cameras.push_back({fmt::format("dive-{}", cameras.size() + 1), camera});
        return cameras;
    }

    /// Draws a camera's frames with all methods: one after the other, so that the mesh's pictures are drawn once.
    Result<void> runCamera(const BenchModel& model, const MeshPicture& mesh,
                           std::vector<std::unique_ptr<PictureMethod>>& methods, const std::string& name) {
        const size_t frames = name == "dive" ? size_t(o_.diveSteps) : 1;
        std::vector<BenchPictureRow> rows(frames * methods.size());
        for (int view = 0; view < o_.views; ++view) {
            const std::vector<NamedCamera> cameras = camerasOf(model, name, view);
            for (const auto& method : methods) VCP_TRY(method->startAnew());
            for (size_t frame = 0; frame < cameras.size(); ++frame) {
                const FrameRequest request = lightRequest(cameras[frame].camera, o_.size);
                VCP_TRY(report(fmt::format("{}: {}, the mesh", model.files.name, cameras[frame].name)));
                const LightPicture reference = mesh.draw(request, o_.samples);
                VCP_TRY(keepPicture(model, cameras[frame], view, "mesh", reference));
                const size_t isolatedInMesh = isolatedPixels(reference, cameras[frame].camera).size();
                for (size_t k = 0; k < methods.size(); ++k) {
                    VCP_TRY(report(fmt::format("{}: {}, {} {}", model.files.name, cameras[frame].name,
                                               methods[k]->name(), methods[k]->knob())));
                    VCP_TRY_ASSIGN(const auto drawn, methods[k]->draw(request));
                    BenchPictureRow& row = rows[frame * methods.size() + k];
                    nameRow(row, model, cameras[frame], *methods[k]);
                    row.isolatedInMesh += isolatedInMesh;
                    judge(row, reference, drawn, cameras[frame].camera, model.cache->dataset().header.cell);
                    VCP_TRY(keepPicture(model, cameras[frame], view,
                                        fmt::format("{} {}", methods[k]->name(), methods[k]->knob()), drawn.picture));
                }
            }
        }
        report_.rows.insert(report_.rows.end(), rows.begin(), rows.end());
        return {};
    }

    void nameRow(BenchPictureRow& row, const BenchModel& model, const NamedCamera& camera,
                 const PictureMethod& method) const {
        row.model = model.files.name;
        row.camera = camera.name;
        row.method = method.name();
        row.knob = method.knob();
        row.device = method.device();
    }

    /// Adds a view's picture to its row: sums of counts and costs, means of errors, the worst of quantiles.
    void judge(BenchPictureRow& row, const LightPicture& reference, const DrawnPicture& drawn, const Camera& camera,
               double cell) const {
        const LightPicture& picture = drawn.picture;
        const double share = 1.0 / o_.views;
        const double perCell = o_.size.y / (2 * std::tan(camera.verticalFov / 2));
        const float middle = reference.depth[size_t(o_.size.y / 2) * o_.size.x + o_.size.x / 2];
        row.cellPixels = std::isfinite(middle) ? cell * perCell / middle : 0;
        row.pixels += picture.light.size();
        row.hitPixels += uint64_t(std::ranges::count(picture.coverage, 1.0f));
        const double error = lightError(reference, picture);
        row.rmse = std::sqrt(row.rmse * row.rmse + share * error * error);
        std::vector<double> differences = flip(greyPicture(reference), greyPicture(picture));
        double sum = 0;
        for (const double difference : differences) sum += difference;
        row.flipMean += share * sum / double(differences.size());
        row.flipP99 = std::max(row.flipP99, quantile(std::move(differences), 0.99));
        row.isolatedPixels += isolatedPixels(picture, camera).size();
        const SilhouetteDifference silhouette = silhouetteDifference(reference, picture);
        row.silhouettePixels += silhouette.pixels;
        takeWorse(row.silhouetteDistance, silhouette.distancePixels);
        takeWorse(row.normalDegrees, normalDifference(reference, picture));
        row.cpuMs += share * drawn.cost.cpuMs;
        row.bytesRead += uint64_t(share * double(drawn.cost.bytesRead));
        row.residentBytes = std::max(row.residentBytes, drawn.cost.residentBytes);
        row.coarsestLevel = drawn.cost.coarsestLevel;
        row.finestLevel = std::max(row.finestLevel, drawn.cost.finestLevel);
    }

    Result<void> keepPicture(const BenchModel& model, const NamedCamera& camera, int view, std::string method,
                             const LightPicture& light) const {
        if (!o_.pictures || o_.out.empty()) return {};
        while (method.ends_with(' ')) method.pop_back();
        std::ranges::replace(method, ' ', '-');
        Picture picture{uint32_t(light.size.x), uint32_t(light.size.y), {}};
        for (const float value : light.light) {
            const auto grey = uint8_t(std::lround(255 * std::clamp(value, 0.0f, 1.0f)));
            picture.rgba.insert(picture.rgba.end(), {grey, grey, grey, 255});
        }
        for (const glm::ivec2 at : isolatedPixels(light, camera.camera)) {
            uint8_t* pixel = &picture.rgba[4 * (size_t(at.y) * light.size.x + at.x)];
            pixel[0] = 255, pixel[1] = pixel[2] = 0;
        }
        const std::string name = fmt::format("{}_{}_{}_{}.png", model.files.name, camera.name, view, method);
        return writePng(picture, o_.out / name, {.inputs = o_.models});
    }

    BenchPictureOptions o_;
    BenchFolder folder_;
    BenchPictureReport report_;
    double done_ = 0;
};

}  // namespace

const std::vector<std::string>& pictureCameraNames() {
    static const std::vector<std::string> names = {"whole", "half", "close", "dive"};
    return names;
}

const std::vector<std::string>& pictureMethodNames() {
    static const std::vector<std::string> names = {"certified", "embree"};
    return names;
}

Result<BenchPictureReport> benchPicture(const BenchPictureOptions& options) { return PictureBench(options).run(); }

}  // namespace vcp
