#include "viewer/widget/handles.h"

#include "viewer/scene/setting_names.h"

namespace vcp::widget {

namespace {

// No struct of ours is nearly as large: a larger size means that it was not set.
constexpr uint32_t kLargestStruct = 4096;

constexpr SettingName kFieldNames[] = {
    {"cell edge", "cell"},
    {"memory cap", "memory_bytes"},
    {"fewer threads", "threads"},
    {"temporary folder", "temp_folder"},
    {"from the start", "resume = 0"},
    {"resumed", "resume = 1"},
    {"memory for pages on their way", "ram_bytes"},
    {"authority's certificate", "ca_file"},
};

/// Returns the bytes of the UTF-8 character at a place; 0 where there is none.
size_t characterAt(const std::string& text, size_t at) {
    const auto byte = [&](size_t i) { return at + i < text.size() ? static_cast<unsigned char>(text[at + i]) : 0u; };
    const unsigned first = byte(0);
    if (first < 0x80) return 1;
    const size_t length = first >= 0xC2 && first < 0xE0   ? 2
                          : (first & 0xF0) == 0xE0        ? 3
                          : first >= 0xF0 && first < 0xF5 ? 4
                                                          : 0;
    for (size_t i = 1; i < length; ++i)
        if ((byte(i) & 0xC0) != 0x80) return 0;
    // Overlong, half of a pair of UTF-16, or beyond the last character.
    const unsigned second = byte(1);
    const bool isWrong = (first == 0xE0 && second < 0xA0) || (first == 0xED && second >= 0xA0) ||
                         (first == 0xF0 && second < 0x90) || (first == 0xF4 && second >= 0x90);
    return isWrong ? 0 : length;
}

}  // namespace

std::string utf8Of(const std::string& text) {
    std::string valid;
    for (size_t at = 0; at < text.size();) {
        const size_t length = characterAt(text, at);
        valid += length > 0 ? text.substr(at, length) : "\xEF\xBF\xBD";
        at += std::max<size_t>(length, 1);
    }
    return valid;
}

Outcome::Outcome(const Error& error) : text(utf8Of(withSettingNames(error.line(), kFieldNames))) {
    switch (error.code) {
        case ErrorCode::InvalidInput:
            status = VCP_INVALID_INPUT;
            break;
        case ErrorCode::Io:
            status = VCP_IO;
            break;
        case ErrorCode::Unsupported:
            status = VCP_UNSUPPORTED;
            break;
        case ErrorCode::Limit:
            status = VCP_LIMIT;
            break;
        case ErrorCode::Device:
            status = VCP_DEVICE;
            break;
        case ErrorCode::Usage:
            status = VCP_USAGE;
            break;
        case ErrorCode::Cancelled:
            status = VCP_CANCELLED;
            break;
    }
}

vcp_status report(vcp_context& context, std::string& lastError, Outcome outcome) noexcept {
    if (outcome.status == VCP_OK) return VCP_OK;
    lastError = std::move(outcome.text);
    const vcp_callbacks& call = context.callbacks;
    if (call.error) call.error(call.user, outcome.status, lastError.c_str());
    return outcome.status;
}

Result<uint32_t> structSize(const void* given) {
    if (!given) return wrong("a struct is needed, and NULL was given");
    uint32_t size = 0;
    std::memcpy(&size, given, sizeof(size));
    if (size < sizeof(size) || size > kLargestStruct)
        return wrong("struct_size of a struct is not set: VCP_INIT sets it");
    return size;
}

Result<void> takeStruct(const void* given, void* value, size_t size) {
    VCP_TRY_ASSIGN(const auto theirs, structSize(given));
    const auto* bytes = static_cast<const unsigned char*>(given);
    if (theirs > size && std::any_of(bytes + size, bytes + theirs, [](unsigned char byte) { return byte != 0; }))
        return wrong("a struct asks for what this version of vcp does not know");
    std::memcpy(value, given, std::min<size_t>(size, theirs));
    return {};
}

Result<void> giveStruct(void* out, const void* value, size_t size) {
    VCP_TRY_ASSIGN(const auto theirs, structSize(out));
    constexpr size_t kBehind = sizeof(uint32_t);
    std::memcpy(static_cast<char*>(out) + kBehind, static_cast<const char*>(value) + kBehind,
                std::min<size_t>(size, theirs) - kBehind);
    return {};
}

void copyText(char* to, size_t size, const std::string& text) {
    if (!to || size == 0) return;
    size_t length = std::min(size - 1, text.size());
    // A character is never cut in two.
    while (length > 0 && length < text.size() && (static_cast<unsigned char>(text[length]) & 0xC0) == 0x80) --length;
    std::memcpy(to, text.data(), length);
    to[length] = '\0';
}

}  // namespace vcp::widget

extern "C" {

const char* vcp_version(void) { return VCP_VERSION; }

const char* vcp_status_text(vcp_status status) {
    switch (status) {
        case VCP_OK:
            return "done";
        case VCP_INVALID_INPUT:
            return "invalid input";
        case VCP_IO:
            return "input or output failed";
        case VCP_UNSUPPORTED:
            return "not supported";
        case VCP_LIMIT:
            return "limit exceeded";
        case VCP_DEVICE:
            return "device failed";
        case VCP_USAGE:
            return "wrong call";
        case VCP_CANCELLED:
            return "cancelled";
        case VCP_BUSY:
            return "another call is under way";
        case VCP_OUT_OF_MEMORY:
            return "out of memory";
        case VCP_INTERNAL:
            return "defect of the library";
        default:
            return "unknown status";
    }
}
}
