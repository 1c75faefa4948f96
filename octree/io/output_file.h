// OutputFile: a file that appears under its name whole, and never at the cost of something else.
//
// The bytes go into a new file beside the output, OUT.partial, which is created exclusively and never through a
// link; commit() makes them durable and renames. What is there already is replaced only where that loses nothing:
//
//   a file that is read       never, whatever it is called: files are compared, not names
//   a device, pipe, socket    never: only regular files are replaced; "-" is standard output
//   a link                    stays; the file that it names is replaced
//   a write-protected file    only with OutputRules::overwrite
//   a file of another kind    only with OutputRules::overwrite; an empty file is of any kind
//   OUT.partial               only what an interrupted writer left, which begins with kPartialMark and is not held;
//                             beside anything else of that name the next free one is taken: OUT.partial.2, ...
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "octree/io/file_descriptor.h"
#include "octree/io/result.h"

namespace vcp {

/// What a file holds, as far as its first bytes tell.
enum class OutputKind { Dataset, Asset, Png, Pfm, JsonText, Svg, Text, Ply, Obj, Stl, Glb, Dxf, Mp4, Webm };

struct OutputRules {
    /// Also files of another kind, meshes that vcp did not write, and write-protected files may be replaced.
    bool overwrite = false;
    /// Files that the caller reads: they are never replaced. Files that do not exist are ignored.
    std::vector<std::filesystem::path> inputs = {};
};

/// The kind that a name's extension stands for, without regard to case; none for unknown ones.
std::optional<OutputKind> outputKindOf(const std::filesystem::path& path);

/// Whether a file that begins with `start` (its first 512 bytes, or all of it) may be of that kind.
bool beginsLike(OutputKind kind, std::span<const std::byte> start);

/// What a chain of links ends at, whether that is there or not; the path itself where it is no link. Errors: Io (a link
/// that cannot be followed, a circle).
Result<std::filesystem::path> linkTarget(const std::filesystem::path& path);

/// Whether two names stand for one file: through links, hard links and any spelling. False where one is missing.
bool isSameFile(const std::filesystem::path& a, const std::filesystem::path& b);

/// Checks what OutputFile::create would refuse, and leaves nothing behind. Errors: Io (with the output's name).
Result<void> checkOutput(const std::filesystem::path& output, OutputKind kind, const OutputRules& rules);

/// An output while it is written, by one thread. Without commit() nothing is left and nothing is replaced.
class OutputFile {
public:
    /// "-" is standard output, except for datasets and assets, which are not written front to back. Errors: Io.
    static Result<OutputFile> create(const std::filesystem::path& output, OutputKind kind,
                                     const OutputRules& rules = {});
    ~OutputFile();
    OutputFile(OutputFile&& other) noexcept;
    OutputFile& operator=(OutputFile&&) = delete;

    /// The descriptor is open for reading and writing (standard output for writing only), and owned by this object.
    [[nodiscard]] int descriptor() const { return file_.number(); }
    /// The output's name as it was given.
    [[nodiscard]] const std::filesystem::path& path() const { return output_; }

    /// Writes at an offset. Errors: Io.
    Result<void> write(uint64_t offset, std::span<const std::byte> bytes);
    /// Writes where the descriptor stands. Errors: Io.
    Result<void> append(std::span<const std::byte> bytes);
    /// Makes what is written so far durable. Errors: Io.
    Result<void> sync();
    /// Syncs, checks once more what is there now, and renames durably. Errors: Io.
    Result<void> commit();

private:
    OutputFile(std::filesystem::path output, OutputKind kind, OutputRules rules)
        : output_(std::move(output)), kind_(kind), rules_(std::move(rules)) {}
    void close();

    std::filesystem::path output_, target_, partial_;  ///< target_: output_ with links followed
    OutputKind kind_;
    OutputRules rules_;
    FileDescriptor file_;
};

/// Writes all of `bytes` as a file. Errors: those of OutputFile.
Result<void> writeFile(const std::filesystem::path& output, OutputKind kind, std::span<const std::byte> bytes,
                       const OutputRules& rules = {});
/// Writes lines of text; the last one ends with a line break.
Result<void> writeFile(const std::filesystem::path& output, OutputKind kind, std::string_view text,
                       const OutputRules& rules = {});

/// The bytes that a dataset or an asset begins with until it is complete.
inline constexpr std::string_view kPartialMark = "vcp-part";

}  // namespace vcp
