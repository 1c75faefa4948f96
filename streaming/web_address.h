// Addresses on the web: their user and password are sent to the server alone, and are shown and kept nowhere.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace vcp {

/// Whether this is an http:// or https:// address.
bool isHttpUrl(std::string_view text);

/// Replaces the user and password of each http(s) address in a text by "***": "https://***@host/x". The text need not
/// contain a valid address.
std::string shownAddress(std::string_view text);

/// Returns an address without its user and password; any other text as it is.
std::string addressWithoutUser(std::string_view address);

/// Returns the address of a file beside another: in its folder, with the same query. `name`: plain letters.
std::string addressBeside(const std::string& address, const std::string& name);

/// The target of a request.
struct WebAddress {
    std::string url;     ///< the address without user and password
    std::string origin;  ///< scheme, host and port
    std::string user, password;
    bool hasUser = false;

    [[nodiscard]] bool isSecure() const { return origin.starts_with("https:"); }
};

/// Parses an address. Returns nothing where it is no http(s) address.
std::optional<WebAddress> parseAddress(const std::string& text);

/// Returns where a Location header leads from `from`: with the user and password of `from` where the origin is the
/// same. Nothing where that is no http(s) address.
std::optional<WebAddress> redirected(const WebAddress& from, const std::string& location);

}  // namespace vcp
