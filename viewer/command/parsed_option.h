// Options whose text becomes a value once, as it is read: what comes later sees no text. What cannot be read is wrong
// usage: "--name: must be like ..., not "TEXT"".
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <glm/vec2.hpp>

#include "viewer/annotation/length_unit.h"

namespace vcp {

/// Returns the error for a text that an option does not take.
inline CLI::ValidationError notTaken(const std::string& option, const std::string& wanted, const std::string& text) {
    return CLI::ValidationError(option.substr(0, option.find(',')), "must be " + wanted + ", not \"" + text + "\"");
}

/// Adds an option of one text. `parse` returns an optional value, which goes to `value`; `wanted` follows "must be".
template <class Value, class Parse>
CLI::Option* addParsed(CLI::App& app, const std::string& name, Value& value, Parse parse, const std::string& wanted,
                       const std::string& description) {
    const auto take = [&value, parse, wanted, name](const CLI::results_t& texts) {
        auto parsed = parse(texts.back());
        if (!parsed) throw notTaken(name, wanted, texts.back());
        value = *std::move(parsed);
        return true;
    };
    return app.add_option(name, take, description);
}

/// Does so for several texts: separated by commas where `delimiter` is one, or each after the option's name.
template <class Value, class Parse>
CLI::Option* addParsedList(CLI::App& app, const std::string& name, std::vector<Value>& values, Parse parse,
                           const std::string& wanted, const std::string& description) {
    const auto take = [&values, parse, wanted, name](const CLI::results_t& texts) {
        values.clear();
        for (const std::string& text : texts) {
            auto parsed = parse(text);
            if (!parsed) throw notTaken(name, wanted, text);
            values.push_back(*std::move(parsed));
        }
        return true;
    };
    return app.add_option(name, take, description)->take_all()->allow_extra_args(false);
}

/// Adds width and height in pixels, like the example.
CLI::Option* addSize(CLI::App& app, glm::ivec2& size, const std::string& example, const std::string& description);

/// Adds bytes of the pool or of memory: at least 1 MiB.
CLI::Option* addBudget(CLI::App& app, const std::string& name, uint64_t& bytes, const std::string& description);

/// Adds --cell, a length in world units.
CLI::Option* addCell(CLI::App& app, double& cell);

/// Adds --unit, which names what one unit of a file is.
CLI::Option* addUnit(CLI::App& app, std::optional<LengthUnit>& unit, const std::string& description);

/// Adds --memory, bytes or a part of the machine's.
CLI::Option* addMemory(CLI::App& app, uint64_t& bytes, const std::string& description);

/// Returns "1920x1200", as an option takes it.
std::string sizeText(glm::ivec2 size);

}  // namespace vcp
