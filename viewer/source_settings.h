// The options of `vcp` for datasets on servers.
#pragma once

#include <string>

#include "viewer/commands.h"
#include "viewer/open_dataset.h"

namespace vcp {

struct SourceSettings {
    std::string caFile;
    std::string cache;
    std::string cacheLimit = "4G";

    operator SourceAccess() const;
};

void addSourceSettings(CLI::App& app, SourceSettings& settings);

}  // namespace vcp
