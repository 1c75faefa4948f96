// Temporary bytes of a build: append-only files in one folder, kept in memory while there is room for them.
//
// A small build never touches the disk. When the files together hold more than the memory they were given, the
// file that is being appended to moves its bytes to the folder. A checkpoint moves all of them and makes them
// durable, so that a journal may rely on their lengths (journal.h).
//
// A disk may return other bytes than were written. So whoever appends first makes a hash of the bytes, keeps it or
// appends it too, and checks it on reading: record_bins.h for blocks, page_spool.h for pages and their entries,
// vertex_join.h for chunks of vertices.
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <vector>

#include "builder/spill/temp_folder.h"
#include "octree/io/result.h"

namespace vcp {

class TempFile;

/// The folder and its accounts. Outlives its files. Any thread.
class TempSpace {
public:
    /// Nothing is created before it is needed. `memoryBytes`: what all files together may hold in memory.
    TempSpace(std::filesystem::path folder, uint64_t memoryBytes, FolderUse use = FolderUse::Own)
        : folder_(std::move(folder), use), memoryBytes_(memoryBytes) {}

    /// The folder, held before files go there, and released with the space.
    [[nodiscard]] TempFolder& folder() { return folder_; }
    [[nodiscard]] const TempFolder& folder() const { return folder_; }

    /// Writes to the disk what the files hold in memory. No file may be appended to meanwhile. Errors: Io.
    Result<void> spill();

    /// Whether the files hold so little that there is no need to code so many bytes more: they stay in memory.
    [[nodiscard]] bool isAmple(uint64_t bytes) const { return held_ + bytes <= memoryBytes_ / 2; }

    /// The most bytes that lay in the folder at one time.
    [[nodiscard]] uint64_t peakDiskBytes() const { return peakDisk_; }
    [[nodiscard]] uint64_t diskBytes() const { return disk_; }

private:
    friend class TempFile;
    void addDisk(int64_t bytes);

    TempFolder folder_;
    uint64_t memoryBytes_;
    std::atomic<uint64_t> held_ = 0, disk_ = 0, peakDisk_ = 0;
    std::mutex filesMutex_;
    std::vector<TempFile*> files_;
};

/// One append-only file. append and sync: one thread at a time; read: any thread, beside append.
class TempFile {
public:
    TempFile(TempSpace& space, std::string name);
    ~TempFile();
    TempFile(const TempFile&) = delete;
    TempFile& operator=(const TempFile&) = delete;

    [[nodiscard]] const std::string& name() const { return name_; }
    [[nodiscard]] std::filesystem::path path() const { return space_.folder().path() / name_; }
    [[nodiscard]] uint64_t size() const { return end_; }
    /// Appends bytes; returns their offset. Errors: Io.
    Result<uint64_t> append(std::span<const std::byte> bytes);
    /// Reads bytes that were appended, without checking them. Errors: Io.
    Result<void> read(uint64_t offset, std::span<std::byte> bytes) const;
    /// Writes all bytes to the disk, durably. Errors: Io.
    Result<void> sync();
    /// Takes over what an interrupted build left, cut to `bytes`, in the held folder; to read, nothing is cut. Errors:
    /// Io (not a file of a build's own); InvalidInput (missing, shorter).
    Result<void> reopen(uint64_t bytes);
    /// Closes a file that another build finished, until wake() opens it again as it was; meanwhile nothing is read. A
    /// build's own files stay open. Errors of wake: reopen's.
    void rest();
    Result<void> wake();
    /// Frees memory and disk.
    void remove();

private:
    friend class TempSpace;
    static constexpr size_t kPieceBytes = size_t{1} << 18;

    Result<void> flush();
    void dropTail();

    TempSpace& space_;
    std::string name_;
    int file_ = -1;
    bool isNamed_ = false;  ///< the folder's entry is durable
    bool isAtRest_ = false;
    uint64_t flushed_ = 0;  ///< bytes on the disk; the rest is in tail_
    std::atomic<uint64_t> end_ = 0;
    std::vector<std::unique_ptr<std::byte[]>> tail_;
    mutable std::mutex mutex_;
};

}  // namespace vcp
