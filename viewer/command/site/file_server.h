// A server of the files in a folder, with ranges, for a first look at what will be published: HTTP/1.1, GET and HEAD.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>

#include "octree/io/result.h"

namespace vcp {

/// Serves a folder: nothing outside of it, whatever is asked for and wherever links in it lead. A thread a connection.
class FileServer {
public:
    /// Listens at an IPv4 address; port 0 takes a free one. Errors: Io, Usage.
    static Result<std::unique_ptr<FileServer>> listen(const std::filesystem::path& folder, const std::string& address,
                                                      uint16_t port);
    ~FileServer();
    FileServer(const FileServer&) = delete;
    FileServer& operator=(const FileServer&) = delete;

    [[nodiscard]] uint16_t port() const { return port_; }
    /// Answers until `stop`, which is asked several times a second, says so; then ends all connections. Errors: Io.
    Result<void> run(const std::function<bool()>& stop);

private:
    FileServer(std::filesystem::path folder, int socket, uint16_t port)
        : folder_(std::move(folder)), socket_(socket), port_(port) {}

    std::filesystem::path folder_;  // without links
    int socket_;
    uint16_t port_;
};

}  // namespace vcp
