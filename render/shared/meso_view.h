// What the mesostructure shaders are handed with a picture (meso_layout.h), in C++.
#pragma once

#include <cstddef>
#include <cstdint>

#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

namespace vcp::frame {

using uint = uint32_t;
using vec3 = glm::vec3;
using vec4 = glm::vec4;

#include "render/shared/meso_layout.h"

static_assert(sizeof(MesoView) == 784 && offsetof(MesoView, width) == 96);

}  // namespace vcp::frame
