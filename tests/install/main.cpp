// What a user of the installed package does first: include, link, call, and handle an error.
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "octree/page/page.h"
#include "octree/surface/packing.h"

int main() {
    const glm::dvec3 v(0.25, -0.5, 0.75);
    const glm::dvec3 back = vcp::unpackVectorSpherical(vcp::packVectorSpherical(v, 2.0), 2.0);
    if (glm::length(back - v) > 0.02) return EXIT_FAILURE;

    alignas(16) const std::array<std::byte, 64> zeros{};
    const auto page = vcp::parsePage(zeros);
    if (page.ok()) return EXIT_FAILURE;
    std::printf("vcp: %s\n", page.error().line().c_str());
    return EXIT_SUCCESS;
}
