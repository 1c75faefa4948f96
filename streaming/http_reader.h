// A file behind http:// or https://, read by range requests (RFC 9110, section 14).
//
// open() asks for the first bytes, which say how large the file is and which version of it this is. Where
// they begin a .vcp file, a second request brings the coarsest page (with the rest of a small directory) and the
// commit record in two ranges; so a first picture takes two requests, whatever the file's size. Every later request
// carries If-Match with the entity tag of the first answer (If-Unmodified-Since without a strong tag), and every
// answer's tag and size are compared with the first: a file that changes on the server while it is read is an error,
// not a mixture.
//
// An answer is accepted as a whole or not at all: status 206, the range that was asked for, of a file of the
// same size, neither a byte short nor a byte long, and no content coding. Redirects are followed, at most 5,
// never from https to http. TLS certificates are verified. Each reading thread has a connection of its own,
// kept alive between reads, which readers may share; HTTP/2 where the server offers it.
//
// Every exchange is bounded: in time by a least rate and by an end that follows from the bytes asked for
// (exchange_pace.h), in bytes by what was asked for and by the bytes of all headers, in memory by what has come. A user
// and password in the address (https://user:password@host/...) are sent to its origin and stand in no name, message or
// identity.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>

#include "octree/io/byte_reader.h"
#include "streaming/web_address.h"

namespace vcp {

class HttpConnections;

struct HttpOptions {
    std::filesystem::path caFile = {};  ///< certificates of authorities to trust, PEM; empty: the system's
    double connectSeconds = 10;
    double stallSeconds = 10;  ///< an answer has failed that brings less than the least rate for so long
    uint64_t leastBytesPerSecond = 1024;
    uint64_t headerBytes = 64 << 10;  ///< most bytes of all header lines of an answer and the redirects before it
    uint64_t firstBytes = 64 << 10;   ///< bytes that the first request asks for
    /// Once it returns true, reads end soon with Cancelled. Reading threads call it, as long as the reader lives.
    std::function<bool()> cancelled = {};
    /// Connections that readers of files on one server share (sharedConnections); null: the reader has its own.
    std::shared_ptr<HttpConnections> connections = {};
};

/// Makes connections for several readers, whose other options are the same.
std::shared_ptr<HttpConnections> sharedConnections();

/// The server is not trusted: what it sends is checked before it is used, and no answer takes more memory
/// than a few times what has come of it, nor more than was asked for (and 4 KiB, and its header).
class HttpReader final : public ByteReader {
public:
    /// Errors: Io (no connection, time-out, a server in trouble: worth another try), InvalidInput (not found,
    /// not allowed, no ranges, certificate not trusted), each in one line that begins with the address.
    static Result<std::shared_ptr<HttpReader>> open(const std::string& url, const HttpOptions& options = {});
    ~HttpReader() override;
    HttpReader(const HttpReader&) = delete;
    HttpReader& operator=(const HttpReader&) = delete;

    /// Any thread. Errors as for open(); also InvalidInput where the file changed since open(), and
    /// Cancelled after interrupt().
    Result<void> read(uint64_t offset, std::span<std::byte> bytes) const override;
    [[nodiscard]] uint64_t size() const override;
    /// The address without user and password, as it may be shown.
    [[nodiscard]] const std::string& name() const override;

    /// Ends reads that are under way soon, with Cancelled. Any thread.
    void interrupt() const override;

    /// The address without user and password, and the file's size and version: equal for equal bytes.
    [[nodiscard]] std::string identity() const;
    /// The number of requests sent so far, and the bytes of bodies received.
    [[nodiscard]] uint64_t requests() const;
    [[nodiscard]] uint64_t bytesReceived() const;

private:
    struct State;
    explicit HttpReader(std::unique_ptr<State> state);
    std::unique_ptr<State> state_;
};

}  // namespace vcp
