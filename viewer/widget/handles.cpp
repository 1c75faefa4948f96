#include "viewer/widget/handles.h"

namespace vcp::widget {

namespace {

// No struct of ours is near as large: what says so was not set.
constexpr uint32_t kLargestStruct = 4096;

}  // namespace

Outcome::Outcome(const Error& error) : text(error.line()) {
    switch (error.code) {
        case ErrorCode::InvalidInput: status = VCP_INVALID_INPUT; break;
        case ErrorCode::Io: status = VCP_IO; break;
        case ErrorCode::Unsupported: status = VCP_UNSUPPORTED; break;
        case ErrorCode::Limit: status = VCP_LIMIT; break;
        case ErrorCode::Device: status = VCP_DEVICE; break;
        case ErrorCode::Usage: status = VCP_USAGE; break;
        case ErrorCode::Cancelled: status = VCP_CANCELLED; break;
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
    if (size < sizeof(size) || size > kLargestStruct) return wrong("struct_size of a struct is not set: VCP_INIT sets it");
    return size;
}

Result<void> takeStruct(const void* given, void* value, size_t size) {
    const auto theirs = structSize(given);
    if (!theirs) return theirs.error();
    const auto* bytes = static_cast<const unsigned char*>(given);
    if (*theirs > size && std::any_of(bytes + size, bytes + *theirs, [](unsigned char byte) { return byte != 0; }))
        return wrong("a struct asks for what this version of vcp does not know");
    std::memcpy(value, given, std::min<size_t>(size, *theirs));
    return {};
}

Result<void> giveStruct(void* out, const void* value, size_t size) {
    const auto theirs = structSize(out);
    if (!theirs) return theirs.error();
    constexpr size_t kBehind = sizeof(uint32_t);
    std::memcpy(static_cast<char*>(out) + kBehind, static_cast<const char*>(value) + kBehind, std::min<size_t>(size, *theirs) - kBehind);
    return {};
}

void copyText(char* to, size_t size, const std::string& text) {
    if (!to || size == 0) return;
    const size_t length = std::min(size - 1, text.size());
    std::memcpy(to, text.data(), length);
    to[length] = '\0';
}

}  // namespace vcp::widget

extern "C" {

const char* vcp_version(void) { return VCP_VERSION; }

const char* vcp_status_text(vcp_status status) {
    switch (status) {
        case VCP_OK: return "done";
        case VCP_INVALID_INPUT: return "invalid input";
        case VCP_IO: return "input or output failed";
        case VCP_UNSUPPORTED: return "not supported";
        case VCP_LIMIT: return "limit exceeded";
        case VCP_DEVICE: return "device failed";
        case VCP_USAGE: return "wrong call";
        case VCP_CANCELLED: return "cancelled";
        case VCP_BUSY: return "another call is under way";
        case VCP_OUT_OF_MEMORY: return "out of memory";
        case VCP_INTERNAL: return "defect of the library";
        default: return "unknown status";
    }
}
}
