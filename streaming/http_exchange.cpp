#include "streaming/http_exchange.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>

#include <curl/curl.h>
#include <fmt/format.h>

namespace vcp {

namespace {

constexpr size_t kMaxParts = 16;
constexpr size_t kMaxPartHeader = 1024;

std::string_view trimmed(std::string_view text) {
    while (!text.empty() && std::isspace(static_cast<unsigned char>(text.front())) != 0) text.remove_prefix(1);
    while (!text.empty() && std::isspace(static_cast<unsigned char>(text.back())) != 0) text.remove_suffix(1);
    return text;
}

bool sameWord(std::string_view a, std::string_view b) {
    return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](unsigned char x, unsigned char y) { return std::tolower(x) == std::tolower(y); });
}

/// Takes a number and the character after it from the front of `text`.
std::optional<uint64_t> takeNumber(std::string_view& text, char after) {
    uint64_t value = 0;
    const auto [end, failed] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (failed != std::errc()) return std::nullopt;
    text.remove_prefix(static_cast<size_t>(end - text.data()));
    if (after == '\0') return text.empty() ? std::optional(value) : std::nullopt;
    if (text.empty() || text.front() != after) return std::nullopt;
    text.remove_prefix(1);
    return value;
}

/// The value of a field among header lines; empty where it is missing.
std::string_view fieldOf(std::string_view lines, std::string_view name) {
    while (!lines.empty()) {
        const size_t end = std::min(lines.find('\n'), lines.size());
        const std::string_view line = lines.substr(0, end);
        lines.remove_prefix(std::min(end + 1, lines.size()));
        const size_t colon = line.find(':');
        if (colon != std::string_view::npos && sameWord(trimmed(line.substr(0, colon)), name)) return trimmed(line.substr(colon + 1));
    }
    return {};
}

std::string boundaryOf(std::string_view contentType) {
    constexpr std::string_view kType = "multipart/byteranges", kBoundary = "boundary=";
    if (contentType.size() < kType.size() || !sameWord(contentType.substr(0, kType.size()), kType)) return {};
    const size_t at = contentType.find(kBoundary);
    if (at == std::string_view::npos) return {};
    std::string_view boundary = trimmed(contentType.substr(at + kBoundary.size()));
    boundary = boundary.substr(0, boundary.find(';'));
    if (boundary.size() >= 2 && boundary.front() == '"' && boundary.back() == '"') boundary = boundary.substr(1, boundary.size() - 2);
    return std::string(boundary);
}

/// What curl's callbacks fill in.
struct Exchange {
    HttpAnswer answer;
    uint64_t most = 0;
    bool tooLong = false, unread = false;
    const std::atomic<uint64_t>* epoch = nullptr;
    uint64_t begunIn = 0;
};

size_t onHeader(char* data, size_t, size_t bytes, void* user) {
    HttpAnswer& answer = static_cast<Exchange*>(user)->answer;
    const std::string_view line(data, bytes);
    // A redirect's header comes before that of the answer.
    if (line.starts_with("HTTP/")) {
        answer = {};
        const size_t space = line.find(' ');
        if (space != std::string_view::npos) std::from_chars(data + space + 1, data + bytes, answer.status);
    }
    const std::pair<std::string_view, std::string*> fields[] = {{"content-range", &answer.range},   {"content-type", &answer.type},
                                                                {"content-encoding", &answer.coding}, {"etag", &answer.entityTag},
                                                                {"last-modified", &answer.lastModified}};
    for (const auto& [name, value] : fields)
        if (const std::string_view found = fieldOf(line, name); !found.empty()) *value = found;
    return bytes;
}

size_t onBody(char* data, size_t, size_t bytes, void* user) {
    Exchange& exchange = *static_cast<Exchange*>(user);
    if (exchange.answer.status / 100 == 3) return bytes;  // a redirect's page
    exchange.unread = exchange.answer.status != 206;
    exchange.tooLong = !exchange.unread && exchange.answer.body.size() + bytes > exchange.most;
    if (exchange.unread || exchange.tooLong) return 0;
    const auto* from = reinterpret_cast<const std::byte*>(data);
    exchange.answer.body.insert(exchange.answer.body.end(), from, from + bytes);
    return bytes;
}

int onProgress(void* user, curl_off_t, curl_off_t, curl_off_t, curl_off_t) {
    const Exchange& exchange = *static_cast<Exchange*>(user);
    return *exchange.epoch != exchange.begunIn ? 1 : 0;
}

Error failure(CURLcode code, const Exchange& exchange, const std::string& detail, const HttpOptions& options) {
    const auto transient = [](std::string message) { return Error{.code = ErrorCode::Io, .message = std::move(message)}; };
    const auto lasting = [](std::string message) { return Error{.code = ErrorCode::InvalidInput, .message = std::move(message)}; };
    const std::string why = detail.empty() ? curl_easy_strerror(code) : detail;
    switch (code) {
        case CURLE_ABORTED_BY_CALLBACK: return {.code = ErrorCode::Cancelled, .message = "cancelled"};
        case CURLE_OPERATION_TIMEDOUT:
            return transient(fmt::format("time-out: no connection within {:g} s, or no byte for {:g} s", options.connectSeconds, options.stallSeconds));
        case CURLE_COULDNT_RESOLVE_HOST: return transient("the server's name is not known: " + why);
        case CURLE_COULDNT_CONNECT: return transient("no connection to the server: " + why);
        case CURLE_PARTIAL_FILE: return transient("the answer ended before all its bytes had come");
        case CURLE_PEER_FAILED_VERIFICATION:
        case CURLE_SSL_CACERT_BADFILE: return lasting("the server's TLS certificate is not trusted (" + why + "); name its authority with --ca-file");
        case CURLE_TOO_MANY_REDIRECTS: return lasting("more than 5 redirects");
        case CURLE_UNSUPPORTED_PROTOCOL: return lasting("redirected to a protocol that is not allowed: " + why);
        case CURLE_URL_MALFORMAT: return lasting("is not an address: " + why);
        case CURLE_WRITE_ERROR:
            if (exchange.tooLong) return transient("the answer is longer than what was asked for");
            [[fallthrough]];
        default: return transient("the transfer failed: " + why);
    }
}

}  // namespace

std::optional<ContentRange> parseContentRange(std::string_view value) {
    constexpr std::string_view kUnit = "bytes ";
    if (value.size() < kUnit.size() || !sameWord(value.substr(0, kUnit.size()), kUnit)) return std::nullopt;
    value.remove_prefix(kUnit.size());
    const auto first = takeNumber(value, '-'), last = first ? takeNumber(value, '/') : std::nullopt;
    const auto size = last ? takeNumber(value, '\0') : std::nullopt;
    if (!size || *first > *last || *last >= *size) return std::nullopt;
    return ContentRange{{*first, *last}, *size};
}

std::vector<BodyPart> parseBodyParts(std::span<const std::byte> body, std::string_view contentType) {
    const std::string boundary = boundaryOf(contentType);
    std::vector<BodyPart> parts;
    if (boundary.empty()) return parts;
    const std::string_view text(reinterpret_cast<const char*>(body.data()), body.size());
    // The sizes in the parts' headers say where the next one begins: the bytes may contain anything.
    size_t at = text.substr(0, kMaxPartHeader).find("--" + boundary);
    while (at != std::string_view::npos && parts.size() < kMaxParts) {
        const size_t blank = text.substr(at, kMaxPartHeader).find("\r\n\r\n");
        if (blank == std::string_view::npos) break;
        const auto range = parseContentRange(fieldOf(text.substr(at, blank + 2), "content-range"));
        const size_t from = at + blank + 4;
        if (!range || range->range.size() > text.size() - from) return {};
        parts.push_back({range->range, body.subspan(from, range->range.size())});
        const size_t end = from + range->range.size();
        const size_t next = text.substr(end, kMaxPartHeader).find("--" + boundary);
        if (next == std::string_view::npos) return {};
        at = end + next;
        if (text.substr(at + 2 + boundary.size()).starts_with("--")) return parts;
    }
    return {};
}

HttpConnection::HttpConnection(const HttpOptions& options) : options_(options) {
    // Once a process; libcurl counts, and is safe to call from several threads since 7.84.
    static const CURLcode started = curl_global_init(CURL_GLOBAL_DEFAULT);
    curl_ = started == CURLE_OK ? curl_easy_init() : nullptr;
}

HttpConnection::~HttpConnection() {
    if (curl_ != nullptr) curl_easy_cleanup(curl_);
}

Result<HttpAnswer> HttpConnection::get(const std::string& url, const std::string& ranges, const std::string& condition, uint64_t most,
                                       const std::atomic<uint64_t>& epoch) {
    if (curl_ == nullptr) return Error{.code = ErrorCode::Io, .message = "libcurl does not start"};
    CURL* curl = curl_;
    Exchange exchange;
    exchange.most = most;
    exchange.epoch = &epoch;
    exchange.begunIn = epoch;
    exchange.answer.body.reserve(most);
    std::array<char, CURL_ERROR_SIZE> detail{};
    curl_slist* headers = condition.empty() ? nullptr : curl_slist_append(nullptr, condition.c_str());

    curl_easy_reset(curl);  // options only: connections stay
    curl_easy_setopt(curl, CURLOPT_URL, url.c_str());
    curl_easy_setopt(curl, CURLOPT_RANGE, ranges.c_str());
    curl_easy_setopt(curl, CURLOPT_HTTPHEADER, headers);
    curl_easy_setopt(curl, CURLOPT_USERAGENT, "vcp");
    curl_easy_setopt(curl, CURLOPT_HTTP_VERSION, static_cast<long>(CURL_HTTP_VERSION_2TLS));
    curl_easy_setopt(curl, CURLOPT_PROTOCOLS_STR, "http,https");
    curl_easy_setopt(curl, CURLOPT_REDIR_PROTOCOLS_STR, sameWord(url.substr(0, 6), "https:") ? "https" : "http,https");
    curl_easy_setopt(curl, CURLOPT_FOLLOWLOCATION, 1L);
    curl_easy_setopt(curl, CURLOPT_MAXREDIRS, 5L);
    curl_easy_setopt(curl, CURLOPT_NOSIGNAL, 1L);
    curl_easy_setopt(curl, CURLOPT_TCP_NODELAY, 1L);
    curl_easy_setopt(curl, CURLOPT_CONNECTTIMEOUT_MS, static_cast<long>(options_.connectSeconds * 1000));
    curl_easy_setopt(curl, CURLOPT_LOW_SPEED_LIMIT, 1L);
    curl_easy_setopt(curl, CURLOPT_LOW_SPEED_TIME, std::max(1L, static_cast<long>(options_.stallSeconds)));
    if (!options_.caFile.empty()) curl_easy_setopt(curl, CURLOPT_CAINFO, options_.caFile.c_str());
    curl_easy_setopt(curl, CURLOPT_ERRORBUFFER, detail.data());
    curl_easy_setopt(curl, CURLOPT_HEADERFUNCTION, onHeader);
    curl_easy_setopt(curl, CURLOPT_HEADERDATA, &exchange);
    curl_easy_setopt(curl, CURLOPT_WRITEFUNCTION, onBody);
    curl_easy_setopt(curl, CURLOPT_WRITEDATA, &exchange);
    curl_easy_setopt(curl, CURLOPT_NOPROGRESS, 0L);
    curl_easy_setopt(curl, CURLOPT_XFERINFOFUNCTION, onProgress);
    curl_easy_setopt(curl, CURLOPT_XFERINFODATA, &exchange);

    const CURLcode code = curl_easy_perform(curl);
    curl_slist_free_all(headers);
    const char* answered = nullptr;
    curl_easy_getinfo(curl, CURLINFO_EFFECTIVE_URL, &answered);
    exchange.answer.url = answered != nullptr ? answered : url;
    // An answer that is refused by its status was left unread on purpose.
    if (code == CURLE_OK || (code == CURLE_WRITE_ERROR && exchange.unread)) return std::move(exchange.answer);
    return failure(code, exchange, detail.data(), options_);
}

}  // namespace vcp
