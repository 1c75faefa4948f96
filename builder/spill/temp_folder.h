// The folder of a build's temporary files: made by the build, marked as its own, held by one process at a time.
//
// What a folder of that name holds is touched only where the mark says that a build made it: `vcp-build`, an empty
// file created with the folder. Files are created exclusively and opened relative to the folder that is held, never
// through links, and only the names that builds give are ever removed.
#pragma once

#include <filesystem>
#include <mutex>
#include <string>
#include <vector>

#include "octree/io/result.h"

namespace vcp {

/// The file that journal.h keeps in the folder.
inline constexpr const char* kJournalName = "journal";

/// The file that says that a build made the folder.
inline constexpr const char* kTempMark = "vcp-build";

/// The names of all other temporary files end in this.
inline constexpr const char* kTempSuffix = ".spill";

/// What to do about a folder that is full.
inline constexpr const char* kWhenTempIsFull = "free some space, or choose a temporary folder with more";

/// Returns the error of a call of the system, with errno `code`: what has failed with a temporary file.
Error tempError(const std::filesystem::path& file, const char* what, int code);

/// Returns the error for bytes that differ from what was written: in `file`, at `byte`.
Error damagedTempFile(const std::filesystem::path& file, std::optional<uint64_t> byte = {});

/// Who uses a folder: the build that it belongs to, or one that only reads what another has finished; of these there
/// may be any number at a time.
enum class FolderUse { Own, Read };

/// A folder for temporary files. Any thread.
class TempFolder {
public:
    /// Makes nothing yet.
    explicit TempFolder(std::filesystem::path path, FolderUse use = FolderUse::Own)
        : path_(std::move(path)), use_(use) {}
    ~TempFolder();
    TempFolder(const TempFolder&) = delete;
    TempFolder& operator=(const TempFolder&) = delete;

    [[nodiscard]] const std::filesystem::path& path() const { return path_; }
    [[nodiscard]] FolderUse use() const { return use_; }
    /// Whether there is anything of that name, even a link to nothing.
    [[nodiscard]] bool exists() const;

    /// Makes the folder, and those that it lies in, or takes over that of an interrupted build or an empty one,
    /// durably, for this process until it is removed or this is destroyed. Nothing is left behind where that fails.
    /// Errors: Io (another build holds it; it is a link or a file; it has no mark and is not empty).
    /// To read, the folder is opened as it is, and not locked. Errors: Io.
    Result<void> take();
    [[nodiscard]] bool isTaken() const { return folder_ >= 0; }

    /// Makes a new file, for reading and writing. Errors: Io (the name is taken).
    Result<int> create(const std::string& name) const;
    /// Opens a file that a build left, for reading and writing; -1 where there is none. Errors: Io (a link, no regular
    /// file, or one that has another name as well).
    Result<int> open(const std::string& name) const;
    /// Removes the file or the link of that name, never what a link leads to.
    void unlink(const std::string& name) const;
    /// Makes created files' names durable. Errors: Io.
    Result<void> sync() const;

    /// Removes the files that a build makes, except those named `kept`, when the folder is held.
    void clear(const std::vector<std::string>& kept = {}) const;
    /// Does so, and removes the folder, and those made for it, where nothing else lies in them. It is no longer held.
    void remove();

private:
    Result<void> make();
    Result<bool> hold();
    Result<void> mark() const;
    void unmake();

    std::filesystem::path path_;
    FolderUse use_;
    std::vector<std::filesystem::path> made_;  ///< folders that were not there, the outermost first
    std::mutex mutex_;
    int folder_ = -1;
};

}  // namespace vcp
