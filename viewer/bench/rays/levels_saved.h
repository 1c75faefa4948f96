// By how many levels a tree of vectors is shallower than one of distances, voxels or contours, at equal error and at
// equal bytes: what Demir and Westermann 2015 say in Fig. 1 (3 levels for Sponza, 1 to 5 for the Thai statue).
#pragma once

#include <optional>
#include <span>
#include <string>

namespace vcp {

struct BenchRaysReport;

/// A peer at one size of its cell. `value`: an error, or bytes.
struct PeerPoint {
    double cell = 1, value = 0;
};
struct PeerCell {
    double log2Cell = 0;
    bool isExtrapolated = false;
};
/// Returns where a peer has a value: linear in the logarithms between two of at least two points, finest first, else
/// along the last two. Nothing where the value hardly depends on the cell there (by less than a tenth of its power).
std::optional<PeerCell> peerCellWith(std::span<const PeerPoint> points, double value);

/// Returns a Markdown section; empty where no model has rows of `paper` and of a peer at several cells. The certified
/// method has no place in it: its finest level is exact.
std::string levelsSavedMarkdown(const BenchRaysReport& report);

}  // namespace vcp
