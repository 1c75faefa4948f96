// vcp man, vcp completions: what is installed beside the program. The build runs them; help does not list them.
#include <filesystem>

#include <fmt/format.h>

#include "octree/io/output_file.h"
#include "viewer/command/commands.h"
#include "viewer/command/manual/completions.h"
#include "viewer/command/manual/manual_page.h"

namespace vcp {

namespace {

/// Returns the entry of the command that the words name.
Result<const CommandEntry*> entryNamed(const CommandEntry& root, const std::vector<std::string>& words) {
    std::string path = root.path;
    for (const std::string& word : words) path += " " + word;
    for (const CommandEntry* command : allCommands(root))
        if (command->path == path) return command;
    return Error{.code = ErrorCode::Usage, .message = fmt::format("there is no command \"{}\"", path)};
}

/// Writes every command's page into a folder: "vcp-build.1".
Result<void> writePages(const CommandEntry& root, const std::string& version, const std::filesystem::path& folder) {
    for (const CommandEntry* command : allCommands(root))
        VCP_TRY(writeFile(folder / (manualName(*command) + ".1"), OutputKind::Text, manualPage(*command, version)));
    return {};
}

}  // namespace

Command addManual(CLI::App& vcp) {
    auto words = std::make_shared<std::vector<std::string>>();
    auto folder = std::make_shared<std::string>();
    CLI::App* app = vcp.add_subcommand("man", "Print a command's manual page, in roff")->group("");
    app->add_option("CMD", *words, "The command")->type_name("");
    app->add_option("--all", *folder, "Write the pages of all commands into this folder")
        ->type_name("DIR")
        ->check(CLI::ExistingDirectory);
    return {app, [words, folder, &vcp]() -> Result<int> {
                const CommandEntry root = commandTree(vcp);
                if (!folder->empty()) {
                    VCP_TRY(writePages(root, vcp.version(), *folder));
                    return 0;
                }
                VCP_TRY_ASSIGN(const auto* command, entryNamed(root, *words));
                VCP_TRY(printLine(manualPage(*command, vcp.version())));
                return 0;
            }};
}

Command addCompletions(CLI::App& vcp) {
    auto shell = std::make_shared<std::string>();
    CLI::App* app = vcp.add_subcommand("completions", "Print what a shell completes after vcp")->group("");
    app->add_option("SHELL", *shell, "bash, zsh or fish")
        ->required()
        ->check(CLI::IsMember(std::vector<std::string>(kShells.begin(), kShells.end())));
    return {app, [shell, &vcp]() -> Result<int> {
                VCP_TRY(printLine(completions(commandTree(vcp), *shell)));
                return 0;
            }};
}

}  // namespace vcp
