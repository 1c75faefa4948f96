#include "builder/mesh/gltf/gltf_meshopt.h"

#include <algorithm>
#include <array>
#include <set>

#include <fmt/format.h>
#include <meshoptimizer.h>

namespace vcp {
namespace {

using Mode = GltfMeshopt::Mode;
using Filter = GltfMeshopt::Filter;

constexpr uint64_t kMostStride = 256;
constexpr uint64_t kExpansion = 64;         // for vertices: 64 times the same byte in two bits of four, from one byte
constexpr uint64_t kLaterExpansion = 1024;  // from version 1 on: four times 256
constexpr uint64_t kSmallTotal = uint64_t{1} << 20;

template <class Kind, size_t N>
bool choose(const JsonFields& f, const char* key, const std::array<std::pair<std::string_view, Kind>, N>& kinds,
            Kind& to) {
    const std::string text = f.text(key);
    const auto found = std::ranges::find(kinds, std::string_view(text), &std::pair<std::string_view, Kind>::first);
    if (found == kinds.end()) return false;
    to = found->second;
    return true;
}

bool isIndices(Mode mode) { return mode != Mode::Attributes; }

// Returns the rule, of those that the decoders assert, that is broken.
std::string brokenRule(const GltfMeshopt& m) {
    if (isIndices(m.mode)) {
        if (m.stride != 2 && m.stride != 4) return "indices of 2 or 4 bytes";
        if (m.mode == Mode::Triangles && m.count % 3 != 0) return "a count of whole triangles";
        if (m.filter != Filter::None) return "indices without a filter";
        return {};
    }
    if (m.stride == 0 || m.stride > kMostStride || m.stride % 4 != 0)
        return fmt::format("a byteStride of 4 to {} in fours", kMostStride);
    if (m.filter == Filter::Octahedral && m.stride != 4 && m.stride != 8)
        return "a byteStride of 4 or 8 for the filter OCTAHEDRAL";
    if (m.filter == Filter::Quaternion && m.stride != 8) return "a byteStride of 8 for the filter QUATERNION";
    return {};
}

// Returns the fewest bytes that can become so many.
uint64_t leastBytes(const GltfMeshopt& m, uint8_t version) {
    switch (m.mode) {
        case Mode::Triangles:
            return 1 + m.count / 3 + 16;
        case Mode::Indices:
            return 1 + m.count + 4;
        case Mode::Attributes:
            break;
    }
    return m.count * m.stride / (version == 0 ? kExpansion : kLaterExpansion);
}

int decode(const GltfMeshopt& m, std::string_view bytes, std::string& to) {
    const auto* const from = reinterpret_cast<const unsigned char*>(bytes.data());
    switch (m.mode) {
        case Mode::Triangles:
            return meshopt_decodeIndexBuffer(to.data(), m.count, m.stride, from, bytes.size());
        case Mode::Indices:
            return meshopt_decodeIndexSequence(to.data(), m.count, m.stride, from, bytes.size());
        case Mode::Attributes:
            break;
    }
    return meshopt_decodeVertexBuffer(to.data(), m.count, m.stride, from, bytes.size());
}

void unfilter(const GltfMeshopt& m, std::string& values) {
    switch (m.filter) {
        case Filter::None:
            return;
        case Filter::Octahedral:
            return meshopt_decodeFilterOct(values.data(), m.count, m.stride);
        case Filter::Quaternion:
            return meshopt_decodeFilterQuat(values.data(), m.count, m.stride);
        case Filter::Exponential:
            return meshopt_decodeFilterExp(values.data(), m.count, m.stride);
    }
}

}  // namespace

void readGltfMeshopt(const JsonFields& fields, const std::string& where, JsonCheck& check,
                     const std::vector<GltfBuffer>& buffers, GltfView& view) {
    const Json* const extensions = fields.find("extensions");
    if (!extensions || !extensions->is_object()) return;
    std::string name = "EXT_meshopt_compression";
    if (!extensions->contains(name)) name = "KHR_meshopt_compression";
    if (!extensions->contains(name)) return;
    const JsonFields f((*extensions)[name], where, check);
    const auto wrong = [&](const std::string& what) { fields.fail(name + ": " + what); };
    GltfMeshopt m;
    if (!f.find("buffer")) return wrong("has no 'buffer'");
    m.buffer = f.index("buffer", buffers.size()).value_or(0);
    m.offset = f.whole("byteOffset", 0);
    m.bytes = f.needWhole("byteLength");
    m.stride = f.needWhole("byteStride");
    m.count = f.needWhole("count");
    if (!check.ok()) return;
    constexpr std::array<std::pair<std::string_view, Mode>, 3> kModes{
        {{"ATTRIBUTES", Mode::Attributes}, {"TRIANGLES", Mode::Triangles}, {"INDICES", Mode::Indices}}};
    constexpr std::array<std::pair<std::string_view, Filter>, 4> kFilters{{{"NONE", Filter::None},
                                                                           {"OCTAHEDRAL", Filter::Octahedral},
                                                                           {"QUATERNION", Filter::Quaternion},
                                                                           {"EXPONENTIAL", Filter::Exponential}}};
    if (!choose(f, "mode", kModes, m.mode)) return wrong("its mode is not ATTRIBUTES, TRIANGLES or INDICES");
    if (f.find("filter") && !choose(f, "filter", kFilters, m.filter))
        return wrong("its filter is not NONE, OCTAHEDRAL, QUATERNION or EXPONENTIAL; compress it with gltfpack -c");
    if (const std::string rule = brokenRule(m); !rule.empty())
        return wrong(fmt::format("{} values of {} bytes; {} are allowed", m.count, m.stride, rule));
    const uint64_t room = buffers[m.buffer].bytes;
    if (m.offset > room || m.bytes > room - m.offset)
        return wrong(fmt::format("bytes {} to {} lie outside buffer {} of {} bytes", m.offset, m.offset + m.bytes,
                                 m.buffer, room));
    if (m.count * m.stride != view.bytes || (view.stride != 0 && view.stride != m.stride))
        return wrong(fmt::format("{} values of {} bytes are not the {} bytes of the view, with its byteStride", m.count,
                                 m.stride, view.bytes));
    view.compressed = m;
}

bool meshoptIsInProportion(const GltfDocument& document) {
    std::set<uint32_t> sources;
    double decoded = 0, stored = 0;
    for (const GltfView& view : document.views) {
        if (!view.compressed) continue;
        decoded += double(view.bytes);
        if (sources.insert(view.compressed->buffer).second)
            stored += double(document.buffers[view.compressed->buffer].bytes);
    }
    return decoded <= kExpansion * stored + kSmallTotal;
}

Result<std::string> decodeMeshopt(const GltfMeshopt& from, std::string_view bytes) {
    constexpr std::array<uint8_t, 3> kMarks{0xA0, 0xE0, 0xD0};  // by mode
    const uint8_t first = bytes.empty() ? uint8_t{0} : uint8_t(bytes[0]);
    const auto version = uint8_t(first & 0x0F);
    const bool isMarked = (first & 0xF0) == kMarks[size_t(from.mode)];
    const auto damaged = [](std::string detail) {
        return Error{.code = ErrorCode::InvalidInput, .message = "its meshopt data are damaged" + std::move(detail)};
    };
    if (!isMarked) return damaged(": they are of another kind");
    if (const uint64_t least = leastBytes(from, version); bytes.size() < least)
        return damaged(
            fmt::format(": {} bytes cannot hold {} values of {} bytes", bytes.size(), from.count, from.stride));
    std::string values(from.count * from.stride, '\0');
    const int failed = decode(from, bytes, values);
    if (failed == -1)
        return Error{.code = ErrorCode::Unsupported,
                     .message = fmt::format("version {} of its meshopt data is not read; compress it with gltfpack -c",
                                            version)};
    if (failed != 0) return damaged(failed == -2 ? ": they are truncated" : "");
    unfilter(from, values);
    return values;
}

}  // namespace vcp
