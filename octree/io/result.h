// Result<T>: how every module of vcp reports what went wrong with data, files and devices.
//
// No exception crosses a module; asserts are for bugs only. An Error is one clear line:
// "FILE: ELEMENT: byte N: what is wrong; what to do". Library code never prints it, the caller does.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <variant>

namespace vcp {

enum class ErrorCode {
    InvalidInput,  ///< the bytes of an input are wrong (mesh, .vcp, camera file)
    Io,            ///< open, read, write, fsync, rename, no space
    Unsupported,   ///< valid, but of a version, format or feature that this build does not know
    Limit,         ///< a memory, size or count limit would be exceeded
    Device,        ///< Vulkan: no device, out of memory, lost
    Usage,         ///< the caller's arguments contradict each other
    Cancelled,     ///< the caller asked to stop
};

struct Error {
    ErrorCode code = ErrorCode::InvalidInput;
    std::string message;                ///< what is wrong, and what to do where that helps
    std::string file = {};              ///< path as the user gave it; empty when no file is concerned
    std::string element = {};           ///< "vertex 17", "line 12", "page 5"; empty when none
    std::optional<uint64_t> byte = {};  ///< offset in the file of the first wrong byte

    /// `path`: of the file that was being read or written, if any.
    static Error cancelled(std::string path = {}) {
        return {.code = ErrorCode::Cancelled, .message = "cancelled", .file = std::move(path)};
    }

    /// The one line shown to a person.
    [[nodiscard]] std::string line() const {
        std::string text;
        if (!file.empty()) text += file + ": ";
        if (!element.empty()) text += element + ": ";
        if (byte) text += "byte " + std::to_string(*byte) + ": ";
        return text + message;
    }
};

/// A value or an Error. `Result<void>` carries no value.
template <class T>
class [[nodiscard]] Result {
public:
    Result(T value) : state_(std::in_place_index<0>, std::move(value)) {}
    Result(Error error) : state_(std::in_place_index<1>, std::move(error)) {}

    [[nodiscard]] bool ok() const { return state_.index() == 0; }
    explicit operator bool() const { return ok(); }
    [[nodiscard]] T& value() & { return std::get<0>(state_); }
    [[nodiscard]] const T& value() const& { return std::get<0>(state_); }
    [[nodiscard]] T&& value() && { return std::get<0>(std::move(state_)); }
    T& operator*() & { return value(); }
    const T& operator*() const& { return value(); }
    T&& operator*() && { return std::move(*this).value(); }
    T* operator->() { return &value(); }
    const T* operator->() const { return &value(); }
    [[nodiscard]] const Error& error() const { return std::get<1>(state_); }

private:
    std::variant<T, Error> state_;
};

template <>
class [[nodiscard]] Result<void> {
public:
    Result() = default;
    Result(Error error) : error_(std::move(error)) {}

    [[nodiscard]] bool ok() const { return !error_.has_value(); }
    explicit operator bool() const { return ok(); }
    [[nodiscard]] const Error& error() const { return *error_; }

private:
    std::optional<Error> error_;
};

}  // namespace vcp

/// Returns the error of `expr` from the enclosing function, if there is one.
#define VCP_TRY(expr)                                                   \
    do {                                                                \
        if (auto vcpTried = (expr); !vcpTried) return vcpTried.error(); \
    } while (false)

/// Gives a variable the value of a Result, or returns its error from the enclosing function. The variable is declared
/// here, VCP_TRY_ASSIGN(const auto reader, openFile(path)), or stands already: VCP_TRY_ASSIGN(reader_, openFile(path)).
/// It is more than one statement, so braces are around it after an `if`.
#define VCP_TRY_ASSIGN(declaration, ...) \
    VCP_TRY_ASSIGN_NAMED(VCP_TRY_NAME(vcpTried, __COUNTER__), declaration, __VA_ARGS__)
#define VCP_TRY_ASSIGN_NAMED(tried, declaration, ...) \
    auto tried = (__VA_ARGS__);                       \
    if (!tried) return tried.error();                 \
    declaration = *std::move(tried)
#define VCP_TRY_NAME(name, number) VCP_TRY_NAME_JOINED(name, number)
#define VCP_TRY_NAME_JOINED(name, number) name##number
