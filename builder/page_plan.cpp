#include "builder/page_plan.h"

#include "builder/bin_passes.h"
#include "builder/deal.h"

namespace vcp {

namespace {

// A part of a build has about so many bins.
constexpr unsigned kBinsOfPart = 4;

using PageCounts = std::vector<std::pair<uint64_t, uint64_t>>;

Result<FinestPageChoice> chooseOn(const PagePlanning& planning, const LevelPlan& levels) {
    const MemoryPlan& memory = planning.memory;
    // Pages of soft leaves must be of one level: their levels come from each other by clustering.
    const PageChoosing choosing{
        .soups = planning.soups,
        .frame = levels.frame,
        .mostLevelsBelow = levels.hasSlabs ? mostLevelsBelow(levels.frame, planning.measures) : 0,
        .mayBeCoarser = levels.hasSlabs && planning.options.cell <= 0,
        .marginCells = levels.marginCells(),
        .uncounted = planning.parts == 0 ? memory.binTriangles(planning.mayKeepImages) : 0,
        .mostPages = memory.mostCountedPages(),
        .progress = planning.progress};
    auto choice = choosePages(choosing);
    // A page that was counted has triangles; twice the memory counts twice as many.
    if (!choice && choice.error().code == ErrorCode::Limit)
        return tooLittleMemory(memory, choice.error().message, 2 * (memory.fixedBytes + memory.usableBytes));
    return choice;
}

uint64_t sumOf(const PageCounts& counts) {
    uint64_t sum = 0;
    for (const auto& [page, count] : counts) sum += count;
    return sum;
}

/// Returns how many triangles a bin may have: parts need several bins each, to be equally large.
uint64_t binTriangles(const PagePlanning& planning, const PageCounts& counts) {
    const uint64_t most = planning.memory.binTriangles(planning.mayKeepImages);
    return planning.parts == 0 ? most : std::min(most, sumOf(counts) / (uint64_t{kBinsOfPart} * planning.parts) + 1);
}

std::vector<size_t> firstBinsOf(const PagePartition& partition, const PageCounts& counts, unsigned parts) {
    std::vector<double> triangles(partition.bins());
    for (const auto& [page, count] : counts) triangles[partition.binOf(page)] += double(count);
    const auto total = double(sumOf(counts));
    std::vector<size_t> first{0};
    double before = 0;
    for (size_t bin = 0; bin < triangles.size(); ++bin) {
        while (first.size() < parts && before + triangles[bin] / 2 > total * double(first.size()) / parts)
            first.push_back(bin);
        before += triangles[bin];
    }
    first.resize(size_t{parts} + 1, triangles.size());
    return first;
}

}  // namespace

Result<PagePlan> planPagesOf(const PagePlanning& planning) {
    PagePlan plan;
    for (;;) {
        VCP_TRY_ASSIGN(plan.levels, planLevels(planning.options, planning.measures, plan.levelsLess));
        VCP_TRY_ASSIGN(auto choice, chooseOn(planning, plan.levels));
        plan.levelsLess += choice.levelsLess;
        if (choice.levelsLess > 0) continue;
        plan.levels.finest = PagePartition(choice.counts, binTriangles(planning, choice.counts));
        plan.levels.setPages(plan.levels.frame, std::move(choice.pages));
        plan.pages = choice.counts.size();
        if (planning.parts > 0) plan.firstBins = firstBinsOf(plan.levels.finest, choice.counts, planning.parts);
        return plan;
    }
}

}  // namespace vcp
