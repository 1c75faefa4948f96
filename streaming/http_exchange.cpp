#include "streaming/http_exchange.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <utility>

#include <curl/curl.h>
#include <fmt/format.h>

#include "streaming/exchange_pace.h"
#include "streaming/steady_seconds.h"

namespace vcp {

namespace {

constexpr size_t kMaxParts = 16;
constexpr size_t kMostQuoted = 80;
constexpr uint64_t kMostDiscarded = 16 << 10;  // bytes of a redirect's page
constexpr int kPollMilliseconds = 50;
constexpr size_t kMaxPartHeader = 1024;

std::string_view trimmed(std::string_view text) {
    while (!text.empty() && std::isspace(static_cast<unsigned char>(text.front())) != 0) text.remove_prefix(1);
    while (!text.empty() && std::isspace(static_cast<unsigned char>(text.back())) != 0) text.remove_suffix(1);
    return text;
}

bool sameWord(std::string_view a, std::string_view b) {
    return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                      [](unsigned char x, unsigned char y) { return std::tolower(x) == std::tolower(y); });
}

/// Takes a number and the character after it from the front of `text`.
std::optional<uint64_t> takeNumber(std::string_view& text, char after) {
    uint64_t value = 0;
    const auto [end, failed] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (failed != std::errc()) return std::nullopt;
    text.remove_prefix(size_t(end - text.data()));
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
        if (colon != std::string_view::npos && sameWord(trimmed(line.substr(0, colon)), name))
            return trimmed(line.substr(colon + 1));
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
    if (boundary.size() >= 2 && boundary.front() == '"' && boundary.back() == '"')
        boundary = boundary.substr(1, boundary.size() - 2);
    return std::string(boundary);
}

Error transient(std::string message) { return {.code = ErrorCode::Io, .message = std::move(message)}; }
Error lasting(std::string message) { return {.code = ErrorCode::InvalidInput, .message = std::move(message)}; }

Error failure(CURLcode code, const std::string& detail, const HttpOptions& options) {
    const std::string why = detail.empty() ? curl_easy_strerror(code) : detail;
    switch (code) {
        case CURLE_OPERATION_TIMEDOUT:
            return transient(fmt::format("time-out: no connection within {:g} s", options.connectSeconds));
        case CURLE_COULDNT_RESOLVE_HOST:
            return transient("the server's name is not known: " + why);
        case CURLE_COULDNT_CONNECT:
            return transient("no connection to the server: " + why);
        case CURLE_PARTIAL_FILE:
            return transient("the answer ended before all its bytes had come");
        case CURLE_PEER_FAILED_VERIFICATION:
        case CURLE_SSL_CACERT_BADFILE:
            return lasting("the server's TLS certificate is not trusted (" + why +
                           "); name its authority's certificate");
        case CURLE_URL_MALFORMAT:
            return lasting("is not an address: " + why);
        default:
            return transient("the transfer failed: " + why);
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
    // The sizes in the parts' headers say where the next part begins, as the bytes themselves may contain anything.
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

std::string quoted(const std::string& field) {
    return field.size() <= kMostQuoted ? field : field.substr(0, kMostQuoted - 3) + "...";
}

/// What curl's callbacks fill in.
struct HttpConnection::Exchange {
    Exchange(uint64_t mostBytes, const HttpOptions& options, const std::atomic<uint64_t>& now, curl_slist* sent)
        : most(mostBytes),
          mostHeaderBytes(options.headerBytes),
          epoch(now),
          begunIn(now),
          pace(options, mostBytes, steadySeconds()),
          fields(sent) {}

    const uint64_t most, mostHeaderBytes;
    const std::atomic<uint64_t>& epoch;
    const uint64_t begunIn;
    ExchangePace pace;
    curl_slist* fields;
    HttpAnswer answer;

    uint64_t headerBytes = 0, bytes = 0;  // bytes of all answers; `bytes` includes the headers
    std::optional<uint64_t> length;       // length of the body, as the header says
    bool isLonger = false, hasManyHeaders = false;
    bool isHeaderWhole = false;
    bool isEnough = false;  // the header says all that is wanted of this answer

    [[nodiscard]] bool isRedirect() const { return answer.status / 100 == 3 && !answer.location.empty(); }
    void begin(const char* data, size_t size);
    bool admitBody();
};

void HttpConnection::Exchange::begin(const char* data, size_t size) {
    answer = {};
    length.reset();
    isHeaderWhole = false;
    const char* space = std::find(data, data + size, ' ');
    if (space != data + size) std::from_chars(space + 1, data + size, answer.status);
}

/// Decides at the end of a header whether the body that follows is read.
bool HttpConnection::Exchange::admitBody() {
    if (answer.status / 100 == 1) return true;  // another header follows
    isHeaderWhole = true;
    if (answer.status == 206) {
        isLonger = length && *length > most;
        return !isLonger;
    }
    // A body that is left unread costs the connection.
    isEnough = length != 0 && !(isRedirect() && length && *length <= kMostDiscarded);
    return !isEnough;
}

size_t HttpConnection::onHeader(char* data, size_t, size_t bytes, void* user) {
    Exchange& exchange = *static_cast<Exchange*>(user);
    exchange.bytes += bytes;
    exchange.headerBytes += bytes;
    exchange.hasManyHeaders = exchange.headerBytes > exchange.mostHeaderBytes;
    if (exchange.hasManyHeaders) return 0;
    const std::string_view line(data, bytes);
    // With redirects, the headers of several answers come; each begins anew.
    if (line.starts_with("HTTP/")) exchange.begin(data, bytes);
    HttpAnswer& answer = exchange.answer;
    const std::pair<std::string_view, std::string*> fields[] = {
        {"content-range", &answer.range}, {"content-type", &answer.type},          {"content-encoding", &answer.coding},
        {"etag", &answer.entityTag},      {"last-modified", &answer.lastModified}, {"location", &answer.location}};
    for (const auto& [name, value] : fields)
        if (const std::string_view found = fieldOf(line, name); !found.empty()) *value = found;
    if (std::string_view length = fieldOf(line, "content-length"); !length.empty())
        exchange.length = takeNumber(length, '\0');
    return !trimmed(line).empty() || exchange.admitBody() ? bytes : 0;
}

size_t HttpConnection::onBody(char* data, size_t, size_t bytes, void* user) {
    Exchange& exchange = *static_cast<Exchange*>(user);
    exchange.bytes += bytes;
    if (exchange.answer.status != 206) return bytes;  // admitBody() let it in, so it is short
    exchange.isLonger = exchange.answer.body.size() + bytes > exchange.most;
    if (exchange.isLonger) return 0;
    const auto* from = reinterpret_cast<const std::byte*>(data);
    exchange.answer.body.insert(exchange.answer.body.end(), from, from + bytes);
    return bytes;
}

HttpConnection::HttpConnection(const HttpOptions& options) : options_(options) {
    options_.connections.reset();  // which have this one
    // curl is started once a process; libcurl counts, and is safe to call from several threads since 7.84.
    static const CURLcode started = curl_global_init(CURL_GLOBAL_DEFAULT);
    if (started != CURLE_OK) return;
    curl_ = curl_easy_init();
    multi_ = curl_multi_init();
}

HttpConnection::~HttpConnection() {
    if (curl_ != nullptr) curl_easy_cleanup(curl_);
    if (multi_ != nullptr) curl_multi_cleanup(multi_);
}

void HttpConnection::prepare(const WebAddress& address, const std::string& ranges, bool mayBePlain,
                             Exchange& exchange) {
    CURL* curl = curl_;
    curl_easy_reset(curl);  // resets the options only: connections stay
    curl_easy_setopt(curl, CURLOPT_URL, address.url.c_str());
    if (address.hasUser) {
        curl_easy_setopt(curl, CURLOPT_USERNAME, address.user.c_str());
        curl_easy_setopt(curl, CURLOPT_PASSWORD, address.password.c_str());
    }
    curl_easy_setopt(curl, CURLOPT_RANGE, ranges.c_str());
    curl_easy_setopt(curl, CURLOPT_HTTPHEADER, exchange.fields);
    curl_easy_setopt(curl, CURLOPT_USERAGENT, "vcp");
    curl_easy_setopt(curl, CURLOPT_HTTP_VERSION, long(CURL_HTTP_VERSION_2TLS));
    curl_easy_setopt(curl, CURLOPT_PROTOCOLS_STR, mayBePlain ? "http,https" : "https");
    curl_easy_setopt(curl, CURLOPT_NOSIGNAL, 1L);
    curl_easy_setopt(curl, CURLOPT_QUICK_EXIT, 1L);  // a name that is being looked up is not waited for
    curl_easy_setopt(curl, CURLOPT_TCP_NODELAY, 1L);
    curl_easy_setopt(curl, CURLOPT_SUPPRESS_CONNECT_HEADERS, 1L);
    curl_easy_setopt(curl, CURLOPT_CONNECTTIMEOUT_MS, std::max(1L, long(options_.connectSeconds * 1000)));
    if (!options_.caFile.empty()) curl_easy_setopt(curl, CURLOPT_CAINFO, options_.caFile.c_str());
    curl_easy_setopt(curl, CURLOPT_HEADERFUNCTION, onHeader);
    curl_easy_setopt(curl, CURLOPT_HEADERDATA, &exchange);
    curl_easy_setopt(curl, CURLOPT_WRITEFUNCTION, onBody);
    curl_easy_setopt(curl, CURLOPT_WRITEDATA, &exchange);
}

/// Sends one request and does not follow redirects.
Result<void> HttpConnection::transfer(Exchange& exchange) {
    std::array<char, CURL_ERROR_SIZE> detail{};
    curl_easy_setopt(curl_, CURLOPT_ERRORBUFFER, detail.data());
    curl_multi_add_handle(multi_, curl_);
    auto done = perform(exchange, detail.data());
    curl_multi_remove_handle(multi_, curl_);
    curl_easy_setopt(curl_, CURLOPT_ERRORBUFFER, nullptr);
    return done;
}

/// Runs a transfer to its end; looks often enough whether it may go on. `detail`: where curl says what is wrong.
Result<void> HttpConnection::perform(Exchange& exchange, const char* detail) {
    for (;;) {
        int running = 0, left = 0;
        if (const CURLMcode wrong = curl_multi_perform(multi_, &running); wrong != CURLM_OK)
            return transient(std::string("the transfer failed: ") + curl_multi_strerror(wrong));
        for (const CURLMsg* message = curl_multi_info_read(multi_, &left); message != nullptr;
             message = curl_multi_info_read(multi_, &left)) {
            if (message->msg != CURLMSG_DONE) continue;
            const CURLcode code = message->data.result;
            if (exchange.isEnough || (code == CURLE_OK && exchange.isHeaderWhole)) return {};
            if (exchange.isLonger) return transient("the answer is longer than what was asked for");
            if (exchange.hasManyHeaders)
                return lasting(fmt::format("the server sends more than {} bytes of header", exchange.mostHeaderBytes));
            return failure(code == CURLE_OK ? CURLE_PARTIAL_FILE : code, detail, options_);
        }
        if (exchange.epoch != exchange.begunIn || (options_.cancelled && options_.cancelled()))
            return Error::cancelled();
        curl_off_t sentAfter = 0;
        curl_easy_getinfo(curl_, CURLINFO_PRETRANSFER_TIME_T, &sentAfter);
        if (auto problem = exchange.pace.problem(steadySeconds(), exchange.bytes, sentAfter > 0))
            return transient(*std::move(problem));
        curl_multi_poll(multi_, nullptr, 0, kPollMilliseconds, nullptr);
    }
}

Result<HttpAnswer> HttpConnection::get(const WebAddress& address, const std::string& ranges,
                                       const std::string& condition, uint64_t most,
                                       const std::atomic<uint64_t>& epoch) {
    if (curl_ == nullptr || multi_ == nullptr) return transient("libcurl does not start");
    const std::unique_ptr<curl_slist, decltype(&curl_slist_free_all)> fields(
        condition.empty() ? nullptr : curl_slist_append(nullptr, condition.c_str()), curl_slist_free_all);
    Exchange exchange(most, options_, epoch, fields.get());
    WebAddress at = address;
    for (int redirects = 0; redirects <= kMostRedirects; ++redirects) {
        exchange.isEnough = exchange.isHeaderWhole = false;
        prepare(at, ranges, !address.isSecure(), exchange);
        VCP_TRY(transfer(exchange));
        if (!exchange.isRedirect()) return std::move(exchange.answer);
        auto next = redirected(at, exchange.answer.location);
        if (!next || (address.isSecure() && !next->isSecure()))
            return lasting("redirected to a protocol that is not allowed: \"" +
                           quoted(shownAddress(exchange.answer.location)) + "\"");
        // The password is sent only to the origin that the user named.
        if (next->origin == address.origin && !next->hasUser)
            next->hasUser = address.hasUser, next->user = address.user, next->password = address.password;
        at = *std::move(next);
    }
    return lasting(fmt::format("more than {} redirects", kMostRedirects));
}

std::unique_ptr<HttpConnection> HttpConnections::take(const HttpOptions& options) {
    {
        const std::lock_guard lock(mutex_);
        if (!idle_.empty()) {
            auto connection = std::move(idle_.back());
            idle_.pop_back();
            return connection;
        }
    }
    return std::make_unique<HttpConnection>(options);
}

void HttpConnections::giveBack(std::unique_ptr<HttpConnection> connection) {
    const std::lock_guard lock(mutex_);
    idle_.push_back(std::move(connection));
}

std::shared_ptr<HttpConnections> sharedConnections() { return std::make_shared<HttpConnections>(); }

}  // namespace vcp
