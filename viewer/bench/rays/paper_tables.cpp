#include "viewer/bench/rays/paper_tables.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include <fmt/format.h>

#include "viewer/bench/rays/bench_rays.h"

namespace vcp {

namespace {

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

/// The order is VCP, signed distance, voxel, sparse voxel octree with contours.
using FourMethods = std::array<double, 4>;
struct Published {
    const char* name;
    FourMethods values;
};
/// Table 1, MiB. Voxels have half the cell, except for Sponza, where they have the same; it is left out here.
constexpr std::array<Published, 2> kMebibytes = {
    {{"Thai statue", {1075, 1075, 1096, 860}}, {"David", {980, 980, 960, 770}}}};
/// Table 2, milliseconds of a frame.
constexpr std::array<Published, 7> kMilliseconds = {{{"Thai 1", {8.6, 8.2, 8.0, 8.1}},
                                                     {"Thai 2", {11.7, 11.1, 10.6, 11.0}},
                                                     {"Thai 3", {20.4, 19.8, 19.4, 18.2}},
                                                     {"David", {9.1, 8.7, 8.2, 8.9}},
                                                     {"Sponza", {18.3, 17.7, 18.7, kUnknown}},
                                                     {"Raptor (top)", {16.7, 16.2, 15.9, 14.2}},
                                                     {"Raptor (bottom)", {13.2, 12.9, 12.7, 16.8}}}};

struct OurMethod {
    const char *method, *knob;
};
constexpr std::array<OurMethod, 4> kOurs = {
    {{"paper", "eps 0.25"}, {"sdf", "cell 1"}, {"voxel", "cell 0.5"}, {"svo-contours", "cell 1"}}};

/// Means over a model's rows of the four methods.
struct OurModel {
    std::string name;
    FourMethods bytes{}, nanoseconds{}, p50{}, p99{}, normal{};
};

std::optional<OurModel> modelOf(const BenchRaysReport& report, const std::string& name) {
    OurModel model{.name = name};
    for (size_t i = 0; i < kOurs.size(); ++i) {
        double rows = 0;
        for (const BenchRaysRow& row : report.rows) {
            if (row.model != name || row.method != kOurs[i].method || row.knob != kOurs[i].knob) continue;
            model.bytes[i] += double(row.bytes);
            model.nanoseconds[i] += row.nsPerRay;
            model.p50[i] += row.classes.distanceCells.p50;
            model.p99[i] += row.classes.distanceCells.p99;
            model.normal[i] += row.classes.normalDegrees.p50;
            ++rows;
        }
        // Without rows a value is not a number, and is printed as nothing.
        for (FourMethods* values : {&model.bytes, &model.nanoseconds, &model.p50, &model.p99, &model.normal})
            (*values)[i] /= rows;
    }
    const auto known = [&](size_t i) { return std::isfinite(model.bytes[i]); };
    if (!known(0) || !known(1) || !(known(2) || known(3))) return {};
    return model;
}

FourMethods ratios(const FourMethods& values) {
    FourMethods out{};
    for (size_t i = 0; i < values.size(); ++i) out[i] = values[i] / values[0];
    return out;
}

std::string line(const std::string& name, const FourMethods& values, const char* format = "{:.2f}") {
    std::string text = fmt::format("| {} |", name);
    for (const double value : values)
        text += std::isfinite(value) ? fmt::format(" {} |", fmt::format(fmt::runtime(format), value)) : " |";
    return text + "\n";
}

/// Means over the models that have a value.
class MeanOfMethods {
public:
    void add(const FourMethods& values) {
        for (size_t i = 0; i < values.size(); ++i)
            if (std::isfinite(values[i])) {
                sum_[i] += values[i];
                ++count_[i];
            }
    }
    [[nodiscard]] FourMethods mean() const {
        FourMethods out{};
        for (size_t i = 0; i < out.size(); ++i) out[i] = sum_[i] / count_[i];
        return out;
    }

private:
    FourMethods sum_{}, count_{};
};

constexpr const char* kHead = "| | VCP (paper) | signed distance | voxels | contours |\n|---|---|---|---|---|\n";

template <class Rows>
std::string ratioTable(const Rows& published, const std::vector<OurModel>& models, FourMethods OurModel::*values) {
    std::string text = kHead;
    MeanOfMethods theirs, ours;
    for (const Published& row : published) {
        text += line(std::string("published: ") + row.name, ratios(row.values));
        theirs.add(ratios(row.values));
    }
    for (const OurModel& model : models) {
        text += line(fmt::format("here: {}", model.name), ratios(model.*values));
        ours.add(ratios(model.*values));
    }
    FourMethods quotient = ours.mean();
    for (size_t i = 0; i < quotient.size(); ++i) quotient[i] /= theirs.mean()[i];
    return text + line("**mean here over mean published**", quotient);
}

}  // namespace

std::string besidePaperMarkdown(const BenchRaysReport& report) {
    std::vector<OurModel> models;
    for (const BenchRaysRow& row : report.rows) {
        if (std::ranges::find(models, row.model, &OurModel::name) != models.end()) continue;
        if (auto model = modelOf(report, row.model)) models.push_back(std::move(*model));
    }
    if (models.empty()) return "";
    std::string text =
        "\n## Beside Demir and Westermann 2015\n\nRatios to their method (`paper`, eps 0.25) at the resolutions of "
        "their Table "
        "1: signed distances and contours at the same cell, voxels at half of it.\n\n### Bytes (Table 1)\n\nHere "
        "voxels and contours are only those that triangles touch, without colours and normals, 4 bytes or less a node "
        "and contour. What theirs held is not published.\n\n";
    text += ratioTable(kMebibytes, models, &OurModel::bytes);
    text += "\n### Time (Table 2)\n\nTheirs on a GTX 580, these on this machine's processor; means over cameras.\n\n";
    text += ratioTable(kMilliseconds, models, &OurModel::nanoseconds);
    text += "\n### Quality at these bytes (their Fig. 11, in numbers)\n\n";
    text += kHead;
    for (const OurModel& model : models) {
        text += line(model.name + ": error p50, cells", model.p50, "{:.4f}");
        text += line(model.name + ": error p99, cells", model.p99, "{:.4f}");
        text += line(model.name + ": normals p50, degrees", model.normal, "{:.1f}");
    }
    return text;
}

}  // namespace vcp
