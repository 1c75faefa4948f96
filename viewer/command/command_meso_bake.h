// vcp meso bake: a part of the command `vcp meso`.
#pragma once

#include "viewer/command/commands.h"

namespace vcp {

RunCommand addMesoBake(CLI::App& meso);

}  // namespace vcp
