// A folder of a test's own, and meshes to put into it.
#pragma once

#include <filesystem>
#include <string>

namespace vcp {

/// An empty folder, removed with what is in it.
class TestFolder {
public:
    explicit TestFolder(const std::string& name);
    ~TestFolder();
    TestFolder(const TestFolder&) = delete;
    TestFolder& operator=(const TestFolder&) = delete;

    [[nodiscard]] std::filesystem::path operator/(const std::string& file) const { return path_ / file; }
    [[nodiscard]] const std::filesystem::path& path() const { return path_; }

private:
    std::filesystem::path path_;
};

/// A closed, bumpy ball of radius about 1 as ASCII PLY with vertex colours: 2 * rings * sectors triangles less
/// those at the poles.
void writeBall(const std::filesystem::path& path, int rings, int sectors);

std::string contentOf(const std::filesystem::path& path);

}  // namespace vcp
