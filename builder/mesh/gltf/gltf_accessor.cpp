#include "builder/mesh/gltf/gltf_accessor.h"

#include <algorithm>
#include <cstring>
#include <utility>

#include <fmt/format.h>

#include "builder/mesh/gltf/gltf_meshopt.h"
#include "builder/stream/data_uri.h"

namespace vcp {
namespace {

constexpr size_t kReadBytes = 256 * 1024;

template <class T>
double component(const char* p, double scale) {
    T value;
    std::memcpy(&value, p, sizeof value);
    return scale == 1 ? double(value) : std::max(double(value) / scale, -1.0);
}

double component(GltfComponent type, const char* p, bool normalized) {
    switch (type) {
        case GltfComponent::Int8:
            return component<int8_t>(p, normalized ? 127 : 1);
        case GltfComponent::Uint8:
            return component<uint8_t>(p, normalized ? 255 : 1);
        case GltfComponent::Int16:
            return component<int16_t>(p, normalized ? 32767 : 1);
        case GltfComponent::Uint16:
            return component<uint16_t>(p, normalized ? 65535 : 1);
        case GltfComponent::Uint32:
            return component<uint32_t>(p, normalized ? 4294967295.0 : 1);
        case GltfComponent::Float:
            break;
    }
    return component<float>(p, 1);
}

}  // namespace

GltfBuffers::GltfBuffers(GltfDocument& document, std::string file, std::filesystem::path folder,
                         std::unique_ptr<RandomBytes> binary, Room room)
    : document_(document),
      file_(std::move(file)),
      folder_(std::move(folder)),
      room_(std::move(room)),
      open_(document.buffers.size()),
      decoded_(room_.tempFolder),
      places_(document.views.size()) {
    // Only the first buffer may be the chunk.
    if (!open_.empty() && document.buffers[0].uri.empty()) open_[0] = std::move(binary);
}

Result<RandomBytes*> GltfBuffers::open(uint32_t number) {
    GltfBuffer& buffer = document_.buffers[number];
    const auto wrong = [&](std::string message) {
        return Error{.code = ErrorCode::InvalidInput,
                     .message = std::move(message),
                     .file = file_,
                     .element = fmt::format("buffer {}", number)};
    };
    auto& opened = open_[number];
    std::string file = "the file";
    if (!opened && buffer.uri.empty()) return wrong("has neither a URI nor the data of a GLB");
    if (!opened && buffer.embedded) {
        opened = randomBytesOf(std::move(buffer.data));
    } else if (!opened) {
        const auto path = folder_.empty() ? std::nullopt : fileBelow(folder_, buffer.uri, room_.allowOutside);
        if (!path)
            return wrong(folder_.empty() ? "lies in another file, but standard input has no folder; use a GLB"
                                         : "its URI names no file in the folder of the glTF file");
        sideFiles.emplace_back(*path);
        auto bytes = openRandomBytes(*path);
        if (!bytes) return wrong(fmt::format("its file {}: {}", path->string(), bytes.error().message));
        opened = *std::move(bytes);
        file = path->string();
    }
    if (opened->size() < buffer.bytes)
        return wrong(fmt::format("declares {} bytes, but {} has only {} for it: it is truncated", buffer.bytes, file,
                                 opened->size()));
    return opened.get();
}

Result<uint64_t> GltfBuffers::placeOfDecoded(uint32_t number) {
    auto& place = places_[number];
    if (place) return *place;
    const GltfMeshopt& from = *document_.views[number].compressed;
    const auto named = [&](Error error) {
        if (error.file.empty()) error.file = file_;
        error.element = fmt::format("bufferView {}", number);
        return error;
    };
    const uint64_t needed = from.bytes + from.count * from.stride;
    if (needed > room_.decoderBytes)
        return named({.code = ErrorCode::Limit,
                      .message = fmt::format("decoding it takes {} MiB, more than the {} MiB that are allowed; save it "
                                             "without meshopt compression, or in smaller meshes",
                                             needed >> 20, room_.decoderBytes >> 20)});
    // A buffer that is shorter than declared is noticed before anything is allocated.
    VCP_TRY_ASSIGN(auto buffer, open(from.buffer));
    std::string bytes(from.bytes, '\0');
    if (const auto done = buffer->read(from.offset, bytes.data(), bytes.size()); !done) return named(done.error());
    const auto values = decodeMeshopt(from, bytes);
    if (!values) return named(values.error());
    const uint64_t at = decoded_.size();
    VCP_TRY(decoded_.append(*values));
    place = at;
    return at;
}

Result<void> GltfBuffers::read(uint32_t view, uint64_t offset, char* to, size_t count, const std::string& element) {
    const GltfView& v = document_.views[view];
    RandomBytes* from = &decoded_;
    if (v.compressed) {
        VCP_TRY_ASSIGN(const auto place, placeOfDecoded(view));
        offset += place;
    } else {
        VCP_TRY_ASSIGN(from, open(v.buffer));
        offset += v.offset;
    }
    auto done = from->read(offset, to, count);
    if (done) return {};
    Error error = done.error();
    error.file = file_;
    error.element = element;
    return error;
}

GltfAccessorReader::GltfAccessorReader(const GltfDocument& document, GltfBuffers& buffers, uint32_t accessor)
    : document_(document),
      buffers_(buffers),
      accessor_(document.accessors[accessor]),
      element_(fmt::format("accessor {}", accessor)) {}

Result<void> GltfAccessorReader::read(size_t most, std::vector<double>& out) {
    const auto count = size_t(std::min<uint64_t>(most, left()));
    out.assign(count * accessor_.components, 0.0);
    if (accessor_.view) VCP_TRY(readDense(count, out));
    if (accessor_.sparse) VCP_TRY(applySparse(count, out));
    next_ += count;
    return {};
}

Result<void> GltfAccessorReader::readDense(size_t count, std::vector<double>& out) {
    const uint64_t elementBytes = accessor_.elementBytes();
    const uint64_t viewStride = document_.views[*accessor_.view].stride;
    const uint64_t stride = viewStride ? viewStride : elementBytes;
    const size_t atOnce = kReadBytes / stride;
    for (size_t done = 0; done < count;) {
        const size_t here = std::min(atOnce, count - done);
        const size_t bytes = (here - 1) * stride + elementBytes;
        bytes_.resize(bytes);
        VCP_TRY(
            buffers_.read(*accessor_.view, accessor_.offset + (next_ + done) * stride, bytes_.data(), bytes, element_));
        decode(bytes_.data(), stride, here, out.data() + done * accessor_.components);
        done += here;
    }
    return {};
}

void GltfAccessorReader::decode(const char* bytes, uint64_t stride, size_t count, double* out) const {
    const size_t componentBytes = byteSize(accessor_.type);
    for (size_t i = 0; i < count; ++i)
        for (uint32_t c = 0; c < accessor_.components; ++c)
            *out++ = component(accessor_.type, bytes + i * stride + c * componentBytes, accessor_.normalized);
}

// Sparse indices increase, so they are merged with the dense values as both are read.
Result<void> GltfAccessorReader::applySparse(size_t count, std::vector<double>& out) {
    const GltfSparse& sparse = *accessor_.sparse;
    std::vector<char> value(accessor_.elementBytes());
    while (true) {
        VCP_TRY(nextSparseIndex());
        if (sparseUsed_ == sparseIndices_.size()) return {};
        const uint64_t index = sparseIndices_[sparseUsed_];
        if (index >= accessor_.count) return sparseError(fmt::format("sparse index {} is out of range", index));
        if (index >= next_ + count) return {};
        if (lastSparse_ && index <= *lastSparse_) return sparseError("its sparse indices are not in increasing order");
        lastSparse_ = index;
        if (index < next_) {  // one of the skipped elements
            ++sparseUsed_;
            continue;
        }
        const uint64_t number = sparseRead_ - sparseIndices_.size() + sparseUsed_;
        VCP_TRY(buffers_.read(sparse.valueView, sparse.valueOffset + number * value.size(), value.data(), value.size(),
                              element_));
        decode(value.data(), value.size(), 1, out.data() + (index - next_) * accessor_.components);
        ++sparseUsed_;
    }
}

// Returns the next sparse index; reads ahead when none are left.
Result<void> GltfAccessorReader::nextSparseIndex() {
    const GltfSparse& sparse = *accessor_.sparse;
    if (sparseUsed_ < sparseIndices_.size()) return {};
    const size_t bytes = byteSize(sparse.indexType);
    const auto count = size_t(std::min<uint64_t>(kReadBytes / bytes, sparse.count - sparseRead_));
    bytes_.resize(count * bytes);
    VCP_TRY(buffers_.read(sparse.indexView, sparse.indexOffset + sparseRead_ * bytes, bytes_.data(), bytes_.size(),
                          element_));
    sparseIndices_.clear();
    sparseUsed_ = 0;
    for (size_t i = 0; i < count; ++i) {
        const double index = component(sparse.indexType, bytes_.data() + i * bytes, false);
        if (!(index >= 0 && index < 4294967296.0)) return sparseError("a sparse index is not a whole number");
        sparseIndices_.push_back(uint64_t(index));
    }
    sparseRead_ += count;
    return {};
}

Error GltfAccessorReader::sparseError(const std::string& message) const {
    return {.code = ErrorCode::InvalidInput, .message = message, .element = element_};
}

}  // namespace vcp
