#include "viewer/bench/picture/colour_models.h"

#include <cmath>
#include <numbers>
#include <string>

#include <fmt/format.h>

#include "builder/stream/colour_encoding.h"
#include "octree/io/output_file.h"
#include "render/picture.h"

namespace vcp {

namespace {

constexpr const char* kPictureName = "colour_models.png";
constexpr const char* kMaterialName = "colour_models.mtl";
constexpr uint32_t kTexels = 512;

/// Red is a slope, green a chequerboard, blue rings that grow finer to the corner opposite of (0, 0): a zone plate.
Picture patternPicture() {
    Picture picture{kTexels, kTexels, {}};
    picture.rgba.reserve(size_t{4} * kTexels * kTexels);
    for (uint32_t y = 0; y < kTexels; ++y)
        for (uint32_t x = 0; x < kTexels; ++x) {
            const double u = (x + 0.5) / kTexels, v = (y + 0.5) / kTexels;
            const double rings = 0.5 + 0.4 * std::cos(60 * std::numbers::pi * (u * u + v * v));
            const bool isDark = ((x / 32) + (y / 32)) % 2 == 0;
            picture.rgba.insert(picture.rgba.end(),
                                {toByte(0.2 + 0.6 * u), toByte(isDark ? 0.25 : 0.7), toByte(rings), uint8_t{255}});
        }
    return picture;
}

/// Returns an OBJ of `quads` x `quads` squares over -1 to 1, `height` times waves high.
std::string gridObj(int quads, double height) {
    std::string text = fmt::format("mtllib {}\nusemtl pattern\n", kMaterialName);
    for (int j = 0; j <= quads; ++j)
        for (int i = 0; i <= quads; ++i) {
            const double u = double(i) / quads, v = double(j) / quads;
            text += fmt::format("v {:.9g} {:.9g} {:.9g}\nvt {:.9g} {:.9g}\n", 2 * u - 1, 2 * v - 1,
                                height * std::sin(9 * u) * std::sin(7 * v), u, v);
        }
    for (int j = 0; j < quads; ++j)
        for (int i = 0; i < quads; ++i) {
            const int a = j * (quads + 1) + i + 1, b = a + 1, c = b + quads + 1, d = a + quads + 1;
            text += fmt::format("f {0}/{0} {1}/{1} {2}/{2}\nf {0}/{0} {2}/{2} {3}/{3}\n", a, b, c, d);
        }
    return text;
}

}  // namespace

Result<std::vector<std::filesystem::path>> writeColourModels(const std::filesystem::path& folder) {
    VCP_TRY(writePng(patternPicture(), folder / kPictureName));
    VCP_TRY(writeFile(folder / kMaterialName, OutputKind::Text,
                      fmt::format("newmtl pattern\nKd 1 1 1\nmap_Kd {}\n", kPictureName)));
    const std::vector<std::filesystem::path> files{folder / "wall.obj", folder / "relief.obj"};
    VCP_TRY(writeFile(files[0], OutputKind::Obj, gridObj(1, 0)));
    VCP_TRY(writeFile(files[1], OutputKind::Obj, gridObj(96, 0.1)));
    return files;
}

}  // namespace vcp
