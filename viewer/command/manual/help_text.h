// How help reads: options in groups, long lines broken, and what few need only with --help-all.
#pragma once

#include <string>

#include <CLI/CLI.hpp>

namespace vcp {

/// Groups of options, by what a person is about. Options of one group may be added in any order.
namespace help_group {
inline constexpr const char* kOutput = "Output";
inline constexpr const char* kCamera = "Where from";
inline constexpr const char* kLook = "How it looks";
inline constexpr const char* kWritten = "Written into the picture";
inline constexpr const char* kPictures = "Many pictures";
inline constexpr const char* kLimits = "Detail and memory";
inline constexpr const char* kMeshes = "Meshes, which are built first";
inline constexpr const char* kServers = "Files on a server";
inline constexpr const char* kReport = "Progress and report";
inline constexpr const char* kHelp = "Help";
inline constexpr const char* kBuilding = "What is built, and with what";
inline constexpr const char* kPart = "What of it";
inline constexpr const char* kMeasured = "What is measured";
// Only with --help-all:
inline constexpr const char* kMeasuring = "For benchmarks and comparisons";
inline constexpr const char* kPaper = "The method of Demir and Westermann 2015";
}  // namespace help_group

/// Puts the options that are added from now on into a group.
void beginGroup(CLI::App& app, const char* group);
/// Does so as long as it lives.
class ScopedGroup {
public:
    ScopedGroup(CLI::App& app, const char* group) : app_(app), before_(app.option_defaults()->get_group()) {
        beginGroup(app, group);
    }
    ~ScopedGroup() { app_.option_defaults()->group(before_); }
    ScopedGroup(const ScopedGroup&) = delete;
    ScopedGroup& operator=(const ScopedGroup&) = delete;

private:
    CLI::App& app_;
    std::string before_;
};

/// Gives `vcp` its help, before it gets its commands, which take it over.
void setUpHelp(CLI::App& vcp);
/// Puts the options that print help into a group of their own, of each command.
void groupHelp(CLI::App& vcp);

}  // namespace vcp
