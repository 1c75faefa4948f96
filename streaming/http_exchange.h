// One request for ranges of a file and its answer: what HttpReader sends and receives, over libcurl.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "octree/io/result.h"
#include "streaming/http_reader.h"
#include "streaming/web_address.h"

namespace vcp {

/// Bytes first to last of the file, both included.
struct ByteRange {
    uint64_t first = 0, last = 0;

    [[nodiscard]] uint64_t size() const { return last - first + 1; }
    bool operator==(const ByteRange&) const = default;
};

/// What "Content-Range: bytes 0-99/1234" says; nothing where its form is another or the range is outside of the file.
struct ContentRange {
    ByteRange range;
    uint64_t fileBytes = 0;
};
std::optional<ContentRange> parseContentRange(std::string_view value);

struct BodyPart {
    ByteRange range;
    std::span<const std::byte> bytes;  ///< the part's bytes in the body
};

/// Returns the parts of a multipart/byteranges body (RFC 9110, 14.6); empty where it is not one. Safe on hostile
/// bytes.
std::vector<BodyPart> parseBodyParts(std::span<const std::byte> body, std::string_view contentType);

/// What the server answered, after all redirects.
struct HttpAnswer {
    long status = 0;
    std::string range, type, coding, entityTag, lastModified, location;  ///< header fields; empty where there are none
    std::vector<std::byte> body;
};

/// Shortens the text of a header field for a message: to its beginning, where it is long.
std::string quoted(const std::string& field);

inline constexpr int kMostRedirects = 5;

/// A connection, kept alive between requests. One thread at a time.
class HttpConnection {
public:
    explicit HttpConnection(const HttpOptions& options);
    ~HttpConnection();
    HttpConnection(const HttpConnection&) = delete;
    HttpConnection& operator=(const HttpConnection&) = delete;

    /// Sends GET with `Range: bytes=RANGES` and `condition` (a header line, may be empty). At most `most` bytes of body
    /// are taken: a longer body is an error, and so is one shorter than announced. The body of an answer other than 206
    /// is not read, except up to 16 KiB of a redirect's. The header lines of all answers together have at most
    /// options.headerBytes; the exchange takes no longer than ExchangePace allows. It ends within some 50 ms where
    /// `epoch` changes or options.cancelled says so. User and password go to the address's origin only. Memory: what
    /// has come. Errors: Io, InvalidInput (TLS, redirects, headers), Cancelled; with the message only.
    Result<HttpAnswer> get(const WebAddress& address, const std::string& ranges, const std::string& condition,
                           uint64_t most, const std::atomic<uint64_t>& epoch);

private:
    struct Exchange;
    static size_t onHeader(char* data, size_t, size_t bytes, void* user);
    static size_t onBody(char* data, size_t, size_t bytes, void* user);
    void prepare(const WebAddress& address, const std::string& ranges, bool mayBePlain, Exchange& exchange);
    Result<void> transfer(Exchange& exchange);
    Result<void> perform(Exchange& exchange, const char* detail);

    void* curl_ = nullptr;
    void* multi_ = nullptr;
    HttpOptions options_;
};

/// Connections that wait for their next request. Any thread.
class HttpConnections {
public:
    /// Returns one that waits, or a new one.
    std::unique_ptr<HttpConnection> take(const HttpOptions& options);
    void giveBack(std::unique_ptr<HttpConnection> connection);

private:
    std::mutex mutex_;
    std::vector<std::unique_ptr<HttpConnection>> idle_;
};

}  // namespace vcp
