// The range coder: whatever is coded comes back, also where carries run through many bytes.
#include "octree/page/range_coder.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

namespace vcp {
namespace {

struct Models {
    BitModel bit[3];
    SymbolModel symbol, few{3};
    NumberModel number;
    SignedModel large;
    SmallModel small;
};

/// What is coded, in turn: kinds 0 to 6.
struct Item {
    int kind;
    int64_t value;
};

Item randomItem(std::mt19937& random, double skew) {
    const int kind = int(random() % 7);
    const auto magnitude = [&] { return int64_t(random() >> (3 + random() % 29)); };
    const bool rare = std::generate_canonical<double, 32>(random) < skew;
    switch (kind) {
        case 0:
            return {kind, rare ? 1 : 0};
        case 1:
            return {kind, rare ? int64_t(random() % 16) : 15};
        case 2:
            return {kind, int64_t(random() % 3)};
        case 3:
            return {kind, magnitude()};
        case 4:
        case 5:
            return {kind, rare ? -magnitude() : magnitude() % 200};
        default:
            return {kind, int64_t(random() % 8192)};
    }
}

template <class Coder>
int64_t code(Coder& coder, Models& m, int kind, int64_t value) {
    bool b = value != 0;
    uint32_t u = uint32_t(value);
    int32_t s = int32_t(value);
    switch (kind) {
        case 0:
            coder.bit(m.bit[0], b);
            return b ? 1 : 0;
        case 1:
            coder.symbol(m.symbol, u);
            return u;
        case 2:
            coder.symbol(m.few, u);
            return u;
        case 3:
            m.number.code(coder, u);
            return u;
        case 4:
            m.large.code(coder, s);
            return s;
        case 5:
            m.small.code(coder, s);
            return s;
        default:
            coder.raw(u, 13);
            return u;
    }
}

TEST(RangeCoder, EverythingComesBack) {
    for (uint32_t seed = 0; seed < 200; ++seed) {
        SCOPED_TRACE(seed);
        std::mt19937 random(seed);
        std::vector<Item> items(1 + random() % 2000);
        for (Item& item : items) item = randomItem(random, seed % 2 != 0 ? 0.002 : 0.3);
        RangeEncoder encoder;
        Models models;
        for (const Item& item : items) code(encoder, models, item.kind, item.value);
        std::vector<std::byte> bytes;
        encoder.finish(bytes);
        RangeDecoder decoder(bytes);
        Models fresh;
        for (size_t i = 0; i < items.size(); ++i)
            ASSERT_EQ(code(decoder, fresh, items[i].kind, 0), items[i].value) << i;
        EXPECT_TRUE(decoder.complete());
    }
}

TEST(RangeCoder, BoundariesOfNumbers) {
    RangeEncoder encoder;
    Models models;
    std::vector<Item> items;
    for (int bits = 0; bits < 30; ++bits)
        for (int64_t v = (int64_t{1} << bits) - 1; v <= int64_t{1} << bits && v < int64_t{1} << 29; ++v)
            for (const int kind : {3, 4, 5})
                for (const int64_t sign : {1, -1})
                    if (sign > 0 || kind != 3) items.push_back({kind, sign * v});
    for (const int64_t v : {191, 192, 193, 127, 128, 95, 96}) items.push_back({5, v});
    for (const Item& item : items) code(encoder, models, item.kind, item.value);
    std::vector<std::byte> bytes;
    encoder.finish(bytes);
    RangeDecoder decoder(bytes);
    Models fresh;
    for (const Item& item : items) ASSERT_EQ(code(decoder, fresh, item.kind, 0), item.value);
    EXPECT_TRUE(decoder.complete());
}

TEST(RangeCoder, LikelySymbolsCostLittle) {
    RangeEncoder encoder;
    Models models;
    for (int i = 0; i < 20000; ++i) {
        encoder.bit(models.bit[1], i % 1000 == 0);
        encoder.symbol(models.symbol, i % 1000 == 0 ? 3u : 9u);
    }
    std::vector<std::byte> bytes;
    encoder.finish(bytes);
    EXPECT_LT(bytes.size(), 300u);
}

TEST(RangeCoder, LongEndsThatWereForetoldAreComplete) {
    // Bits that are all but certain move nothing: the coded bytes may end in any number of zeros.
    for (const int certain : {0, 10, 1000, 100000, 1000000}) {
        RangeEncoder encoder;
        BitModel model;
        for (int i = 0; i < 40 + certain; ++i) encoder.bit(model, i < 40 && i % 3 == 0);
        std::vector<std::byte> bytes;
        encoder.finish(bytes);
        RangeDecoder decoder(bytes);
        BitModel again;
        for (int i = 0; i < 40 + certain; ++i) {
            bool bit = false;
            decoder.bit(again, bit);
            ASSERT_EQ(bit, i < 40 && i % 3 == 0) << i;
        }
        EXPECT_TRUE(decoder.complete()) << certain;
    }
}

TEST(RangeCoder, HeldBytesTakeCarries) {
    // Unlikely ones after long runs of likely ones: low ends in runs of 0xff that a carry goes through.
    for (uint32_t seed = 0; seed < 300; ++seed) {
        std::mt19937 random(seed);
        std::vector<bool> bits(5000);
        for (size_t i = 0; i < bits.size(); ++i) bits[i] = random() % (2 + seed) != 0;
        RangeEncoder encoder;
        BitModel model, fresh;
        for (const bool b : bits) encoder.bit(model, b);
        std::vector<std::byte> bytes;
        encoder.finish(bytes);
        RangeDecoder decoder(bytes);
        for (size_t i = 0; i < bits.size(); ++i) {
            bool b = false;
            decoder.bit(fresh, b);
            ASSERT_EQ(b, bits[i]) << seed << ' ' << i;
        }
    }
}

}  // namespace
}  // namespace vcp
