#include "viewer/command/source_arguments.h"

#include "viewer/command/manual/help_text.h"
#include "viewer/command/parsed_option.h"
#include "viewer/command/terminal/interrupt.h"
#include "viewer/scene/option_values.h"

namespace vcp {

void addSourceSettings(CLI::App& app, SourceAccess& settings) {
    settings.cancelled = interrupted;
    const ScopedGroup servers(app, help_group::kServers);
    app.add_option("--ca-file", settings.caFile, "Certificates of authorities to trust for https, PEM [the system's]")
        ->type_name("FILE")
        ->check(CLI::ExistingFile);
    app.add_option("--cache", settings.cache,
                   "Keep what a server sends in this folder, and read it from there next time")
        ->type_name("DIR");
    addParsed(app, "--cache-limit", settings.cacheBytes, parseBytes, "like 512M or 4G",
              "Bytes that the folder of --cache may hold; what was used longest ago goes")
        ->type_name("BYTES")
        ->default_str("4G");
}

}  // namespace vcp
