// The panel's section that compares: what with what, then figures, histogram and the range of the colours.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <fmt/format.h>
#include <imgui.h>
#include <glm/common.hpp>

#include "viewer/export/diverging_colours.h"
#include "viewer/scene/option_values.h"
#include "viewer/window/icons.h"
#include "viewer/window/interface.h"

namespace vcp {

namespace {

constexpr size_t kBars = 64;
constexpr float kHistogramHeight = 72;
// The range of the colours goes from a thousandth of the largest distance to all of it, by powers.
constexpr double kLeastRange = 1e-3;

/// How far from the other surface points may be, as parts of the diagonal.
struct Within {
    const char* name;
    double part;
};
constexpr std::array<Within, 5> kWithin = {{{"All points", std::numeric_limits<double>::infinity()},
                                            {"Points within 10 % of its size", 0.1},
                                            {"Points within 3 % of its size", 0.03},
                                            {"Points within 1 % of its size", 0.01},
                                            {"Points within 0.1 % of its size", 0.001}}};

ImU32 packed(glm::dvec3 colour) {
    const glm::dvec3 c = 255.0 * colour + 0.5;
    return IM_COL32(int(c.x), int(c.y), int(c.z), 255);
}

}  // namespace

bool Interface::canCompare() const { return !session_->layers().empty() && session_->layers().front().triangles > 0; }

void Interface::toggleComparison() {
    if (session_->comparison()) return session_->endComparison();
    if (!canCompare() || session_->saving()) return;
    const std::vector<uint32_t> scans = scansShownFirst();
    if (scans.size() > 1)
        session_->compare(scans[0], scans[1]);
    else
        chooseCompared(scans.front());
}

/// Returns the numbers of the datasets: those that are shown, then the others.
std::vector<uint32_t> Interface::scansShownFirst() const {
    std::vector<uint32_t> scans;
    const std::vector<uint32_t>& hidden = session_->viewer().hidden();
    for (uint32_t i = 0; i < session_->layers().size(); ++i)
        if (session_->layers()[i].triangles > 0) scans.push_back(i);
    std::stable_partition(scans.begin(), scans.end(), [&](uint32_t i) { return !std::ranges::count(hidden, i); });
    return scans;
}

void Interface::chooseCompared(uint32_t dataset) {
    comparesDataset_ = dataset;
    openFileList();
    comparesFile_ = true;
}

void Interface::layOutCompare() {
    if (session_->comparison()) return layOutCompared();
    if (!canCompare()) return wrapped("There is no scan to compare.");
    ImGui::PushStyleColor(ImGuiCol_Text, look_->palette.dim);
    wrapped("How far one surface lies from another, as colours: red in front of it, blue behind.");
    ImGui::PopStyleColor();
    const std::vector<uint32_t> scans = scansShownFirst();
    ImGui::BeginDisabled(session_->saving().has_value());
    layOutComparisonChoice();
    if (scans.size() > 1) {
        const float room = ImGui::GetContentRegionAvail().x - units(64);
        std::vector<std::string> names;
        std::vector<const char*> texts;
        for (const uint32_t scan : scans) names.push_back(fitted(session_->layers()[scan].name, room));
        for (const std::string& name : names) texts.push_back(name.c_str());
        // The choice is of what was open when it was made.
        for (int& each : compared_) each = std::clamp(each, 0, int(scans.size()) - 1);
        comboRow(*look_, "##first", texts, compared_[0], {"The surface that is coloured", ""});
        comboRow(*look_, "##second", texts, compared_[1], {"The surface that distances are measured from", ""});
        ImGui::BeginDisabled(compared_[0] == compared_[1]);
        if (textButton(*look_, nullptr, "Compare the two", {"Colour the first by its distance from the second", ""}, -1,
                       true))
            session_->compare(scans[size_t(compared_[0])], scans[size_t(compared_[1])]);
        ImGui::EndDisabled();
    }
    const uint32_t first = scans.size() > 1 ? scans[size_t(compared_[0])] : scans.front();
    if (textButton(*look_, icon::kOpen, "Compare with a file\u2026", {"Another scan, or a mesh such as its CAD", ""},
                   -1, scans.size() == 1))
        chooseCompared(first);
    ImGui::EndDisabled();
}

void Interface::layOutComparisonChoice() {
    Comparison::Choice& choice = session_->comparisonChoice;
    std::array<const char*, kWithin.size()> names{};
    std::ranges::transform(kWithin, names.begin(), &Within::name);
    int chosen = int(std::ranges::find(kWithin, choice.within, &Within::part) - kWithin.begin());
    if (comboRow(*look_, "##within", names, chosen,
                 {"Points of the first that are farther from the second have no counterpart: they do not count", ""}))
        choice.within = kWithin[size_t(chosen)].part;
    switchRow(*look_, "Measure back", choice.both, {"Figures of the second from the first as well", ""});
}

/// Lists the figures of one surface from the other.
void Interface::layOutDeviation(const Deviation& deviation) {
    const auto& unit = session_->unit();
    valueRow(*look_, "Mean", lengthText(deviation.mean, unit));
    valueRow(*look_, "Root mean square", lengthText(deviation.rms, unit));
    valueRow(*look_, "95 % are within", lengthText(deviation.absoluteQuantile(0.95), unit));
    valueRow(*look_, "At most", lengthText(deviation.absoluteQuantile(1), unit));
    valueRow(*look_, "Points measured", formatCount(deviation.samples));
    if (deviation.withoutCounterpart() > 0)
        valueRow(*look_, "Without a counterpart", formatCount(deviation.withoutCounterpart()));
}

void Interface::layOutCompared() {
    const ViewSession::ShownComparison& shown = *session_->comparison();
    const Comparison::Measured& measured = *shown.measured;
    const Deviation& deviation = measured.deviation;
    const auto& unit = session_->unit();
    const float width = ImGui::GetContentRegionAvail().x;
    valueRow(*look_, "Of", fitted(measured.compared.a, 0.7f * width));
    valueRow(*look_, "From", fitted(measured.compared.b, 0.7f * width));
    drawDistances(deviation, shown.range);
    const double most = std::max(deviation.absoluteQuantile(1), measured.compared.range);
    caption(*look_, "Colours end at");
    // The slider has its own number while it is dragged, and while colours are made anew for it.
    if (!isDraggingRange_ && !session_->saving()) rangeDragged_ = float(std::log10(shown.range / most));
    ImGui::SetNextItemWidth(-1);
    const std::string text = typeset("± " + lengthText(std::pow(10.0, double(rangeDragged_)) * most, unit));
    ImGui::BeginDisabled(session_->saving().has_value());
    ImGui::SliderFloat("##range", &rangeDragged_, float(std::log10(kLeastRange)), 0, text.c_str(),
                       ImGuiSliderFlags_NoInput | ImGuiSliderFlags_AlwaysClamp);
    isDraggingRange_ = ImGui::IsItemActive();
    if (ImGui::IsItemDeactivatedAfterEdit()) session_->setComparisonRange(std::pow(10.0, double(rangeDragged_)) * most);
    ImGui::EndDisabled();
    showTip(*look_, {"The distance at both ends of the colours; they are made anew when it is let go", ""});
    layOutDeviation(deviation);
    if (measured.back) {
        caption(*look_, "And back");
        layOutDeviation(*measured.back);
    }
    if (const double certified = measured.compared.certifiedA + measured.compared.certifiedB; certified > 0)
        valueRow(*look_, "Each is within", "± " + lengthText(certified, unit));
    ImGui::BeginDisabled(session_->saving().has_value());
    const float half = (ImGui::GetContentRegionAvail().x - units(8)) / 2;
    if (textButton(*look_, icon::kExport, "Export", {"Write deviation-1.csv and .json", ""}, half))
        session_->exportComparison();
    ImGui::SameLine();
    if (textButton(*look_, icon::kClose, "End", {"Show its own colours again", ""}, half)) session_->endComparison();
    ImGui::EndDisabled();
}

/// Draws a histogram in the colours of the surface, from -range to range.
void Interface::drawDistances(const Deviation& deviation, double range) const {
    const DeviationHistogram histogram = histogramOf(deviation, range, kBars);
    const auto largest = double(std::max<uint64_t>(*std::ranges::max_element(histogram.counts), 1));
    const ImVec2 from = ImGui::GetCursorScreenPos();
    const float width = ImGui::GetContentRegionAvail().x, height = units(kHistogramHeight);
    ImGui::Dummy({width, height});
    ImDrawList& list = *ImGui::GetWindowDrawList();
    for (size_t i = 0; i < kBars; ++i) {
        const double middle = (histogram.lowerEnd(i) + histogram.binWidth() / 2) / range;
        const float left = std::round(from.x + width * float(i) / float(kBars)),
                    right = std::round(from.x + width * float(i + 1) / float(kBars));
        // What is there is seen, however few they are.
        const double part = double(histogram.counts[i]) / largest;
        const float tall = histogram.counts[i] == 0 ? 0 : std::max(units(1), float(part) * height);
        list.AddRectFilled({left, from.y + height - tall}, {right, from.y + height}, packed(divergingColour(middle)));
    }
    list.AddLine({from.x, from.y + height}, {from.x + width, from.y + height}, look_->palette.line, units(1));
    const auto& unit = session_->unit();
    const std::string low = typeset(lengthText(-range, unit)), high = typeset(lengthText(range, unit));
    const float left = ImGui::GetCursorPosX();
    text(look_->small, look_->palette.dim, low);
    ImGui::SameLine(left + 0.5f * width - units(3));
    text(look_->small, look_->palette.dim, "0");
    ImGui::PushFont(look_->small);
    const float wide = ImGui::CalcTextSize(high.c_str()).x;
    ImGui::PopFont();
    ImGui::SameLine(left + width - wide);
    text(look_->small, look_->palette.dim, high);
    const uint64_t beyond = histogram.below + histogram.above;
    if (beyond > 0)
        valueRow(*look_, "Beyond the colours",
                 fmt::format("{:.2g} %", 100 * double(beyond) / double(deviation.distances.size())));
}

}  // namespace vcp
