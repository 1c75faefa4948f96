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

    /// Cancelled by the signals of an InterruptScope (interrupt.h).
    operator SourceAccess() const;
};

void addSourceSettings(CLI::App& app, SourceSettings& settings);

}  // namespace vcp
