#include "viewer/command/optional_values.h"

#include "viewer/scene/option_values.h"

namespace vcp {

namespace {

/// Whether an option's value may be left out. Flags have none.
bool isOptional(const CLI::Option& option) {
    return option.get_expected_min() == 0 && option.get_items_expected_max() == 1;
}

bool mayBeValue(CLI::Option& option, const std::string& word) {
    if (parseNumbers(word).size() == 1) return true;
    try {
        const CLI::Validator& check = *option.get_validator();
        return check(word).empty();
    } catch (const CLI::OptionNotFound&) {
        return false;  // the option checks nothing
    }
}

}  // namespace

std::vector<std::string> withOptionalValues(CLI::App& vcp, const std::vector<std::string>& words) {
    CLI::App* command = &vcp;
    std::vector<std::string> all;
    for (size_t i = 0; i < words.size(); ++i) {
        const std::string& word = words[i];
        if (word == "--") return all.insert(all.end(), words.begin() + ptrdiff_t(i), words.end()), all;
        all.push_back(word);
        if (!word.starts_with('-')) {
            const auto inner = command->get_subcommands([&](CLI::App* each) { return each->check_name(word); });
            if (!inner.empty()) command = inner.front();
            continue;
        }
        CLI::Option* const option = command->get_option_no_throw(word);
        const bool isFollowed = i + 1 < words.size() && !words[i + 1].starts_with('-');
        if (option == nullptr || !isOptional(*option) || !isFollowed) continue;
        const bool isValue = mayBeValue(*option, words[i + 1]);
        all.back() += "=" + (isValue ? words[++i] : option->get_default_str());
    }
    return all;
}

}  // namespace vcp
