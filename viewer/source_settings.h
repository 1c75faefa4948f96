// Settings for datasets on servers.
#pragma once

#include <string>

#include "viewer/open_dataset.h"

namespace vcp {

struct SourceSettings {
    std::string caFile;
    std::string cache;
    std::string cacheLimit = "4G";

    operator SourceAccess() const;
};

}  // namespace vcp
