// What the CPU hands to the mesostructure shaders. Compiles as C++ (render/meso_arrays.h) and as GLSL; made of 16-byte
// vectors as frame_layout.h is. All arrays of an asset are one buffer of 32-bit words, read as single words and as
// aligned fours ("quads"); bytes and 16-bit values are packed low end first.

const uint kMesoMaxLevels = 14u;
const uint kMesoMostBorders = 32u;

// The values of the specialization constants, in the order of their ids.
const uint kMesoGrid = 0u, kMesoRelief = 1u, kMesoPyramid = 2u, kMesoSphere = 3u;            // kWalk
const uint kMesoOccupancy = 0u, kMesoDistances = 1u, kMesoCompressed = 2u, kMesoBoxes = 3u;  // kSkip
const uint kMesoCell = 0u, kMesoPatches = 1u, kMesoHeights = 2u, kMesoField = 3u;            // kSurface
const uint kMesoUnrefined = 0u, kMesoBinary = 1u, kMesoSecant = 2u, kMesoAsPrinted = 3u,
           kMesoIllinois = 4u;  // kRefinement

const uint kMesoColours = 1u, kMesoNormals = 2u;  // bits of kTextures, which is their sum

const uint kMesoFarViews = 8u, kMesoFarTexels = 6u;  // those of meso::Appearance

// The parts of the light: of the sun by n . l, of the sky by how far n points up, and from everywhere.
const float kMesoSun = 0.72f, kMesoSky = 0.18f, kMesoAmbient = 0.10f;

const uint kMesoHit = 0u, kMesoMiss = 1u, kMesoUnresolved = 2u;

struct MesoRecord {
    vec4 extent;                   // of the tile; w: tile units of one step of a length
    vec4 cell;                     // tile units; w: (sphere) the distance that is a hit
    ivec4 cells;                   // of the grid; w: cells in all
    ivec4 fine;                    // texels or samples along the axes; w: (sphere, relief) steps at most
    ivec4 ratio;                   // of them a cell; w: (relief) refinements at most
    ivec4 cones;                   // azimuths, elevations; (compressed) z: levels; (pyramid) z: levels
    ivec4 top;                     // (compressed) entries of level 0
    uvec4 at;                      // first words: what skips; texels, samples or ranks; rows; first quad of the patches
    vec4 scale;                    // height of a step, of the slab; (relief) tolerance; (sphere) tile units of a step
    uvec4 levels[kMesoMaxLevels];  // compressed: steps, entries, edge * 65536 + factor, bricks; pyramid: maxima,
                                   // columns, rows
    vec4 borders[kMesoMostBorders];  // of cones: azimuth x y, elevation x y (meso::ConeBorders)
};

// What the pictures show.
const uint kMesoShowLit = 0u, kMesoShowHeat = 1u, kMesoShowNormals = 2u, kMesoShowUnlit = 3u;

// A picture of one surface, in the space of its shell. Hits of a pixel: the depth along the unit ray, the packed
// normal (hit_records.glsl), colour and light, iterations.
struct MesoView {
    vec4 eye, eyeX, eyeY;              // ray of the pixel x, y: origin
    vec4 forward, forwardX, forwardY;  // and direction, not normalized
    uvec4 picture;                     // width, height; z: nodes of the shell; w: 1: the base is drawn too
    vec4 light;                        // unit, towards the light; w: world units by which shadow rays start above a hit
    vec4 colour;                       // of what the surface is made; w: 1: shadows
    vec4 up;                           // unit; w: what the picture shows
    uvec4 colours, normals;            // textures: first texel, width, height, levels
    vec4 far;  // pixels that a surface may stray from its mean height and not be marched; that height, tile units; 1:
               // light with shadows
};

const uint kMesoPlanes = 4u;
const float kMesoMostIterations = 100.0f;  // what the heat map shows as its hottest
