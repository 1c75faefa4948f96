// Exceptions end where a thread or a command begins: what libraries throw becomes an Error there.
#pragma once

#include <exception>
#include <new>
#include <stdexcept>
#include <string>
#include <system_error>
#include <type_traits>
#include <utility>

#include "octree/io/result.h"

namespace vcp {

/// Returns what `work` returns, a Result, or the Error for what it throws, with `file`: Limit where there was no
/// memory, Io for what the system refused, else Unsupported. Anything but a std::exception passes.
template <class Work>
std::invoke_result_t<Work> caught(Work&& work, const std::string& file = {}) {
    const auto error = [&](ErrorCode code, std::string message) {
        return Error{.code = code, .message = std::move(message), .file = file};
    };
    constexpr const char* kNoMemory = "needs more memory than there is; close other programs, or give less at once";
    try {
        return std::forward<Work>(work)();
    } catch (const std::bad_alloc&) {
        return error(ErrorCode::Limit, kNoMemory);
    } catch (const std::length_error&) {
        return error(ErrorCode::Limit, kNoMemory);
    } catch (const std::system_error& e) {
        return error(ErrorCode::Io, e.what());
    } catch (const std::exception& e) {
        return error(ErrorCode::Unsupported, std::string("failed in a way that nobody foresaw: ") + e.what());
    }
}

}  // namespace vcp
