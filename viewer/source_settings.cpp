#include "viewer/source_settings.h"

#include "streaming/caching_reader.h"
#include "streaming/http_reader.h"
#include "viewer/option_values.h"

namespace vcp {

void addSourceSettings(CLI::App& app, SourceSettings& settings) {
    app.add_option("--ca-file", settings.caFile, "Certificates of authorities to trust for https, PEM [the system's]")
        ->type_name("FILE")
        ->check(CLI::ExistingFile);
    app.add_option("--cache", settings.cache, "Keep what a server sends in this folder, and read it from there next time")->type_name("DIR");
    app.add_option("--cache-limit", settings.cacheLimit, "Bytes that the folder may hold; what was used longest ago goes")
        ->type_name("BYTES")
        ->capture_default_str()
        ->check([](const std::string& text) { return parseBytes(text) ? std::string() : "must be like 512M or 4G, not \"" + text + "\""; });
}

Result<std::shared_ptr<const ByteReader>> openReader(const std::string& where, const SourceSettings& settings) {
    if (!isHttpUrl(where)) {
        auto file = openFile(where);
        if (!file) return file.error();
        return std::shared_ptr<const ByteReader>(*file);
    }
    HttpOptions options;
    options.caFile = settings.caFile;
    auto http = HttpReader::open(where, options);
    if (!http) return http.error();
    if (settings.cache.empty()) return std::shared_ptr<const ByteReader>(*http);
    auto cached = CachingReader::open(*http, (*http)->identity(), settings.cache, *parseBytes(settings.cacheLimit));
    if (!cached) return cached.error();
    return std::shared_ptr<const ByteReader>(*cached);
}

Box OpenDataset::bounds() const {
    const FileHeader& h = dataset->header;
    return {{h.boundsMin[0], h.boundsMin[1], h.boundsMin[2]}, {h.boundsMax[0], h.boundsMax[1], h.boundsMax[2]}};
}

Result<OpenDataset> openDataset(const std::string& where, const SourceSettings& settings) {
    auto reader = openReader(where, settings);
    if (!reader) return reader.error();
    auto dataset = readDatasetStart(**reader);
    if (!dataset) return dataset.error();
    OpenDataset open;
    open.isRemote = isHttpUrl(where);
    open.reader = *reader;
    open.dataset = std::make_shared<const Dataset>(*std::move(dataset));
    open.source = std::make_shared<const FilePageSource>(open.reader, open.dataset, open.runBytes());
    return open;
}

}  // namespace vcp
