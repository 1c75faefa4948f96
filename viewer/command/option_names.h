// The options of `vcp` that messages of other rooms speak of.
#pragma once

#include "viewer/scene/setting_names.h"

namespace vcp {

inline constexpr SettingName kOptionNames[] = {
    {"cell edge", "--cell"},
    {"memory cap", "--memory"},
    {"fewer threads", "--threads"},
    {"temporary folder", "--temp"},
    {"colour to keep", "--colour"},
    {"from the start", "without --resume"},
    {"resumed", "--resume"},
    {"paper's method", "--method paper"},
    {"paper's march", "--paper-..."},
    {"shadows, ambient occlusion and caps", "--shadows, --occlusion, --caps"},
    {"memory for pages on their way", "--ram"},
    {"authority's certificate", "--ca-file"},
    {"another axis up", "--up"},
    {"how far it repeats", "--period"},
    {"take a Vulkan device", "--device"},
    {"heights alone", "--only-heights"},
};

}  // namespace vcp
