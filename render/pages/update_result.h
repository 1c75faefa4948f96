// What an update of the pages that a view draws came to.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "octree/io/result.h"

namespace vcp {

struct UpdateResult {
    bool changed = false;     ///< the cut differs from that of the update before
    bool settled = false;     ///< nothing that this view wants is missing, loading or queued
    bool awaitsRays = false;  ///< no page is missing that the view is known to want: its next frame says whether rays
                              ///< hit others that are too coarse
    bool drawable = false;    ///< at least the coarsest page is there
    double errorPixels = 0;   ///< largest projected certified error in the cut (inf without a page or certificate)
    double colourPixels = 0;  ///< edge of the widest slabs in the cut whose colours are farther off than allowed
    uint64_t residentBytes = 0;  ///< geometry and colour pages in the pool
    uint64_t bytesRead = 0;      ///< decompressed page bytes the loader has delivered since open()
    bool relaxed = false;  ///< the budget is too small for the view's pixel error, which errorPixels reaches, or the
                           ///< memory for images for all of their levels that it needs
    uint64_t heldBytesMax =
        0;  ///< most memory that pages took between source and pool, and stored ones kept, since open() or setBudgets()
    uint64_t loads = 0, evictions = 0;        ///< pages into and out of the pool since open()
    uint64_t reloads = 0;                     ///< pages loaded twice in one still view: always 0
    uint32_t deviceLosses = 0;                ///< losses since create(): all was made anew and pages are read again
    uint64_t submissions = 0, hostWaits = 0;  ///< this update's submissions, and how often it waited for one
    uint64_t failures = 0;                    ///< reads that failed and were, or will be, tried again
    uint32_t pagesResident = 0, pagesInCut = 0, pagesWanted = 0;
    uint32_t pagesMissing = 0;                    ///< pages wanted, but not resident
    uint32_t pagesPending = 0;                    ///< pages wished for, being read, or waiting for an update
    uint32_t coarsestLevel = 0, finestLevel = 0;  ///< levels of the pages in the cut
    std::vector<Error> problems;                  ///< pages that cannot be read; each is reported once
};

/// What limits the detail of a picture.
enum class Detail {
    Loading,  ///< pages are still to come
    Settled,  ///< nothing: it errs by no more than was asked for
    Finest,   ///< the file: its finest level is drawn where it errs by more
    Budget,   ///< the budget
};

/// What errs most in a picture, and so decides what is refined next: distances, or colours.
enum class DetailLimit { Geometry, Colour };
inline DetailLimit detailLimitOf(const UpdateResult& update) {
    return update.colourPixels > update.errorPixels ? DetailLimit::Colour : DetailLimit::Geometry;
}
inline const char* nameOf(DetailLimit limit) { return limit == DetailLimit::Colour ? "colour" : "geometry"; }

/// Returns the error for which pages are refined, in pixels: of distances, or the edge of slabs whose colours are off.
inline double refinedPixels(const UpdateResult& update) { return std::max(update.errorPixels, update.colourPixels); }

/// `askedPixels`: the error that the view may have.
inline Detail detailOf(const UpdateResult& update, double askedPixels) {
    if (!update.settled) return Detail::Loading;
    if (update.relaxed) return Detail::Budget;
    // Without a certificate, and without a page, the error is infinite.
    const double error = refinedPixels(update);
    return std::isfinite(error) && error > askedPixels ? Detail::Finest : Detail::Settled;
}

/// Returns "loading", "settled", "finest" or "budget": for programs.
inline const char* nameOf(Detail detail) {
    const char* const names[] = {"loading", "settled", "finest", "budget"};
    return names[int(detail)];
}

/// Returns the same for people.
inline const char* textOf(Detail detail) {
    const char* const texts[] = {"loading", "settled", "settled, finest level", "settled, budget full"};
    return texts[int(detail)];
}

}  // namespace vcp
