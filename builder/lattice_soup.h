// Soup in world space -> soup on the finest level's lattice: snapped, long edges cut, colours settled.
#pragma once

#include <vector>

#include "builder/ingest.h"
#include "builder/lattice_mesh.h"
#include "builder/soup.h"
#include "octree/leaf_math.h"

namespace vcp {

/// Snaps triangles to a frame's lattice. Any thread.
class LatticeSnapper {
public:
    explicit LatticeSnapper(const GridFrame& frame) : origin_(frame.origin), scale_(double(kLatticePerCell) / frame.cell) {}

    /// Gives the triangle, or its pieces, to `sink(const LatticeTriangle&)`; nothing when it has no area on the
    /// lattice. An edge is cut at the same lattice point in every triangle that has it, so no crack opens.
    template <class Real, class Sink>
    void add(const WorldTriangle<Real>& triangle, Sink&& sink) const {
        const LatticeTriangle t = snap(triangle);
        if (isShort(t)) {
            if (hasArea(t.corner[0], t.corner[1], t.corner[2])) sink(t);
            return;
        }
        LatticeTriangle pieces[4];
        cutInto(t, pieces, sink);
    }

private:
    template <class Real>
    LatticeTriangle snap(const WorldTriangle<Real>& triangle) const;
    static bool isShort(const LatticeTriangle& t);
    /// Cuts each edge that is too long in its middle; returns the number of pieces.
    static int cut(const LatticeTriangle& t, LatticeTriangle (&pieces)[4]);

    template <class Sink>
    static void cutInto(const LatticeTriangle& t, LatticeTriangle (&pieces)[4], Sink& sink) {
        const int count = cut(t, pieces);
        if (count == 0 && hasArea(t.corner[0], t.corner[1], t.corner[2])) sink(t);
        for (int i = 0; i < count; ++i) {
            LatticeTriangle finer[4];
            cutInto(pieces[i], finer, sink);
        }
    }

    glm::dvec3 origin_;
    double scale_;
};

}  // namespace vcp
