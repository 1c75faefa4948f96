// A range of oneTBB that one thread goes through.
#pragma once

#include <cstddef>

namespace tbb {

template <class Value>
class blocked_range {
public:
    blocked_range(Value begin, Value end) : begin_(begin), end_(end) {}
    [[nodiscard]] Value begin() const { return begin_; }
    [[nodiscard]] Value end() const { return end_; }
    [[nodiscard]] bool empty() const { return !(begin_ < end_); }

private:
    Value begin_, end_;
};

template <class Value>
class blocked_range2d {
public:
    blocked_range2d(Value rowBegin, Value rowEnd, size_t, Value columnBegin, Value columnEnd, size_t)
        : rows_(rowBegin, rowEnd), columns_(columnBegin, columnEnd) {}
    [[nodiscard]] const blocked_range<Value>& rows() const { return rows_; }
    [[nodiscard]] const blocked_range<Value>& cols() const { return columns_; }
    [[nodiscard]] bool empty() const { return rows_.empty() || columns_.empty(); }

private:
    blocked_range<Value> rows_, columns_;
};

}  // namespace tbb
