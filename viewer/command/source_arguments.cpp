#include "viewer/command/source_arguments.h"

#include "viewer/command/interrupt.h"
#include "viewer/scene/option_values.h"

namespace vcp {

void addSourceSettings(CLI::App& app, SourceSettings& settings) {
    settings.cancelled = interrupted;
    app.add_option("--ca-file", settings.caFile, "Certificates of authorities to trust for https, PEM [the system's]")
        ->type_name("FILE")
        ->check(CLI::ExistingFile);
    app.add_option("--cache", settings.cache,
                   "Keep what a server sends in this folder, and read it from there next time")
        ->type_name("DIR");
    app.add_option("--cache-limit", settings.cacheLimit,
                   "Bytes that the folder may hold; what was used longest ago goes")
        ->type_name("BYTES")
        ->capture_default_str()
        ->check([](const std::string& text) {
            return parseBytes(text) ? std::string() : "must be like 512M or 4G, not \"" + text + "\"";
        });
}

}  // namespace vcp
