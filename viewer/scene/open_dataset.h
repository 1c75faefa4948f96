// Opens a dataset for showing: a local file or a server.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "octree/result.h"
#include "streaming/page_source.h"
#include "viewer/camera/orbit_camera.h"

namespace vcp {

/// How servers are asked.
struct SourceAccess {
    std::string caFile;                ///< PEM; empty: the system's
    std::string cache;                 ///< folder that keeps what a server sends; empty: nothing is kept
    uint64_t cacheBytes = 4ull << 30;  ///< limit of that folder
    /// Ends what a server is asked for, within some 50 ms, once it says so: while a dataset is opened, and in its later
    /// reads. Any thread asks.
    std::function<bool()> cancelled = {};
};

/// Opens a path or an http(s) address, through the cache where one is asked for. Errors: those of openFile,
/// HttpReader::open and CachingReader::open.
Result<std::shared_ptr<const ByteReader>> openReader(const std::string& where, const SourceAccess& access);

/// A dataset opened for showing: of a large directory the beginning, more as pages are asked for.
struct OpenDataset {
    std::shared_ptr<const ByteReader> reader;
    std::shared_ptr<const Dataset> dataset;
    std::shared_ptr<const PageSource> source;
    bool isRemote = false;

    [[nodiscard]] Box bounds() const;
    /// Threads that read pages: from a server most of them wait.
    [[nodiscard]] uint32_t loaderThreads() const { return isRemote ? 8 : 2; }
    /// Pages read together up to so many bytes (FilePageSource).
    [[nodiscard]] uint64_t runBytes() const { return isRemote ? 256 << 10 : 0; }
};

/// Errors: those of openReader and readDatasetStart.
Result<OpenDataset> openDataset(const std::string& where, const SourceAccess& access);

}  // namespace vcp
