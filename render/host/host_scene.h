// The pages of a cut, placed in space: what the host casts rays through.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <glm/vec3.hpp>

#include "octree/image/image_set.h"
#include "octree/page/page.h"
#include "octree/reference_caster.h"

namespace vcp {

/// Where the grid of a dataset lies, and how fine it is.
struct HostGrid {
    glm::dvec3 origin{0};  ///< world position of the lowest corner of the root page
    double cell = 1;       ///< edge of a cell of the finest level, world units
    uint32_t levels = 1;
    uint32_t log2Cells = 1;  ///< cells an edge of a page: 2^log2Cells
};

HostGrid hostGrid(const FileHeader& header);

/// A page of a cut, or one octant of it. The view must outlive the scene.
struct HostPage {
    const PageView* view = nullptr;
    uint64_t number = 0;  ///< in the directory
    glm::uvec3 place{0};  ///< among the subvolumes of its level
    uint32_t level = 0;   ///< 0 is the coarsest
    float error = 0;      ///< certified error, finest cells
    /// Only this octant is drawn. Precondition: the page's root is an internal node.
    std::optional<uint32_t> octant = {};
    uint8_t parts = 0;  ///< as PageEntry's
};

/// Returns the page of an entry of the directory, whole.
HostPage hostPage(const FileHeader& header, uint64_t number, const PageEntry& entry, const PageView& view);

/// Appends a page or, where some of its octants alone are drawn (bits), each of these.
void appendDrawn(std::vector<HostPage>& pages, HostPage page, uint32_t octants);

/// An immutable tree down to the pages of a cut. Any thread may read it.
///
/// Places inside are whole subcells: eighths of a finest cell, which no leaf is smaller than.
class HostScene {
public:
    /// Errors: Usage where a page lies outside of the grid, or in another page.
    static Result<HostScene> create(const HostGrid& grid, std::span<const HostPage> cut);
    /// `cut`: pages that `cache` has loaded; it must outlive the scene. `octants`: of each of them, those that alone
    /// are drawn (bits; 0: all); empty: all pages are whole. Errors: Usage as above, or where one is not loaded.
    static Result<HostScene> create(const PageCache& cache, std::span<const uint64_t> cut,
                                    std::span<const uint8_t> octants = {});

    struct Page {
        const PageView* view;
        uint64_t number;
        std::optional<uint32_t> octant;  ///< of which alone it is drawn
        uint32_t root;                   ///< word of its root node, or that of the octant
        glm::uvec3 corner;               ///< of the whole page; subcells
        uint32_t cellBits;               ///< log2 of the edge of a cell of its level in finest cells
        float error;                     ///< certified error, finest cells
        uint8_t parts;                   ///< as PageEntry's
    };
    /// A child of the tree: nothing, another node, or a page.
    struct Child {
        enum class Kind : uint8_t { None, Node, Page } kind = Kind::None;
        uint32_t index = 0;
    };
    using Node = std::array<Child, 8>;  ///< child i at octant x + 2y + 4z

    /// Lets triangles that have images be seen in them, and not in the colours of their vertices. `images`: the file's;
    /// null: none.
    void showImages(std::shared_ptr<const ImageSet> images) { images_ = std::move(images); }
    [[nodiscard]] const ImageSet* images() const { return images_.get(); }

    [[nodiscard]] const HostGrid& grid() const { return grid_; }
    [[nodiscard]] Child root() const { return root_; }
    [[nodiscard]] uint32_t rootBits() const;  ///< log2 of the root's edge in subcells
    [[nodiscard]] const Node& node(uint32_t index) const { return nodes_[index]; }
    [[nodiscard]] const Page& page(uint32_t index) const { return pages_[index]; }
    [[nodiscard]] size_t pages() const { return pages_.size(); }
    /// Returns the index of the page that holds a point, in finest cells from the root's lowest corner.
    [[nodiscard]] std::optional<uint32_t> pageAt(glm::dvec3 point) const;
    /// The level of a page; 0 is the coarsest.
    [[nodiscard]] uint32_t levelOf(const Page& page) const { return grid_.levels - 1 - page.cellBits; }

private:
    Result<void> add(const HostPage& page);

    HostGrid grid_;
    std::shared_ptr<const ImageSet> images_;
    Child root_;
    std::vector<Node> nodes_;
    std::vector<Page> pages_;
};

}  // namespace vcp
