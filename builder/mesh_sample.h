// What a build has read so far, as an even sample of bounded size: for a picture before there is a dataset.
#pragma once

#include <cstddef>
#include <cstdint>
#include <mutex>
#include <span>
#include <vector>

#include <glm/vec3.hpp>

#include "builder/lattice/soup.h"

namespace vcp {

/// Every n-th of what comes, at most `most`: n doubles whenever there are too many.
template <class Item>
class EvenSample {
public:
    explicit EvenSample(size_t most) : most_(most) {}

    /// Whether the item that comes now is to be kept; then keep() follows.
    [[nodiscard]] bool wantsNext() { return seen_++ % each_ == 0; }
    void keep(const Item& item) {
        items_.push_back(item);
        if (items_.size() < most_) return;
        for (size_t i = 0; 2 * i < items_.size(); ++i) items_[i] = items_[2 * i];
        items_.resize((items_.size() + 1) / 2);
        each_ *= 2;
    }

    [[nodiscard]] const std::vector<Item>& items() const { return items_; }
    [[nodiscard]] uint64_t each() const { return each_; }

private:
    size_t most_;
    uint64_t seen_ = 0, each_ = 1;
    std::vector<Item> items_;
};

/// The sample of a build's inputs (BuildOptions::sample). One thread adds; any may ask meanwhile.
class MeshSample {
public:
    struct Triangle {
        glm::vec3 corner[3];  ///< world units, relative to Snapshot::origin
        uint32_t colour;      ///< RGBA8 of the first corner; white where the mesh has none, whatever its materials
    };
    struct Snapshot {
        glm::dvec3 origin{0};
        glm::dvec3 low{0}, high{0};       ///< bounds of all vertices so far, world units
        std::vector<glm::vec3> vertices;  ///< relative to the origin
        std::vector<Triangle> triangles;  ///< those that have all their vertices
        uint64_t trianglesEach = 1;       ///< how many triangles of the mesh each stands for
    };

    /// Keeps at most so many vertices, and so many triangles.
    explicit MeshSample(size_t most = size_t{1} << 16) : vertices_(most), triangles_(most) {}

    void addVertices(std::span<const glm::dvec3> positions);
    void addTriangle(const WorldTriangle<double>& triangle);

    /// Returns a number that grows whenever there is more to see; 0: nothing was read.
    [[nodiscard]] uint64_t version() const;
    [[nodiscard]] Snapshot snapshot() const;

private:
    mutable std::mutex mutex_;  // guards all that is kept; what comes is counted by the thread that adds
    uint64_t version_ = 0;
    glm::dvec3 origin_{0}, low_{0}, high_{0};
    EvenSample<glm::vec3> vertices_;
    EvenSample<Triangle> triangles_;
};

}  // namespace vcp
