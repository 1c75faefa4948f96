#include "viewer/bench/rays/levels_saved.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include <fmt/format.h>

#include "viewer/bench/rays/bench_rays.h"

namespace vcp {

namespace {

constexpr double kLeastPower = 0.1;  // of the cell, in a value that depends on it
constexpr std::array<const char*, 3> kPeers = {"sdf", "voxel", "svo-contours"};

/// Means over a model's cameras.
struct MeanRow {
    std::string method, knob;
    double bytes = 0, p50 = 0, p95 = 0, normal = 0;
};
struct Measure {
    const char* name;
    double MeanRow::*value;
};
constexpr std::array<Measure, 3> kMeasures = {
    {{"p50, cells", &MeanRow::p50}, {"p95, cells", &MeanRow::p95}, {"normals p50, degrees", &MeanRow::normal}}};

std::vector<MeanRow> meansOf(const BenchRaysReport& report, const std::string& model) {
    std::vector<MeanRow> means;
    std::vector<double> counts;
    for (const BenchRaysRow& row : report.rows) {
        if (row.model != model) continue;
        const auto found = std::ranges::find_if(
            means, [&](const MeanRow& mean) { return mean.method == row.method && mean.knob == row.knob; });
        const auto i = size_t(found - means.begin());
        if (found == means.end()) means.push_back({.method = row.method, .knob = row.knob}), counts.push_back(0);
        means[i].bytes += double(row.bytes);
        means[i].p50 += row.classes.distanceCells.p50;
        means[i].p95 += row.classes.distanceCells.p95;
        means[i].normal += row.classes.normalDegrees.p50;
        ++counts[i];
    }
    for (size_t i = 0; i < means.size(); ++i)
        for (const auto value : {&MeanRow::bytes, &MeanRow::p50, &MeanRow::p95, &MeanRow::normal})
            means[i].*value /= counts[i];
    return means;
}

/// Returns a peer's points, finest first.
std::vector<PeerPoint> pointsOf(const std::vector<MeanRow>& means, const std::string& peer, double MeanRow::*value) {
    constexpr std::string_view prefix = "cell ";
    std::vector<PeerPoint> points;
    for (const MeanRow& mean : means)
        if (mean.method == peer && mean.knob.starts_with(prefix) && mean.*value > 0)
            points.push_back({std::stod(mean.knob.substr(prefix.size())), mean.*value});
    std::ranges::sort(points, {}, &PeerPoint::cell);
    return points;
}

/// Returns how many levels a cell is finer than that of the vectors, to a tenth.
std::string levels(const PeerCell& at) {
    // Adding 0 takes the sign off a zero.
    return fmt::format("{}{:.1f}", at.isExtrapolated ? "~" : "", std::round(-10 * at.log2Cell) / 10 + 0.0);
}

std::string levelsText(const std::vector<PeerPoint>& points, double value) {
    if (points.size() < 2 || !(value > 0)) return " |";
    const auto at = peerCellWith(points, value);
    return at ? " " + levels(*at) + " |" : " never |";
}

/// Returns a peer's error at a cell: as peerCellWith, the other way round.
double errorAt(const std::vector<PeerPoint>& points, double log2Cell) {
    size_t i = 0;
    while (i + 2 < points.size() && std::log2(points[i + 1].cell) < log2Cell) ++i;
    const double from = std::log2(points[i].cell), to = std::log2(points[i + 1].cell), a = std::log2(points[i].value),
                 b = std::log2(points[i + 1].value);
    return std::exp2(a + (b - a) * (log2Cell - from) / (to - from));
}

std::string atBytesText(const std::vector<MeanRow>& means, const std::string& peer, const MeanRow& ours) {
    const auto bytes = pointsOf(means, peer, &MeanRow::bytes), errors = pointsOf(means, peer, &MeanRow::p50);
    if (bytes.size() < 2 || errors.size() < 2 || !(ours.p50 > 0)) return " | |";
    const auto at = peerCellWith(bytes, ours.bytes);
    if (!at) return " never | |";
    return fmt::format(" {} | {}{:.2g} |", levels(*at), at->isExtrapolated ? "~" : "",
                       errorAt(errors, at->log2Cell) / ours.p50);
}

}  // namespace

std::optional<PeerCell> peerCellWith(std::span<const PeerPoint> points, double value) {
    const double wanted = std::log2(value);
    const auto logOf = [&](size_t i) { return std::log2(points[i].value); };
    const size_t last = points.size() - 1;
    // Of the segments that reach the value, the coarsest counts; where none does, the end that is nearest to it.
    std::optional<size_t> segment;
    for (size_t i = 0; i < last; ++i)
        if ((logOf(i) - wanted) * (logOf(i + 1) - wanted) <= 0) segment = i;
    const bool isInside = segment.has_value();
    if (!isInside) segment = std::abs(logOf(0) - wanted) < std::abs(logOf(last) - wanted) ? 0 : last - 1;
    const double from = std::log2(points[*segment].cell), to = std::log2(points[*segment + 1].cell),
                 power = (logOf(*segment + 1) - logOf(*segment)) / (to - from);
    if (!isInside && std::abs(power) < kLeastPower) return std::nullopt;
    return PeerCell{power == 0 ? to : from + (wanted - logOf(*segment)) / power, !isInside};
}

std::string levelsSavedMarkdown(const BenchRaysReport& report) {
    std::string atError, atBytes;
    for (const std::string& model : modelsOf(report)) {
        const std::vector<MeanRow> means = meansOf(report, model);
        const bool hasPeers = std::ranges::any_of(
            kPeers, [&](const char* peer) { return pointsOf(means, peer, &MeanRow::p50).size() > 1; });
        if (!hasPeers) continue;
        for (const MeanRow& ours : means) {
            if (ours.method != "paper") continue;
            const std::string name = fmt::format("| {} | {} | ", model, ours.knob);
            for (const Measure& measure : kMeasures) {
                atError += name + fmt::format("{}: {:.3g} |", measure.name, ours.*measure.value);
                for (const char* peer : kPeers)
                    atError += levelsText(pointsOf(means, peer, measure.value), ours.*measure.value);
                atError += "\n";
            }
            atBytes += name + fmt::format("{:.1f} |", ours.bytes * 1e-6);
            for (const char* peer : kPeers) atBytes += atBytesText(means, peer, ours);
            atBytes += "\n";
        }
    }
    if (atError.empty()) return {};
    return "\n### Levels saved (their Fig. 1)\n\nBy how many levels a peer's tree is deeper where it has the same "
           "error; below 0 it is shallower. Interpolated in\nthe logarithm of the cell; ~: beyond the cells that were "
           "swept, "
           "along the last two; never: its error does not\nfall with the cell. Published: 3 levels (Sponza) and 1 to 5 "
           "(Thai statue) fewer than voxels.\n\n"
           "| model | `paper` | error | signed distance | voxels | contours |\n|---|---|---|---|---|---|\n" +
           atError +
           "\nAt equal bytes: how many levels deeper a peer may be, and its error (p50) there over that of the "
           "vectors.\n\n"
           "| model | `paper` | MB | signed distance | error | voxels | error | contours | error |\n"
           "|---|---|---|---|---|---|---|---|---|\n" +
           atBytes;
}

}  // namespace vcp
