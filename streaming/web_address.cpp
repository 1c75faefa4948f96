#include "streaming/web_address.h"

#include <algorithm>
#include <cctype>
#include <memory>

#include <curl/curl.h>

namespace vcp {

namespace {

constexpr std::string_view kSchemes[] = {"http://", "https://"};
constexpr const char* kEndOfAddress = " \t\r\n\"'<>`";

bool startsWith(std::string_view text, std::string_view start) {
    return text.size() >= start.size() && std::equal(start.begin(), start.end(), text.begin(), [](char a, char b) {
               return a == (b >= 'A' && b <= 'Z' ? b + 32 : b);
           });
}

/// Returns where user and password end in what follows "://": the position of their "@". Nothing where there are none.
std::optional<size_t> endOfUser(std::string_view rest) {
    const std::string_view authority = rest.substr(0, rest.find_first_of("/?#"));
    if (const size_t at = authority.rfind('@'); at != std::string_view::npos) return at;
    // What stands in the place of a port but is none may begin a password with a slash in it.
    const size_t colon = authority.rfind(':');
    if (colon == std::string_view::npos || authority.starts_with('[')) return std::nullopt;
    const std::string_view port = authority.substr(colon + 1);
    if (std::all_of(port.begin(), port.end(), [](unsigned char c) { return std::isdigit(c) != 0; }))
        return std::nullopt;
    const size_t at = rest.rfind('@');
    return at == std::string_view::npos ? std::nullopt : std::optional(at);
}

/// `stand`: the text that replaces user, password and "@".
std::string withUserReplaced(std::string_view text, std::string_view stand) {
    std::string shown;
    while (!text.empty()) {
        const auto* scheme = std::find_if(std::begin(kSchemes), std::end(kSchemes),
                                          [&](std::string_view each) { return startsWith(text, each); });
        if (scheme == std::end(kSchemes)) {
            shown += text.front();
            text.remove_prefix(1);
            continue;
        }
        shown += text.substr(0, scheme->size());
        text.remove_prefix(scheme->size());
        const size_t end = std::min(text.find_first_of(kEndOfAddress), text.size());
        if (const auto user = endOfUser(text.substr(0, end))) {
            shown += stand;
            text.remove_prefix(*user + 1);
        }
    }
    return shown;
}

struct UrlDeleter {
    void operator()(CURLU* url) const { curl_url_cleanup(url); }
};
using Url = std::unique_ptr<CURLU, UrlDeleter>;

std::optional<std::string> partOf(CURLU* url, CURLUPart part, unsigned int flags = 0) {
    char* text = nullptr;
    if (curl_url_get(url, part, &text, flags) != CURLUE_OK) return std::nullopt;
    std::string copy(text);
    curl_free(text);
    return copy;
}

std::optional<WebAddress> addressOf(CURLU* url) {
    const auto scheme = partOf(url, CURLUPART_SCHEME), host = partOf(url, CURLUPART_HOST),
               port = partOf(url, CURLUPART_PORT, CURLU_DEFAULT_PORT);
    if (!scheme || !host || host->empty() || !port || (*scheme != "http" && *scheme != "https")) return std::nullopt;
    const auto user = partOf(url, CURLUPART_USER, CURLU_URLDECODE),
               password = partOf(url, CURLUPART_PASSWORD, CURLU_URLDECODE);
    WebAddress address;
    address.hasUser = user || password;
    address.user = user.value_or("");
    address.password = password.value_or("");
    curl_url_set(url, CURLUPART_USER, nullptr, 0);
    curl_url_set(url, CURLUPART_PASSWORD, nullptr, 0);
    address.origin = *scheme + "://" + *host + ":" + *port;
    std::transform(address.origin.begin(), address.origin.end(), address.origin.begin(),
                   [](unsigned char c) { return char(std::tolower(c)); });
    address.url = partOf(url, CURLUPART_URL).value_or("");
    return address.url.empty() ? std::nullopt : std::optional(address);
}

}  // namespace

bool isHttpUrl(std::string_view text) { return startsWith(text, kSchemes[0]) || startsWith(text, kSchemes[1]); }

std::string shownAddress(std::string_view text) { return withUserReplaced(text, "***@"); }

std::string addressWithoutUser(std::string_view address) {
    return isHttpUrl(address) ? withUserReplaced(address, "") : std::string(address);
}

std::string addressBeside(const std::string& address, const std::string& name) {
    const size_t end = std::min(address.find_first_of("?#"), address.size());
    // A host without a path has one slash less.
    const size_t path = address.find('/', address.find("://") + 3);
    if (path >= end) return address.substr(0, end) + "/" + name + address.substr(end);
    return address.substr(0, address.rfind('/', end - 1) + 1) + name + address.substr(end);
}

std::optional<WebAddress> parseAddress(const std::string& text) {
    const Url url(curl_url());
    if (!isHttpUrl(text) || !url || curl_url_set(url.get(), CURLUPART_URL, text.c_str(), CURLU_URLENCODE) != CURLUE_OK)
        return std::nullopt;
    return addressOf(url.get());
}

std::optional<WebAddress> redirected(const WebAddress& from, const std::string& location) {
    const Url url(curl_url());
    if (!url || curl_url_set(url.get(), CURLUPART_URL, from.url.c_str(), 0) != CURLUE_OK ||
        curl_url_set(url.get(), CURLUPART_URL, location.c_str(), CURLU_URLENCODE) != CURLUE_OK)
        return std::nullopt;
    auto to = addressOf(url.get());
    if (!to || to->hasUser || to->origin != from.origin) return to;
    to->hasUser = from.hasUser;
    to->user = from.user;
    to->password = from.password;
    return to;
}

}  // namespace vcp
