// What the CPU hands to the shaders for a frame. Compiles as C++ (render/shared/frame.h) and as GLSL; every
// struct is made of 16-byte vectors and of scalars in fours, so that both agree on the layout, and a test reads the
// offsets back out of the SPIR-V.
//
// Lattice: the root page's edge is 2^30 lattice units, so every page's box has integer corners; points
// where rays cross page walls are rounded to it, and both pages at a wall see the same point.
// Ray parameter: cells of the finest level along the unit direction, from the eye (orthographic: from the
// picture's plane).

const uint kLatticeBits = 30u;
const uint kTileSize = 8u;
const uint kMaxPoolChunks = 8u;

// A tile list is dispatched in rows of this many workgroups.
const uint kTileRow = 256u;

// Shading modes, as in ShadingMode.
const uint kShadeLit = 0u;
const uint kShadeClay = 1u;
const uint kShadeNormals = 2u;
const uint kShadeUnlit = 3u;
// The false colours begin here.
const uint kShadeSteps = 4u;
const uint kShadeCells = 5u;
const uint kShadeFetches = 6u;
const uint kShadeLevel = 7u;
const uint kShadeError = 8u;
// The false colours end here.
const uint kShadeWireframe = 9u;
// The counts of work that false colours show as 1.
const float kMostShownSteps = 64.0f;
const float kMostShownCells = 16.0f;
const float kMostShownFetches = 128.0f;

const uint kMaxSections = 6u;
const uint kMaxLights = 4u;
const uint kMaxMoreLights = 3u;

struct FrameConstants {
    // Ray of the picture's point x, y (pixels): origin + x originX + y originY, in finest cells relative to
    // originLattice; direction + x directionX + y directionY, not normalized.
    vec4 origin, originX, originY;
    vec4 direction, directionX, directionY;
    ivec4 originLattice;
    float latticePerCell, cellPerLattice;  // lattice units a finest cell, and its reciprocal
    float feedbackX, feedbackY;            // where in its part of the picture a feedback ray goes, 0 to 1
    uint width, height, tilesX, tilesY;    // size of the picture, in pixels and in tiles
    uint log2Cells;                        // log2 of cells an edge of a page
    uint finestLevel;
    uint stripes;  // of the tile list: see stripedIndex in tiles.glsl
    uint shadingMode;
    vec4 lightDirection;                 // unit, world axes, towards the first light; w: its strength
    vec4 upDirection;                    // unit: where the hemisphere's light comes from
    vec4 clay;                           // encoded for the screen
    vec4 cap;                            // colour of cut solids, encoded for the screen
    float pixelEdge, pixelEdgePerDepth;  // a pixel's edge at a depth, finest cells: first + second * depth
    float occlusionReach;                // how far occlusion reaches, finest cells
    float lightLift;                     // how far above the surface rays of light begin, in pixels
    uint lightPlane;                     // the hits' plane of light or false colours; below 2: there is none
    uint sectionCount;
    uint occlusionRays;   // a pixel
    uint hasShadows;      // 0 or 1
    float paperEpsilon;   // of the method `paper`, finest cells
    float worldPerCell;   // world units a finest cell
    uint hasEnvironment;  // 0 or 1
    uint sampleNumber;    // of the pixels (render/pixel_samples.h): 0: their middles
    // Rows of another picture that accumulate.comp adds this one to: from partRow on, partRows of them, for which this
    // one has skippedRows above (render/picture_parts.h).
    uint partRow, partRows, skippedRows;
    uint firstHitMark;  // word of the feedback buffer with the first mark of a page that was hit; 0: there are none
    vec4 rotation;      // quaternion: world from the dataset's axes
    uint lightCount;
    float opacity;  // part of the samples in which the dataset is there
    uint unused0, unused1;
    vec4 moreLights[kMaxMoreLights];  // the other lights, as lightDirection
    // What has dot(xyz, p) + w >= 0 is kept; p in finest cells relative to originLattice.
    vec4 sections[kMaxSections];
    // The light from everywhere on a surface with the normal x, y, z: red, green and blue of 1, x, y, z, xy, yz, zx, x
    // x and y y.
    vec4 environment[9];
};

// A record of the table is a node of the frame's page tree: three structs, each one texel.
struct TableNode {
    // Bits 0..7: octants that have a child; bit 8: this page is in the cut; bit 9: it is resident, so that its fields
    // are there; bit 10: this is an octant of a page, which is drawn in the place of the page that would be here: all
    // but `root` is that page's; bits 11 and 12: it has open parts, and no others; bit 13: marks tell which are open;
    // bit 14: its vertices have points in images;
    // bits 16..31: its certified error in finest cells, the upper half of a float, rounded up.
    uint flags;
    uint firstChild;  // number in the table
    uint root;        // root word of the page, or that of the octant
    uint pageTexel;   // of the page in the pool
};
struct TableSections {
    uint faces, vertices, normals, strips;  // texels in the pool
};
struct TableColours {
    uint faces, vertices;  // texels in the colour pool
    uint entry;            // of the page in the directory
    uint asked;            // entry of the page that is here, or would be
};
struct TableRecord {
    TableNode node;
    TableSections sections;
    TableColours colours;
};
const uint kRecordTexels = 3u;
const uint kRecordInCut = 256u;
const uint kRecordResident = 512u;
const uint kRecordIsOctant = 1024u;
const uint kRecordHasOpen = 2048u;
const uint kRecordIsOpen = 4096u;
const uint kRecordHasMarks = 8192u;
const uint kRecordHasPoints = 16384u;
const uint kRecordErrorMask = 0xffff0000u;

// The list of tiles to trace. Three words of an indirect dispatch, the count, then each tile's place: x + 2^16 y.
const uint kTileListHeader = 4u;

// The start distance of a tile in which no ray can hit.
const float kTileEmpty = 3e38f;

// The depth of a pixel whose ray hits nothing.
const float kNoHit = 3e38f;
// The depth of a pixel whose ray gave up.
const float kGaveUp = 3.1e38f;

// Feedback: a ray for each of 24 x 16 parts of the picture. Its buffer has four words a ray (lattice point of the
// hit; number in the table, plus 1, of the page that was hit, or 0), then a word a record of the table: the sum of
// kNearnessOne eps / (a + eps) over the rays that went into that page at a distance a. Then come two words a record, of
// which the first is 1 where rays of the camera hit that page or begin in it, and the second where rays of light do.
const uint kFeedbackWidth = 24u;
const uint kFeedbackHeight = 16u;
const uint kFeedbackRays = 384u;
const uint kFeedbackRayWords = 4u;
const uint kHitByCamera = 0u;
const uint kHitByLight = 1u;
const float kNearnessOne = 65536.0f;
const float kNearnessEps = 0.015625f;  // edges of the root page

// A ray of light through one of several datasets (scene_light.comp).
struct SceneRay {
    uint number;           // of the rays into the sky; kSunRay
    uint isFirst, isLast;  // 1: of the datasets that the ray goes through
    uint unused;
};
const uint kSunRay = 0xffffffffu;  // of the first light; those of the others have the numbers below

// Planes of a picture of several datasets that shade each other, words: the packed normal in the world's axes
// (hit_records.glsl), by how many world units rays of light begin above the hit (float bits; negative where a surface
// is seen from far, which any light may reach), light (8 bits sun, 8 bits sky, as shade.comp has them; before the last
// ray into the sky the sum of what these see, float bits), and where the ray that is being cast was stopped (float
// bits; world units).
const uint kSceneNormal = 0u;
const uint kSceneLift = 1u;
const uint kSceneLight = 2u;
const uint kSceneNear = 3u;
const uint kScenePlanes = 4u;

struct FrameCounters {
    uint hitPixels;
};
