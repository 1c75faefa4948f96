// An array whose elements are zero until they are written, and only then take memory.
//
// It serves what has an element for each page that a file claims to have: the claim costs addresses, not memory. Large
// arrays are mapped without being reserved; the system gives memory in pieces of 4 KiB where something is written.
#pragma once

#include <cstddef>
#include <cstdlib>
#include <new>
#include <span>
#include <type_traits>
#include <utility>

#include <sys/mman.h>

namespace vcp {

/// T: all bytes zero must be a valid value. It can only be moved: whoever copies knows which elements count. As in a
/// vector, only one thread may write an element at a time. Throws std::bad_alloc where no addresses are left.
template <class T>
class SparseArray {
public:
    static_assert(std::is_trivially_destructible_v<T>);

    SparseArray() = default;
    explicit SparseArray(size_t size) : size_(size) {
        if (size == 0) return;
        if (size > SIZE_MAX / sizeof(T)) throw std::bad_alloc();
        void* memory = isMapped() ? ::mmap(nullptr, bytes(), PROT_READ | PROT_WRITE,
                                           MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0)
                                  : std::calloc(size, sizeof(T));
        if (memory == nullptr || memory == MAP_FAILED) throw std::bad_alloc();
        // A huge page would take 2 MiB for one element.
        if (isMapped()) ::madvise(memory, bytes(), MADV_NOHUGEPAGE);
        data_ = static_cast<T*>(memory);
    }
    SparseArray(SparseArray&& other) noexcept
        : data_(std::exchange(other.data_, nullptr)), size_(std::exchange(other.size_, 0)) {}
    SparseArray& operator=(SparseArray&& other) noexcept {
        std::swap(data_, other.data_);
        std::swap(size_, other.size_);
        return *this;
    }
    SparseArray(const SparseArray&) = delete;
    SparseArray& operator=(const SparseArray&) = delete;
    ~SparseArray() {
        if (data_ == nullptr) return;
        if (isMapped())
            ::munmap(data_, bytes());
        else
            std::free(data_);
    }

    [[nodiscard]] size_t size() const { return size_; }
    [[nodiscard]] bool empty() const { return size_ == 0; }
    [[nodiscard]] T* data() { return data_; }
    [[nodiscard]] const T* data() const { return data_; }
    [[nodiscard]] T& operator[](size_t i) { return data_[i]; }
    [[nodiscard]] const T& operator[](size_t i) const { return data_[i]; }
    operator std::span<T>() { return {data_, size_}; }
    operator std::span<const T>() const { return {data_, size_}; }
    /// The bytes of all elements, with those that are not written and so take no memory.
    [[nodiscard]] size_t bytes() const { return size_ * sizeof(T); }

private:
    static constexpr size_t kLeastMapped = size_t{1} << 20;
    [[nodiscard]] bool isMapped() const { return bytes() >= kLeastMapped; }

    T* data_ = nullptr;
    size_t size_ = 0;
};

}  // namespace vcp
