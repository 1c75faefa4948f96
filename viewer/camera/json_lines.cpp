#include "viewer/camera/json_lines.h"

#include <algorithm>

#include <nlohmann/json.hpp>

namespace vcp {

namespace {

using Json = nlohmann::json;

constexpr int kDeepestRead = 16;
// How deep the values of a scene or a path of cameras nest: deeper ones have no line of their own.
constexpr int kDeepestLine = 5;
constexpr size_t kLongestKey = 64, kMostItems = 1024;

}  // namespace

size_t LinesOf::operator()(std::string pointer) const {
    while (true) {
        if (const auto found = lines_.find(pointer); found != lines_.end()) return found->second;
        if (pointer.empty()) return 1;
        pointer.resize(std::min(pointer.rfind('/'), pointer.size() - 1));
    }
}

void LinesOf::skipSpace() {
    for (; at_ < text_.size() && std::string_view(" \t\r\n").find(text_[at_]) != std::string_view::npos; ++at_)
        if (text_[at_] == '\n') ++line_;
}

std::string LinesOf::string() {
    const size_t begin = at_++;
    while (at_ < text_.size() && text_[at_] != '"') at_ += text_[at_] == '\\' ? 2 : 1;
    ++at_;
    const Json decoded = Json::parse(text_.substr(begin, at_ - begin), nullptr, false);
    return decoded.is_string() ? decoded.get<std::string>() : std::string();
}

void LinesOf::value(const std::string& pointer, int depth, bool keep) {
    skipSpace();
    if (keep) lines_.emplace(pointer, line_);
    // What nests deeper is no scene: the rest of the text has no lines.
    if (depth > kDeepestRead) at_ = text_.size();
    if (at_ >= text_.size()) return;
    if (text_[at_] == '"') {
        string();
    } else if (text_[at_] == '{' || text_[at_] == '[') {
        members(pointer, depth, keep && depth < kDeepestLine);
    } else {
        while (at_ < text_.size() && std::string_view(",]} \t\r\n").find(text_[at_]) == std::string_view::npos) ++at_;
    }
}

void LinesOf::members(const std::string& pointer, int depth, bool keep) {
    const bool isObject = text_[at_++] == '{';
    for (size_t i = 0;; ++i) {
        skipSpace();
        if (at_ >= text_.size()) return;
        if (text_[at_] == '}' || text_[at_] == ']') {
            ++at_;
            return;
        }
        if (text_[at_] == ',') {
            ++at_;
            skipSpace();
        }
        std::string key = std::to_string(i);
        bool keepThis = keep && i < kMostItems;
        if (isObject) {
            const size_t line = line_;
            key = string();
            keepThis = keepThis && key.size() <= kLongestKey;
            if (keepThis && !lines_.emplace(pointer + "/" + key, line).second && !twice_)
                twice_.emplace(pointer + "/" + key, line);
            skipSpace();
            ++at_;
        }
        value(keepThis ? pointer + "/" + key : std::string(), depth + 1, keepThis);
    }
}

}  // namespace vcp
