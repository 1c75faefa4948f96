// View-dependent remeshing in grid space (Gumhold and Huettner 1999, 3): where a corner lies in the grid, how an edge
// is split, which way a triangle is swept, and which grid points its columns have. Compiles as C++
// (mesostructure/remesh/remesh_math.h, in single and in double precision) and as GLSL
// (render/shaders/remesh_piece.glsl). PRECISE keeps a device from contracting: C++ is compiled so as a whole.
//
// Eye space: x right, y up, z forward, world units. Grid space: x and y are pixels of the whole picture in units of a
// cell, z is the logarithm of the depth in the same units (eq. 4), so that cells are cubes in the world as well.
// Corners are rounded to whole cells; what an edge is split into depends on its two corners alone.

// A camera's grid.
struct RemeshGrid {
    Real focal;       // cells that a unit tangent spans; of parallel rays: that a world unit spans
    Real nearest;     // depth, world units: nearer corners are taken to be there, so that a logarithm exists
    Real depthScale;  // 1 / ln(1 + 1 / focal): cells that a factor e in depth spans
    uint isParallel;  // 1: rays are parallel; depth is not logarithmic
};

// RemeshView::access, as HeightAccess.
CONSTANT uint kRemeshMost = 1u;
CONSTANT uint kRemeshMap = 2u;

// How a frame's points are found.
struct RemeshView {
    RemeshGrid grid;
    Real cellSize;  // world units of a cell at depth 1, or at any of parallel rays
    uint access;    // to heights
};

// A corner of a piece. What is interpolated over the piece is the part up to `height`.
struct RemeshCorner {
    Real3 position, direction;  // eye space
    ivec3 grid;
    Real2 uv;
    Real density;  // texels a world unit
    Real height;   // of the corner itself, the same in all pieces
    Real weight;   // 1 / depth, what perspective interpolates with; 1 where cells are the map's
};

// The coordinates of an edge's other side, at its start and its end.
struct RemeshSeam {
    bool is;
    Real2 start, end;
};

// Corners lie at most so many cells from the eye's axis: their differences are whole numbers of 32 bits.
CONSTANT int kRemeshFarthest = 1000000000;

// What positions are divided by: the depth, which perspective needs above 0.
INLINE Real remeshDepth(CONST_REF(RemeshGrid) grid, Real3 p) {
    return grid.isParallel != 0u ? Real(1) : max(p.z, grid.nearest);
}

INLINE int remeshRounded(Real x) {
    return int(clamp(floor(x + Real(0.5)), Real(-kRemeshFarthest), Real(kRemeshFarthest)));
}

INLINE ivec3 remeshGridPoint(CONST_REF(RemeshGrid) grid, Real3 p) {
    Real w = remeshDepth(grid, p);
    Real z = grid.isParallel != 0u ? grid.focal * p.z : grid.depthScale * log(w / grid.nearest);
    return ivec3(remeshRounded(grid.focal * p.x / w), remeshRounded(grid.focal * p.y / w), remeshRounded(z));
}

// The main direction of an edge and what it is split into (definition 1): at least one part, also where its ends are
// rounded to one grid point.
struct RemeshEdge {
    int axis;
    int cells;
};

INLINE RemeshEdge remeshEdge(ivec3 a, ivec3 b) {
    ivec3 d = abs(b - a);
    RemeshEdge edge;
    edge.axis = d.x >= d.y && d.x >= d.z ? 0 : d.y >= d.z ? 1 : 2;
    edge.cells = max(d[edge.axis], 1);
    return edge;
}

// Whether the third corner lies within the edge's range along its main direction (definition 2).
INLINE bool remeshIsPrimary(ivec3 a, ivec3 b, ivec3 c) {
    int axis = remeshEdge(a, b).axis;
    return min(a[axis], b[axis]) <= c[axis] && c[axis] <= max(a[axis], b[axis]);
}

// How a triangle is swept. Corner `first` has the lesser sweep coordinate of the primary edge's ends, `second` the
// greater; `apex` is the third. `sign` turns the side axis so that the apex is above the primary edge.
struct RemeshPlan {
    int first, second, apex;
    int sweep, side;
    int sign;
    int isWhole;     // 1: all corners are rounded to one grid point; the triangle is not parted
    int isMirrored;  // 1: first, second, apex are clockwise in the triangle's own order
};

INLINE int remeshArea(ivec3 a, ivec3 b, ivec3 c, int sweep, int side) {
    // Edges have at most a thousand or so cells (remesher.h), so that this is a whole number.
    return abs((b[sweep] - a[sweep]) * (c[side] - a[side]) - (c[sweep] - a[sweep]) * (b[side] - a[side]));
}

INLINE RemeshPlan remeshPlan(ivec3 g0, ivec3 g1, ivec3 g2) {
    ivec3 g[3];
    g[0] = g0;
    g[1] = g1;
    g[2] = g2;
    int best = -1, length = -1;
    for (int k = 0; k < 3; ++k) {
        int next = (k + 1) % 3, other = (k + 2) % 3;
        RemeshEdge edge = remeshEdge(g[k], g[next]);
        if (!remeshIsPrimary(g[k], g[next], g[other])) continue;
        int span = abs(g[next][edge.axis] - g[k][edge.axis]);
        if (span > length) {
            best = k;
            length = span;
        }
    }
    RemeshPlan plan;
    // Theorem 1: there is a primary edge.
    plan.isWhole = length <= 0 ? 1 : 0;
    best = max(best, 0);
    int k = best, next = (best + 1) % 3;
    plan.sweep = remeshEdge(g[k], g[next]).axis;
    plan.isMirrored = g[k][plan.sweep] <= g[next][plan.sweep] ? 0 : 1;
    plan.first = plan.isMirrored == 0 ? k : next;
    plan.second = plan.isMirrored == 0 ? next : k;
    plan.apex = (best + 2) % 3;
    int a = (plan.sweep + 1) % 3, b = (plan.sweep + 2) % 3;
    ivec3 p = g[plan.first], q = g[plan.second], r = g[plan.apex];
    plan.side = remeshArea(p, q, r, plan.sweep, a) >= remeshArea(p, q, r, plan.sweep, b) ? a : b;
    int span = q[plan.sweep] - p[plan.sweep];
    int lift = (r[plan.side] - p[plan.side]) * span - (q[plan.side] - p[plan.side]) * (r[plan.sweep] - p[plan.sweep]);
    plan.sign = lift < 0 ? -1 : 1;
    return plan;
}

// Whole quotients of a number of either sign by one above 0.
INLINE int remeshFloorDivided(int n, int d) {
    int q = n / d;
    return q * d > n ? q - 1 : q;
}

// The grid points of a column within a triangle: whole side coordinates from `from`, `count` of them, between the
// primary edge at `bottom` and the side edge at `top`, at least half a cell from both. What is nearer is the edges'.
// How many there are is found in whole numbers, so that no rounding changes it.
struct RemeshColumn {
    Real bottom, top;
    int from, count;
};

// `p`, `q`: (sweep, side) of the primary edge's ends; `a`, `b`: of the side edge's, the lesser sweep coordinate first.
INLINE RemeshColumn remeshColumn(ivec2 p, ivec2 q, ivec2 a, ivec2 b, int column) {
    RemeshColumn made;
    int low = (q.y - p.y) * (column - p.x), lowSpan = q.x - p.x, high = (b.y - a.y) * (column - a.x),
        highSpan = b.x - a.x;
    PRECISE Real bottom = Real(p.y) + Real(low) / Real(lowSpan), top = Real(a.y) + Real(high) / Real(highSpan);
    made.bottom = bottom;
    made.top = top;
    // The least whole number of at least bottom + 1/2, and the greatest of at most top - 1/2.
    made.from = p.y - remeshFloorDivided(-2 * low - lowSpan, 2 * lowSpan);
    int last = a.y + remeshFloorDivided(2 * high - highSpan, 2 * highSpan);
    made.count = max(last - made.from + 1, 0);
    return made;
}

// Which of the `parts` points of an edge is nearest to the i-th of `cells`, of which there are at least as many: each
// is nearest to one, and their order stays.
INLINE int remeshPart(int i, int cells, int parts) {
    return parts == cells ? i : (2 * i * parts + cells) / (2 * cells);
}

// Which of the parts of an edge from sweep coordinate `from` to `to`, of `cells` parts, ends nearest to a column. Next
// columns have next parts: an edge has at least as many parts as columns.
INLINE int remeshNearestPart(int from, int to, int cells, int column) {
    int span = to - from;
    return (2 * (column - from) * cells + span) / (2 * span);
}

// The k-th of the n points of an edge between corners with weights `a` and `b`: symmetric, so that it is the same from
// either end (a (n - k) + b k, without contraction).
INLINE Real remeshBetween(Real a, Real b, int k, int n) {
    PRECISE Real sum = a * Real(n - k) + b * Real(k);
    return sum;
}
