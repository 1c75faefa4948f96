// Finds where the values of a JSON text stand, for errors that name the line.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

namespace vcp {

/// The line of each value of a JSON text, by its JSON pointer; for a member the line of its key. In texts that nest
/// deeply, have long keys or many items, not all lines are kept.
class LinesOf {
public:
    /// Precondition: the text is valid JSON.
    explicit LinesOf(std::string_view text) : text_(text) { value("", 0, true); }

    /// The JSON pointer of a member that is there twice, with the line of the second.
    [[nodiscard]] const std::optional<std::pair<std::string, size_t>>& twice() const { return twice_; }
    /// Returns the line of a value, or of what holds it where its own is not kept.
    [[nodiscard]] size_t operator()(std::string pointer) const;

private:
    void skipSpace();
    std::string string();
    void value(const std::string& pointer, int depth, bool keep);
    void members(const std::string& pointer, int depth, bool keep);

    std::string_view text_;
    size_t at_ = 0, line_ = 1;
    std::map<std::string, size_t> lines_;
    std::optional<std::pair<std::string, size_t>> twice_;
};

}  // namespace vcp
