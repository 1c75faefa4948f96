// Temporary bytes of a build: append-only files in one folder, kept in memory while there is room for them.
//
// A small build never touches the disk. When the files together hold more than the memory they were given, the
// file that is being appended to moves its bytes to the folder. A checkpoint moves all of them and makes them
// durable, so that a journal may rely on their lengths (journal.h).
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <vector>

#include "octree/result.h"

namespace vcp {

/// The file that journal.h keeps in the folder.
inline constexpr const char* kJournalName = "journal";

/// What to do about a folder that is full.
inline constexpr const char* kWhenTempIsFull = "free some space, or give --temp a folder with more";

class TempFile;

/// The folder and its accounts. Outlives its files. Any thread.
class TempSpace {
public:
    /// Nothing is created before it is needed. `memoryBytes`: what all files together may hold in memory.
    TempSpace(std::filesystem::path folder, uint64_t memoryBytes) : folder_(std::move(folder)), memoryBytes_(memoryBytes) {}

    [[nodiscard]] const std::filesystem::path& folder() const { return folder_; }
    /// Makes the folder, durably, and takes it for this process until removed or destroyed. Files lock it
    /// before they go there. Errors: Io (another build holds it).
    Result<void> lock();
    /// Removes what a build puts into the folder, but for the files named `kept`, when the folder is held;
    /// what else lies in it stays.
    void clear(const std::vector<std::string>& kept = {});
    /// The same with the folder, which is given back.
    void remove();
    ~TempSpace();
    TempSpace(const TempSpace&) = delete;
    TempSpace& operator=(const TempSpace&) = delete;

    /// Brings to the disk what the files hold in memory. No file may be appended to meanwhile. Errors: Io.
    Result<void> spill();

    /// Most bytes that lay in the folder at one time.
    [[nodiscard]] uint64_t peakDiskBytes() const { return peakDisk_; }
    [[nodiscard]] uint64_t diskBytes() const { return disk_; }

private:
    friend class TempFile;
    void addDisk(int64_t bytes);
    Result<void> take();

    std::filesystem::path folder_;
    uint64_t memoryBytes_;
    std::atomic<uint64_t> held_ = 0, disk_ = 0, peakDisk_ = 0;
    std::mutex filesMutex_;
    std::vector<TempFile*> files_;
    std::mutex lockMutex_;
    int lock_ = -1;
};

/// One append-only file. append and sync: one thread at a time; read: any thread, beside append.
class TempFile {
public:
    TempFile(TempSpace& space, std::string name);
    ~TempFile();
    TempFile(const TempFile&) = delete;
    TempFile& operator=(const TempFile&) = delete;

    [[nodiscard]] const std::string& name() const { return name_; }
    [[nodiscard]] std::filesystem::path path() const { return space_.folder() / name_; }
    [[nodiscard]] uint64_t size() const { return end_; }
    /// Appends; returns where. Errors: Io.
    Result<uint64_t> append(std::span<const std::byte> bytes);
    /// Reads bytes that were appended. Errors: Io.
    Result<void> read(uint64_t offset, std::span<std::byte> bytes) const;
    /// Brings all bytes to the disk, durably. Errors: Io.
    Result<void> sync();
    /// Takes over what an interrupted build left, cut to `bytes`. Errors: Io; InvalidInput (missing, shorter).
    Result<void> reopen(uint64_t bytes);
    /// Gives back memory and disk.
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
    uint64_t flushed_ = 0;  ///< bytes on the disk; the rest is in tail_
    std::atomic<uint64_t> end_ = 0;
    std::vector<std::unique_ptr<std::byte[]>> tail_;
    mutable std::mutex mutex_;
};

}  // namespace vcp
