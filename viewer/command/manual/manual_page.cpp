#include "viewer/command/manual/manual_page.h"

#include <algorithm>
#include <cctype>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace vcp {

namespace {

constexpr const char* kExitStatus =
    ".SH EXIT STATUS\n"
    ".TP\n0\ndone\n"
    ".TP\n1\nfailed, with one line on standard error\n"
    ".TP\n2\nwrong usage\n";

/// Writes text as roff shows it unchanged.
std::string roff(const std::string& text) {
    std::string out;
    for (const char c : text) {
        if (c == '\\')
            out += "\\e";
        else if (c == '-')
            out += "\\-";
        else if ((c == '.' || c == '\'') && (out.empty() || out.back() == '\n'))
            out += std::string("\\&") + c;
        else
            out += c;
    }
    return out;
}

/// Ends a description as a sentence: roff joins lines.
std::string sentence(const std::string& description) {
    return roff(description) + (description.ends_with('.') ? "" : ".");
}

std::string upper(std::string text) {
    std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return char(std::toupper(c)); });
    return text;
}

std::string bold(const std::string& text) { return "\\fB" + roff(text) + "\\fR"; }
std::string italic(const std::string& text) { return "\\fI" + roff(text) + "\\fR"; }

/// Returns "--method certified|paper", "--caps[=all]", and so on.
std::string heading(const OptionEntry& option) {
    std::string text;
    for (const std::string& name : option.names) text += (text.empty() ? "" : ", ") + bold(name);
    const bool isApart = !text.empty() && !option.value.starts_with('[');
    if (!option.value.empty()) text += (isApart ? " " : "") + italic(option.value);
    return text;
}

std::string paragraph(const OptionEntry& option) {
    std::string text = fmt::format(".TP\n{}\n{}\n", heading(option), sentence(option.description));
    if (!option.words.empty())
        text += fmt::format("One of {}.\n", roff(fmt::format("{}", fmt::join(option.words, ", "))));
    if (!option.usual.empty()) text += fmt::format("Where nothing is said: {}.\n", roff(option.usual));
    if (option.isRequired && !option.names.empty()) text += "Required.\n";
    return text;
}

std::string synopsis(const CommandEntry& command) {
    std::string text = bold(command.path);
    if (!command.groups.empty()) text += " [" + italic("OPTIONS") + "]";
    for (const OptionEntry& argument : command.arguments) {
        const std::string name = italic(argument.value) + (argument.mayRepeat ? "..." : "");
        text += argument.isRequired ? " " + name : " [" + name + "]";
    }
    if (!command.commands.empty()) text += " " + italic("COMMAND");
    return text + "\n";
}

/// Returns the section of the commands below, each with its page.
std::string commandsBelow(const CommandEntry& command) {
    if (command.commands.empty()) return {};
    std::string text = ".SH COMMANDS\n";
    for (const CommandEntry& each : command.commands)
        text += fmt::format(".TP\n{}\n{}\nSee {}(1).\n", bold(each.name), sentence(each.description),
                            bold(manualName(each)));
    return text;
}

}  // namespace

std::string manualName(const CommandEntry& command) {
    std::string name = command.path;
    std::replace(name.begin(), name.end(), ' ', '-');
    return name;
}

std::string manualPage(const CommandEntry& command, const std::string& version) {
    const std::string name = manualName(command);
    std::string page = fmt::format(".TH \"{}\" 1 \"\" \"{}\" \"{}\"\n", upper(name), version, "The manual of vcp");
    page += fmt::format(".SH NAME\n{} \\- {}\n", roff(name), roff(firstClause(command.description)));
    page += ".SH SYNOPSIS\n" + synopsis(command);
    page += fmt::format(".SH DESCRIPTION\n{}\n", sentence(command.description));
    if (!command.arguments.empty()) page += ".SH ARGUMENTS\n";
    for (const OptionEntry& argument : command.arguments) page += paragraph(argument);
    for (const OptionGroup& group : command.groups) {
        page += ".SH " + upper(group.name) + "\n";
        for (const OptionEntry& option : group.options) page += paragraph(option);
    }
    page += commandsBelow(command);
    if (!command.footer.empty()) page += fmt::format(".SH NOTES\n.nf\n{}\n.fi\n", roff(command.footer));
    page += kExitStatus;
    if (name != "vcp") page += ".SH SEE ALSO\n" + bold(name.substr(0, name.rfind('-'))) + "(1)\n";
    page.pop_back();  // what writes it ends the last line
    return page;
}

}  // namespace vcp
