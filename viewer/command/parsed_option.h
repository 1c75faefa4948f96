// Options whose text becomes a value once, as it is read: what comes later sees no text.
#pragma once

#include <string>
#include <utility>

#include <CLI/CLI.hpp>

namespace vcp {

/// Adds an option of one text; `parse` returns an optional value, which goes to `value`. What it refuses is wrong
/// usage:
/// "--name: must be WANTED, not "TEXT"".
template <class Value, class Parse>
CLI::Option* addParsed(CLI::App& app, const std::string& name, Value& value, Parse parse, const std::string& wanted,
                       const std::string& description) {
    const auto take = [&value, parse, wanted, name](const CLI::results_t& texts) {
        const auto parsed = parse(texts.back());
        if (!parsed)
            throw CLI::ValidationError(name.substr(0, name.find(',')),
                                       "must be " + wanted + ", not \"" + texts.back() + "\"");
        value = *parsed;
        return true;
    };
    return app.add_option(name, take, description);
}

}  // namespace vcp
