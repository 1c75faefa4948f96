// Addresses on the web: their user and password are for the server alone, and are shown and kept nowhere.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace vcp {

/// Whether this is an http:// or https:// address.
bool isHttpUrl(std::string_view text);

/// The text with "***" for the user and password of each http(s) address in it: "https://***@host/x". Any text may be
/// given, also what is no valid address.
std::string shownAddress(std::string_view text);

/// An address without its user and password; anything else as it is.
std::string addressWithoutUser(std::string_view address);

/// What a request is sent to.
struct WebAddress {
    std::string url;     ///< without user and password
    std::string origin;  ///< scheme, host and port
    std::string user, password;
    bool hasUser = false;

    [[nodiscard]] bool isSecure() const { return origin.starts_with("https:"); }
};

/// Nothing where it is no http(s) address.
std::optional<WebAddress> parseAddress(const std::string& text);

/// Where a Location header leads from `from`: with the user and password of `from` where the origin is the same.
/// Nothing where that is no http(s) address.
std::optional<WebAddress> redirected(const WebAddress& from, const std::string& location);

}  // namespace vcp
