#include "builder/mesh/gltf/json_text.h"

#include <algorithm>
#include <iterator>
#include <optional>
#include <string_view>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace vcp {
namespace {

constexpr uint64_t kMostValues = 4'000'000;
constexpr int kMostLevels = 256;

// Gives the bytes of the source one by one; after an error it ends.
struct Characters {
    Characters(ByteSource& bytes, uint64_t count) : source(bytes), left(count) { load(); }

    void load() {
        if (used > 0) source.advance(used);
        left -= used;
        used = 0;
        view = {};
        if (left == 0 || source.atEnd()) return;
        const auto window = source.window();
        if (window)
            view = window->substr(0, std::min<uint64_t>(window->size(), left));
        else
            error = window.error();
    }

    ByteSource& source;
    uint64_t left;
    std::string_view view;
    size_t used = 0;
    std::optional<Error> error;
};

class Character {
public:
    using iterator_category = std::input_iterator_tag;
    using value_type = char;
    using difference_type = std::ptrdiff_t;
    using pointer = const char*;
    using reference = const char&;

    explicit Character(Characters* from) : from_(from) {}
    const char& operator*() const { return from_->view[from_->used]; }
    Character& operator++() {
        if (++from_->used == from_->view.size()) from_->load();
        return *this;
    }
    bool operator==(const Character& other) const { return ended() == other.ended(); }
    bool operator!=(const Character& other) const { return !(*this == other); }

private:
    [[nodiscard]] bool ended() const { return !from_ || from_->view.empty(); }
    Characters* from_;
};

struct TooMuch {};  // thrown by the callback; becomes a Limit in this file

}  // namespace

Result<nlohmann::json> readJson(ByteSource& source, uint64_t bytes, uint64_t textLimit) {
    const auto tooMuch = [&](uint64_t byte) {
        return source.error(
            ErrorCode::Limit, "JSON", byte,
            fmt::format("is larger than {} MiB, {} million values or {} levels; keep the data in a file of "
                        "their own (.bin or .glb)",
                        textLimit >> 20, kMostValues / 1'000'000, kMostLevels));
    };
    const uint64_t begin = source.offset();
    const uint64_t most = std::min(bytes, source.remaining());
    const bool cut = most > textLimit;
    if (cut && source.sizeKnown()) return tooMuch(begin);
    Characters characters(source, cut ? textLimit : most);
    uint64_t values = 0;
    const auto count = [&](int depth, nlohmann::json::parse_event_t, nlohmann::json&) {
        if (++values > kMostValues || depth > kMostLevels) throw TooMuch{};
        return true;
    };
    try {
        auto json = nlohmann::json::parse(Character(&characters), Character(nullptr), count);
        if (characters.error) return *characters.error;
        return json;
    } catch (const TooMuch&) {
        return tooMuch(source.offset() + characters.used);
    } catch (const nlohmann::json::parse_error& e) {
        if (characters.error) return *characters.error;
        if (cut && characters.left == 0) return tooMuch(source.offset());
        return source.error(
            ErrorCode::InvalidInput, "JSON", begin + (e.byte > 0 ? e.byte - 1 : 0),
            characters.view.empty() ? "ends too early, or has a syntax error at its end" : "syntax error");
    } catch (const nlohmann::json::exception&) {
        return source.error(ErrorCode::InvalidInput, "JSON", source.offset() + characters.used,
                            "a number is out of range");
    }
}

}  // namespace vcp
