// Adaptive binary range coding, after Martin 1979 and the LZMA coder: bits with adaptive probabilities, raw
// bits, and numbers as bit length and mantissa. Encoder and decoder have the same interface, so that a format
// is written down once, as a template over the coder: `bit(model, value)` reads `value` in the one and sets it
// in the other. Integers alone decide, so every machine decodes the same.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace vcp {

/// Probability that the next bit is 0, in 1/65536; learns quickly at first, then slowly.
struct BitModel {
    uint16_t zero = 32768;
    uint16_t seen = 0;

    void learn(bool bit) {
        // Rates 1/2, 1/4, ... down to 1/64, each for twice as many bits as the one before.
        const int shift = seen >= 63 ? 6 : std::bit_width(static_cast<unsigned>(seen) + 1u);
        if (seen < 63) ++seen;
        // Ends a little short of certainty: the coder needs room for either bit.
        zero = static_cast<uint16_t>(bit ? zero - ((zero - 48) >> shift) : zero + ((65488 - zero) >> shift));
    }
};

class RangeEncoder {
public:
    static constexpr bool kEncodes = true;

    void bit(BitModel& model, bool value) {
        const uint32_t bound = (range_ >> 16) * model.zero;
        if (value) {
            low_ += bound;
            range_ -= bound;
        } else {
            range_ = bound;
        }
        model.learn(value);
        normalize();
    }
    /// The lowest `count` bits of `value`, 0 to 31 of them.
    void raw(uint32_t value, int count) {
        while (count > 0) {
            const int part = count < 12 ? count : 12;
            count -= part;
            range_ >>= part;
            low_ += uint64_t{range_} * (value >> count & ((1u << part) - 1));
            normalize();
        }
    }
    /// The bytes; the encoder is done.
    std::vector<std::byte> finish() {
        for (int i = 0; i < 5; ++i) shiftLow();
        // The decoder takes bytes past the end for zero.
        while (!bytes_.empty() && bytes_.back() == std::byte{0}) bytes_.pop_back();
        return std::move(bytes_);
    }

private:
    void normalize() {
        while (range_ < 1u << 24) {
            range_ <<= 8;
            shiftLow();
        }
    }
    /// Bytes wait while a carry could still change them.
    void shiftLow() {
        if (low_ < 0xff000000u || low_ > 0xffffffffu) {
            const uint8_t carry = static_cast<uint8_t>(low_ >> 32);
            if (started_) bytes_.push_back(static_cast<std::byte>(held_ + carry));
            for (; waiting_ > 0; --waiting_) bytes_.push_back(static_cast<std::byte>(0xff + carry));
            started_ = true;
            held_ = static_cast<uint8_t>(low_ >> 24);
        } else {
            ++waiting_;
        }
        low_ = (low_ & 0x00ffffffu) << 8;
    }

    std::vector<std::byte> bytes_;
    uint64_t low_ = 0, waiting_ = 0;
    uint32_t range_ = 0xffffffffu;
    uint8_t held_ = 0;
    bool started_ = false;
};

/// Any bytes decode to something; overrun() tells whether there were too few.
class RangeDecoder {
public:
    static constexpr bool kEncodes = false;

    explicit RangeDecoder(std::span<const std::byte> bytes) : bytes_(bytes) {
        for (int i = 0; i < 4; ++i) code_ = code_ << 8 | next();
    }
    void bit(BitModel& model, bool& value) {
        const uint32_t bound = (range_ >> 16) * model.zero;
        value = code_ >= bound;
        if (value) {
            code_ -= bound;
            range_ -= bound;
        } else {
            range_ = bound;
        }
        model.learn(value);
        normalize();
    }
    void raw(uint32_t& value, int count) {
        value = 0;
        while (count > 0) {
            const int part = count < 12 ? count : 12;
            count -= part;
            range_ >>= part;
            const uint32_t most = (1u << part) - 1, digit = code_ / range_;
            const uint32_t taken = digit < most ? digit : most;
            code_ -= taken * range_;
            value = value << part | taken;
            normalize();
        }
    }
    /// Whether more was decoded than the bytes held.
    [[nodiscard]] bool overrun() const { return at_ > bytes_.size() + 8; }
    /// Whether all bytes were used.
    [[nodiscard]] bool exhausted() const { return at_ >= bytes_.size(); }

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

    std::span<const std::byte> bytes_;
    size_t at_ = 0;
    uint32_t range_ = 0xffffffffu, code_ = 0;
};

/// A symbol of `Bits` bits, highest first, each bit in the context of those before it.
template <int Bits>
struct SymbolModel {
    BitModel node[1 << Bits];

    template <class Coder>
    void code(Coder& coder, uint32_t& value) {
        uint32_t at = 1;
        for (int i = Bits - 1; i >= 0; --i) {
            bool b = (value >> i & 1u) != 0;
            coder.bit(node[at], b);
            at = at << 1 | (b ? 1u : 0u);
        }
        value = at - (1u << Bits);
    }
};

/// A number below 2^30: its bit length, the bit after the leading one, the rest raw.
struct NumberModel {
    SymbolModel<5> length;
    BitModel second[32][3];

    template <class Coder>
    void code(Coder& coder, uint32_t& value) {
        uint32_t bits = static_cast<uint32_t>(std::bit_width(value));
        length.code(coder, bits);
        if (bits > 30) bits = 30;  // only where the bytes were made up
        if (bits < 2) {
            value = bits;
            return;
        }
        uint32_t top = value >> (bits - 2) & 1u;
        bool b = top != 0;
        coder.bit(second[bits][0], b);
        uint32_t result = 2u | (b ? 1u : 0u);
        int left = static_cast<int>(bits) - 2;
        if (left > 0) {
            const int context = b ? 2 : 1;
            --left;
            b = (value >> left & 1u) != 0;
            coder.bit(second[bits][context], b);
            result = result << 1 | (b ? 1u : 0u);
        }
        uint32_t rest = value & ((1u << left) - 1);
        coder.raw(rest, left);
        value = result << left | rest;
    }
};

/// A signed number of magnitude below 2^30.
struct SignedModel {
    NumberModel magnitude;
    BitModel sign;

    template <class Coder>
    void code(Coder& coder, int32_t& value) {
        uint32_t size = static_cast<uint32_t>(value < 0 ? -value : value);
        magnitude.code(coder, size);
        bool negative = value < 0;
        if (size != 0) coder.bit(sign, negative);
        value = negative && size != 0 ? -static_cast<int32_t>(size) : static_cast<int32_t>(size);
    }
};

}  // namespace vcp
