// Adaptive range coding: bits with adaptive probabilities (after Martin 1979 and the LZMA coder), symbols of up to
// 16 values whose probabilities adapt as well, and raw bits, as they are, which are kept apart in bytes of their
// own. Encoder and decoder have the same interface, so that a format is written down once, as a template over the
// coder: `bit(model, value)` reads `value` in the one and sets it in the other. Integers alone decide, so every
// machine decodes the same.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <vector>

namespace vcp {

/// Probability that the next bit is 0, in 1/65536; learns quickly at first, then slowly.
struct BitModel {
    uint16_t zero = 32768;
    uint16_t seen = 0;

    void learn(bool bit) {
        // The rates are 1/2, 1/4, ... down to 1/64, each for twice as many bits as the one before.
        const int shift = seen >= 63 ? 6 : std::bit_width(unsigned(seen) + 1u);
        if (seen < 63) ++seen;
        // The probability ends a little short of certainty: the coder needs room for either bit.
        zero = uint16_t(zero + (((bit ? 48 : 65488) - zero) >> shift));
    }
};

/// Probabilities of 16 symbols, cumulative, in 1/32768; none falls below 1.
struct SymbolModel {
    static constexpr int kSymbols = 16, kBits = 15;

    alignas(32) int16_t before[kSymbols];  ///< total probability of the symbols below each
    uint16_t seen = 0;

    /// `used`: symbols from this number on hardly ever come.
    explicit SymbolModel(int used = kSymbols) {
        for (int i = 0; i < kSymbols; ++i)
            before[i] = int16_t(i < used ? i * ((1 << kBits) - kSymbols) / used + i : (1 << kBits) - kSymbols + i);
    }
    [[nodiscard]] uint32_t begin(uint32_t symbol) const { return uint32_t(before[symbol]); }
    [[nodiscard]] uint32_t end(uint32_t symbol) const {
        return symbol + 1 < kSymbols ? uint32_t(before[symbol + 1]) : 1u << kBits;
    }
    /// Returns the symbol within whose share `target` lies.
    [[nodiscard]] uint32_t find(uint32_t target) const {
        int16_t count = 0;
        for (int i = 0; i < kSymbols; ++i) count = int16_t(count + (before[i] <= int16_t(target) ? 1 : 0));
        return uint32_t(count - 1);
    }
    void learn(uint32_t symbol) {
        const int shift = seen < 6 ? 2 : seen < 16 ? 3 : seen < 48 ? 4 : 5;
        if (seen < 48) ++seen;
        const int16_t at = int16_t(symbol);
        for (int16_t i = 0; i < kSymbols; ++i) {
            const int16_t goal = int16_t(i <= at ? i : (1 << kBits) - kSymbols + i);
            const int16_t away = int16_t(goal - before[i]);
            before[i] = int16_t(before[i] + int16_t(away >> shift));
        }
    }
};

/// So many zero bytes at the end are not stored, at most.
inline constexpr size_t kSparedZeros = 8;

class RangeEncoder {
public:
    static constexpr bool kEncodes = true;

    void bit(BitModel& model, bool value) {
        const uint32_t bound = (range_ >> 16) * model.zero;
        low_ += value ? bound : 0;
        range_ = value ? range_ - bound : bound;
        model.learn(value);
        normalize();
    }
    void symbol(SymbolModel& model, uint32_t value) {
        const uint32_t unit = range_ >> SymbolModel::kBits, begin = model.begin(value);
        low_ += uint64_t{unit} * begin;
        range_ = value + 1 < SymbolModel::kSymbols ? unit * (model.end(value) - begin) : range_ - unit * begin;
        model.learn(value);
        normalize();
    }
    /// Appends the lowest `count` bits of `value`, 0 to 32 of them.
    void raw(uint32_t value, int count) {
        rawBits_ |= (uint64_t{value} & ((uint64_t{1} << count) - 1)) << rawCount_;
        for (rawCount_ += count; rawCount_ >= 8; rawCount_ -= 8) {
            raw_.push_back(std::byte(rawBits_ & 255u));
            rawBits_ >>= 8;
        }
    }
    /// Appends all that was coded: bytes of raw bits (4 bytes), raw bits, range coded bytes. The encoder is done.
    void finish(std::vector<std::byte>& out) {
        if (rawCount_ > 0) raw_.push_back(std::byte(rawBits_ & 255u));
        for (int i = 0; i < 5; ++i) shiftLow();
        // The decoder takes bytes past the end, up to kSparedZeros, for zero.
        for (size_t i = 0; i < kSparedZeros && !bytes_.empty() && bytes_.back() == std::byte{0}; ++i) bytes_.pop_back();
        for (int shift = 0; shift < 32; shift += 8) out.push_back(std::byte(raw_.size() >> shift & 255u));
        out.insert(out.end(), raw_.begin(), raw_.end());
        out.insert(out.end(), bytes_.begin(), bytes_.end());
    }

private:
    void normalize() {
        while (range_ < 1u << 24) {
            range_ <<= 8;
            shiftLow();
        }
    }
    /// Bytes are held back while a carry could still change them.
    void shiftLow() {
        if (low_ < 0xff000000u || low_ > 0xffffffffu) {
            const uint8_t carry = uint8_t(low_ >> 32);
            if (started_) bytes_.push_back(std::byte(held_ + carry));
            for (; waiting_ > 0; --waiting_) bytes_.push_back(std::byte(0xff + carry));
            started_ = true;
            held_ = uint8_t(low_ >> 24);
        } else {
            ++waiting_;
        }
        low_ = (low_ & 0x00ffffffu) << 8;
    }

    std::vector<std::byte> bytes_, raw_;
    uint64_t low_ = 0, waiting_ = 0, rawBits_ = 0;
    uint32_t range_ = 0xffffffffu;
    int rawCount_ = 0;
    uint8_t held_ = 0;
    bool started_ = false;
};

/// Any bytes decode to something; complete() tells whether they were as many as the encoder made.
class RangeDecoder {
public:
    static constexpr bool kEncodes = false;

    explicit RangeDecoder(std::span<const std::byte> bytes) {
        uint64_t rawBytes = 0;
        for (size_t i = 0; i < 4 && i < bytes.size(); ++i) rawBytes |= std::to_integer<uint64_t>(bytes[i]) << 8 * i;
        if (bytes.size() < 4 || rawBytes > bytes.size() - 4) {
            torn_ = true;
            return;
        }
        raw_ = bytes.subspan(4, rawBytes);
        bytes_ = bytes.subspan(4 + rawBytes);
        for (int i = 0; i < 4; ++i) code_ = code_ << 8 | next();
    }
    void bit(BitModel& model, bool& value) {
        const uint32_t bound = (range_ >> 16) * model.zero;
        value = code_ >= bound;
        code_ -= value ? bound : 0;
        range_ = value ? range_ - bound : bound;
        model.learn(value);
        normalize();
    }
    void symbol(SymbolModel& model, uint32_t& value) {
        const uint32_t unit = range_ >> SymbolModel::kBits, target = code_ / unit;
        value = model.find(target < 0x7fff ? target : 0x7fff);
        const uint32_t begin = model.begin(value);
        code_ -= unit * begin;
        range_ = value + 1 < SymbolModel::kSymbols ? unit * (model.end(value) - begin) : range_ - unit * begin;
        model.learn(value);
        normalize();
    }
    void raw(uint32_t& value, int count) {
        while (rawCount_ < count) {
            const size_t i = rawAt_++;
            rawBits_ |= uint64_t{i < raw_.size() ? std::to_integer<uint8_t>(raw_[i]) : uint8_t{0}} << rawCount_;
            rawCount_ += 8;
        }
        value = uint32_t(rawBits_ & ((uint64_t{1} << count) - 1));
        rawBits_ >>= count;
        rawCount_ -= count;
    }
    /// Whether exactly the bytes that there were have been used.
    [[nodiscard]] bool complete() const {
        return !torn_ && rawAt_ == raw_.size() && at_ >= bytes_.size() && at_ <= bytes_.size() + kSparedZeros;
    }

private:
    uint32_t next() {
        const size_t i = at_++;
        return i < bytes_.size() ? std::to_integer<uint32_t>(bytes_[i]) : 0u;
    }
    void normalize() {
        while (range_ < 1u << 24) {
            range_ <<= 8;
            code_ = code_ << 8 | next();
        }
    }

    std::span<const std::byte> bytes_, raw_;
    size_t at_ = 0, rawAt_ = 0;
    uint64_t rawBits_ = 0;
    int rawCount_ = 0;
    uint32_t range_ = 0xffffffffu, code_ = 0;
    bool torn_ = false;
};

/// Codes a number below 2^30: its bit length, then the rest as raw bits.
struct NumberModel {
    SymbolModel length;

    template <class Coder>
    void code(Coder& coder, uint32_t& value) {
        constexpr uint32_t kLong = SymbolModel::kSymbols - 1;
        uint32_t bits = uint32_t(std::bit_width(value));
        uint32_t symbol = bits < kLong ? bits : kLong;
        coder.symbol(length, symbol);
        if (symbol == kLong) {
            uint32_t more = bits - kLong;
            coder.raw(more, 4);
            bits = kLong + more;
        } else {
            bits = symbol;
        }
        if (bits < 2) {
            value = bits;
            return;
        }
        uint32_t rest = value;
        coder.raw(rest, int(bits) - 1);
        value = 1u << (bits - 1) | (rest & ((1u << (bits - 1)) - 1));
    }
};

/// Codes a signed number that is mostly large; its magnitude is below 2^30.
struct SignedModel {
    NumberModel magnitude;

    template <class Coder>
    void code(Coder& coder, int32_t& value) {
        uint32_t size = uint32_t(value < 0 ? -value : value);
        magnitude.code(coder, size);
        uint32_t negative = value < 0 ? 1u : 0u;
        if (size != 0) coder.raw(negative, 1);
        value = negative != 0 && size != 0 ? -int32_t(size) : int32_t(size);
    }
};

/// Codes a signed number, mostly below 256, more finely: half octaves of its magnitude, then raw bits.
struct SmallModel {
    SymbolModel half;
    NumberModel beyond;

    template <class Coder>
    void code(Coder& coder, int32_t& value) {
        constexpr uint32_t kBeyond = 15;
        // The classes are 0, 1, 2, 3, 4..5, 6..7, 8..11, 12..15, ... 96..127, 128..191, and all from 192 on.
        const uint32_t size = uint32_t(value < 0 ? -value : value);
        uint32_t symbol = size;
        if (size >= 4) {
            const uint32_t bits = uint32_t(std::bit_width(size));
            symbol = size >= 192 ? kBeyond : 2 * bits - 2 + (size >> (bits - 2) & 1u);
        }
        coder.symbol(half, symbol);
        uint32_t result = symbol;
        if (symbol == kBeyond) {
            result = size - 192;
            beyond.code(coder, result);
            result += 192;
        } else if (symbol >= 4) {
            const int left = int(symbol) / 2 - 1;
            uint32_t rest = size;
            coder.raw(rest, left);
            result = (2u | (symbol & 1u)) << left | (rest & ((1u << left) - 1));
        }
        uint32_t negative = value < 0 ? 1u : 0u;
        if (result != 0) coder.raw(negative, 1);
        value = negative != 0 && result != 0 ? -int32_t(result) : int32_t(result);
    }
};

}  // namespace vcp
