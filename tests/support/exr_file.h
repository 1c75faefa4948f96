// EXR pictures for tests, of what the specification allows.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

namespace vcp::test {

using Bytes = std::vector<std::byte>;

/// An uncompressed EXR of scan lines as its specification has it; a channel is a name and a value for each texel,
/// floats.
class ExrFile {
public:
    ExrFile(int left, int top, int width, int height) : window_{left, top, left + width - 1, top + height - 1} {}

    ExrFile& channel(std::string name, std::vector<float> values, bool isHalf = false) {
        channels_.push_back({std::move(name), std::move(values), isHalf});
        return *this;
    }
    ExrFile& with(std::string name, std::string type, size_t size) {
        further_.push_back({std::move(name), std::move(type), size});
        return *this;
    }
    [[nodiscard]] Bytes bytes() const {
        Bytes out;
        put<uint32_t>(out, 20000630), put<uint32_t>(out, 2);
        for (const Further& f : further_) attribute(out, f.name, f.type, Bytes(f.size, std::byte{0x7f}));
        Bytes list;
        for (const Channel& c : channels_) {
            text(list, c.name);
            for (const int32_t value : {c.isHalf ? 1 : 2, 0, 1, 1}) put(list, value);
        }
        list.push_back({});
        attribute(out, "channels", "chlist", list);
        attribute(out, "compression", "compression", Bytes(1));
        Bytes box;
        for (const int32_t value : window_) put(box, value);
        attribute(out, "dataWindow", "box2i", box), attribute(out, "displayWindow", "box2i", box);
        attribute(out, "lineOrder", "lineOrder", Bytes(1));
        attribute(out, "pixelAspectRatio", "float", real(1));
        Bytes centre = real(0);
        centre.resize(8);
        attribute(out, "screenWindowCenter", "v2f", centre), attribute(out, "screenWindowWidth", "float", real(1));
        out.push_back({});
        const int width = window_[2] - window_[0] + 1, height = window_[3] - window_[1] + 1;
        uint64_t line = 8;
        for (const Channel& c : channels_) line += uint64_t(width) * (c.isHalf ? 2 : 4);
        const uint64_t first = out.size() + 8 * uint64_t(height);
        for (int y = 0; y < height; ++y) put<uint64_t>(out, first + line * uint64_t(y));
        for (int y = 0; y < height; ++y) {
            put<int32_t>(out, window_[1] + y), put<uint32_t>(out, uint32_t(line - 8));
            for (const Channel& c : channels_)
                for (int x = 0; x < width; ++x) {
                    const float value = c.values[size_t(y * width + x)];
                    if (c.isHalf)
                        put<uint16_t>(out, halfOf(value));
                    else
                        put(out, value);
                }
        }
        return out;
    }

private:
    struct Channel {
        std::string name;
        std::vector<float> values;
        bool isHalf;
    };
    struct Further {
        std::string name, type;
        size_t size;
    };
    template <class T>
    static void put(Bytes& out, T value) {
        const auto* from = reinterpret_cast<const std::byte*>(&value);
        for (size_t i = 0; i < sizeof value; ++i) out.push_back(from[i]);
    }
    static void text(Bytes& out, const std::string& text) {
        for (const char c : text) out.push_back(std::byte(c));
        out.push_back({});
    }
    static Bytes real(float value) {
        Bytes bytes;
        put(bytes, value);
        return bytes;
    }
    static void attribute(Bytes& out, const std::string& name, const std::string& type, const Bytes& value) {
        text(out, name), text(out, type);
        put<uint32_t>(out, uint32_t(value.size()));
        for (const std::byte byte : value) out.push_back(byte);
    }
    /// Returns the bits of a half; `value` must be one that a half holds.
    static uint16_t halfOf(float value) {
        uint32_t bits = 0;
        std::memcpy(&bits, &value, sizeof bits);
        const uint32_t sign = bits >> 16 & 0x8000;
        if ((bits & 0x7fffffff) == 0) return uint16_t(sign);
        return uint16_t(sign | ((bits >> 23 & 0xff) - 112) << 10 | (bits >> 13 & 0x3ff));
    }

    std::array<int32_t, 4> window_;
    std::vector<Channel> channels_;
    std::vector<Further> further_;
};

}  // namespace vcp::test
