// Grows a surface triangle by triangle across its open edges, as encoder and decoder of its triangles do alike
// (the cut-border machine, Gumhold and Strasser 1998). Edges wait in a queue; the triangle behind the first one
// has a new vertex, the vertex that the front goes on to or comes from there, or any other. Surfaces need not be
// manifold: what the front cannot reach begins anew.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace vcp {

class TriangleFront {
public:
    static constexpr uint32_t kNone = 0xffffffff;

    /// An open edge of the triangle (from, to, opposite).
    struct Gate {
        uint32_t from, to, opposite;
        uint32_t previous, next;  ///< gates along the front, or kNone
        bool open;
    };

    explicit TriangleFront(uint32_t vertices) : gateFrom_(vertices, kNone), degree_(vertices, 0) {}

    /// Returns the next open gate, or kNone when the front is closed.
    [[nodiscard]] uint32_t first() {
        while (head_ < gates_.size() && !gates_[head_].open) ++head_;
        return head_ < gates_.size() ? uint32_t(head_) : kNone;
    }
    [[nodiscard]] const Gate& gate(uint32_t g) const { return gates_[g]; }
    /// Returns the vertex that closes the corner with the next or previous gate, or kNone.
    [[nodiscard]] uint32_t nextVertex(uint32_t g) const {
        return gates_[g].next == kNone ? kNone : gates_[gates_[g].next].to;
    }
    [[nodiscard]] uint32_t previousVertex(uint32_t g) const {
        return gates_[g].previous == kNone ? kNone : gates_[gates_[g].previous].from;
    }
    /// Returns the number of triangles so far at a vertex, up to 255.
    [[nodiscard]] uint32_t degree(uint32_t vertex) const { return degree_[vertex]; }

    /// Records that there is no triangle behind the gate.
    void closeGate(uint32_t g);
    /// Adds the triangle (to, from, c) behind the gate.
    void attach(uint32_t g, uint32_t c);
    /// Adds a triangle that the front does not lead to.
    void begin(uint32_t a, uint32_t b, uint32_t c);

private:
    uint32_t add(uint32_t from, uint32_t to, uint32_t opposite);
    void link(uint32_t g, uint32_t next);
    void count(uint32_t a, uint32_t b, uint32_t c);
    void zip(uint32_t g);

    std::vector<Gate> gates_;
    size_t head_ = 0;
    std::vector<uint32_t> gateFrom_;  ///< for each vertex: the latest gate from it
    std::vector<uint8_t> degree_;
};

}  // namespace vcp
