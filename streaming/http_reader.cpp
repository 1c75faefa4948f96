#include "streaming/http_reader.h"

#include <algorithm>
#include <atomic>
#include <cstring>
#include <mutex>
#include <optional>

#include <fmt/format.h>

#include "streaming/http_exchange.h"

namespace vcp {

namespace {

constexpr uint64_t kTailBytes = sizeof(CommitRecord);
constexpr uint64_t kPartsOverhead = 4096;  // headers between the parts of an answer
constexpr uint64_t kMostAtOpening = 256ull << 20;

bool startsWith(std::string_view text, std::string_view start) {
    return text.size() >= start.size() &&
           std::equal(start.begin(), start.end(), text.begin(), [](char a, char b) { return a == (b >= 'A' && b <= 'Z' ? b + 32 : b); });
}

std::string rangeText(ByteRange range) { return fmt::format("{}-{}", range.first, range.last); }

/// How far a .vcp file must be read for its directory and its coarsest page; 0 where this is no such file.
uint64_t endOfFirstView(std::span<const std::byte> head) {
    if (head.size() < kDirectoryOffset + sizeof(PageEntry)) return 0;
    FileHeader header;
    PageEntry root;
    std::memcpy(&header, head.data(), sizeof header);
    std::memcpy(&root, head.data() + kDirectoryOffset, sizeof root);
    if (std::memcmp(header.magic, FileHeader{}.magic, sizeof header.magic) != 0 || header.version < kFileVersion || header.version > kMethodFileVersion) return 0;
    if (header.pages > kMostAtOpening / sizeof(PageEntry)) return 0;
    const uint64_t directory = kDirectoryOffset + (header.pages + kEntriesPerBlock - 1) / kEntriesPerBlock * kBlockBytes;
    const uint64_t page = std::max(root.offset + root.storedBytes, root.colourOffset + root.colourStoredBytes);
    return page < kMostAtOpening ? std::max(directory, page) : directory;
}

}  // namespace

bool isHttpUrl(std::string_view text) { return startsWith(text, "http://") || startsWith(text, "https://"); }

struct HttpReader::State {
    std::string url;
    HttpOptions options;
    uint64_t size = 0;
    std::string entityTag, lastModified, condition;
    std::atomic<uint64_t> epoch{0}, requests{0}, received{0};

    std::mutex mutex;
    std::vector<std::unique_ptr<HttpConnection>> idle;
    std::optional<Error> changed;  // once it has, every read fails at once
    std::shared_ptr<const std::vector<std::byte>> head;  // the first bytes, until all have been read
    std::vector<std::byte> tail;                         // the last bytes

    Result<HttpAnswer> get(const std::string& ranges, uint64_t most);
    Result<void> begin();
    Result<void> readAhead();
    Result<void> readRange(ByteRange range, std::byte* bytes);
    Result<void> checkVersion(const HttpAnswer& answer, uint64_t fileBytes);
    bool copyHeld(uint64_t offset, std::span<std::byte> bytes);

    [[nodiscard]] Error fail(ErrorCode code, std::string message, std::optional<uint64_t> byte = {}) const {
        return {.code = code, .message = std::move(message), .file = url, .byte = byte};
    }
    [[nodiscard]] Error refused(const HttpAnswer& answer) const;
    Error changedNow();
};

Error HttpReader::State::refused(const HttpAnswer& answer) const {
    switch (answer.status) {
        case 200: return fail(ErrorCode::InvalidInput, "the server does not answer range requests (status 200 in place of 206)");
        case 401:
        case 403: return fail(ErrorCode::InvalidInput, fmt::format("the server does not allow it (status {})", answer.status));
        case 404:
        case 410: return fail(ErrorCode::InvalidInput, fmt::format("there is no such file on the server (status {})", answer.status));
        case 416: return fail(ErrorCode::InvalidInput, "the file on the server is empty or ends before these bytes (status 416)");
        default: break;
    }
    const bool transient = answer.status >= 500 || answer.status == 408 || answer.status == 429;
    return fail(transient ? ErrorCode::Io : ErrorCode::InvalidInput, fmt::format("the server answers with status {}", answer.status));
}

Error HttpReader::State::changedNow() {
    const std::lock_guard lock(mutex);
    changed = fail(ErrorCode::InvalidInput, "the file on the server changed while it was read; open it again");
    return *changed;
}

Result<HttpAnswer> HttpReader::State::get(const std::string& ranges, uint64_t most) {
    std::unique_ptr<HttpConnection> connection;
    {
        const std::lock_guard lock(mutex);
        if (changed) return *changed;
        if (!idle.empty()) {
            connection = std::move(idle.back());
            idle.pop_back();
        }
    }
    if (!connection) connection = std::make_unique<HttpConnection>(options);
    ++requests;
    auto answer = connection->get(url, ranges, condition, most, epoch);
    if (!answer) return fail(answer.error().code, answer.error().message);
    received += answer->body.size();
    const std::lock_guard lock(mutex);
    idle.push_back(std::move(connection));
    return answer;
}

Result<void> HttpReader::State::checkVersion(const HttpAnswer& answer, uint64_t fileBytes) {
    // Some servers ignore If-Match.
    if (fileBytes != size || answer.entityTag != entityTag || answer.lastModified != lastModified) return changedNow();
    return {};
}

Result<void> HttpReader::State::begin() {
    const ByteRange wanted{0, std::max<uint64_t>(options.firstBytes, 1) - 1};
    auto answer = get(rangeText(wanted), wanted.size());
    if (!answer) return answer.error();
    if (answer->status != 206) return refused(*answer);
    if (!answer->coding.empty() && answer->coding != "identity")
        return fail(ErrorCode::InvalidInput, "the server encodes the file (" + answer->coding + "), so its ranges cannot be read");
    const auto range = parseContentRange(answer->range);
    if (!range || range->range.first != 0 || range->range.last != std::min(wanted.last, range->fileBytes - 1))
        return fail(ErrorCode::InvalidInput, "the server sends another range than was asked for: \"" + answer->range + "\"");
    if (answer->body.size() != range->range.size()) return fail(ErrorCode::Io, "the answer ended before all its bytes had come");
    size = range->fileBytes;
    entityTag = answer->entityTag;
    lastModified = answer->lastModified;
    // A weak tag never matches in If-Match.
    if (!entityTag.empty() && !entityTag.starts_with("W/")) condition = "If-Match: " + entityTag;
    else if (!lastModified.empty()) condition = "If-Unmodified-Since: " + lastModified;
    head = std::make_shared<const std::vector<std::byte>>(std::move(answer->body));
    return readAhead();
}

/// The rest of the directory, the coarsest page and the commit record, in one request where the server puts
/// several ranges into an answer; else they are read when they are needed.
Result<void> HttpReader::State::readAhead() {
    const uint64_t end = endOfFirstView(*head);
    if (end == 0 || head->size() >= size || end > size - kTailBytes) return {};
    const ByteRange last{size - kTailBytes, size - 1};
    std::vector<ByteRange> wanted;
    if (end > head->size()) wanted.push_back({head->size(), end - 1});
    if (last.first >= head->size()) wanted.push_back(last);
    if (wanted.size() < 2) return {};
    const auto answer = get(rangeText(wanted[0]) + "," + rangeText(wanted[1]), wanted[0].size() + wanted[1].size() + kPartsOverhead);
    if (!answer || answer->status != 206) return {};
    std::vector<BodyPart> parts = parseBodyParts(answer->body, answer->type);
    // A server may answer with the first range alone.
    if (const auto only = parts.empty() ? parseContentRange(answer->range) : std::nullopt; only && only->range.size() == answer->body.size())
        parts.push_back({only->range, answer->body});
    VCP_TRY(checkVersion(*answer, size));
    for (const BodyPart& part : parts) {
        if (part.range == wanted[0]) {
            auto longer = *head;
            longer.insert(longer.end(), part.bytes.begin(), part.bytes.end());
            head = std::make_shared<const std::vector<std::byte>>(std::move(longer));
        }
        if (part.range == last) tail.assign(part.bytes.begin(), part.bytes.end());
    }
    return {};
}

bool HttpReader::State::copyHeld(uint64_t offset, std::span<std::byte> bytes) {
    std::shared_ptr<const std::vector<std::byte>> held;
    {
        const std::lock_guard lock(mutex);
        held = head;
        // The coarsest page is last: once it has been taken over, nothing here is needed again.
        if (held && offset + bytes.size() == held->size()) head.reset();
    }
    if (held && offset + bytes.size() <= held->size()) {
        std::memcpy(bytes.data(), held->data() + offset, bytes.size());
        return true;
    }
    if (offset + bytes.size() == size && bytes.size() <= tail.size()) {
        std::memcpy(bytes.data(), tail.data() + (tail.size() - bytes.size()), bytes.size());
        return true;
    }
    return false;
}

Result<void> HttpReader::State::readRange(ByteRange range, std::byte* bytes) {
    auto answer = get(rangeText(range), range.size());
    if (!answer) return fail(answer.error().code, answer.error().message, range.first);
    if (answer->status == 412) return changedNow();
    if (answer->status != 206) {
        Error error = refused(*answer);
        error.byte = range.first;
        return error;
    }
    const auto got = parseContentRange(answer->range);
    if (got) VCP_TRY(checkVersion(*answer, got->fileBytes));
    if (!got || got->range != range)
        return fail(ErrorCode::InvalidInput, "the server sends another range than was asked for: \"" + answer->range + "\"", range.first);
    if (answer->body.size() != range.size()) return fail(ErrorCode::Io, "the answer ended before all its bytes had come", range.first);
    std::memcpy(bytes, answer->body.data(), range.size());
    return {};
}

HttpReader::HttpReader(std::unique_ptr<State> state) : state_(std::move(state)) {}
HttpReader::~HttpReader() = default;

Result<std::shared_ptr<HttpReader>> HttpReader::open(const std::string& url, const HttpOptions& options) {
    auto state = std::make_unique<State>();
    state->url = url;
    state->options = options;
    VCP_TRY(state->begin());
    return std::shared_ptr<HttpReader>(new HttpReader(std::move(state)));
}

Result<void> HttpReader::read(uint64_t offset, std::span<std::byte> bytes) const {
    if (bytes.empty()) return {};
    if (offset > size() || bytes.size() > size() - offset) return state_->fail(ErrorCode::Io, "the file ends here; it was truncated", offset);
    if (state_->copyHeld(offset, bytes)) return {};
    return state_->readRange({offset, offset + bytes.size() - 1}, bytes.data());
}

uint64_t HttpReader::size() const { return state_->size; }
const std::string& HttpReader::name() const { return state_->url; }
void HttpReader::interrupt() const { ++state_->epoch; }
std::string HttpReader::identity() const { return fmt::format("{}\n{}\n{}\n{}", state_->url, state_->size, state_->entityTag, state_->lastModified); }
uint64_t HttpReader::requests() const { return state_->requests; }
uint64_t HttpReader::bytesReceived() const { return state_->received; }

}  // namespace vcp
