// Settings for datasets on servers.
#pragma once

#include <functional>
#include <string>

#include "viewer/scene/scene_opening.h"

namespace vcp {

struct SourceSettings {
    std::string caFile;
    std::string cache;
    std::string cacheLimit = "4G";

    std::function<bool()> cancelled;  ///< called during exchanges with a server; may be empty

    operator SourceAccess() const;
};

}  // namespace vcp
