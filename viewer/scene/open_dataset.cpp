#include "viewer/scene/open_dataset.h"

#include "streaming/caching_reader.h"
#include "streaming/http_reader.h"

namespace vcp {

Result<std::shared_ptr<const ByteReader>> openReader(const std::string& where, const SourceAccess& access) {
    if (!isHttpUrl(where)) {
        VCP_TRY_ASSIGN(auto file, openFile(where));
        return std::shared_ptr<const ByteReader>(file);
    }
    HttpOptions options;
    options.caFile = access.caFile;
    options.cancelled = access.cancelled;
    VCP_TRY_ASSIGN(auto http, HttpReader::open(where, options));
    if (access.cache.empty()) return std::shared_ptr<const ByteReader>(http);
    VCP_TRY_ASSIGN(auto cached, CachingReader::open(http, http->identity(), access.cache, access.cacheBytes));
    return std::shared_ptr<const ByteReader>(cached);
}

Box OpenDataset::bounds() const {
    const FileHeader& h = dataset->header;
    return {{h.boundsMin[0], h.boundsMin[1], h.boundsMin[2]}, {h.boundsMax[0], h.boundsMax[1], h.boundsMax[2]}};
}

Result<OpenDataset> openDataset(const std::string& where, const SourceAccess& access) {
    VCP_TRY_ASSIGN(auto reader, openReader(where, access));
    VCP_TRY_ASSIGN(auto dataset, readDatasetStart(*reader));
    OpenDataset open;
    open.isRemote = isHttpUrl(where);
    open.reader = reader;
    open.dataset = std::make_shared<const Dataset>(std::move(dataset));
    open.source = std::make_shared<const FilePageSource>(open.reader, open.dataset, open.runBytes());
    return open;
}

}  // namespace vcp
