// Tiles that are JPEGs where there is no libjpeg: the browser decodes them, meanwhile all else goes on, and
// unpackJpeg() (octree/image/jpeg_tile.h) finds their texels here.
//
// The way of a tile: asked for (state), taken by the page that holds the module (takeWanted), given back (put), read
// (find), forgotten.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <vector>

#include <glm/vec2.hpp>

namespace vcp {

class JpegTiles {
public:
    enum class State : uint8_t { Awaited, Decoded, Failed };
    /// A tile for the browser to decode.
    struct Wanted {
        uint32_t id = 0;
        glm::uvec2 size{0};  ///< texels
        std::vector<std::byte> bytes;
    };

    /// Begins to go through what is wished for: tiles that only earlier walks asked for make room for others.
    void beginWalk() { ++walk_; }
    /// Returns how far a tile has come. One that is not known is wanted from now on, where there is room for it.
    /// `hash`: of its bytes. What is no plain JPEG of that size has failed: browsers are asked for nothing else.
    State state(uint64_t hash, std::span<const std::byte> jpeg, glm::uvec2 size);
    /// Returns the tiles that are wanted since the last call.
    std::vector<Wanted> takeWanted();
    /// Takes in the texels of a tile, RGBA8, row by row. One with another number of texels has failed.
    void put(uint32_t id, std::span<const uint32_t> texels);
    /// Returns the texels of a tile; none where they are not there, or in another number.
    [[nodiscard]] std::span<const uint32_t> find(uint64_t hash, glm::uvec2 size) const;
    void forget(uint64_t hash) { tiles_.erase(hash); }

private:
    struct Tile {
        State state = State::Awaited;
        uint32_t id = 0;
        uint64_t bytes = 0;  // of its texels
        uint64_t walk = 0;   // that asked for it last
        std::vector<uint32_t> texels;
    };
    bool makeRoom(uint64_t bytes);

    std::map<uint64_t, Tile> tiles_;  // by hash
    std::vector<Wanted> wanted_;
    uint64_t walk_ = 0;
    uint32_t lastId_ = 0;
};

/// Those of this instance.
JpegTiles& jpegTiles();

}  // namespace vcp
