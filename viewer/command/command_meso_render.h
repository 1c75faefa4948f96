// vcp meso render: a part of the command `vcp meso`.
#pragma once

#include "viewer/command/commands.h"

namespace vcp {

RunCommand addMesoRender(CLI::App& meso);

}  // namespace vcp
