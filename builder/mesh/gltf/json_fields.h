// The members of a JSON object, each checked for its type. A JsonCheck remembers the first error; from then on defaults
// are returned, so that a reader asks once at the end instead of at every member.
#pragma once

#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include <nlohmann/json.hpp>

namespace vcp {

using Json = nlohmann::json;

struct JsonCheck {
    std::string element;  ///< where it was, "accessor 3"; empty when nothing is wrong
    std::string message;

    [[nodiscard]] bool ok() const { return message.empty(); }
    void fail(const std::string& where, std::string what) {
        if (!ok()) return;
        element = where;
        message = std::move(what);
    }
};

class JsonFields {
public:
    /// All three must outlive this.
    JsonFields(const Json& object, const std::string& where, JsonCheck& check)
        : object_(object), where_(where), check_(check) {
        if (!object.is_object()) fail("is not a JSON object");
    }

    void fail(std::string what) const { check_.fail(where_, std::move(what)); }

    [[nodiscard]] const Json& object() const { return object_; }
    /// Returns those of an object in this one.
    [[nodiscard]] JsonFields within(const Json& object) const { return {object, where_, check_}; }

    [[nodiscard]] const Json* find(const char* key) const {
        if (!object_.is_object()) return nullptr;
        const auto found = object_.find(key);
        return found == object_.end() ? nullptr : &*found;
    }

    /// Returns a whole number from 0 to 2^53.
    [[nodiscard]] std::optional<uint64_t> whole(const char* key) const {
        const Json* const value = find(key);
        if (!value) return std::nullopt;
        constexpr double kExact = 9007199254740992.0;
        const double number = value->is_number() ? value->get<double>() : -1;
        if (!(number >= 0 && number <= kExact) || number != std::floor(number)) {
            fail(std::string("'") + key + "' is not a whole number of 0 or more");
            return std::nullopt;
        }
        return uint64_t(number);
    }
    [[nodiscard]] uint64_t whole(const char* key, uint64_t missing) const { return whole(key).value_or(missing); }
    [[nodiscard]] uint64_t needWhole(const char* key) const {
        if (!find(key)) fail(std::string("has no '") + key + "'");
        return whole(key, 0);
    }

    /// Returns the number of one of `count` things.
    [[nodiscard]] std::optional<uint32_t> index(const char* key, size_t count) const {
        const auto value = whole(key);
        if (!value) return std::nullopt;
        if (*value >= count) {
            fail(std::string("'") + key + "' is " + std::to_string(*value) + ", but there are only " +
                 std::to_string(count));
            return std::nullopt;
        }
        return uint32_t(*value);
    }

    [[nodiscard]] std::string text(const char* key) const {
        const Json* const value = find(key);
        if (!value) return {};
        if (value->is_string()) return value->get_ref<const std::string&>();
        fail(std::string("'") + key + "' is not a text");
        return {};
    }

    /// Returns a member that is an array; nothing when it is missing.
    [[nodiscard]] const Json* array(const char* key) const {
        const Json* const value = find(key);
        if (value && !value->is_array()) {
            fail(std::string("'") + key + "' is not an array");
            return nullptr;
        }
        return value;
    }

    /// Reads `N` finite numbers, where the member exists. Returns whether it does.
    template <class Numbers>
    bool numbers(const char* key, Numbers& out) const {
        const Json* const value = array(key);
        if (!value) return false;
        bool right = value->size() == out.size();
        for (size_t i = 0; right && i < out.size(); ++i) {
            right = (*value)[i].is_number();
            if (right) out[i] = (*value)[i].template get<double>();
            right = right && std::isfinite(out[i]);
        }
        if (!right) fail(std::string("'") + key + "' is not " + std::to_string(out.size()) + " finite numbers");
        return right;
    }

    /// Calls `read` with the fields of every object of an array, as long as nothing is wrong; `where` is then "NAME 3".
    template <class Read>
    void each(const char* key, const std::string& name, std::string& where, Read&& read) const {
        const Json* const objects = array(key);
        for (size_t i = 0; objects && i < objects->size() && check_.ok(); ++i) {
            where = name + " " + std::to_string(i);
            read(JsonFields((*objects)[i], where, check_));
        }
    }

private:
    const Json& object_;
    const std::string& where_;
    JsonCheck& check_;
};

}  // namespace vcp
