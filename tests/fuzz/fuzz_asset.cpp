// Assets behind right hashes: an input is a whole file, whose hashes are made here. What is read is marched too, so
// that no count or index in it reaches out of its arrays.
#include <algorithm>
#include <cstddef>
#include <cstring>

#include "mesostructure/method.h"
#include "octree/io/content_hash.h"

namespace {

using namespace vcp;
using namespace vcp::meso;
using Bytes = std::vector<std::byte>;

template <class T>
T valueAt(const Bytes& file, uint64_t at) {
    T value;
    std::memcpy(&value, &file[at], sizeof value);
    return value;
}

template <class T>
void setValue(Bytes& file, uint64_t at, const T& value) {
    std::memcpy(&file[at], &value, sizeof value);
}

/// Gives chunks, table, header and commit record the hashes and sizes that they must have, as far as they lie in it.
void hashFile(Bytes& file) {
    if (file.size() < sizeof(AssetHeader) + sizeof(AssetCommit)) return;
    const uint64_t commitAt = file.size() - sizeof(AssetCommit);
    auto header = valueAt<AssetHeader>(file, 0);
    const uint64_t room = (commitAt - sizeof header) / sizeof(AssetChunk),
                   chunks = std::min<uint64_t>(header.chunks, room);
    for (uint64_t i = 0; i < chunks; ++i) {
        const uint64_t at = sizeof header + i * sizeof(AssetChunk);
        auto chunk = valueAt<AssetChunk>(file, at);
        if (chunk.offset > commitAt || chunk.bytes > commitAt - chunk.offset) continue;
        chunk.hash = hashBytes(std::span(file).subspan(chunk.offset, chunk.bytes));
        setValue(file, at, chunk);
    }
    header.tableHash = hashBytes(std::span(file).subspan(sizeof header, chunks * sizeof(AssetChunk)));
    header.fileBytes = file.size();
    setValue(file, 0, header);
    header.hash = hashBytes(std::span(file).first(offsetof(AssetHeader, hash)));
    setValue(file, 0, header);
    AssetCommit commit;
    commit.fileBytes = file.size(), commit.headerHash = header.hash;
    commit.hash = hashBytes(std::as_bytes(std::span(&commit, 1)).first(offsetof(AssetCommit, hash)));
    setValue(file, commitAt, commit);
}

void march(const Result<std::unique_ptr<Marcher>>& marcher, double top) {
    if (!marcher) return;
    for (int i = 0; i < 4; ++i)
        static_cast<void>((*marcher)->march({{0.1 * i, 0.2, top}, {0.6, 0, i % 2 ? 0.8 : -0.8}, 64, i - 1.5}));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    const auto input = std::as_bytes(std::span(data, size));
    Bytes file(input.begin(), input.end());
    hashFile(file);
    const auto asset = parseAsset(file, "fuzz");
    if (!asset) return 0;
    if (asset->gdm) march(gdmMarcher(*asset->gdm), asset->extent.z);
    if (asset->vdm) march(gdmMarcher(*asset->vdm), asset->extent.z);
    if (asset->compressed && asset->patches)
        march(gridMarcher({.compressed = &*asset->compressed}, {.patches = &*asset->patches}), asset->extent.z);
    return 0;
}
