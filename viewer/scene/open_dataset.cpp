#include "viewer/scene/open_dataset.h"

#include "streaming/caching_reader.h"
#include "streaming/http_reader.h"

namespace vcp {

Result<std::shared_ptr<const ByteReader>> openReader(const std::string& where, const SourceAccess& access) {
    if (!isHttpUrl(where)) {
        auto file = openFile(where);
        if (!file) return file.error();
        return std::shared_ptr<const ByteReader>(*file);
    }
    HttpOptions options;
    options.caFile = access.caFile;
    options.cancelled = access.cancelled;
    auto http = HttpReader::open(where, options);
    if (!http) return http.error();
    if (access.cache.empty()) return std::shared_ptr<const ByteReader>(*http);
    auto cached = CachingReader::open(*http, (*http)->identity(), access.cache, access.cacheBytes);
    if (!cached) return cached.error();
    return std::shared_ptr<const ByteReader>(*cached);
}

Box OpenDataset::bounds() const {
    const FileHeader& h = dataset->header;
    return {{h.boundsMin[0], h.boundsMin[1], h.boundsMin[2]}, {h.boundsMax[0], h.boundsMax[1], h.boundsMax[2]}};
}

Result<OpenDataset> openDataset(const std::string& where, const SourceAccess& access) {
    auto reader = openReader(where, access);
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
