// vcp: the command line. Exit status 0: done; 1: failed, with one line on stderr; 2: wrong usage.
#include <algorithm>
#include <cstdio>
#include <string>
#include <vector>

#include "octree/io/caught.h"
#include "streaming/web_address.h"
#include "viewer/command/commands.h"
#include "viewer/command/manual/help_text.h"
#include "viewer/command/option_names.h"
#include "viewer/command/optional_values.h"
#include "viewer/command/terminal/suggestion.h"
#include "viewer/command/terminal/terminal_text.h"

namespace vcp {

namespace {

constexpr int kFailed = 1;
constexpr int kWrongUsage = 2;

/// Writes one line on stderr, whatever the message contains; mistyped text may be an address with a password.
void complain(const std::string& what) {
    std::string message = withSettingNames(shownAddress(what), kOptionNames);
    std::replace(message.begin(), message.end(), '\n', ' ');
    std::fprintf(stderr, "vcp: %s\n", terminalText(message).c_str());
}

std::vector<std::string> commandNames(const CLI::App& app) {
    std::vector<std::string> names;
    for (const CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; }))
        if (!command->get_group().empty()) names.push_back(command->get_name());
    return names;
}

std::vector<std::string> optionNames(const CLI::App& app) {
    std::vector<std::string> names;
    for (const CLI::Option* option : app.get_options())
        for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
    return names;
}

/// Returns "; did you mean NAME?" where one of the names is near, else nothing.
std::string suggestion(const std::string& typed, const std::vector<std::string>& names) {
    const auto nearest = nearestName(typed, names);
    return nearest ? "; did you mean " + *nearest + "?" : "";
}

/// Adds `vcp help`, `vcp help CMD`, `vcp help bench rays`.
Command addHelp(CLI::App& vcp) {
    auto words = std::make_shared<std::vector<std::string>>();
    CLI::App* app = vcp.add_subcommand("help", "Say how a command is used");
    app->add_option("CMD", *words, "The command")->type_name("");
    const auto run = [words, &vcp]() -> Result<int> {
        const CLI::App* about = &vcp;
        std::string path = vcp.get_name();
        for (const std::string& word : *words) {
            const auto found = about->get_subcommands([&](const CLI::App* sub) { return sub->check_name(word); });
            if (found.empty())
                return Error{
                    .code = ErrorCode::Usage,
                    .message = "there is no command \"" + word + "\"" + suggestion(word, commandNames(*about))};
            about = found.front();
            path += " " + word;
        }
        VCP_TRY(printLine(about->get_formatter()->make_help(about, path, CLI::AppFormatMode::Normal)));
        return 0;
    };
    return {app, run};
}

std::string commandPath(const CLI::App& vcp) {
    std::string path;
    const CLI::App* at = &vcp;
    while (!at->get_subcommands().empty()) {
        at = at->get_subcommands().front();
        path += (path.empty() ? "" : " ") + at->get_name();
    }
    return path;
}

const CLI::App& innermost(const CLI::App& vcp) {
    const CLI::App* at = &vcp;
    while (!at->get_subcommands().empty()) at = at->get_subcommands().front();
    return *at;
}

/// Returns the files that a command was given, shortened; empty without any.
std::string inputsOf(const CLI::App& vcp) {
    std::vector<std::string> inputs;
    for (const CLI::Option* option : innermost(vcp).get_options())
        if (option->get_positional()) inputs.insert(inputs.end(), option->results().begin(), option->results().end());
    if (inputs.empty()) return {};
    return inputs.size() == 1 ? inputs.front() : inputs.front() + " and " + std::to_string(inputs.size() - 1) + " more";
}

/// Returns what the first word that nothing takes was meant to be.
std::string suggestionFor(const CLI::App& vcp) {
    const CLI::App& command = innermost(vcp);
    for (const CLI::App* app : {&command, &vcp})
        for (const std::string& word : app->remaining(false)) {
            const std::string name = word.substr(0, word.find('='));
            return suggestion(name, name.starts_with('-') ? optionNames(command) : commandNames(command));
        }
    return "";
}

int complainOfUsage(const CLI::App& vcp, const std::string& message) {
    const std::string path = commandPath(vcp);
    complain((path.empty() ? "" : path + ": ") + message + "; see `vcp help" + (path.empty() ? "`" : " " + path + "`"));
    return kWrongUsage;
}

int runParsed(const CLI::App& vcp, const std::vector<Command>& commands) {
    const auto parsed =
        std::find_if(commands.begin(), commands.end(), [](const Command& c) { return c.app->parsed(); });
    const Result<int> status = caught([&] { return parsed->run(); }, inputsOf(vcp));
    if (status) return *status;
    if (status.error().code == ErrorCode::Usage) return complainOfUsage(vcp, status.error().line());
    complain(status.error().line());
    return kFailed;
}

int runCommandLine(int argc, char** argv) {
    CLI::App vcp("Views massive scans: turns meshes of any size into one file that opens at once, and shows it.",
                 "vcp");
    vcp.require_subcommand(0, 1);
    setUpHelp(vcp);
    vcp.set_version_flag("--version", "vcp " VCP_VERSION, "Print the version")->group(help_group::kHelp);
    vcp.footer("`vcp help CMD` says how a command is used, `vcp CMD --help-all` names all its options.");
    const std::vector<Command> commands = {addBuild(vcp),   addInfo(vcp),   addVerify(vcp),    addRender(vcp),
                                           addView(vcp),    addExport(vcp), addCompare(vcp),   addStress(vcp),
                                           addPublish(vcp), addServe(vcp),  addBuildPlan(vcp), addBuildStep(vcp),
                                           addShard(vcp),   addPack(vcp),   addBench(vcp),     addMeso(vcp),
                                           addDevices(vcp), addHelp(vcp),   addManual(vcp),    addCompletions(vcp)};
    groupHelp(vcp);
    try {
        const auto words = withOptionalValues(vcp, {argv + 1, argv + argc});
        vcp.parse(std::vector<std::string>(words.rbegin(), words.rend()));
    } catch (const CLI::CallForHelp&) {
        return printLine(vcp.help()) ? 0 : kFailed;
    } catch (const CLI::CallForAllHelp&) {
        return printLine(vcp.help("", CLI::AppFormatMode::All)) ? 0 : kFailed;
    } catch (const CLI::CallForVersion& version) {
        return printLine(version.what()) ? 0 : kFailed;
    } catch (const CLI::ParseError& wrong) {
        return complainOfUsage(vcp, wrong.what() + suggestionFor(vcp));
    }
    if (vcp.get_subcommands().empty()) return complainOfUsage(vcp, "a command is needed");
    return runParsed(vcp, commands);
}

}  // namespace

}  // namespace vcp

int main(int argc, char** argv) { return vcp::runCommandLine(argc, argv); }
