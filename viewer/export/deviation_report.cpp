#include "viewer/export/deviation_report.h"

#include <algorithm>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace vcp {

namespace {

constexpr size_t kReportBins = 60;

}  // namespace

double usualRange(const Deviation& deviation, double diagonal) {
    const double most = deviation.absoluteQuantile(0.99);
    return most > 0 ? most : std::max(diagonal * 1e-6, 1e-300);
}

nlohmann::ordered_json deviationJson(const Deviation& d, const ComparedSurfaces& compared,
                                     const std::string& direction) {
    using Json = nlohmann::ordered_json;
    const DeviationHistogram histogram = histogramOf(d, compared.range, kReportBins);
    Json figures = {{"mean", d.mean}, {"rms", d.rms}, {"mean_absolute", d.meanAbsolute}};
    for (const auto& [word, part] : kDeviationQuantiles) figures[word] = d.quantile(part);
    figures["min"] = d.distances.front();
    figures["max"] = d.distances.back();
    figures["absolute_p50"] = d.absoluteQuantile(0.5);
    figures["absolute_p95"] = d.absoluteQuantile(0.95);
    figures["absolute_p99"] = d.absoluteQuantile(0.99);
    figures["absolute_max"] = d.absoluteQuantile(1);
    figures["samples"] = d.samples;
    figures["without_counterpart"] = d.withoutCounterpart();
    figures["histogram"] = {{"range", histogram.range},
                            {"counts", histogram.counts},
                            {"below", histogram.below},
                            {"above", histogram.above}};
    return {{"a", compared.a},
            {"b", compared.b},
            {"unit", compared.unit.empty() ? Json() : Json(compared.unit)},
            {"certified_a", compared.certifiedA},
            {"certified_b", compared.certifiedB},
            {direction, figures}};
}

std::string deviationCsv(const Deviation& d, double range) {
    std::string text = "quantity,from,to,value\n";
    const auto figure = [&](const char* name, double value) { text += fmt::format("{},,,{}\n", name, value); };
    figure("mean", d.mean);
    figure("rms", d.rms);
    figure("mean_absolute", d.meanAbsolute);
    for (const auto& [word, part] : kDeviationQuantiles) figure(word, d.quantile(part));
    figure("min", d.distances.front());
    figure("max", d.distances.back());
    text += fmt::format("samples,,,{}\nwithout_counterpart,,,{}\n", d.samples, d.withoutCounterpart());
    const DeviationHistogram h = histogramOf(d, range, kReportBins);
    text += fmt::format("count,,{},{}\n", -h.range, h.below);
    for (size_t i = 0; i < kReportBins; ++i)
        text += fmt::format("count,{},{},{}\n", h.lowerEnd(i), h.lowerEnd(i) + h.binWidth(), h.counts[i]);
    return text + fmt::format("count,{},,{}\n", h.range, h.above);
}

}  // namespace vcp
