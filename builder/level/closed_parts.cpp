#include "builder/level/closed_parts.h"

#include <algorithm>
#include <atomic>
#include <numeric>
#include <tuple>

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_for.h>

namespace vcp {

namespace {

// Shared triangles are joined in so many runs, so that only a part of them is in memory.
constexpr size_t kSharedBins = 32;
constexpr size_t kGrain = 16384;

/// Numbers that are joined into sets; a set is called by its lowest number.
class Sets {
public:
    explicit Sets(size_t count) : parent_(count) { std::iota(parent_.begin(), parent_.end(), 0u); }

    uint32_t of(uint32_t i) {
        for (; parent_[i] != i; i = parent_[i]) parent_[i] = parent_[parent_[i]];
        return i;
    }
    void join(uint32_t a, uint32_t b) {
        a = of(a), b = of(b);
        parent_[std::max(a, b)] = std::min(a, b);
    }

private:
    std::vector<uint32_t> parent_;
};

/// The ends of edges, by their lower ends.
class EdgeLists {
public:
    EdgeLists(const LatticeMesh& mesh, std::span<const Corners> changed, std::span<const uint8_t> owned)
        : owned_(owned), begin_(mesh.positions.size() + 1, 0) {
        std::vector<std::array<uint32_t, 3>> others;
        for (const Corners& t : changed) {
            std::array<uint32_t, 3> v{};
            for (size_t i = 0; i < 3; ++i) v[i] = findVertex(mesh, t[i]).value_or(kNone);
            others.push_back(v);
        }
        const auto forEdges = [&](auto&& visit) {
            for (const auto& t : mesh.triangles) visitEdges(t, visit);
            for (const auto& t : others) visitEdges(t, visit);
        };
        forEdges([&](uint32_t low, uint32_t) { ++begin_[low + 1]; });
        std::partial_sum(begin_.begin(), begin_.end(), begin_.begin());
        ends_.resize(begin_.back());
        std::vector<uint64_t> next(begin_.begin(), begin_.end() - 1);
        forEdges([&](uint32_t low, uint32_t high) { ends_[next[low]++] = high; });
    }

    /// Returns for each vertex how many edges with an odd number of triangles begin there.
    std::vector<uint32_t> oddEdges() {
        std::vector<uint32_t> odd(begin_.size() - 1, 0);
        tbb::parallel_for(tbb::blocked_range<size_t>(0, odd.size(), kGrain), [&](const auto& range) {
            for (size_t v = range.begin(); v < range.end(); ++v) odd[v] = oddRuns(begin_[v], begin_[v + 1]);
        });
        return odd;
    }

private:
    static constexpr uint32_t kNone = 0xffffffff;

    template <class Visit>
    void visitEdges(const std::array<uint32_t, 3>& t, const Visit& visit) const {
        for (size_t i = 0; i < 3; ++i) {
            const auto [low, high] = std::minmax(t[i], t[(i + 1) % 3]);
            if (high != kNone && low != high && owned_[low] != 0) visit(low, high);
        }
    }

    uint32_t oddRuns(uint64_t first, uint64_t end) {
        std::sort(ends_.begin() + ptrdiff_t(first), ends_.begin() + ptrdiff_t(end));
        uint32_t odd = 0;
        for (uint64_t i = first; i < end;) {
            uint64_t k = i;
            while (k < end && ends_[k] == ends_[i]) ++k;
            odd += uint32_t((k - i) & 1);
            i = k;
        }
        return odd;
    }

    std::span<const uint8_t> owned_;
    std::vector<uint64_t> begin_;
    std::vector<uint32_t> ends_;
};

std::vector<uint8_t> ownedVertices(const LatticeMesh& mesh, const std::function<bool(glm::i32vec3)>& owns) {
    std::vector<uint8_t> owned(mesh.positions.size());
    tbb::parallel_for(tbb::blocked_range<size_t>(0, owned.size(), kGrain), [&](const auto& range) {
        for (size_t v = range.begin(); v < range.end(); ++v) owned[v] = owns(mesh.positions[v]);
    });
    return owned;
}

/// The parts of one bin.
class BinParts {
public:
    /// `firstUndecided`: how many undecided parts the bins before have.
    BinParts(const LatticeMesh& mesh, std::span<const Corners> changed, std::vector<uint8_t> owned,
             uint32_t firstUndecided)
        : mesh_(mesh), owned_(std::move(owned)), first_(firstUndecided), sets_(mesh.positions.size()) {
        for (const auto& [a, b, c] : mesh.triangles) sets_.join(a, b), sets_.join(a, c);
        const std::vector<uint32_t> odd = EdgeLists(mesh, changed, owned_).oddEdges();
        states_.resize(mesh.positions.size());
        for (uint32_t v = 0; v < odd.size(); ++v) {
            State& state = states_[sets_.of(v)];
            state.isOpen |= odd[v] > 0;
            state.isShared |= owned_[v] == 0;
            counts_.openEdges += odd[v];
        }
        for (uint32_t v = 0; v < odd.size(); ++v)
            if (sets_.of(v) == v) decide(v);
    }

    [[nodiscard]] uint32_t undecided() const { return undecided_; }
    /// Returns the part of each vertex; none where all are closed.
    std::vector<uint32_t> parts() {
        std::vector<uint32_t> parts(mesh_.positions.size());
        bool isClosed = true;
        for (uint32_t v = 0; v < parts.size(); ++v) {
            parts[v] = states_[sets_.of(v)].part;
            isClosed &= parts[v] == kClosedPart;
        }
        if (isClosed) parts.clear();
        return parts;
    }

    /// Returns the bin's notes, but those of what it shares.
    [[nodiscard]] std::vector<PartRecord> notes() const {
        std::vector<PartRecord> notes = open_;
        notes.push_back({PartRecord::Kind::Counts,
                         undecided_,
                         {int32_t(counts_.parts), int32_t(counts_.closed), int32_t(counts_.openEdges)}});
        return notes;
    }

    /// Returns the notes of triangles that other bins have as well, one for each of their lowest vertices.
    std::vector<PartRecord> shared() {
        std::vector<PartRecord> notes;
        std::vector<bool> isNoted(mesh_.positions.size());
        for (const auto& [a, b, c] : mesh_.triangles) {
            const uint32_t low = std::min({a, b, c});
            if ((owned_[a] & owned_[b] & owned_[c]) != 0 || isNoted[low]) continue;
            isNoted[low] = true;
            notes.push_back(
                {PartRecord::Kind::Shared, states_[sets_.of(low)].part - kFirstUndecidedPart, mesh_.positions[low]});
        }
        return notes;
    }

private:
    struct State {
        bool isOpen = false, isShared = false;
        uint32_t part = kClosedPart;
    };

    void decide(uint32_t set) {
        State& state = states_[set];
        if (!state.isShared) {
            state.part = state.isOpen ? kOpenPart : kClosedPart;
            ++counts_.parts;
            counts_.closed += state.isOpen ? 0 : 1;
            return;
        }
        const uint32_t number = first_ + undecided_++;
        state.part = kFirstUndecidedPart + number;
        if (state.isOpen) open_.push_back({PartRecord::Kind::Open, number, {}});
    }

    const LatticeMesh& mesh_;
    std::vector<uint8_t> owned_;
    uint32_t first_, undecided_ = 0;
    Sets sets_;
    std::vector<State> states_;  ///< by a set's number
    PartCounts counts_;
    std::vector<PartRecord> open_;
};

bool isBefore(const PartRecord& a, const PartRecord& b) {
    return std::tie(a.at.x, a.at.y, a.at.z) < std::tie(b.at.x, b.at.y, b.at.z);
}

size_t sharedBinOf(glm::i32vec3 p) {
    const uint64_t h = (uint64_t(uint32_t(p.x)) * 0x9e3779b97f4a7c15u) ^
                       (uint64_t(uint32_t(p.y)) * 0xc2b2ae3d27d4eb4fu) ^
                       (uint64_t(uint32_t(p.z)) * 0x165667b19e3779f9u);
    return 1 + size_t(h >> 40) % kSharedBins;
}

}  // namespace

PartNotes::PartNotes(TempSpace& space, uint64_t bufferBytes) : notes_(space, "parts", 1 + kSharedBins, bufferBytes) {}

Result<void> PartNotes::add(LatticeMesh& mesh, std::span<const Corners> changed,
                            const std::function<bool(glm::i32vec3)>& owns) {
    if (!undecided_) {
        MeshParts before;
        VCP_TRY(readFirst(before, undecided_.emplace(0)));
    }
    BinParts bin(mesh, changed, ownedVertices(mesh, owns), uint32_t(*undecided_));
    *undecided_ += bin.undecided();
    mesh.parts = bin.parts();
    VCP_TRY(notes_.append(0, bin.notes()));
    BinBatch<PartRecord> batch(notes_);
    for (const PartRecord& note : bin.shared()) VCP_TRY(batch.add(sharedBinOf(note.at), note));
    return batch.flush();
}

/// Reads what bins have noted of single parts: counts, and which of the undecided are open.
Result<void> PartNotes::readFirst(MeshParts& parts, uint64_t& undecided) {
    VCP_TRY(notes_.raw().flush(0));
    VCP_TRY_ASSIGN(const auto notes, notes_.load(0));
    const uint64_t first = undecided;
    for (const PartRecord& note : notes) {
        if (note.kind == PartRecord::Kind::Open) {
            const size_t number = first + note.part;
            if (parts.isOpen.size() <= number) parts.isOpen.resize(number + 1);
            parts.isOpen[number] = true;
            continue;
        }
        undecided += note.part;
        parts.counts.parts += uint32_t(note.at.x);
        parts.counts.closed += uint32_t(note.at.y);
        parts.counts.openEdges += uint32_t(note.at.z);
    }
    parts.isOpen.resize(undecided);
    return {};
}

Result<MeshParts> PartNotes::join(std::span<PartNotes* const> all) {
    MeshParts parts;
    uint64_t undecided = 0;
    for (PartNotes* const each : all) {
        VCP_TRY(each->notes_.raw().flush());
        parts.first.push_back(undecided);
        VCP_TRY(each->readFirst(parts, undecided));
    }
    Sets sets(undecided);
    for (size_t bin = 1; bin <= kSharedBins; ++bin) {
        std::vector<PartRecord> shared;
        for (size_t k = 0; k < all.size(); ++k) {
            VCP_TRY_ASSIGN(auto notes, all[k]->notes_.load(bin));
            for (PartRecord& note : notes) note.part += uint32_t(parts.first[k]);
            shared.insert(shared.end(), notes.begin(), notes.end());
        }
        std::sort(shared.begin(), shared.end(), isBefore);
        for (size_t i = 1; i < shared.size(); ++i)
            if (shared[i].at == shared[i - 1].at) sets.join(shared[i].part, shared[i - 1].part);
    }
    for (uint32_t i = 0; i < undecided; ++i)
        if (parts.isOpen[i]) parts.isOpen[sets.of(i)] = true;
    for (uint32_t i = 0; i < undecided; ++i) {
        parts.isOpen[i] = parts.isOpen[sets.of(i)];
        if (sets.of(i) != i) continue;
        ++parts.counts.parts;
        parts.counts.closed += parts.isOpen[i] ? 0 : 1;
    }
    return parts;
}

}  // namespace vcp
