// What the CPU hands to the mesostructure shaders, besides what mesostructure/shared/ lays out. Compiles as C++
// (render/shared/meso_view.h) and as GLSL; made of groups of 16 bytes as frame_layout.h is.

const uint kMesoColours = 1u, kMesoNormals = 2u;  // bits of kTextures, which is their sum

const float kMesoSun = 0.72f;  // what a light of strength 1 gives at most, as sunlightOf (hit_light.h)

// What the pictures show.
const uint kMesoShowLit = 0u, kMesoShowHeat = 1u, kMesoShowNormals = 2u, kMesoShowUnlit = 3u;
const float kMesoHottest = 100.0f;  // iterations that the heat map shows as its hottest

const float kMesoNoHit = 1e30f;  // from here on, a depth is none

// The planes of the hits of a picture: the depth along the unit ray, the packed normal (hit_records.glsl; 0: no hit),
// the look (ShellLook), iterations, and how much of each light arrives (8 bits each).
const uint kMesoPlaneDepth = 0u, kMesoPlaneNormal = 1u, kMesoPlaneLook = 2u, kMesoPlaneIterations = 3u,
           kMesoPlaneLight = 4u;
const uint kMesoPlanes = 5u;
// One more, where surfaces have transfer: the light from everywhere that a hit gets (packedLight; 0: none is known).
const uint kMesoPlaneTransfer = 5u;
// And three, where rays of light go through surfaces from remeshed ones: by how much they start elsewhere than where
// the pixel's own ray is at its depth (kStarts: the first of them; 0: there are none).
const uint kMesoStartPlanes = 3u;
const uint kMesoTransferKept = 1u, kMesoTransferRead = 2u;  // kTransfer: the plane is there; the surface fills it

const uint kMesoMaxSections = 6u;
const uint kMesoMaxLights = 4u;

// A ray of light through surfaces from what a picture shows, whatever that is (FrameConstants, SceneRay).
struct MesoLightRay {
    uint number;  // of the rays into the sky; kSunRay, of the first light, and the numbers below it of the others
    uint isFirst, isLast;  // 1: of all that the ray goes through
    uint occlusionRays, sampleNumber;
    float reach;  // of occlusion, world units
    uint unused0, unused1;
};

// A texture over the tile, with its smaller levels.
struct MesoImage {
    uint first;  // texel
    uint width, height, levels;
};

// Where a volume of transfer lies among a surface's looks.
struct MesoTransfer {
    uint first;             // texel
    uint across, back, up;  // cells along x, y, z; 0: there is none
};

// A picture of one surface, in the space of its shell.
struct MesoView {
    vec4 eye, eyeX, eyeY;              // ray of the pixel x, y: origin
    vec4 forward, forwardX, forwardY;  // and direction, not normalized
    uint width, height;                // of the picture; of a list of rays the width is their number
    uint nodes;                        // of the shell
    uint withBase;                     // 1: the base is drawn too
    vec3 colour;                       // of what the surface is made
    uint lightCount;
    vec3 up;     // unit
    uint shows;  // what the picture shows
    MesoImage colours, normals;
    float strayPixels;  // that a surface may stray from its mean height and not be marched
    float meanHeight;   // tile units
    uint farShadows;    // 1: what is seen from far has the shadows of the mesostructure on itself
    uint sectionCount;
    float shadowLift;             // world units by which shadow rays start above a hit
    uint hasEnvironment;          // 0 or 1
    uint hasBaseLight;            // 1: the base changes the light of the surroundings (mesostructure/base_transfer.h)
    uint pieces;                  // of the shell
    vec4 lights[kMesoMaxLights];  // unit, towards each light; w: its strength
    vec4 sections[kMesoMaxSections];  // as FrameConstants::sections, in world units from the shell's origin
    vec4 environment[9];              // as FrameConstants::environment, world axes
    MesoTransfer transfer;
    vec4 harmonics[16];  // of the radiance of the surroundings, world axes (mesostructure/shared/harmonics.h)
};
