// The sweep of one piece (Gumhold and Huettner 1999, 3) as columns that know nothing of each other: which points are a
// column's, and the strip of triangles between it and the next. After remesh_math.h; whoever includes this has
//   RemeshView view                           the frame's
//   RemeshCorner remeshCorner(int k)          the piece's, and of each corner the cell alone, remeshCell(k)
//   RemeshSeam remeshSeam(int k)              of the edge from corner k to the next
//   int remeshParts(int k, int cells)         into how many parts that edge is split, at most its cells
//   int remeshHeightLevel(int k)              of the map's heights along that edge; 3: within the piece
//   remesh_heights.h, and remeshMapWidth(): texels of the map along x
//   void remeshAddVertex(uint number, Real3 position, Real2 uv, Real height)
//   void remeshAddTriangle(uint a, uint b, uint c)
//
// Vertices are numbered corners first, then the points of the edges 0, 1 and 2, then the grid points column by column.
// Where an edge has fewer parts than cells, points of its cells lie at the nearest ends of its parts: so two pieces
// with cells of different size have the same points on the edge between them. Triangles between points of one place are
// points or lines, which draw nothing.
//
// A strip lies between the columns c and c + 1. Its left side goes up column c: from the primary edge over the grid
// points to the point of the side edge that is nearest to the column; its right side likewise; and along the top there
// may be further points of the side edge, where that is split along another direction than the sweep's. They are put on
// the side that they go up on, so that both sides end in one point, and the strip is zipped.

// What a vertex is before it is displaced.
struct RemeshPoint {
    Real3 position, direction;
    Real2 uv;
    Real density, height;
};

// Returns the edge of a cell at a place, in texels.
INLINE Real remeshTexelsAt(Real3 position, Real density) {
    PRECISE Real texels = density * view.cellSize * remeshDepth(view.grid, position);
    return texels;
}

// Returns what heights are taken from: for a footprint of so many texels, or the map's level, whose texels are 2^level.
INLINE RemeshFootprint remeshHeightFootprint(Real texels, int level) {
    return remeshFootprint(view.access == kRemeshMap ? Real(1 << level) : texels);
}

// Returns the height at a place, of a point of the base at `position`. The footprint is that of its texels.
INLINE Real remeshHeightAt(CONST_REF(RemeshFootprint) footprint, Real texels, Real2 uv, Real3 position,
                           Real3 direction) {
    Real most = remeshHeight(footprint, uv);
    if (view.access != kRemeshMost || !(texels > Real(1))) return most;
    // The footprint is stretched to a square, which the edge alone allows; its samples are half a cell away.
    PRECISE Real reach = Real(0.5) * texels / remeshMapWidth();
    Real3 along = view.grid.isParallel != 0u ? Real3(0, 0, 1) : position;
    PRECISE Real away = direction.x * along.x + direction.y * along.y + direction.z * along.z;
    for (int k = 0; k < 4; ++k) {
        Real x = k < 2 ? -reach : reach, y = k % 2 == 0 ? -reach : reach;
        Real other = remeshHeight(footprint, uv + Real2(x, y));
        most = away > Real(0) ? min(most, other) : max(most, other);
    }
    return most;
}

// What all columns of a piece share.
struct RemeshSweep {
    RemeshPlan plan;
    ivec2 first, second, apex;  // (sweep, side) of the corners that the plan names so
    ivec3 cells;                // of the edges from corner k to the next
    ivec3 firstOnEdge;          // numbers of their first points between corners
    int firstInside;            // number of the first grid point
    uint firstVertex;           // what numbers begin with
};

INLINE ivec2 remeshPlace(CONST_REF(RemeshPlan) plan, int corner) {
    ivec3 grid = remeshCell(corner);
    return ivec2(grid[plan.sweep], plan.sign * grid[plan.side]);
}

INLINE RemeshSweep remeshSweep(uint firstVertex) {
    ivec3 a = remeshCell(0), b = remeshCell(1), c = remeshCell(2);
    RemeshSweep made;
    made.plan = remeshPlan(a, b, c);
    made.first = remeshPlace(made.plan, made.plan.first);
    made.second = remeshPlace(made.plan, made.plan.second);
    made.apex = remeshPlace(made.plan, made.plan.apex);
    made.cells = ivec3(remeshEdge(a, b).cells, remeshEdge(b, c).cells, remeshEdge(c, a).cells);
    made.firstOnEdge = ivec3(3, made.cells.x + 2, made.cells.x + made.cells.y + 1);
    made.firstInside = made.cells.x + made.cells.y + made.cells.z;
    made.firstVertex = firstVertex;
    return made;
}

// Returns how many columns add something: those but the last of the sweep, and one where there is no sweep.
INLINE int remeshColumns(CONST_REF(RemeshPlan) plan, ivec2 first, ivec2 second) {
    return plan.isWhole != 0 ? 1 : second.x - first.x;
}

// The edge of the plan's corners `from` and `to`, which may be either way round.
INLINE int remeshCellsBetween(CONST_REF(RemeshSweep) s, int from, int to) {
    return s.cells[(from + 1) % 3 == to ? from : to];
}

// Returns the number of a point of such an edge, counted from its first corner.
INLINE uint remeshOnEdge(CONST_REF(RemeshSweep) s, int from, int to, int i) {
    bool isAhead = (from + 1) % 3 == to;
    int k = isAhead ? from : to, n = s.cells[k];
    int number = i == 0 ? from : i == n ? to : s.firstOnEdge[k] + (isAhead ? i : n - i) - 1;
    return s.firstVertex + uint(number);
}

// The side edge over the strip after a column.
struct RemeshTop {
    int from, to;  // corners
    ivec2 a, b;    // their places
    int cells;
    int first, last;  // the points that are nearest to the strip's two columns
};

INLINE RemeshTop remeshTop(CONST_REF(RemeshSweep) s, int column) {
    RemeshTop top;
    // Where the apex is above an end of the primary edge, there is one side edge along the sweep.
    bool isLeft = column < s.apex.x;
    top.from = isLeft ? s.plan.first : s.plan.apex;
    top.to = isLeft ? s.plan.apex : s.plan.second;
    top.a = isLeft ? s.first : s.apex;
    top.b = isLeft ? s.apex : s.second;
    top.cells = remeshCellsBetween(s, top.from, top.to);
    top.first = remeshNearestPart(top.a.x, top.b.x, top.cells, column);
    top.last = remeshNearestPart(top.a.x, top.b.x, top.cells, column + 1);
    return top;
}

// Returns a column's grid points. The ends of the primary edge have none above them.
INLINE RemeshColumn remeshInside(CONST_REF(RemeshSweep) s, int column) {
    RemeshColumn none;
    none.bottom = none.top = Real(0);
    none.from = none.count = 0;
    if (column <= s.first.x || column >= s.second.x) return none;
    bool isLeft = column <= s.apex.x && s.apex.x > s.first.x;
    return remeshColumn(s.first, s.second, isLeft ? s.first : s.apex, isLeft ? s.apex : s.second, column);
}

// One side of a strip, from the primary edge up: points of an edge, grid points, points of the side edge.
struct RemeshSide {
    int edgeFrom, edgeTo, edgeFirst, edgeCount;
    int insideFrom, insideCount;  // side coordinates
    uint insideFirst;             // number of the first
    int topFirst, topStep, topCount;
};

struct RemeshStrip {
    RemeshTop top;
    RemeshSide left, right;
};

INLINE int remeshCount(RemeshSide side) { return side.edgeCount + side.insideCount + side.topCount; }

// Returns a side of the strip after `column`; `insideFirst`: the number of its column's first grid point.
INLINE RemeshSide remeshSide(CONST_REF(RemeshSweep) s, CONST_REF(RemeshTop) top, int column, bool isRight,
                             uint insideFirst) {
    int at = isRight ? column + 1 : column;
    bool isFirst = at == s.first.x, isSecond = at == s.second.x;
    bool isUpright = (isFirst || isSecond) && s.apex.x == at;  // the side is an edge that lies along the column
    RemeshSide side;
    side.edgeFrom = isUpright && isSecond ? s.plan.second : s.plan.first;
    side.edgeTo = isUpright ? s.plan.apex : s.plan.second;
    side.edgeFirst = isUpright ? 0 : at - s.first.x;
    side.edgeCount = isUpright ? remeshCellsBetween(s, side.edgeFrom, side.edgeTo) + 1 : 1;
    RemeshColumn inside = remeshInside(s, at);
    side.insideFrom = inside.from;
    side.insideCount = inside.count;
    side.insideFirst = insideFirst;
    bool hasTop = !isFirst && !isSecond, goesUp = isRight ? top.b.y < top.a.y : top.b.y >= top.a.y;
    side.topStep = isRight ? -1 : 1;
    side.topFirst = (isRight ? top.last : top.first) + (hasTop ? 0 : side.topStep);
    side.topCount = (hasTop ? 1 : 0) + (goesUp ? top.last - top.first : 0);
    return side;
}

INLINE RemeshStrip remeshStrip(CONST_REF(RemeshSweep) s, int column, uint insideFirst, uint nextInsideFirst) {
    RemeshStrip strip;
    strip.top = remeshTop(s, column);
    strip.left = remeshSide(s, strip.top, column, false, insideFirst);
    strip.right = remeshSide(s, strip.top, column, true, nextInsideFirst);
    return strip;
}

// Returns how many triangles lie between two sides, which end in one point.
INLINE int remeshTriangles(CONST_REF(RemeshStrip) strip) {
    int lefts = remeshCount(strip.left) - 1, rights = remeshCount(strip.right) - 1;
    return max(lefts - 1, 0) + max(rights - 1, 0) + (lefts > 0 && rights > 0 ? 1 : 0);
}

// A point of a side: its number, and its side coordinate, in which strips are zipped.
struct RemeshSidePoint {
    uint vertex;
    Real side;
};

INLINE RemeshSidePoint remeshSidePoint(CONST_REF(RemeshSweep) s, CONST_REF(RemeshTop) top, CONST_REF(RemeshSide) side,
                                       int i) {
    RemeshSidePoint point;
    int within = i - side.edgeCount;
    if (within >= 0 && within < side.insideCount) {
        point.vertex = side.insideFirst + uint(within);
        point.side = Real(side.insideFrom + within);
        return point;
    }
    bool isTop = within >= 0;
    int from = isTop ? top.from : side.edgeFrom, to = isTop ? top.to : side.edgeTo;
    int k = isTop ? side.topFirst + side.topStep * (within - side.insideCount) : side.edgeFirst + i;
    int n = remeshCellsBetween(s, from, to);
    point.vertex = remeshOnEdge(s, from, to, k);
    PRECISE Real at = remeshBetween(Real(remeshPlace(s.plan, from).y), Real(remeshPlace(s.plan, to).y), k, n) / Real(n);
    point.side = at;
    return point;
}

// Adds the triangles between two sides.
INLINE void remeshAddStrip(CONST_REF(RemeshSweep) s, CONST_REF(RemeshStrip) strip) {
    int i = 0, j = 0, lefts = remeshCount(strip.left) - 1, rights = remeshCount(strip.right) - 1;
    RemeshSidePoint left = remeshSidePoint(s, strip.top, strip.left, 0),
                    right = remeshSidePoint(s, strip.top, strip.right, 0);
    RemeshSidePoint nextLeft = remeshSidePoint(s, strip.top, strip.left, min(1, lefts)),
                    nextRight = remeshSidePoint(s, strip.top, strip.right, min(1, rights));
    int count = remeshTriangles(strip);
    for (int n = 0; n < count; ++n) {
        bool moreLeft = i + 1 < lefts, moreRight = j + 1 < rights;
        // The last triangle ends in the point that both sides have.
        bool goesLeft = !moreRight && (moreLeft || n + 1 == count);
        if (moreLeft && moreRight) goesLeft = nextLeft.side <= nextRight.side;
        uint third = goesLeft ? nextLeft.vertex : nextRight.vertex;
        if (s.plan.isMirrored == 0)
            remeshAddTriangle(left.vertex, right.vertex, third);
        else
            remeshAddTriangle(left.vertex, third, right.vertex);
        if (goesLeft) {
            left = nextLeft;
            ++i;
            nextLeft = remeshSidePoint(s, strip.top, strip.left, min(i + 1, lefts));
        } else {
            right = nextRight;
            ++j;
            nextRight = remeshSidePoint(s, strip.top, strip.right, min(j + 1, rights));
        }
    }
}

// A point whose height is not known yet.
INLINE RemeshPoint remeshFlatPoint(Real3 position, Real3 direction, Real2 uv, Real density) {
    RemeshPoint point;
    point.position = position;
    point.direction = direction;
    point.uv = uv;
    point.density = density;
    point.height = Real(0);
    return point;
}

// The i-th of the n points of the edge from corner k to the next, without its height.
INLINE RemeshPoint remeshEdgePoint(int k, int i, int n) {
    RemeshCorner a = remeshCorner(k), b = remeshCorner((k + 1) % 3);
    Real x = Real(n - i), y = Real(i);
    PRECISE Real sum = a.weight * x + b.weight * y;
    PRECISE Real3 position = (a.position * a.weight * x + b.position * b.weight * y) / sum,
                  direction = (a.direction * a.weight * x + b.direction * b.weight * y) / sum;
    PRECISE Real2 uv = (a.uv * a.weight * x + b.uv * b.weight * y) / sum;
    PRECISE Real density = (a.density * a.weight * x + b.density * b.weight * y) / sum;
    return remeshFlatPoint(position, direction, uv, density);
}

// Where the map jumps along an edge: the coordinates that the other side has at a point.
INLINE Real2 remeshBeyond(CONST_REF(RemeshSeam) seam, int k, int i, int n) {
    Real x = remeshCorner(k).weight, y = remeshCorner((k + 1) % 3).weight;
    PRECISE Real sum = x * Real(n - i) + y * Real(i);
    PRECISE Real2 uv = (seam.start * x * Real(n - i) + seam.end * y * Real(i)) / sum;
    return uv;
}

// The i-th grid point of a column, without its height; `a`, `b`, `c`: first, second and apex.
INLINE RemeshPoint remeshInsidePoint(CONST_REF(RemeshSweep) s, CONST_REF(RemeshColumn) inside, int column, int i,
                                     CONST_REF(RemeshCorner) a, CONST_REF(RemeshCorner) b, CONST_REF(RemeshCorner) c) {
    bool isLeft = column <= s.apex.x && s.apex.x > s.first.x;
    ivec2 from = isLeft ? s.first : s.apex, to = isLeft ? s.apex : s.second;
    PRECISE Real alongPrimary = Real(column - s.first.x) / Real(s.second.x - s.first.x),
                 alongSide = Real(column - from.x) / Real(to.x - from.x);
    PRECISE Real up = (Real(inside.from + i) - inside.bottom) / (inside.top - inside.bottom);
    PRECISE Real start = up * (Real(1) - alongSide), end = up * alongSide;
    PRECISE Real x = (Real(1) - up) * (Real(1) - alongPrimary) + (isLeft ? start : Real(0)),
                 y = (Real(1) - up) * alongPrimary + (isLeft ? Real(0) : end), z = isLeft ? end : start;
    x *= a.weight;
    y *= b.weight;
    z *= c.weight;
    PRECISE Real sum = x + y + z;
    PRECISE Real3 position = (x * a.position + y * b.position + z * c.position) / sum,
                  direction = (x * a.direction + y * b.direction + z * c.direction) / sum;
    PRECISE Real2 uv = (x * a.uv + y * b.uv + z * c.uv) / sum;
    PRECISE Real density = (x * a.density + y * b.density + z * c.density) / sum;
    return remeshFlatPoint(position, direction, uv, density);
}

// Adds the points of a column: the corners if it is the first; its point of the primary edge; those of the side edge
// up to the next column; all of an edge that lies along it; its grid points, of which `insideFirst` is the first.
INLINE void remeshAddPoints(CONST_REF(RemeshSweep) s, int column, uint insideFirst) {
    bool isSwept = s.plan.isWhole == 0, isFirst = column == s.first.x || !isSwept;
    int corners = isFirst ? 3 : 0, primaries = isFirst ? 0 : 1, tops = 0, uprights = 0, topFirst = 0;
    int topFrom = 0, topTo = 1, upright = s.plan.first;
    RemeshColumn inside = remeshInside(s, column);
    if (isSwept) {
        RemeshTop top = remeshTop(s, column);
        topFrom = top.from;
        topTo = top.to;
        topFirst = top.first + 1;
        tops = max(min(top.last, top.cells - 1) - top.first, 0);
        bool isAtFirst = isFirst && s.apex.x == s.first.x;
        bool isAtSecond = column + 1 == s.second.x && s.apex.x == s.second.x;
        upright = isAtFirst ? s.plan.first : s.plan.second;
        if (isAtFirst || isAtSecond) uprights = remeshCellsBetween(s, upright, s.plan.apex) - 1;
    }
    int beforeTops = corners + primaries, beforeUprights = beforeTops + tops, beforeInside = beforeUprights + uprights;
    RemeshCorner a = remeshCorner(s.plan.first), b = remeshCorner(s.plan.second), c = remeshCorner(s.plan.apex);
    for (int j = 0; j < beforeInside + inside.count; ++j) {
        RemeshPoint point;
        Real2 beyond;
        uint number;
        bool hasSeam = false;
        int side = 3;  // the edge that it is on; 3: none
        int ownCorner = j < corners ? j : -1;
        if (j >= beforeInside) {
            number = insideFirst + uint(j - beforeInside);
            point = remeshInsidePoint(s, inside, column, j - beforeInside, a, b, c);
        } else if (j >= corners) {
            bool isTop = j >= beforeTops && j < beforeUprights, isUpright = j >= beforeUprights;
            int from = isTop ? topFrom : isUpright ? upright : s.plan.first;
            int to = isTop ? topTo : isUpright ? s.plan.apex : s.plan.second;
            int i = isTop ? topFirst + j - beforeTops : isUpright ? 1 + j - beforeUprights : column - s.first.x;
            bool isAhead = (from + 1) % 3 == to;
            int k = isAhead ? from : to, cells = s.cells[k], n = remeshParts(k, cells),
                along = remeshPart(isAhead ? i : cells - i, cells, n);
            number = remeshOnEdge(s, from, to, i);
            if (along == 0 || along == n) {
                ownCorner = along == 0 ? k : (k + 1) % 3;
            } else {
                RemeshSeam seam = remeshSeam(k);
                point = remeshEdgePoint(k, along, n);
                side = k;
                hasSeam = seam.is;
                if (hasSeam) beyond = remeshBeyond(seam, k, along, n);
            }
        } else {
            number = s.firstVertex + uint(j);
        }
        if (ownCorner >= 0) {
            RemeshCorner corner = remeshCorner(ownCorner);
            point.position = corner.position;
            point.direction = corner.direction;
            point.uv = corner.uv;
            point.density = corner.density;
            point.height = corner.height;
        }
        if (ownCorner < 0) {
            Real texels = remeshTexelsAt(point.position, point.density);
            RemeshFootprint sampled = remeshHeightFootprint(texels, remeshHeightLevel(side));
            point.height = remeshHeightAt(sampled, texels, point.uv, point.position, point.direction);
            // Where the map jumps, an edge's point has the higher of its two sides' heights.
            if (hasSeam)
                point.height =
                    max(point.height, remeshHeightAt(sampled, texels, beyond, point.position, point.direction));
        }
        PRECISE Real3 position = point.position + point.height * point.direction;
        remeshAddVertex(number, position, point.uv, point.height);
    }
}

// Adds what a column of a piece adds.
INLINE void remeshAddColumn(CONST_REF(RemeshSweep) s, int column, uint insideFirst) {
    remeshAddPoints(s, column, insideFirst);
    if (s.plan.isWhole != 0)
        remeshAddTriangle(s.firstVertex, s.firstVertex + 1u, s.firstVertex + 2u);
    else
        remeshAddStrip(s, remeshStrip(s, column, insideFirst, insideFirst + uint(remeshInside(s, column).count)));
}
