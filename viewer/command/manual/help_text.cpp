#include "viewer/command/manual/help_text.h"

#include <algorithm>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "viewer/command/manual/command_tree.h"

namespace vcp {

namespace {

constexpr size_t kNames = 28, kLine = 100;  // columns of names, and of all

bool isForFew(std::string_view group) { return group == help_group::kMeasuring || group == help_group::kPaper; }

/// Breaks text at blanks, so that no line is longer than `width` where words are not.
std::string broken(const std::string& text, size_t width) {
    std::string out;
    size_t column = 0;
    for (size_t from = 0; from < text.size();) {
        const size_t end = std::min(text.find(' ', from), text.size());
        if (column > 0 && column + 1 + end - from > width) {
            out += '\n';
            column = 0;
        } else if (from > 0) {
            out += ' ';
            ++column;
        }
        out.append(text, from, end - from);
        column += end - from;
        from = end + 1;
    }
    return out;
}

class HelpText : public CLI::Formatter {
public:
    HelpText() { column_width(kNames); }

    std::string make_help(const CLI::App* app, std::string name, CLI::AppFormatMode mode) const override {
        if (mode == CLI::AppFormatMode::Sub) return make_expanded(app);
        return make_description(app) + make_usage(app, std::move(name)) + make_positionals(app) +
               optionsOf(*app, mode == CLI::AppFormatMode::Normal) + make_subcommands(app, mode) + "\n" +
               make_footer(app);
    }

    /// Returns " WxH [1920x1200]": the name of the value, and what it is where it is not given.
    std::string make_option_opts(const CLI::Option* option) const override {
        if (option->get_type_size() == 0) return {};
        const std::string type = option->get_type_name();
        std::string text = type.empty() ? "" : " " + type.substr(0, type.find(':'));
        if (text.starts_with(" [=")) return text.substr(1);  // what a flag may have behind its name
        if (!text.empty() && option->get_items_expected_min() == 0) return fmt::format(" [{}]", text.substr(1));
        if (option->get_expected_max() == CLI::detail::expected_max_vector_size) text += "...";
        if (!option->get_default_str().empty()) text += fmt::format(" [{}]", option->get_default_str());
        return option->get_required() && option->nonpositional() ? text + " (required)" : text;
    }

    /// Returns "--settle,--no-settle": the names without the values in braces that they stand for.
    std::string make_option_name(const CLI::Option* option, bool isPositional) const override {
        std::string name = CLI::Formatter::make_option_name(option, isPositional);
        for (size_t at = 0; (at = name.find('{')) != std::string::npos;) name.erase(at, name.find('}', at) + 1 - at);
        return name;
    }

    std::string make_option_desc(const CLI::Option* option) const override {
        return broken(option->get_description(), kLine - kNames);
    }

private:
    [[nodiscard]] std::string optionsOf(const CLI::App& app, bool isShort) const {
        std::string text, left;
        for (const std::string& group : groupsOf(app)) {
            const auto options = app.get_options([&group](const CLI::Option* option) {
                return option->get_group() == group && option->nonpositional();
            });
            if (group.empty() || options.empty()) continue;
            if (isShort && isForFew(group))
                left += fmt::format("{}{}", left.empty() ? "" : "; ", group);
            else
                text += make_group(group, false, options);
        }
        return left.empty() ? text : text + broken(fmt::format("\nMore with --help-all: {}.", left), kLine) + "\n";
    }
};

}  // namespace

void setUpHelp(CLI::App& vcp) {
    vcp.formatter(std::make_shared<HelpText>());
    vcp.set_help_flag("-h,--help", "Print this");
    vcp.set_help_all_flag("--help-all", "Print all options");
}

void groupHelp(CLI::App& vcp) {
    vcp.get_help_ptr()->group(help_group::kHelp);
    vcp.get_option("--help-all")->group(help_group::kHelp);
    for (CLI::App* command : vcp.get_subcommands([](const CLI::App*) { return true; })) groupHelp(*command);
}

void beginGroup(CLI::App& app, const char* group) { app.option_defaults()->group(group); }

}  // namespace vcp
