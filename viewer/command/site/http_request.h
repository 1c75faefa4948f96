// What a browser asks a file server for, and which bytes of a file that means. Pure; the text may be hostile.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace vcp {

struct HttpRequest {
    bool isHead = false;  ///< the answer has no body
    std::string path;     ///< decoded, begins with a slash, without query; no part of it is "." or ".."
    std::string range;    ///< value of Range; empty where there is none
    bool closes = false;  ///< the connection ends with the answer
};

/// What stands in the way of an answer, as HTTP numbers it.
enum class HttpProblem : int { BadRequest = 400, NotFound = 404, NoSuchMethod = 405 };

struct ParsedRequest {
    HttpRequest request;
    std::optional<HttpProblem> problem;
};

/// Reads a request's head, up to and with the empty line.
ParsedRequest parseRequest(std::string_view head);

struct ByteStretch {
    uint64_t first = 0, count = 0;
};

enum class RangeKind { Whole, Part, Unsatisfiable };
struct FileRange {
    RangeKind kind = RangeKind::Whole;
    ByteStretch bytes;
};

/// Returns which bytes of a file of `size` a Range asks for. What is no single range of bytes counts as absent, as HTTP
/// allows.
FileRange fileRange(std::string_view range, uint64_t size);

}  // namespace vcp
