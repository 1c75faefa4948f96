#include "tests/support/test_folder.h"

#include <cmath>
#include <fstream>
#include <iterator>
#include <numbers>

#include <unistd.h>

namespace vcp {

namespace fs = std::filesystem;

TestFolder::TestFolder(const std::string& name)
    : path_(fs::temp_directory_path() / (name + "." + std::to_string(getpid()))) {
    fs::remove_all(path_);
    fs::create_directories(path_);
}

TestFolder::~TestFolder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
}

void writeBall(const fs::path& path, int rings, int sectors) {
    std::ofstream file(path);
    file << "ply\nformat ascii 1.0\nelement vertex " << (rings - 1) * sectors + 2
         << "\nproperty float x\nproperty float y\nproperty float z\n"
            "property uchar red\nproperty uchar green\nproperty uchar blue\nelement face "
         << 2 * (rings - 1) * sectors << "\nproperty list uchar int vertex_indices\nend_header\n";
    const auto vertex = [&](double polar, double around) {
        const double radius = 1 + 0.05 * std::sin(6 * polar) * std::sin(5 * around);
        file << radius * std::sin(polar) * std::cos(around) << ' ' << radius * std::cos(polar) << ' '
             << radius * std::sin(polar) * std::sin(around) << ' ' << int(127 + 120 * std::cos(around)) << ' '
             << int(127 + 120 * std::sin(around)) << " 90\n";
    };
    vertex(0, 0);
    for (int ring = 1; ring < rings; ++ring)
        for (int sector = 0; sector < sectors; ++sector)
            vertex(std::numbers::pi * ring / rings, 2 * std::numbers::pi * sector / sectors);
    vertex(std::numbers::pi, 0);

    const int last = (rings - 1) * sectors + 1;
    const auto at = [&](int ring, int sector) { return 1 + (ring - 1) * sectors + sector % sectors; };
    for (int sector = 0; sector < sectors; ++sector) {
        file << "3 0 " << at(1, sector + 1) << ' ' << at(1, sector) << '\n';
        file << "3 " << last << ' ' << at(rings - 1, sector) << ' ' << at(rings - 1, sector + 1) << '\n';
        for (int ring = 1; ring + 1 < rings; ++ring) {
            file << "3 " << at(ring, sector) << ' ' << at(ring, sector + 1) << ' ' << at(ring + 1, sector) << '\n';
            file << "3 " << at(ring, sector + 1) << ' ' << at(ring + 1, sector + 1) << ' ' << at(ring + 1, sector)
                 << '\n';
        }
    }
}

std::string contentOf(const fs::path& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
}

}  // namespace vcp
