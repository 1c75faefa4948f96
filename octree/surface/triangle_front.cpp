#include "octree/surface/triangle_front.h"

namespace vcp {

void TriangleFront::link(uint32_t g, uint32_t next) {
    if (g != kNone) gates_[g].next = next;
    if (next != kNone) gates_[next].previous = g;
}

uint32_t TriangleFront::add(uint32_t from, uint32_t to, uint32_t opposite) {
    const uint32_t g = uint32_t(gates_.size());
    gates_.push_back({from, to, opposite, kNone, kNone, true});
    gateFrom_[from] = g;
    return g;
}

void TriangleFront::count(uint32_t a, uint32_t b, uint32_t c) {
    for (const uint32_t v : {a, b, c})
        if (degree_[v] < 255) ++degree_[v];
}

void TriangleFront::closeGate(uint32_t g) {
    gates_[g].open = false;
    if (gates_[g].previous != kNone) gates_[gates_[g].previous].next = kNone;
    if (gates_[g].next != kNone) gates_[gates_[g].next].previous = kNone;
}

void TriangleFront::attach(uint32_t g, uint32_t c) {
    const auto [a, b, opposite, previous, next, open] = gates_[g];
    count(a, b, c);
    gates_[g].open = false;
    if (next != kNone && gates_[next].to == c) {
        const uint32_t after = gates_[next].next, made = add(a, c, b);
        gates_[next].open = false;
        link(previous == next ? kNone : previous, made);
        link(made, after == g ? kNone : after);
        return zip(made);
    }
    if (previous != kNone && gates_[previous].from == c) {
        const uint32_t before = gates_[previous].previous, made = add(c, b, a);
        gates_[previous].open = false;
        link(before == g ? kNone : before, made);
        link(made, next);
        return zip(made);
    }
    // The vertex is new, or elsewhere on the front: then the front splits there.
    const uint32_t there = gateFrom_[c];
    const uint32_t in = add(a, c, b), out = add(c, b, a);
    link(previous, in);
    link(out, next);
    if (there == kNone) return link(in, out);
    if (!gates_[there].open || there == previous || there == next) return;
    link(gates_[there].previous, out);
    link(in, there);
}

void TriangleFront::begin(uint32_t a, uint32_t b, uint32_t c) {
    count(a, b, c);
    const uint32_t ab = add(a, b, c), bc = add(b, c, a), ca = add(c, a, b);
    link(ab, bc);
    link(bc, ca);
    link(ca, ab);
}

/// Where the front returns along the edge that it came by, the two sides have met and are joined.
void TriangleFront::zip(uint32_t g) {
    const Gate made = gates_[g];
    const auto meets = [&](uint32_t other) {
        return other != kNone && other != g && gates_[other].from == made.to && gates_[other].to == made.from;
    };
    if (meets(made.next)) {
        const uint32_t after = gates_[made.next].next;
        gates_[g].open = gates_[made.next].open = false;
        link(made.previous == made.next ? kNone : made.previous, after == g ? kNone : after);
    } else if (meets(made.previous)) {
        const uint32_t before = gates_[made.previous].previous;
        gates_[g].open = gates_[made.previous].open = false;
        link(before == g ? kNone : before, made.next);
    }
}

}  // namespace vcp
