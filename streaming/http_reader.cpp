#include "streaming/http_reader.h"

#include <algorithm>
#include <atomic>
#include <cstring>
#include <mutex>
#include <optional>

#include <fmt/format.h>

#include "octree/dataset_reader.h"
#include "streaming/http_exchange.h"

namespace vcp {

namespace {

constexpr uint64_t kTailBytes = sizeof(CommitRecord);
constexpr uint64_t kPartsOverhead = 4096;  // headers between the parts of an answer
constexpr uint64_t kMostAtOpening = 16ull << 20;

/// Whether what a server sent may be sent back to it, in a header line.
bool isFieldText(std::string_view text) {
    constexpr size_t kMost = 1024;
    return !text.empty() && text.size() <= kMost &&
           std::all_of(text.begin(), text.end(), [](unsigned char c) { return c >= ' ' && c != 127; });
}

std::string rangeText(ByteRange range) { return fmt::format("{}-{}", range.first, range.last); }

/// Returns what a first view needs of a .vcp file beside its first bytes and its last: the coarsest page, and the
/// directory where it is small. Nothing where the file is no .vcp, or all of that is in the first bytes.
std::optional<ByteRange> restOfFirstView(std::span<const std::byte> head) {
    if (head.size() < kDirectoryOffset + sizeof(PageEntry)) return std::nullopt;
    FileHeader header;
    PageEntry root;
    std::memcpy(&header, head.data(), sizeof header);
    std::memcpy(&root, head.data() + kDirectoryOffset, sizeof root);
    if (std::memcmp(header.magic, FileHeader{}.magic, sizeof header.magic) != 0 || !isKnownVersion(header.version))
        return std::nullopt;
    const uint64_t blocks = header.pages / kEntriesPerBlock + (header.pages % kEntriesPerBlock != 0 ? 1 : 0);
    const bool isWhole = blocks <= wholeDirectoryBytes(kLeadBytes) / kBlockBytes;
    const uint64_t lead = isWhole ? blockOffset(blocks) : kLeadBytes;
    const uint64_t rootEnd = std::max(root.offset + root.storedBytes, root.colourOffset + root.colourStoredBytes);
    // Where the directory is large, the coarsest page behind it is a range of its own.
    const bool isApart = !isWhole && head.size() >= lead;
    const uint64_t first = isApart ? std::max<uint64_t>(root.offset, head.size()) : head.size();
    const uint64_t end = (isWhole || isApart) && rootEnd > first && rootEnd - first < kMostAtOpening ? rootEnd : lead;
    if (end <= first) return std::nullopt;
    return ByteRange{first, end - 1};
}

}  // namespace

struct HttpReader::State {
    WebAddress address;
    std::string shown, kept;  // both without user and password: the address for messages, and for what is kept
    HttpOptions options;
    uint64_t size = 0;
    std::string entityTag, lastModified, condition;
    std::atomic<uint64_t> epoch{0}, requests{0}, received{0};

    std::mutex mutex;
    std::optional<Error> changed;  // once the file has changed, every read fails at once
    struct Stretch {
        uint64_t begin = 0;
        std::vector<std::byte> bytes;
    };
    // What came at opening, held until the coarsest page has been taken over; and the file's last bytes.
    std::vector<std::shared_ptr<const Stretch>> held;
    uint64_t heldEnd = 0;  // end of the coarsest page
    std::vector<std::byte> tail;

    Result<HttpAnswer> get(const std::string& ranges, uint64_t most);
    Result<void> begin();
    Result<void> readAhead();
    Result<void> readRange(ByteRange range, std::byte* bytes);
    Result<void> checkVersion(const HttpAnswer& answer, uint64_t fileBytes);
    void hold(const BodyPart& part);
    bool copyHeld(uint64_t offset, std::span<std::byte> bytes);

    [[nodiscard]] Error fail(ErrorCode code, std::string message, std::optional<uint64_t> byte = {}) const {
        return {.code = code, .message = std::move(message), .file = shown, .byte = byte};
    }
    [[nodiscard]] Error refused(const HttpAnswer& answer) const;
    Result<void> checkAnswer(const HttpAnswer& answer) const;
    [[nodiscard]] Error anotherRange(const HttpAnswer& answer) const {
        return fail(ErrorCode::InvalidInput,
                    "the server sends another range than was asked for: \"" + quoted(answer.range) + "\"");
    }
    Error changedNow();
};

Error HttpReader::State::refused(const HttpAnswer& answer) const {
    switch (answer.status) {
        case 200:
            return fail(ErrorCode::InvalidInput,
                        "the server does not answer range requests (status 200 in place of 206)");
        case 401:
        case 403:
            return fail(ErrorCode::InvalidInput,
                        fmt::format("the server does not allow it (status {})", answer.status));
        case 404:
        case 410:
            return fail(ErrorCode::InvalidInput,
                        fmt::format("there is no such file on the server (status {})", answer.status));
        case 416:
            return fail(ErrorCode::InvalidInput,
                        "the file on the server is empty or ends before these bytes (status 416)");
        default:
            break;
    }
    const bool transient = answer.status >= 500 || answer.status == 408 || answer.status == 429;
    return fail(transient ? ErrorCode::Io : ErrorCode::InvalidInput,
                fmt::format("the server answers with status {}", answer.status));
}

/// Checks that the answer brings bytes of the file.
Result<void> HttpReader::State::checkAnswer(const HttpAnswer& answer) const {
    if (answer.status != 206) return refused(answer);
    if (answer.coding.empty() || answer.coding == "identity") return {};
    return fail(ErrorCode::InvalidInput,
                "the server encodes the file (" + quoted(answer.coding) + "), so its ranges cannot be read");
}

Error HttpReader::State::changedNow() {
    const std::lock_guard lock(mutex);
    changed = fail(ErrorCode::InvalidInput, "the file on the server changed while it was read; open it again");
    return *changed;
}

Result<HttpAnswer> HttpReader::State::get(const std::string& ranges, uint64_t most) {
    {
        const std::lock_guard lock(mutex);
        if (changed) return *changed;
    }
    auto connection = options.connections->take(options);
    ++requests;
    auto answer = connection->get(address, ranges, condition, most, epoch);
    if (!answer) return fail(answer.error().code, answer.error().message);
    received += answer->body.size();
    options.connections->giveBack(std::move(connection));
    return answer;
}

Result<void> HttpReader::State::checkVersion(const HttpAnswer& answer, uint64_t fileBytes) {
    // The answer is compared too, since some servers ignore If-Match.
    if (fileBytes != size || answer.entityTag != entityTag || answer.lastModified != lastModified) return changedNow();
    return {};
}

Result<void> HttpReader::State::begin() {
    const ByteRange wanted{0, std::max<uint64_t>(options.firstBytes, 1) - 1};
    VCP_TRY_ASSIGN(auto answer, get(rangeText(wanted), wanted.size()));
    VCP_TRY(checkAnswer(answer));
    const auto range = parseContentRange(answer.range);
    if (!range || range->range.first != 0 || range->range.last != std::min(wanted.last, range->fileBytes - 1))
        return anotherRange(answer);
    if (answer.body.size() != range->range.size())
        return fail(ErrorCode::Io, "the answer ended before all its bytes had come");
    size = range->fileBytes;
    entityTag = answer.entityTag;
    lastModified = answer.lastModified;
    // A weak tag never matches in If-Match.
    if (isFieldText(entityTag) && !entityTag.starts_with("W/"))
        condition = "If-Match: " + entityTag;
    else if (isFieldText(lastModified))
        condition = "If-Unmodified-Since: " + lastModified;
    heldEnd = answer.body.size();
    held = {std::make_shared<const Stretch>(Stretch{0, std::move(answer.body)})};
    return readAhead();
}

/// Reads what else a first view needs and the commit record, in one request where the server puts several ranges into
/// an answer; else they are read when they are needed.
Result<void> HttpReader::State::readAhead() {
    const uint64_t headBytes = held[0]->bytes.size();
    const auto rest = restOfFirstView(held[0]->bytes);
    const ByteRange last{size - std::min(size, kTailBytes), size - 1};
    if (!rest || last.first < headBytes || rest->last >= last.first) return {};
    const ByteRange wanted[] = {*rest, last};
    const auto answer =
        get(rangeText(wanted[0]) + "," + rangeText(wanted[1]), wanted[0].size() + wanted[1].size() + kPartsOverhead);
    if (!answer && answer.error().code == ErrorCode::Cancelled) return answer.error();
    if (!answer || !checkAnswer(*answer)) return {};
    std::vector<BodyPart> parts = parseBodyParts(answer->body, answer->type);
    // A server may answer with only the first range.
    if (const auto only = parts.empty() ? parseContentRange(answer->range) : std::nullopt;
        only && only->range.size() == answer->body.size())
        parts.push_back({only->range, answer->body});
    VCP_TRY(checkVersion(*answer, size));
    for (const BodyPart& part : parts) {
        if (part.range == wanted[0]) hold(part);
        if (part.range == last) tail.assign(part.bytes.begin(), part.bytes.end());
    }
    return {};
}

/// Holds a part: appended to the first bytes where it follows them, else apart.
void HttpReader::State::hold(const BodyPart& part) {
    Stretch stretch{part.range.first, {}};
    if (part.range.first == held[0]->bytes.size()) {
        stretch = *held[0];
        held.clear();
    }
    stretch.bytes.insert(stretch.bytes.end(), part.bytes.begin(), part.bytes.end());
    held.push_back(std::make_shared<const Stretch>(std::move(stretch)));
    heldEnd = part.range.last + 1;
}

bool HttpReader::State::copyHeld(uint64_t offset, std::span<std::byte> bytes) {
    std::shared_ptr<const Stretch> from;
    {
        const std::lock_guard lock(mutex);
        for (const auto& stretch : held)
            if (offset >= stretch->begin && offset + bytes.size() <= stretch->begin + stretch->bytes.size())
                from = stretch;
        // The coarsest page is last: once it has been taken over, nothing here is needed again.
        if (from && offset + bytes.size() == heldEnd) held.clear();
    }
    if (from) {
        std::memcpy(bytes.data(), from->bytes.data() + (offset - from->begin), bytes.size());
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
    const auto at = [&](Error error) {
        error.byte = range.first;
        return error;
    };
    if (const auto sound = checkAnswer(*answer); !sound) return at(sound.error());
    const auto got = parseContentRange(answer->range);
    if (got) VCP_TRY(checkVersion(*answer, got->fileBytes));
    if (!got || got->range != range) return at(anotherRange(*answer));
    if (answer->body.size() != range.size())
        return fail(ErrorCode::Io, "the answer ended before all its bytes had come", range.first);
    std::memcpy(bytes, answer->body.data(), range.size());
    return {};
}

HttpReader::HttpReader(std::unique_ptr<State> state) : state_(std::move(state)) {}
HttpReader::~HttpReader() = default;

Result<std::shared_ptr<HttpReader>> HttpReader::open(const std::string& url, const HttpOptions& options) {
    auto state = std::make_unique<State>();
    state->shown = shownAddress(url);
    state->kept = addressWithoutUser(url);
    auto address = parseAddress(url);
    if (!address) return state->fail(ErrorCode::InvalidInput, "is not an address of a file on a server");
    state->address = *std::move(address);
    state->options = options;
    if (!state->options.connections) state->options.connections = sharedConnections();
    VCP_TRY(state->begin());
    return std::shared_ptr<HttpReader>(new HttpReader(std::move(state)));
}

Result<void> HttpReader::read(uint64_t offset, std::span<std::byte> bytes) const {
    if (bytes.empty()) return {};
    if (offset > size() || bytes.size() > size() - offset)
        return state_->fail(ErrorCode::Io, "the file ends here; it was truncated", offset);
    if (state_->copyHeld(offset, bytes)) return {};
    return state_->readRange({offset, offset + bytes.size() - 1}, bytes.data());
}

uint64_t HttpReader::size() const { return state_->size; }
const std::string& HttpReader::name() const { return state_->shown; }
void HttpReader::interrupt() const { ++state_->epoch; }
std::string HttpReader::identity() const {
    return fmt::format("{}\n{}\n{}\n{}", state_->kept, state_->size, state_->entityTag, state_->lastModified);
}
uint64_t HttpReader::requests() const { return state_->requests; }
uint64_t HttpReader::bytesReceived() const { return state_->received; }

}  // namespace vcp
