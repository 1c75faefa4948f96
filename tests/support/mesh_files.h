// Files of meshes, for builds to read.
#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "builder/measure/indexed_mesh.h"

namespace vcp::test {

/// Little endian binary PLY in doubles, so that nothing is rounded.
inline void writePly(const IndexedMesh& mesh, const std::filesystem::path& path,
                     const std::vector<uint32_t>& colours = {}) {
    std::ofstream out(path, std::ios::binary);
    out << "ply\nformat binary_little_endian 1.0\nelement vertex " << mesh.positions.size()
        << "\nproperty double x\nproperty double y\nproperty double z\n";
    if (!colours.empty())
        out << "property uchar red\nproperty uchar green\nproperty uchar blue\nproperty uchar alpha\n";
    out << "element face " << mesh.triangles.size() << "\nproperty list uchar uint vertex_indices\nend_header\n";
    for (size_t v = 0; v < mesh.positions.size(); ++v) {
        out.write(reinterpret_cast<const char*>(&mesh.positions[v]), 24);
        if (!colours.empty()) out.write(reinterpret_cast<const char*>(&colours[v]), 4);
    }
    for (const auto& t : mesh.triangles) {
        out.put(3);
        out.write(reinterpret_cast<const char*>(t.data()), 12);
    }
}

/// Binary STL: a soup of floats.
inline void writeStl(const IndexedMesh& mesh, const std::filesystem::path& path) {
    std::ofstream out(path, std::ios::binary);
    const std::string header(80, ' ');
    out << header;
    const auto count = uint32_t(mesh.triangles.size());
    out.write(reinterpret_cast<const char*>(&count), 4);
    for (size_t k = 0; k < mesh.triangles.size(); ++k) {
        float values[12] = {};
        const auto t = mesh.corners(k);
        for (int i = 0; i < 3; ++i)
            for (int a = 0; a < 3; ++a) values[3 + 3 * i + a] = float(t[i][a]);
        out.write(reinterpret_cast<const char*>(values), 48);
        out.write("\0\0", 2);
    }
}

}  // namespace vcp::test
