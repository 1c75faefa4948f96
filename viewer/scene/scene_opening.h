// Opens what is shown: one dataset, a scene with its datasets and surfaces, or whatever a person names. SceneOpening
// does the last in a thread of its own. All functions may be called from any thread, and wait for disks and servers.
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "builder/mesh_sample.h"
#include "render/view/renderer.h"
#include "streaming/page_source.h"
#include "viewer/annotation/legend.h"
#include "viewer/scene/inputs.h"
#include "viewer/scene/scene_file.h"

namespace vcp {

/// How servers are accessed.
struct SourceAccess {
    std::string caFile;                ///< PEM; empty: the system's
    std::string cache;                 ///< folder that keeps what a server sends; empty: nothing is kept
    uint64_t cacheBytes = 4ull << 30;  ///< limit of that folder
    /// Makes requests to a server end, within some 50 ms, once it returns true: while a dataset is opened, and in its
    /// later reads. Any thread calls it. May be empty.
    std::function<bool()> cancelled = {};
};

/// Opens a path or an http(s) address, through the cache where one is asked for. A manifest of shards is read as the
/// one file that it stands for. Errors: those of openDatasetFile, HttpReader::open and CachingReader::open.
Result<std::shared_ptr<const ByteReader>> openReader(const std::string& where, const SourceAccess& access);

/// A dataset opened for showing: of a large directory the beginning is read, and more as pages are asked for.
struct OpenDataset {
    std::shared_ptr<const ByteReader> reader;
    std::shared_ptr<const Dataset> dataset;
    std::shared_ptr<const PageSource> source;
    bool isRemote = false;

    [[nodiscard]] Box bounds() const;
    /// Returns the number of threads that read pages: with a server most of them wait.
    [[nodiscard]] uint32_t loaderThreads() const { return isRemote ? 8 : 2; }
    /// Returns up to how many bytes pages are read together (FilePageSource).
    [[nodiscard]] uint64_t runBytes() const { return isRemote ? 256 << 10 : 0; }
};

/// Opens a dataset. Errors: those of openReader and readDatasetStart.
Result<OpenDataset> openDataset(const std::string& where, const SourceAccess& access);

/// A dataset that was named and could not be opened.
struct LeftOut {
    std::string input;
    Error why;
};

struct OpenedScene {
    struct Part {
        OpenDataset open;
        Similarity placement;
    };
    std::vector<Part> parts;                       ///< at least one, or a surface
    MesoScene surfaces;                            ///< made from the file's surfaces
    std::optional<EnvironmentLight> environment;   ///< of the file's
    SceneFile file;                                ///< light, camera and sections of a scene file; empty without one
    std::vector<LeftOut> leftOut;                  ///< in the order given; only where that is allowed
    std::vector<std::filesystem::path> filesRead;  ///< files that no output may replace; may include addresses

    /// Returns the box about all datasets where they are placed, and the surfaces.
    [[nodiscard]] Box bounds() const;
    [[nodiscard]] std::vector<PlacedDataset> placed() const;
    [[nodiscard]] LegendSubject legendSubject() const;
};

/// Opens the datasets of a scene, each by `open`, which is given its file, and makes its surfaces. `name` stands for
/// the scene in errors. `leavesOut`: what cannot be opened is left out, while there is one dataset that can.
/// `progress`: of the surfaces. Errors: those of `open` and makeMesoScene; InvalidInput, where they lie too far apart.
Result<OpenedScene> openScene(SceneFile file, const std::string& name,
                              const std::function<Result<OpenDataset>(const std::string& file)>& open,
                              bool leavesOut = false, const SurfaceProgress& progress = {});

/// What holds for all surfaces of a scene.
struct SurfaceChoices {
    std::string method;            ///< empty: the scene's
    std::optional<int> subdivide;  ///< times that Loop's rules are applied; none: the scene's
    bool withLightRays = true;     ///< false: no shadows and no occlusion will be asked for

    void applyTo(SceneFile& scene) const;
};

/// Opens one scene file, or .vcp files and addresses, each where it lies by itself, or meshes, which are built into one
/// dataset in the cache first; meshes of a scene are built one by one. `build`: how, and who is told the progress.
/// `instead`: for all surfaces, in place of what the scene says. `leavesOut`: of several .vcp files and addresses,
/// those that cannot be opened are left out while there is one that can. Errors: Usage (.vcp files among meshes); those
/// of readScene, MeshCache, openDataset and the other openScene.
Result<OpenedScene> openScene(const std::vector<std::string>& inputs, const BuildOptions& build,
                              const SourceAccess& access, const SurfaceChoices& instead = {}, bool leavesOut = false);

/// Returns "statue.ply", or "statue.ply and 2 more"; addresses without user and password.
std::string nameOf(const std::vector<std::string>& inputs);

/// openScene in a thread of its own; but of several .vcp files and addresses those that cannot be opened are left out,
/// as long as there is one that can. One thread may call; destroying it before it is done cancels and waits for the
/// build, or the exchange with a server, to notice.
class SceneOpening {
public:
    struct Progress {
        std::string stage;
        double fraction = 0;
        uint64_t triangles = 0;
        double seconds = 0;  ///< since the build began
        double begun = 0;    ///< fraction that an earlier run had done
    };

    /// Takes what openScene takes. `build.progress` is called in the thread, and destroyed when the work is done.
    SceneOpening(std::vector<std::string> inputs, BuildOptions build, SourceAccess access);
    ~SceneOpening();
    SceneOpening(const SceneOpening&) = delete;
    SceneOpening& operator=(const SceneOpening&) = delete;

    [[nodiscard]] const std::vector<std::string>& inputs() const { return inputs_; }
    [[nodiscard]] Progress progress() const;
    void cancel() { *cancelled_ = true; }
    [[nodiscard]] bool isDone() const { return done_; }
    /// What was read of the meshes that are being built; nothing of a scene's, which lie where the scene places them.
    [[nodiscard]] const MeshSample& sample() const { return *sample_; }
    /// Returns what was opened; call it once, when it is done. Errors: those of openScene; Cancelled; those of
    /// caught().
    Result<OpenedScene> take();

private:
    Result<OpenedScene> open();

    std::vector<std::string> inputs_;
    BuildOptions build_;  // used by the thread, as is access_
    SourceAccess access_;
    const std::shared_ptr<MeshSample> sample_ = std::make_shared<MeshSample>();
    const std::shared_ptr<std::atomic<bool>> cancelled_ =
        std::make_shared<std::atomic<bool>>(false);  // shared with readers, which live longer
    std::atomic<bool> done_ = false;
    mutable std::mutex mutex_;
    Progress progress_;                          // guarded by mutex_
    std::optional<Result<OpenedScene>> opened_;  // belongs to the thread until done_
    std::thread thread_;
};

}  // namespace vcp
