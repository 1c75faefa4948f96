// Where a dataset is read from: a local file, or a server with the options of `vcp` for it.
#pragma once

#include <memory>
#include <string>

#include "octree/result.h"
#include "octree/vcp_file.h"
#include "streaming/page_source.h"
#include "viewer/commands.h"
#include "viewer/orbit_camera.h"

namespace vcp {

struct SourceSettings {
    std::string caFile;
    std::string cache;
    std::string cacheLimit = "4G";
};

void addSourceSettings(CLI::App& app, SourceSettings& settings);

/// Opens a path or an http(s) address, through the cache where one is asked for. Errors: those of openFile,
/// HttpReader::open and CachingReader::open.
Result<std::shared_ptr<const ByteReader>> openReader(const std::string& where, const SourceSettings& settings);

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
Result<OpenDataset> openDataset(const std::string& where, const SourceSettings& settings);

}  // namespace vcp
