// glTF files written by hand for the tests of their reader.
#pragma once

#include <cstdint>
#include <cstring>
#include <initializer_list>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>

namespace vcp::test {

inline std::string base64(std::string_view bytes) {
    constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string text;
    for (size_t i = 0; i < bytes.size(); i += 3) {
        uint32_t bits = 0;
        for (size_t j = 0; j < 3; ++j) bits = bits << 8 | (i + j < bytes.size() ? uint8_t(bytes[i + j]) : 0);
        for (size_t j = 0; j < 4; ++j) text += i + j > bytes.size() ? '=' : kDigits[bits >> (18 - 6 * j) & 63];
    }
    return text;
}

template <class T>
std::string bytesOf(std::initializer_list<T> values) {
    std::string bytes(values.size() * sizeof(T), '\0');
    std::memcpy(bytes.data(), std::data(values), bytes.size());
    return bytes;
}

/// A document put together piece by piece: every accessor has a view of its own.
struct GltfFile {
    std::string buffer;
    std::vector<std::string> views, accessors;
    std::string meshes, nodes = R"({"mesh":0})", scene = "0", more;

    /// Returns the number of the view.
    size_t view(const std::string& bytes, const std::string& extra = "") {
        while (buffer.size() % 4) buffer += '\0';
        views.push_back(
            fmt::format(R"({{"buffer":0,"byteOffset":{},"byteLength":{}{}}})", buffer.size(), bytes.size(), extra));
        buffer += bytes;
        return views.size() - 1;
    }
    size_t accessor(const std::string& bytes, int component, const char* type, size_t count,
                    const std::string& extra = "") {
        const size_t number = view(bytes);
        accessors.push_back(fmt::format(R"({{"bufferView":{},"componentType":{},"type":"{}","count":{}{}}})", number,
                                        component, type, count, extra));
        return accessors.size() - 1;
    }
    size_t floats(std::initializer_list<float> values, const char* type, size_t count) {
        return accessor(bytesOf(values), 5126, type, count);
    }

    [[nodiscard]] std::string json(const std::string& uri) const {
        return fmt::format(
            R"({{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[{}]}}],"nodes":[{}],"meshes":[{}],"accessors":[{}],"bufferViews":[{}],"buffers":[{{"byteLength":{}{}}}]{}}})",
            scene, nodes, meshes, fmt::join(accessors, ","), fmt::join(views, ","), buffer.size(),
            uri.empty() ? "" : R"(,"uri":")" + uri + '"', more);
    }
    [[nodiscard]] std::string embedded() const {
        return json("data:application/octet-stream;base64," + base64(buffer));
    }
    [[nodiscard]] std::string glb() const {
        std::string text = json(""), binary = buffer;
        while (text.size() % 4) text += ' ';
        while (binary.size() % 4) binary += '\0';
        const auto word = [](size_t value) { return bytesOf({uint32_t(value)}); };
        return "glTF" + word(2) + word(28 + text.size() + binary.size()) + word(text.size()) + "JSON" + text +
               word(binary.size()) + std::string("BIN\0", 4) + binary;
    }
};

/// One triangle (0,0,0) (1,0,0) (0,1,0), indexed.
inline GltfFile oneTriangle() {
    GltfFile file;
    file.floats({0, 0, 0, 1, 0, 0, 0, 1, 0}, "VEC3", 3);
    file.accessor(bytesOf<uint16_t>({0, 1, 2}), 5123, "SCALAR", 3);
    file.meshes = R"({"primitives":[{"attributes":{"POSITION":0},"indices":1}]})";
    return file;
}

}  // namespace vcp::test
