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

/// How servers are accessed.
struct SourceAccess {
    std::string caFile;                ///< PEM; empty: the system's
    std::string cache;                 ///< folder that keeps what a server sends; empty: nothing is kept
    uint64_t cacheBytes = 4ull << 30;  ///< limit of that folder
    /// Makes requests to a server end, within some 50 ms, once it returns true: while a dataset is opened, and in its
    /// later reads. Any thread calls it.
    std::function<bool()> cancelled = {};
};

/// Opens a path or an http(s) address, through the cache where one is asked for. Errors: those of openFile,
/// HttpReader::open and CachingReader::open.
Result<std::shared_ptr<const ByteReader>> openReader(const std::string& where, const SourceAccess& access);

/// A dataset opened for showing: of a large directory the beginning is read, and more as pages are asked for.
struct OpenDataset {
    std::shared_ptr<const ByteReader> reader;
    std::shared_ptr<const Dataset> dataset;
    std::shared_ptr<const PageSource> source;
    bool isRemote = false;

    [[nodiscard]] Box bounds() const;
    /// Returns the number of threads that read pages: with a server most of them wait.
    [[nodiscard]] uint32_t loaderThreads() const { return isRemote ? 8 : 2; }
    /// Returns up to how many bytes pages are read together (FilePageSource).
    [[nodiscard]] uint64_t runBytes() const { return isRemote ? 256 << 10 : 0; }
};

/// Opens a dataset. Errors: those of openReader and readDatasetStart.
Result<OpenDataset> openDataset(const std::string& where, const SourceAccess& access);

}  // namespace vcp
