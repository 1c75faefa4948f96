// The sizes of a shell's texels (mesostructure/shell.h) and of an appearance's (mesostructure/appearance.h). Compiles
// as C++ (mesostructure/march_math.h) and as GLSL.

const uint kShellNodeTexels = 2u, kShellPieceTexels = 7u;
const uint kShellDepth = 32u;     // of the tree of nodes
const uint kShellBaseFace = 16u;  // the bit of a piece's face that is the base
// Two bits from this one on: which of its prism's three pieces it is. A prism has a column over each corner of its base
// triangle; of the piece with the number k both corners of column 2 - k are the piece's, and one of each other.
const uint kShellPart = 5u;
// The bit of a shell that turns gently all over, and has no column that is cut: all its pieces have it.
const uint kShellSmooth = 128u;

const uint kAppearanceViews = 8u;   // along an edge of the grid
const uint kAppearanceTexels = 6u;  // of a view
