// vcp meso base: a part of the command `vcp meso`.
#pragma once

#include "viewer/command/commands.h"

namespace vcp {

RunCommand addMesoBase(CLI::App& meso);

}  // namespace vcp
