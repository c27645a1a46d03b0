// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Integers of 128 bits in two words against the compiler's.

#include <voxelpipe/core/int128.hpp>

#include <cstdint>
#include <initializer_list>
#include <random>
#include <type_traits>
#include <vector>

#include <gtest/gtest.h>

namespace {

using namespace voxelpipe;

__extension__ typedef __int128 builtin_signed;
__extension__ typedef unsigned __int128 builtin_unsigned;
using ours_signed = core::wide_integer<true>;
using ours_unsigned = core::wide_integer<false>;

static_assert(std::is_trivially_copyable_v<ours_signed> && sizeof(ours_signed) == 16);
static_assert(!std::is_convertible_v<ours_signed, ours_unsigned>, "mixed signs are to be converted in writing");
static_assert(!std::is_convertible_v<ours_signed, std::int64_t>, "nothing is cut off without a word");
// At compile time there is no instruction of the processor's.
static_assert((ours_unsigned(1) << 100) == (ours_unsigned(1) << 50) * (ours_unsigned(1) << 50));
static_assert(((ours_signed(-7) << 90) + 5) / (ours_signed(1) << 90) == -6);
static_assert(((ours_signed(-7) << 90) + 5) % (ours_signed(1) << 90) == 5 - (ours_signed(1) << 90));

ours_unsigned ours(builtin_unsigned v) {
    return ours_unsigned(core::word_pair{static_cast<std::uint64_t>(v), static_cast<std::uint64_t>(v >> 64)});
}
ours_signed ours(builtin_signed v) { return ours_signed(ours(static_cast<builtin_unsigned>(v))); }
template <bool Signed>
builtin_unsigned bits_of(const core::wide_integer<Signed>& v) {
    return static_cast<builtin_unsigned>(v.high()) << 64 | v.low();
}

// Numbers of every width, those next to powers of two, and their negatives.
class numbers {
public:
    builtin_unsigned next() {
        const auto bits = static_cast<int>(random_() % 128);
        const builtin_unsigned any = static_cast<builtin_unsigned>(random_()) << 64 | random_();
        switch (random_() % 5) {
        case 0:
            return any >> bits;
        case 1:
            return builtin_unsigned{0} - (any >> bits);
        case 2:
            return (builtin_unsigned{1} << bits) - 1 + random_() % 3;
        case 3:
            return builtin_unsigned{0} - (builtin_unsigned{1} << bits);
        default:
            return random_() % 4;
        }
    }
    int shift() { return static_cast<int>(random_() % 128); }

private:
    std::mt19937_64 random_{20261130};
};

TEST(Int128, OperatorsAreTheCompilers) {
    numbers any;
    for (int i = 0; i < 200'000; ++i) {
        const builtin_unsigned a = any.next(), b = any.next();
        const ours_unsigned x = ours(a), y = ours(b);
        const int by = any.shift();
        ASSERT_TRUE(bits_of(x + y) == a + b && bits_of(x - y) == a - b && bits_of(x * y) == a * b) << i;
        ASSERT_TRUE(bits_of(x & y) == (a & b) && bits_of(x | y) == (a | b) && bits_of(x ^ y) == (a ^ b)) << i;
        ASSERT_TRUE(bits_of(~x) == ~a && bits_of(-x) == builtin_unsigned{0} - a) << i;
        ASSERT_TRUE(bits_of(x << by) == a << by && bits_of(x >> by) == a >> by) << i;
        ASSERT_TRUE((x < y) == (a < b) && (x == y) == (a == b) && (x >= y) == (a >= b)) << i;
        const auto p = static_cast<builtin_signed>(a), q = static_cast<builtin_signed>(b);
        const ours_signed s = ours(p), t = ours(q);
        ASSERT_TRUE(bits_of(s >> by) == static_cast<builtin_unsigned>(p >> by)) << i;
        ASSERT_TRUE((s < t) == (p < q) && (s > t) == (p > q) && (s <= t) == (p <= q) && (s != t) == (p != q)) << i;
        ASSERT_TRUE(static_cast<std::int64_t>(s) == static_cast<std::int64_t>(p) &&
                    static_cast<bool>(s) == static_cast<bool>(p))
            << i;
    }
}

TEST(Int128, QuotientsAreTheCompilers) {
    numbers any;
    for (int i = 0; i < 200'000; ++i) {
        const builtin_unsigned a = any.next(), b = any.next();
        if (b == 0) continue;
        ASSERT_TRUE(bits_of(ours(a) / ours(b)) == a / b && bits_of(ours(a) % ours(b)) == a % b) << i;
        const auto p = static_cast<builtin_signed>(a), q = static_cast<builtin_signed>(b);
        if (q == -1) continue; // the least number has no negative
        ASSERT_TRUE(bits_of(ours(p) / ours(q)) == static_cast<builtin_unsigned>(p / q) &&
                    bits_of(ours(p) % ours(q)) == static_cast<builtin_unsigned>(p % q))
            << i;
    }
}

// Quotients whose first estimate is too large: divisors with all bits set, or none but the highest, and remainders next
// to them.
TEST(Int128, EstimatedQuotientsAreMended) {
    std::vector<builtin_unsigned> divisors;
    for (int high = 1; high < 128; ++high)
        for (const builtin_unsigned less : {builtin_unsigned{0}, builtin_unsigned{1}, builtin_unsigned{1} << high / 2})
            divisors.push_back((builtin_unsigned{1} << high) - less);
    for (const builtin_unsigned d : divisors)
        for (const builtin_unsigned q : {builtin_unsigned{1}, builtin_unsigned{0xffffffffu}, ~builtin_unsigned{0} / d})
            for (const builtin_unsigned rest : {builtin_unsigned{0}, builtin_unsigned{1}, d - 1}) {
                if (rest >= d || q > (~builtin_unsigned{0} - rest) / d) continue;
                ASSERT_TRUE(bits_of(ours(q * d + rest) / ours(d)) == q);
            }
}

TEST(Int128, ProductsByHalvesAreExact) {
    numbers any;
    for (int i = 0; i < 200'000; ++i) {
        const auto a = static_cast<std::uint64_t>(any.next()), b = static_cast<std::uint64_t>(any.next());
        const core::word_pair p = core::multiply_by_halves(a, b);
        ASSERT_TRUE((static_cast<builtin_unsigned>(p.high) << 64 | p.low) == static_cast<builtin_unsigned>(a) * b) << i;
    }
}

TEST(Int128, DoublesAreTheCompilers) {
    numbers any;
    for (int i = 0; i < 200'000; ++i) {
        builtin_unsigned a = any.next();
        if (i % 4 == 0) a = a >> 12 | builtin_unsigned{1} << (any.shift() / 2 + 10); // near ties of narrower numbers
        const auto p = static_cast<builtin_signed>(a);
        ASSERT_EQ(static_cast<double>(a), static_cast<double>(ours(a))) << i;
        ASSERT_EQ(static_cast<double>(p), static_cast<double>(ours(p))) << i;
    }
    for (int bit = 54; bit < 128; ++bit) // ties, and the numbers beside them
        for (const int beside : {-1, 0, 1})
            for (const int odd : {0, 1}) {
                const builtin_unsigned tie = (builtin_unsigned{1} << bit) + (builtin_unsigned{1} << (bit - 53)) +
                                             static_cast<builtin_unsigned>(odd) * (builtin_unsigned{1} << (bit - 52));
                const builtin_unsigned a = tie + static_cast<builtin_unsigned>(beside);
                ASSERT_EQ(static_cast<double>(a), static_cast<double>(ours(a))) << bit << ' ' << beside;
            }
}

TEST(Int128, IntegersConvertWithTheirSign) {
    EXPECT_TRUE(ours_signed(std::int8_t{-3}) == -3 && ours_signed(-3).high() == ~std::uint64_t{0});
    EXPECT_TRUE(ours_unsigned(-1) == ~ours_unsigned(0));
    EXPECT_EQ(0u, ours_signed(~std::uint64_t{0}).high());
    EXPECT_TRUE(ours_signed(true) == 1);
    ours_signed n = 1;
    n <<= 100;
    n -= 1;
    n >>= 36;
    EXPECT_TRUE(n == ~std::uint64_t{0});
    EXPECT_TRUE(++n == (ours_signed(1) << 64));
}

} // namespace
