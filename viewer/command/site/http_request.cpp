#include "viewer/command/site/http_request.h"

#include <algorithm>
#include <charconv>

namespace vcp {

namespace {

std::string lower(std::string_view text) {
    std::string low(text);
    std::ranges::transform(low, low.begin(), [](char c) { return c >= 'A' && c <= 'Z' ? char(c - 'A' + 'a') : c; });
    return low;
}

std::string_view trimmed(std::string_view text) {
    while (!text.empty() && (text.front() == ' ' || text.front() == '\t')) text.remove_prefix(1);
    while (!text.empty() && (text.back() == ' ' || text.back() == '\t')) text.remove_suffix(1);
    return text;
}

std::optional<uint64_t> number(std::string_view text, int base = 10) {
    uint64_t value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value, base);
    if (text.empty() || error != std::errc() || end != text.data() + text.size()) return std::nullopt;
    return value;
}

/// Decodes %XX; nothing where it is broken or hides a zero.
std::optional<std::string> decoded(std::string_view target) {
    std::string path;
    for (size_t i = 0; i < target.size(); ++i) {
        char c = target[i];
        if (c == '%') {
            const auto code = number(target.substr(i + 1, 2), 16);
            if (!code || target.size() < i + 3) return std::nullopt;
            c = char(*code);
            i += 2;
        }
        if (c == '\0') return std::nullopt;
        path += c;
    }
    return path;
}

bool leavesFolder(std::string_view path) {
    for (size_t from = 0; from < path.size();) {
        const size_t to = std::min(path.find('/', from), path.size());
        const std::string_view part = path.substr(from, to - from);
        if (part == "." || part == "..") return true;
        from = to + 1;
    }
    return false;
}

}  // namespace

ParsedRequest parseRequest(std::string_view head) {
    HttpRequest request;
    const auto bad = [&](HttpProblem problem) {
        request.closes = true;
        return ParsedRequest{request, problem};
    };
    bool isFirst = true;
    while (!head.empty()) {
        const size_t end = head.find("\r\n");
        if (end == std::string_view::npos) return bad(HttpProblem::BadRequest);
        const std::string_view line = head.substr(0, end);
        head.remove_prefix(end + 2);
        if (line.empty()) break;
        if (isFirst) {
            isFirst = false;
            const size_t one = line.find(' '), two = line.rfind(' ');
            if (one == two || !line.substr(two + 1).starts_with("HTTP/1.")) return bad(HttpProblem::BadRequest);
            const std::string_view method = line.substr(0, one), target = line.substr(one + 1, two - one - 1);
            if (method != "GET" && method != "HEAD") return bad(HttpProblem::NoSuchMethod);
            request.isHead = method == "HEAD";
            request.closes = line.ends_with("1.0");
            const auto path = decoded(target.substr(0, target.find('?')));
            if (!path || !path->starts_with('/')) return bad(HttpProblem::BadRequest);
            if (leavesFolder(*path)) return bad(HttpProblem::NotFound);
            request.path = *path;
            continue;
        }
        const size_t colon = line.find(':');
        if (colon == std::string_view::npos) return bad(HttpProblem::BadRequest);
        const std::string name = lower(line.substr(0, colon));
        const std::string_view value = trimmed(line.substr(colon + 1));
        if (name == "range") request.range = value;
        if (name == "connection" && lower(value) == "close") request.closes = true;
        // A body would be taken for the next request.
        if (name == "transfer-encoding" || (name == "content-length" && value != "0"))
            return bad(HttpProblem::BadRequest);
    }
    if (isFirst) return bad(HttpProblem::BadRequest);
    return {request, std::nullopt};
}

FileRange fileRange(std::string_view range, uint64_t size) {
    const FileRange whole{RangeKind::Whole, {0, size}};
    constexpr std::string_view kUnit = "bytes=";
    if (!range.starts_with(kUnit)) return whole;
    range.remove_prefix(kUnit.size());
    const size_t dash = range.find('-');
    if (dash == std::string_view::npos) return whole;
    const std::string_view before = range.substr(0, dash), behind = range.substr(dash + 1);
    const auto first = number(before), last = number(behind);
    if (before.empty() && last) {
        const uint64_t count = std::min(*last, size);
        if (count == 0) return {RangeKind::Unsatisfiable, {}};
        return {RangeKind::Part, {size - count, count}};
    }
    if (!first || (!last && !behind.empty()) || (last && *last < *first)) return whole;
    if (*first >= size) return {RangeKind::Unsatisfiable, {}};
    return {RangeKind::Part, {*first, std::min(last.value_or(size - 1), size - 1) - *first + 1}};
}

}  // namespace vcp
