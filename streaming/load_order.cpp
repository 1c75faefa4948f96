#include "streaming/load_order.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

namespace vcp {

namespace {

constexpr int kPlaceBits = 30;  // bits of RayFeedback::Hit::place

// The share of what earlier frames reported that counts beside the newest report.
constexpr double kRemembered = 0.75;
constexpr double kForgotten = 1e-6;

// Ranges of priorities: requested, passed, the rest.
constexpr double kMost = 1e6, kRequested = 1e3, kPassed = 1, kLeast = 1e-3;

/// Maps 0..infinity to low..high; larger values to larger ones.
double inRange(double value, double low, double high) { return low + (high - low) * (value / (value + 1)); }

constexpr std::array<std::string_view, 5> kNames{"feedback", "error", "nearest", "breadth", "random"};

/// Mixes all bits (the finalizer of SplitMix64).
uint64_t hashOf(uint64_t x) {
    x += 0x9e3779b97f4a7c15;
    x = (x ^ x >> 30) * 0xbf58476d1ce4e5b9;
    x = (x ^ x >> 27) * 0x94d049bb133111eb;
    return x ^ x >> 31;
}

/// Returns the child at a place, or nothing where the surface does not continue there.
std::optional<uint64_t> childAt(const PageEntry& page, glm::ivec3 place) {
    const int bit = kPlaceBits - 1 - page.level;
    const uint32_t octant =
        uint32_t(place.x >> bit & 1) | uint32_t(place.y >> bit & 1) << 1 | uint32_t(place.z >> bit & 1) << 2;
    if ((page.childMask >> octant & 1) == 0) return std::nullopt;
    return childIn(page, octant);
}

void fade(std::unordered_map<uint64_t, double>& values, double remembered) {
    for (auto& [page, value] : values) value *= remembered;
    std::erase_if(values, [](const auto& entry) { return entry.second < kForgotten; });
}

}  // namespace

std::optional<LoadOrder> loadOrderNamed(std::string_view name) {
    const auto at = std::find(kNames.begin(), kNames.end(), name);
    if (at == kNames.end()) return std::nullopt;
    return static_cast<LoadOrder>(at - kNames.begin());
}

std::string_view nameOf(LoadOrder order) { return kNames[size_t(order)]; }

LoadPriorities::LoadPriorities(std::shared_ptr<const Dataset> dataset, std::span<const uint64_t> pageUnits,
                               LoadOrder order)
    : dataset_(std::move(dataset)), pageUnits_(pageUnits.size()), parents_(dataset_->pages.size()), order_(order) {
    for (uint64_t page = 0; page < pageUnits.size(); ++page) {
        if (!dataset_->pages.knows(page))
            page += kEntriesPerBlock - 1 - page % kEntriesPerBlock;  // no other page of its block is known either
        else if (pageUnits[page] != 0)
            learn(page, pageUnits[page]);
    }
}

void LoadPriorities::learn(uint64_t page, uint64_t units) {
    pageUnits_[page] = units;
    for (const uint64_t child : childrenOf(dataset_->pages[page])) parents_[child] = uint32_t(page);
}

void LoadPriorities::hear(const RayFeedback& feedback, const SelectionView& view, size_t views) {
    const double remembered = std::pow(kRemembered, 1 / double(std::max<size_t>(views, 1)));
    fade(gains_, remembered);
    fade(nearness_, remembered);
    for (const RayFeedback::Passed& passed : feedback.passed) nearness_[passed.page] += passed.nearness;
    if (dataset_->pages.empty()) return;
    const glm::dvec3 corner = dataset_->originOf(dataset_->pages[0]);
    const double unit = std::ldexp(dataset_->edgeOf(dataset_->pages[0]), -kPlaceBits);
    for (const RayFeedback::Hit& hit : feedback.hits) {
        const double distance = view.orthographic ? 1 : glm::length(corner + glm::dvec3(hit.place) * unit - view.eye);
        const auto errorOf = [&](uint64_t page) {
            if (pageUnits_[page] == 0) return 0.0;
            return refinedError(*dataset_, dataset_->pages[page], view) * view.pixelsPerUnit / std::max(distance, unit);
        };
        std::optional<uint64_t> page = hit.page;
        while (page && errorOf(*page) > view.errorPixels && dataset_->pages[*page].childMask != 0) {
            const auto child = childAt(dataset_->pages[*page], hit.place);
            gains_[*page] += errorOf(*page) - std::min(child ? errorOf(*child) : 0, errorOf(*page));
            page = child;
        }
    }
}

double LoadPriorities::gainOf(uint64_t page) const {
    const auto gain = gains_.find(page);
    return gain != gains_.end() ? gain->second : 0;
}

/// Nearness of the page itself, or of the page that it is part of: half as much for each level below the page passed.
double LoadPriorities::nearnessOf(uint64_t page) const {
    for (double part = 1;; part /= 2, page = parents_[page]) {
        if (const auto found = nearness_.find(page); found != nearness_.end()) return found->second * part;
        if (page == 0) return 0;
    }
}

double LoadPriorities::feedbackPriority(uint64_t page, std::span<const SelectionView> views, uint64_t units) const {
    if (const double gain = gainOf(page); gain > 0) return inRange(gain / double(units), kRequested, kMost);
    if (const double nearness = nearnessOf(page); nearness > 0) return inRange(nearness, kPassed, kRequested);
    double error = 0;
    for (const SelectionView& view : views)
        error = std::max(error, std::min(projectedError(*dataset_, dataset_->pages[page], view), 1e9));
    return inRange(error, kLeast, kPassed);
}

/// The priority of the children of `page`, which take `units` units.
double LoadPriorities::priorityBelow(uint64_t page, std::span<const SelectionView> views, uint64_t units) const {
    const PageEntry& entry = dataset_->pages[page];
    switch (order_) {
        case LoadOrder::Nearest: {
            const glm::dvec3 low = dataset_->originOf(entry), high = low + dataset_->edgeOf(entry);
            double distance = kMost;
            for (const SelectionView& view : views)
                distance = std::min(distance, glm::length(glm::clamp(view.eye, low, high) - view.eye) /
                                                  dataset_->edgeOf(dataset_->pages[0]));
            return std::max(kMost / (1 + distance * kMost), kLeast);
        }
        case LoadOrder::Breadth:
            return std::ldexp(1.0, -entry.level);
        case LoadOrder::Random:
            return kLeast + double(hashOf(page) >> 11) * 0x1p-53;
        default:
            return feedbackPriority(page, views, units);
    }
}

std::vector<WantedPage> LoadPriorities::ordered(std::vector<WantedPage> missing,
                                                std::span<const SelectionView> views) const {
    if (order_ == LoadOrder::Error) return missing;
    std::unordered_map<uint64_t, uint64_t> units;  // for each page, units of its missing children
    for (const WantedPage& wanted : missing) units[parents_[wanted.page]] += pageUnits_[wanted.page];
    std::unordered_map<uint64_t, double> given;
    for (WantedPage& wanted : missing) {
        if (wanted.page == 0) {
            wanted.priority = std::numeric_limits<double>::infinity();
        } else {
            // A page is no more urgent than its parent, which comes before it in the list where it is missing too.
            const uint64_t parent = parents_[wanted.page];
            const auto above = given.find(parent);
            wanted.priority = priorityBelow(parent, views, units[parent]);
            if (above != given.end()) wanted.priority = std::min(wanted.priority, above->second);
        }
        given.emplace(wanted.page, wanted.priority);
    }
    // Among equals the directory's order decides, which has parents before children.
    std::sort(missing.begin(), missing.end(), [](const WantedPage& a, const WantedPage& b) {
        return a.priority != b.priority ? a.priority > b.priority : a.page < b.page;
    });
    return missing;
}

uint64_t LoadPriorities::bytesHeld() const {
    constexpr uint64_t kEntry = 4 * sizeof(void*);
    const auto bytesOf = [](const auto& map) { return map.bucket_count() * sizeof(void*) + map.size() * kEntry; };
    return pageUnits_.bytes() + parents_.bytes() + bytesOf(gains_) + bytesOf(nearness_);
}

}  // namespace vcp
