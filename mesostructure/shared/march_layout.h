// The arrays that a marcher reads, and the record that says where each begins. Compiles as C++
// (mesostructure/march_math.h) and as GLSL, made of groups of 16 bytes. All arrays are one run of 32-bit words, read
// as single words and as aligned fours ("quads"); bytes and 16-bit values are packed low end first.

const uint kMesoMaxLevels = 14u;
const uint kMesoMostBorders = 32u;

// The values of the constants that choose a marcher.
const uint kMesoGrid = 0u, kMesoRelief = 1u, kMesoPyramid = 2u, kMesoSphere = 3u, kMesoGdm = 4u, kMesoVdm = 5u,
           kMesoSlices = 6u;                                                                                  // kWalk
const uint kMesoOccupancy = 0u, kMesoDistances = 1u, kMesoCompressed = 2u, kMesoBoxes = 3u, kMesoGuess = 4u;  // kSkip
const uint kMesoTable = 0u, kMesoFactored = 1u;         // kSkip of a displacement map
const uint kMesoDensity = 0u, kMesoVisibilityBit = 1u;  // kSurface of a displacement map
const uint kMesoCell = 0u, kMesoPatches = 1u, kMesoHeights = 2u, kMesoField = 3u,
           kMesoLayers = 4u;  // kSurface; the last of relief mapping
const uint kMesoUnrefined = 0u, kMesoBinary = 1u, kMesoSecant = 2u, kMesoAsPrinted = 3u,
           kMesoIllinois = 4u;                  // kRefinement
const uint kMesoStraight = 0u, kMesoBent = 1u;  // kRefinement of a view-dependent map: over flat bases, or all

const uint kMesoHit = 0u, kMesoMiss = 1u, kMesoUnresolved = 2u;  // the states of a ray

const uint kMesoMostIterations = 8192u;  // of a walk; then the ray is unresolved
const uint kMesoMostSteps = 254u;        // the longest length of a distance map
const uint kMesoOccupied = 255u;         // in place of a length
const uint kMesoBrick = 0x80000000u;     // in place of a block's length, with the number of its brick

// The word of an occupied cell of octant boxes, and of one that says which of its small cells the surface passes.
const uint kMesoBoxOccupied = 0x8000u, kMesoSmallCells = 0x4000u;

// A level of a compressed map or of a pyramid.
struct MesoLevel {
    uint first;          // word of the entries, or of the maxima
    uint entries;        // of a cone, or of a row
    uint edgeAndFactor;  // (compressed) edge * 65536 + factor
    uint unused;
};

// Where cones meet (meso::ConeBorders).
struct MesoBorder {
    vec2 azimuth, elevation;
};

struct MesoRecord {
    vec3 extent;  // of the tile
    float unit;   // tile units of one step of a length
    vec3 cell;    // edges, tile units
    float reach;  // (sphere) the distance that is a hit, tile units
    ivec3 cells;  // of the grid
    int cellCount;
    ivec3 fine;                            // texels, samples or a displacement map's points along the axes
    int mostSteps;                         // (sphere, relief)
    ivec3 ratio;                           // texels or samples a cell
    int mostRefinements;                   // (relief)
    int azimuths, elevations, levelCount;  // (displacement maps, guesses) the last is groups of terms, or of layers
    int columnCount;                       // (displacement maps, guesses) of the matrix; its rows are cellCount
    ivec3 top;                             // (compressed) entries of level 0
    int clusters;                          // (guesses)
    ivec3 volume;                          // (displacement maps, slices) points of the solid's density and normals
    int valueBits;                         // (displacement maps) 8 or 16
    uint guessRows, guessColumns;          // first quads
    int guesses;                           // that a ray makes at most
    float product;                         // (guesses) tile units of a weight times a value
    uint skipping;                         // word of what skips
    uint data;                             // word of texels, samples or ranks
    uint rows;                             // word of the rows
    uint patches;                          // first quad of the patches
    float step;           // tile units of a step of a height or (sphere, displacement maps) of a distance
    float height;         // of the slab, tile units
    float tolerance;      // (relief)
    uint patchNormals;    // first quad of the patches' normals; 0: there are none
    int curvatures;       // (view-dependent maps) samples of the base's curvature
    float mostCurvature;  // and the greatest, 1 over tile units
    uint unused0, unused1;
    MesoLevel levels[kMesoMaxLevels];
    MesoBorder borders[kMesoMostBorders];
};
