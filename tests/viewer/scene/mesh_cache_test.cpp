// The cache of built meshes, with a builder that only pretends.
#include "viewer/scene/mesh_cache.h"

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <iterator>

#include <gtest/gtest.h>
#include <unistd.h>

namespace vcp {
namespace {

namespace fs = std::filesystem;

class MeshCacheTest : public testing::Test {
protected:
    void SetUp() override {
        folder_ = fs::temp_directory_path() / ("vcp_cache_test." + std::to_string(getpid()));
        fs::remove_all(folder_);
        fs::create_directories(folder_);
        mesh_ = folder_ / "mesh.ply";
        std::ofstream(mesh_) << "not looked at";
        options_.inputs = {mesh_};
    }
    void TearDown() override { fs::remove_all(folder_); }

    MeshCache::Builder failing() {
        return [this](const BuildOptions& options) -> Result<BuildReport> {
            ++builds_;
            built_ = options.output;
            return Error{.code = ErrorCode::InvalidInput, .message = "wrong", .file = "mesh.ply"};
        };
    }
    // Writes bytes that are no dataset: the cache must not take them for one the next time.
    MeshCache::Builder writing(size_t bytes) {
        return [this, bytes](const BuildOptions& options) -> Result<BuildReport> {
            ++builds_;
            std::ofstream(options.output) << std::string(bytes, 'x');
            return BuildReport{};
        };
    }
    [[nodiscard]] fs::path cacheFolder() const { return folder_ / "cache"; }
    static void age(const fs::path& file, int hours) {
        fs::last_write_time(file, fs::file_time_type::clock::now() - std::chrono::hours(hours));
    }

    fs::path folder_, mesh_, built_;
    BuildOptions options_;
    int builds_ = 0;
};

TEST_F(MeshCacheTest, NameDependsOnMeshAndOptionsAlone) {
    const MeshCache cache(cacheFolder());
    const fs::path first = *cache.pathFor(options_);
    EXPECT_EQ(*cache.pathFor(options_), first);

    BuildOptions other = options_;
    other.threads = 7;  // does not change the bytes
    other.output = "elsewhere.vcp";
    EXPECT_EQ(*cache.pathFor(other), first);
    other.cell = 0.5;
    EXPECT_NE(*cache.pathFor(other), first);
    other = options_;
    other.error = 0.5;
    EXPECT_NE(*cache.pathFor(other), first);
    const fs::path absolute = *cache.pathFor(other);
    other.errorIsRelative = true;
    EXPECT_NE(*cache.pathFor(other), absolute);
    other = options_;
    other.colour = ColourChoice::None;
    EXPECT_NE(*cache.pathFor(other), first);
    other = options_;
    other.format = "obj";
    EXPECT_NE(*cache.pathFor(other), first);

    age(mesh_, 1);
    EXPECT_NE(*cache.pathFor(options_), first) << "a mesh that was written again";
    std::ofstream(mesh_) << "longer than it was before";
    EXPECT_NE(*cache.pathFor(options_), first);
}

TEST_F(MeshCacheTest, TheSameMeshByAnotherPathIsTheSame) {
    const MeshCache cache(cacheFolder());
    BuildOptions other = options_;
    other.inputs = {folder_ / "." / "mesh.ply"};
    EXPECT_EQ(*cache.pathFor(other), *cache.pathFor(options_));
}

TEST_F(MeshCacheTest, AMeshWithItsTimeSetBackIsAnother) {
    const MeshCache cache(cacheFolder());
    const auto time = fs::last_write_time(mesh_);
    const fs::path first = *cache.pathFor(options_);
    std::ofstream(mesh_) << "NOT LOOKED AT";  // as long as before
    ASSERT_EQ(fs::file_size(mesh_), std::string("not looked at").size());
    fs::last_write_time(mesh_, time);
    EXPECT_NE(*cache.pathFor(options_), first);
}

TEST_F(MeshCacheTest, AMeshThatChangesWhileItIsReadIsNotKept) {
    const auto path =
        MeshCache(cacheFolder()).dataset(options_, [&](const BuildOptions& options) -> Result<BuildReport> {
            std::ofstream(options.output) << "of half of it";
            std::ofstream(mesh_, std::ios::app) << "more";
            return BuildReport{};
        });
    ASSERT_FALSE(path);
    EXPECT_EQ(path.error().file, mesh_.string());
    EXPECT_NE(path.error().message.find("changed"), std::string::npos) << path.error().message;
    EXPECT_TRUE(fs::is_empty(cacheFolder()));
}

/// With buildOctree: a triangle whose colours lie beside it.
class MeshCacheSideFilesTest : public MeshCacheTest {
protected:
    [[nodiscard]] fs::path build() {
        const auto path = MeshCache(cacheFolder()).dataset(options_, [&](const BuildOptions& options) {
            ++builds_;
            return buildOctree(options);
        });
        EXPECT_TRUE(path) << path.error().line();
        return path ? *path : fs::path();
    }
    static void write(const fs::path& path, const std::string& text) { std::ofstream(path, std::ios::binary) << text; }
    static std::string content(const fs::path& path) {
        std::ifstream file(path, std::ios::binary);
        return {std::istreambuf_iterator<char>(file), {}};
    }
    /// Built anew since `change`, to other bytes; not again without one.
    void expectStale(const std::function<void()>& change) {
        const std::string before = content(build());
        const int builds = builds_;
        EXPECT_EQ(content(build()), before);
        EXPECT_EQ(builds_, builds);
        change();
        EXPECT_NE(content(build()), before);
        EXPECT_EQ(builds_, builds + 1);
        static_cast<void>(build());
        EXPECT_EQ(builds_, builds + 1);
    }
};

TEST_F(MeshCacheSideFilesTest, MaterialsOfAnObj) {
    mesh_ = folder_ / "mesh.obj";
    options_.inputs = {mesh_};
    write(mesh_,
          "mtllib colours.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nvt 0 0\nusemtl a\nf 1/1 2/1 3/1\nusemtl b\nf 2/1 "
          "4/1 3/1\n");
    const fs::path mtl = folder_ / "colours.mtl";
    expectStale([&] { write(mtl, "newmtl a\nKd 1 0 0\nnewmtl b\nKd 0 1 0\n"); });  // which was missing
    expectStale([&] { write(mtl, "newmtl a\nKd 0 0 1\nnewmtl b\nKd 0 1 0\n"); });
    const int builds = builds_;
    fs::remove(mtl);
    static_cast<void>(build());
    EXPECT_EQ(builds_, builds) << "what it was at first is still there";
}

TEST_F(MeshCacheSideFilesTest, BuffersOfAGltf) {
    mesh_ = folder_ / "mesh.gltf";
    options_.inputs = {mesh_};
    write(mesh_, R"({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}], "buffers": [{"uri": "mesh.bin", "byteLength": 36}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [9, 9, 9]}]})");
    const auto corners = [&](float x) {
        const float values[9] = {0, 0, 0, x, 0, 0, 0, 1, 0};
        write(folder_ / "mesh.bin", std::string(reinterpret_cast<const char*>(values), sizeof(values)));
    };
    corners(1);
    expectStale([&] { corners(2); });
}

TEST_F(MeshCacheSideFilesTest, ASideFileThatChangesWhileItIsReadIsNotKept) {
    mesh_ = folder_ / "mesh.obj";
    options_.inputs = {mesh_};
    write(mesh_, "mtllib colours.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    const auto path = MeshCache(cacheFolder()).dataset(options_, [&](const BuildOptions& options) {
        auto report = buildOctree(options);
        write(folder_ / "colours.mtl", "newmtl a\n");
        return report;
    });
    ASSERT_FALSE(path);
    EXPECT_EQ(path.error().file, (folder_ / "colours.mtl").string());
    EXPECT_TRUE(fs::is_empty(cacheFolder()));
}

TEST_F(MeshCacheSideFilesTest, ListsGoWithTheirDatasets) {
    mesh_ = folder_ / "mesh.obj";
    options_.inputs = {mesh_};
    write(mesh_, "mtllib colours.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    const fs::path dataset = build();
    const auto lists = [&] {
        return std::count_if(fs::directory_iterator(cacheFolder()), fs::directory_iterator(),
                             [](const fs::directory_entry& each) { return each.path().extension() == ".files"; });
    };
    EXPECT_EQ(lists(), 1);
    MeshCache(cacheFolder(), 1).trim(dataset);
    EXPECT_EQ(lists(), 1);
    MeshCache(cacheFolder(), 1).trim({});
    EXPECT_FALSE(fs::exists(dataset));
    write(cacheFolder() / "00000000000000ff.vcp", "later");
    MeshCache(cacheFolder()).trim({});
    EXPECT_EQ(lists(), 0);
}

TEST_F(MeshCacheTest, MissingMeshIsNamed) {
    options_.inputs = {folder_ / "missing.ply"};
    const auto path = MeshCache(cacheFolder()).dataset(options_, failing());
    ASSERT_FALSE(path);
    EXPECT_EQ(path.error().file, (folder_ / "missing.ply").string());
    EXPECT_EQ(builds_, 0);
    EXPECT_FALSE(fs::exists(cacheFolder()));
}

TEST_F(MeshCacheTest, FailedBuildLeavesNothing) {
    const auto path = MeshCache(cacheFolder()).dataset(options_, failing());
    ASSERT_FALSE(path);
    EXPECT_EQ(path.error().message, "wrong");
    EXPECT_TRUE(fs::is_empty(cacheFolder()));
}

TEST_F(MeshCacheTest, BuildsBesideAndRenames) {
    const auto path = MeshCache(cacheFolder()).dataset(options_, writing(10));
    ASSERT_TRUE(path) << path.error().line();
    EXPECT_TRUE(fs::exists(*path));
    EXPECT_EQ(std::distance(fs::directory_iterator(cacheFolder()), fs::directory_iterator()), 1);
}

TEST_F(MeshCacheTest, WhatIsNotWholeIsBuiltAgain) {
    MeshCache cache(cacheFolder());
    ASSERT_TRUE(cache.dataset(options_, writing(10)));
    ASSERT_TRUE(cache.dataset(options_, writing(10)));
    EXPECT_EQ(builds_, 2);
}

TEST_F(MeshCacheTest, UnwritableFolderIsNamed) {
    std::ofstream(folder_ / "file") << "in the way";
    const auto path = MeshCache(folder_ / "file" / "cache").dataset(options_, failing());
    ASSERT_FALSE(path);
    EXPECT_EQ(path.error().code, ErrorCode::Io);
    EXPECT_NE(path.error().line().find("file/cache"), std::string::npos);
    EXPECT_NE(path.error().line().find("XDG_CACHE_HOME"), std::string::npos);
}

TEST_F(MeshCacheTest, OldestGoFirstAndForeignFilesStay) {
    fs::create_directories(cacheFolder());
    const fs::path a = cacheFolder() / "00000000000000aa.vcp", b = cacheFolder() / "00000000000000bb.vcp";
    const fs::path foreign = cacheFolder() / "mine.vcp";
    for (const fs::path& file : {a, b, foreign}) std::ofstream(file) << std::string(100, 'x');
    age(a, 2);
    age(b, 3);
    age(foreign, 9);
    const auto path = MeshCache(cacheFolder(), 250).dataset(options_, writing(100));
    ASSERT_TRUE(path) << path.error().line();
    EXPECT_TRUE(fs::exists(a));
    EXPECT_FALSE(fs::exists(b)) << "used least recently";
    EXPECT_TRUE(fs::exists(foreign));
    EXPECT_TRUE(fs::exists(*path));
}

TEST_F(MeshCacheTest, TheNewOneStaysEvenBeyondTheLimit) {
    const auto path = MeshCache(cacheFolder(), 1).dataset(options_, writing(100));
    ASSERT_TRUE(path);
    EXPECT_TRUE(fs::exists(*path));
}

TEST_F(MeshCacheTest, LeftoversOfDeadBuildsGo) {
    fs::create_directories(cacheFolder());
    const fs::path dead = cacheFolder() / "00000000000000aa.17.building.vcp.partial";
    const fs::path alive = cacheFolder() / "00000000000000aa.18.building.vcp.partial";
    for (const fs::path& file : {dead, alive}) std::ofstream(file) << "x";
    age(dead, 48);
    MeshCache(cacheFolder()).trim({});
    EXPECT_FALSE(fs::exists(dead));
    EXPECT_TRUE(fs::exists(alive));
}

TEST_F(MeshCacheTest, FolderFollowsTheEnvironment) {
    const std::string before = std::getenv("XDG_CACHE_HOME") ? std::getenv("XDG_CACHE_HOME") : "";
    const std::string home = std::getenv("HOME") ? std::getenv("HOME") : "";
    setenv("XDG_CACHE_HOME", "/somewhere", 1);
    EXPECT_EQ(*defaultCacheFolder(), "/somewhere/vcp");
    setenv("XDG_CACHE_HOME", "relative", 1);  // the specification says to ignore it
    setenv("HOME", "/elsewhere", 1);
    EXPECT_EQ(*defaultCacheFolder(), "/elsewhere/.cache/vcp");
    unsetenv("XDG_CACHE_HOME");
    unsetenv("HOME");
    EXPECT_FALSE(defaultCacheFolder());
    if (!before.empty()) setenv("XDG_CACHE_HOME", before.c_str(), 1);
    if (!home.empty()) setenv("HOME", home.c_str(), 1);
}

TEST_F(MeshCacheTest, DatasetsAreKnownByTheirStart) {
    const fs::path file = folder_ / "anything.bin";
    std::ofstream(file, std::ios::binary) << std::string("VCP\r\n\x1a\n\0", 8);
    EXPECT_TRUE(looksLikeDataset(file));
    EXPECT_FALSE(looksLikeDataset(mesh_));
    EXPECT_TRUE(looksLikeDataset("missing.vcp"));
    EXPECT_FALSE(looksLikeDataset(folder_));
}

}  // namespace
}  // namespace vcp
