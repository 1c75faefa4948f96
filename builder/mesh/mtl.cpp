#include "builder/mesh/mtl.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "builder/stream/byte_source.h"
#include "builder/stream/colour_encoding.h"
#include "builder/stream/data_uri.h"
#include "builder/stream/number_text.h"

namespace vcp {
namespace {

constexpr uint64_t kMostBytes = 16u << 20;
constexpr size_t kMostMaterials = 65536;

// Takes words off the front of a line.
class Words {
public:
    explicit Words(std::string_view line) : p_(line.data()), end_(line.data() + line.size()) {}

    [[nodiscard]] std::string_view peek() {
        p_ = skipSpaces(p_, end_);
        return {p_, size_t(wordEnd(p_, end_) - p_)};
    }
    std::string_view take() {
        const std::string_view word = peek();
        p_ += word.size();
        return word;
    }
    bool takeNumber(double& value) {
        const std::string_view word = peek();
        const char* const end = word.data() + word.size();
        if (word.empty() || parseReal(word.data(), end, value) != end) return false;
        p_ += word.size();
        return true;
    }
    /// Returns what is left, without the white space around it: names may hold spaces.
    [[nodiscard]] std::string rest() {
        static_cast<void>(peek());
        const char* end = end_;
        while (end != p_ && isSpace(end[-1])) --end;
        return {p_, end};
    }

private:
    const char* p_;
    const char* end_;
};

/// Where an image lies: texture coordinates of the file are scaled, then moved.
struct MapPlace {
    glm::vec2 uvScale{1}, uvOffset{0};

    bool operator==(const MapPlace&) const = default;
};

class MtlReader {
public:
    MtlReader(const std::filesystem::path& path, bool allowOutside, std::vector<MtlMaterial>& materials,
              std::vector<std::string>& warnings, std::vector<SideFile>& sideFiles)
        : path_(path), allowOutside_(allowOutside), materials_(materials), warnings_(warnings), sideFiles_(sideFiles) {}

    void read() {
        sideFiles_.emplace_back(path_);
        // Opening a named pipe would wait for its writer.
        std::error_code ignored;
        if (!std::filesystem::is_regular_file(path_, ignored)) return warn("no such file; its colours are left out");
        auto source = ByteSource::open(path_);
        if (!source) return warn(source.error().message + "; its colours are left out");
        if (source->size() > kMostBytes) return warn("is larger than 16 MiB; its colours are left out");
        while (true) {
            const auto line = source->line(kLineLimit);
            if (!line) return warn(line.error().message + "; the rest of it is left out");
            if (!*line) break;
            readLine(**line);
        }
        finish();
    }

private:
    void warn(const std::string& what) { warnings_.push_back(path_.string() + ": " + what); }

    void readLine(std::string_view line) {
        Words words(line);
        const std::string_view keyword = words.take();
        if (keyword == "newmtl") {
            finish();
            current_ = {};
            current_.material.name = words.rest();
            current_.material.channels.metalness = 0;
            open_ = true;
        } else if (keyword == "Kd") {
            std::array<double, 3> rgb{};
            for (double& channel : rgb)
                if (!words.takeNumber(channel)) return;
            current_.material.factor = packRgba({toByte(rgb[0]), toByte(rgb[1]), toByte(rgb[2]), 255});
        } else if (keyword == "map_Kd") {
            readImage(words, current_.material.image, current_.uvScale, current_.uvOffset);
        } else if (keyword == "map_d") {
            MaskRule& mask = current_.material.mask;
            readImage(words, mask.image, mask.uvScale, mask.uvOffset);
        } else {
            readChannel(keyword, words);
        }
    }

    /// Reads what a material has beside its colour.
    void readChannel(std::string_view keyword, Words& words) {
        MaterialChannels& channels = current_.material.channels;
        const auto take = [&](float& number) {
            double value = 0;
            if (words.takeNumber(value)) number = float(std::clamp(value, 0.0, 1.0));
        };
        const auto image = [&](ImageSource& source, MapPlace& place) {
            MapPlace read;
            readImage(words, source, read.uvScale, read.uvOffset);
            place = read;
        };
        if (keyword == "norm")
            image(channels.normals, normals_);
        else if (keyword == "map_Pr")
            image(channels.surface, surface_);
        else if (keyword == "map_Ke")
            image(channels.emission, emission_);
        else if (keyword == "map_Pm")
            warn("images of metalness alone are not read; it is left out");
        else if (keyword == "Pr")
            take(channels.roughness);
        else if (keyword == "Pm")
            take(channels.metalness);
        else if (keyword == "Ke")
            for (int i = 0; i < 3; ++i) take(channels.emissionFactor[i]);
    }

    /// Leaves out channels that lie elsewhere than the colour, and those of materials without images.
    void settleChannels() {
        Material& material = current_.material;
        MaterialChannels& channels = material.channels;
        std::optional<MapPlace> place;
        if (material.image.exists()) place = MapPlace{current_.uvScale, current_.uvOffset};
        const auto fits = [&](const ImageSource& image, const MapPlace& of) {
            if (!image.exists()) return true;
            if (!place) place = of;
            if (of == *place) return true;
            warn(fmt::format("the image {} lies elsewhere than the colour of its material; it is left out",
                             shown(image.path.filename().string())));
            return false;
        };
        if (!fits(channels.normals, normals_)) channels.forgetNormals();
        if (!fits(channels.surface, surface_)) channels.forgetSurface();
        if (!fits(channels.emission, emission_)) channels.forgetEmission();
        // The image of roughness is grey, and its blue would be taken for metalness.
        if (channels.surface.exists() && channels.metalness > 0) {
            warn(fmt::format("the material {} has metalness beside an image of roughness; it is left out",
                             shown(material.name)));
            channels.metalness = 0;
        }
        if (!place) channels = {};
        if (!place || material.image.exists()) return;
        current_.uvScale = place->uvScale;
        current_.uvOffset = place->uvOffset;
    }

    void readImage(Words& words, ImageSource& image, glm::vec2& uvScale, glm::vec2& uvOffset) {
        while (words.peek().starts_with('-')) readOption(words, uvScale, uvOffset);
        const std::string name = words.rest();
        if (name.empty()) return;
        const auto path = nameBelow(path_.parent_path(), name, allowOutside_);
        if (path) sideFiles_.emplace_back(*path);
        std::error_code ignored;
        if (!path)
            warn(fmt::format("the image {} lies outside its folder, which was not allowed; it is left out",
                             shown(name)));
        else if (!std::filesystem::is_regular_file(*path, ignored))
            warn(fmt::format("the image {} is missing; it is left out", shown(name)));
        else
            image.path = *path;
    }

    void readOption(Words& words, glm::vec2& uvScale, glm::vec2& uvOffset) {
        const std::string_view option = words.take();
        if (option == "-o" || option == "-s" || option == "-t") {
            std::array<double, 3> numbers{0, option == "-s" ? 1.0 : 0.0, 0};
            for (double& number : numbers)
                if (!words.takeNumber(number)) break;
            const glm::vec2 pair{float(numbers[0]), float(numbers[1])};
            if (!std::isfinite(pair.x) || !std::isfinite(pair.y)) return;
            if (option == "-o") uvOffset = pair;
            if (option == "-s") uvScale = pair;
        } else if (option == "-mm") {
            words.take();
            words.take();
        } else {
            const std::string_view value = words.take();
            if (option == "-clamp" && value == "on") current_.material.wrapU = current_.material.wrapV = Wrap::Clamp;
            double scale = 1;
            if (option == "-bm" && Words(value).takeNumber(scale))
                current_.material.channels.normalScale = float(std::clamp(scale, -1000.0, 1000.0));
        }
    }

    void finish() {
        if (!open_) return;
        open_ = false;
        if (materials_.size() == kMostMaterials) return warn("more than 65536 materials; the rest is left out");
        if (current_.material.image.exists()) current_.material.factor = kWhite;
        settleMask();
        settleChannels();
        materials_.push_back(std::move(current_));
    }

    /// Brings the mask's texture coordinates from the file's to those of the material's triangles, v growing downwards.
    void settleMask() {
        Material& material = current_.material;
        MaskRule& mask = material.mask;
        mask.sparesGlass = true;
        mask.mayBeGrey = material.ignoresAlpha = mask.image.exists();
        if (!mask.image.exists()) {
            mask = {.image = material.image, .sparesGlass = true};
            return;
        }
        if (!material.image.exists()) {
            current_.uvScale = std::exchange(mask.uvScale, glm::vec2(1));
            current_.uvOffset = std::exchange(mask.uvOffset, glm::vec2(0));
            return;
        }
        const glm::vec2 scale = mask.uvScale / current_.uvScale, offset = mask.uvOffset - current_.uvOffset * scale;
        mask.uvScale = scale;
        mask.uvOffset = {offset.x, 1 - scale.y - offset.y};
    }

    std::filesystem::path path_;
    bool allowOutside_;
    std::vector<MtlMaterial>& materials_;
    std::vector<std::string>& warnings_;
    std::vector<SideFile>& sideFiles_;
    MtlMaterial current_;
    MapPlace normals_, surface_, emission_;  // of the current material's channels, where they have images
    bool open_ = false;
};

}  // namespace

void readMtl(const std::filesystem::path& path, bool allowOutside, std::vector<MtlMaterial>& materials,
             std::vector<std::string>& warnings, std::vector<SideFile>& sideFiles) {
    MtlReader(path, allowOutside, materials, warnings, sideFiles).read();
}

}  // namespace vcp
