// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Every operation of core/exact.hpp against exact rational numbers that are rounded once. Compiled twice: by the C++
// compiler, and by nvcc, where a kernel evaluates the operations and so the device's own instructions are checked.

#include "test_support.hpp"

#include <voxelpipe/core/exact.hpp>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace {

namespace ex = voxelpipe::exact;
using unit::rational;
using unit::splitmix64;
using voxelpipe::int128;
using voxelpipe::uint128;

// ---- evaluation, on the host or on the device -----------------------------------------------------------------------

struct vec {
    float x, y, z;
};

struct float_input {
    vec a, b;
    float c;
};
struct float_output {
    float add, sub, mul, div, fma, sqrt, dot, lerp, saturated, inverse, least, greatest, absolute;
    double as_double;
};
VOXELPIPE_HD void evaluate(const float_input& in, float_output& out) {
    const float a = in.a.x, b = in.b.x;
    out.add = ex::add(a, b);
    out.sub = ex::sub(a, b);
    out.mul = ex::mul(a, b);
    out.div = ex::div(a, b);
    out.fma = ex::fma(a, b, in.c);
    out.sqrt = ex::sqrt(a < 0 ? -a : a);
    out.dot = ex::dot(in.a, in.b);
    out.lerp = ex::lerp(a, b, in.c);
    out.saturated = ex::fma_saturated(a, b, in.c);
    out.inverse = ex::near_inverse(a);
    out.least = ex::min(a, b);
    out.greatest = ex::max(a, b);
    out.absolute = ex::absolute(a);
    out.as_double = ex::to_double(a);
}

struct double_input {
    double a, b, c;
};
struct double_output {
    double mul, div, fma, sqrt;
    float as_float;
    std::uint32_t high_word;
};
VOXELPIPE_HD void evaluate(const double_input& in, double_output& out) {
    out.mul = ex::mul(in.a, in.b);
    out.div = ex::div(in.a, in.b);
    out.fma = ex::fma(in.a, in.b, in.c);
    out.sqrt = ex::sqrt(in.a < 0 ? -in.a : in.a);
    out.as_float = ex::to_float(in.a);
    out.high_word = ex::high_word(in.a);
}

struct rounding_input {
    double large;           // |large| < 2^63
    double near;            // |near| <= 2^30
    std::int64_t offset;    // even, from 0 to 2^40
    float fraction, factor; // their product is a multiple of 2^-20
    float base;             // an integer
    float coordinate;       // |coordinate| <= 2^21
};
struct rounding_output {
    std::int64_t large;
    std::int32_t near, below, integer;
    float up, down, over;
};
VOXELPIPE_HD void evaluate(const rounding_input& in, rounding_output& out) {
    out.large = ex::round_to_int64(in.large);
    out.near = ex::round_to_int32(in.near, ex::rounding_shift(in.offset));
    out.up = ex::fma_up(in.fraction, in.factor, in.base);
    out.down = ex::fma_down(in.fraction, in.factor, in.base);
    out.below = ex::integer_below(in.coordinate, out.over);
    out.integer = ex::to_integer(in.base);
}

struct integer_input {
    uint128 wide;
    std::int64_t narrow;
    int shift;
};
struct integer_output {
    uint128 shifted;
    std::uint64_t half_bits, float_bits, double_bits;
    double wide_as_double, narrow_as_double;
    float narrow_as_float;
    int wide_width, narrow_width, highest, lowest, lowest_of_64, ones;
};
VOXELPIPE_HD void evaluate(const integer_input& in, integer_output& out) {
    const auto word = static_cast<std::uint32_t>(in.narrow) | 1u << (in.shift & 31);
    out.shifted = ex::shift_right_rne(in.wide, in.shift);
    out.half_bits = ex::round_to_binary(in.wide, -in.shift, 10, 5);
    out.float_bits = ex::round_to_binary(in.wide, -in.shift, 23, 8);
    out.double_bits = ex::round_to_binary(in.wide, -in.shift, 52, 11);
    out.wide_as_double = ex::to_double(static_cast<int128>(in.wide));
    out.narrow_as_double = ex::to_double(in.narrow);
    out.narrow_as_float = ex::to_float(in.narrow);
    out.wide_width = ex::bit_width(in.wide);
    out.narrow_width = ex::bit_width(static_cast<std::uint64_t>(in.narrow));
    out.highest = ex::highest_one(word);
    out.lowest = ex::lowest_one(word);
    out.lowest_of_64 = ex::lowest_one(static_cast<std::uint64_t>(in.narrow) | std::uint64_t{1} << 63);
    out.ones = ex::count_ones(word);
}

#if defined(__CUDACC__)
template <class In, class Out>
__global__ void evaluate_all(const In* in, Out* out, unsigned count) {
    const unsigned i = blockIdx.x * blockDim.x + threadIdx.x;
    if (i < count) evaluate(in[i], out[i]);
}
template <class Out, class In>
std::vector<Out> evaluated(const std::vector<In>& in) {
    std::vector<Out> out(in.size());
    In* d_in = nullptr;
    Out* d_out = nullptr;
    EXPECT_EQ(cudaMalloc(&d_in, in.size() * sizeof(In)), cudaSuccess);
    EXPECT_EQ(cudaMalloc(&d_out, in.size() * sizeof(Out)), cudaSuccess);
    EXPECT_EQ(cudaMemcpy(d_in, in.data(), in.size() * sizeof(In), cudaMemcpyHostToDevice), cudaSuccess);
    const auto count = static_cast<unsigned>(in.size());
    evaluate_all<<<(count + 255) / 256, 256>>>(d_in, d_out, count);
    EXPECT_EQ(cudaMemcpy(out.data(), d_out, out.size() * sizeof(Out), cudaMemcpyDeviceToHost), cudaSuccess);
    cudaFree(d_in);
    cudaFree(d_out);
    return out;
}
#else
template <class Out, class In>
std::vector<Out> evaluated(const std::vector<In>& in) {
    std::vector<Out> out(in.size());
    for (std::size_t i = 0; i < in.size(); ++i) evaluate(in[i], out[i]);
    return out;
}
#endif

// ---- exact arithmetic -----------------------------------------------------------------------------------------------

rational operator+(const rational& a, const rational& b) {
    return {a.numerator * b.denominator + b.numerator * a.denominator, a.denominator * b.denominator};
}
rational operator*(const rational& a, const rational& b) {
    return {a.numerator * b.numerator, a.denominator * b.denominator};
}
rational operator-(const rational& a) { return {-a.numerator, a.denominator}; }
rational inverse(const rational& a) { // a != 0
    if (a.numerator.sign() < 0) return {-a.denominator, -a.numerator};
    return {a.denominator, a.numerator};
}
rational exact(double a) { return unit::exact(a); }

float fused(float a, float b, float c) { return unit::nearest_float(exact(a) * exact(b) + exact(c)); }
float product(float a, float b) { return unit::nearest_float(exact(a) * exact(b)); }
float difference(float a, float b) { return unit::nearest_float(exact(a) + -exact(b)); }

// True if `root` is the number of its format nearest to the square root: the square lies between those of the points
// half-way to its neighbours.
bool is_nearest_root(const rational& square, double root, double below, double above) {
    const rational low = exact(root) + exact(below), high = exact(root) + exact(above); // doubled
    const rational four{unit::wide(4)};
    const auto at_most = [](const rational& a, const rational& b) {
        return !(a.numerator * b.denominator > b.numerator * a.denominator);
    };
    return at_most(low * low, four * square) && at_most(four * square, high * high);
}

// Floats of like magnitudes, some of which cancel, some with results below the normal range.
std::vector<float_input> float_inputs() {
    splitmix64 random(21);
    std::vector<float_input> in;
    while (in.size() < static_cast<std::size_t>(unit::cases(10'000))) {
        const int scale = random.one_in(4) ? -66 : 0;
        const auto f = [&] { return static_cast<float>(unit::spread_double(random, scale - 6, scale + 6)); };
        float_input i{{f(), f(), f()}, {f(), f(), f()}, f()};
        if (random.one_in(3)) i.c = -(i.a.x * i.b.x); // what a fused step leaves is the product's rounding
        if (random.one_in(5)) i.a.z = -(i.a.y * i.b.y + i.a.x * i.b.x) / i.b.z;
        if (random.one_in(4)) i.c = static_cast<float>(random.uniform(0.0, 1.0)) - i.a.x * i.b.x;
        const float all[] = {i.a.x, i.a.y, i.a.z, i.b.x, i.b.y, i.b.z, i.c};
        if (std::all_of(std::begin(all), std::end(all), [](float x) { return x != 0 && std::isfinite(x); }))
            in.push_back(i);
    }
    return in;
}

std::uint32_t bits(float a) { return std::bit_cast<std::uint32_t>(a); }
std::uint64_t bits(double a) { return std::bit_cast<std::uint64_t>(a); }
// The model has one zero only.
float plain_zero(float a) { return a == 0 ? 0.0f : a; }
double plain_zero(double a) { return a == 0 ? 0.0 : a; }

TEST(FloatOperations, AreTheExactResultRoundedOnce) {
    const std::vector<float_input> in = float_inputs();
    const auto out = evaluated<float_output>(in);
    int fusing_shows = 0, subnormal = 0;
    for (std::size_t i = 0; i < in.size(); ++i) {
        const float a = in[i].a.x, b = in[i].b.x, c = in[i].c;
        const float_output& r = out[i];
        const rational x = exact(a), y = exact(b), z = exact(c);
        ASSERT_EQ(bits(plain_zero(r.add)), bits(unit::nearest_float(x + y))) << a << " + " << b;
        ASSERT_EQ(bits(plain_zero(r.sub)), bits(unit::nearest_float(x + -y))) << a << " - " << b;
        ASSERT_EQ(bits(plain_zero(r.mul)), bits(plain_zero(product(a, b)))) << a << " * " << b;
        ASSERT_EQ(bits(plain_zero(r.div)), bits(plain_zero(unit::nearest_float(x * inverse(y))))) << a << " / " << b;
        ASSERT_EQ(bits(plain_zero(r.fma)), bits(plain_zero(fused(a, b, c)))) << a << " * " << b << " + " << c;
        // Points half-way to the neighbours, whose squares a double holds exactly.
        const double below = 0.5 * (double{r.sqrt} + double{std::nextafterf(r.sqrt, 0.0f)});
        const double above = 0.5 * (double{r.sqrt} + double{std::nextafterf(r.sqrt, HUGE_VALF)});
        ASSERT_TRUE(below * below <= std::fabs(double{a}) && std::fabs(double{a}) <= above * above) << "root of " << a;
        ASSERT_EQ(r.as_double, double{a});
        ASSERT_EQ(r.least, std::min(a, b));
        ASSERT_EQ(r.greatest, std::max(a, b));
        ASSERT_EQ(r.absolute, std::fabs(a));
        const float kept = std::min(1.0f, std::max(0.0f, fused(a, b, c)));
        ASSERT_EQ(bits(plain_zero(r.saturated)), bits(kept)) << a << " * " << b << " + " << c;
        ASSERT_LE(std::fabs(double{r.inverse} * double{a} - 1.0), 0x1p-22) << "1 / " << a;
        fusing_shows += unit::nearest_float(exact(product(a, b)) + z) != fused(a, b, c) ? 1 : 0;
        subnormal += std::fpclassify(product(a, b)) == FP_SUBNORMAL ? 1 : 0;
    }
    EXPECT_GT(fusing_shows, static_cast<int>(in.size() / 4));
    EXPECT_GT(subnormal, static_cast<int>(in.size() / 40));
}

// x x' first, then a fused step for y and one for z; every other order of the three gives other floats for some.
TEST(FloatOperations, DotIsOneProductAndTwoFusedStepsInOrder) {
    const std::vector<float_input> in = float_inputs();
    const auto out = evaluated<float_output>(in);
    std::array<int, 3> order{0, 1, 2};
    do {
        int others = 0;
        for (std::size_t i = 0; i < in.size(); ++i) {
            const float a[] = {in[i].a.x, in[i].a.y, in[i].a.z}, b[] = {in[i].b.x, in[i].b.y, in[i].b.z};
            const auto [x, y, z] = order;
            const float d = fused(a[z], b[z], fused(a[y], b[y], product(a[x], b[x])));
            others += plain_zero(d) != plain_zero(out[i].dot) ? 1 : 0;
        }
        if (order == std::array<int, 3>{0, 1, 2})
            EXPECT_EQ(others, 0);
        else
            EXPECT_GT(others, 0) << order[0] << order[1] << order[2];
    } while (std::next_permutation(order.begin(), order.end()));
}

TEST(FloatOperations, LerpIsADifferenceAndAFusedStep) {
    std::vector<float_input> in = float_inputs();
    for (std::size_t i = 0; i < in.size(); i += 10) in[i].c = 0.0f;
    for (std::size_t i = 1; i < in.size(); i += 10) in[i].b.x = in[i].a.x;
    const auto out = evaluated<float_output>(in);
    for (std::size_t i = 0; i < in.size(); ++i) {
        const float a = in[i].a.x, b = in[i].b.x, t = in[i].c;
        if (t == 0 || a == b)
            ASSERT_EQ(bits(out[i].lerp), bits(a)) << "exact where t is 0 or both are the same";
        else
            ASSERT_EQ(plain_zero(out[i].lerp), plain_zero(fused(t, difference(b, a), a)));
    }
}

TEST(FloatOperations, SaturatedIsZeroForWhatIsNoNumber) {
    const float nan = std::numeric_limits<float>::quiet_NaN();
    std::vector<float_input> in(3);
    in[0] = {{nan, 1, 1}, {1, 1, 1}, 1};
    in[1] = {{HUGE_VALF, 1, 1}, {1, 1, 1}, 0};
    in[2] = {{-HUGE_VALF, 1, 1}, {1, 1, 1}, 0};
    const auto out = evaluated<float_output>(in);
    EXPECT_EQ(bits(plain_zero(out[0].saturated)), bits(0.0f));
    EXPECT_EQ(out[1].saturated, 1.0f);
    EXPECT_EQ(plain_zero(out[2].saturated), 0.0f);
}

TEST(DoubleOperations, AreTheExactResultRoundedOnce) {
    splitmix64 random(22);
    std::vector<double_input> in;
    while (in.size() < static_cast<std::size_t>(unit::cases(10'000))) {
        const auto d = [&] { return unit::spread_double(random, -10, 10); };
        double_input i{d(), d(), d()};
        if (random.one_in(3)) i.c = -(i.a * i.b);
        if (random.one_in(3)) // as a float's middle and next to it, where the conversion to float decides
            i.a =
                double{static_cast<float>(i.a)} * (1 + 0x1p-24) + static_cast<double>(random.between(-1, 1)) * 0x1p-60;
        if (i.a != 0 && i.b != 0 && i.c != 0) in.push_back(i);
    }
    const auto out = evaluated<double_output>(in);
    int fusing_shows = 0;
    for (std::size_t i = 0; i < in.size(); ++i) {
        const auto [a, b, c] = in[i];
        const double_output& r = out[i];
        const rational x = exact(a), y = exact(b), z = exact(c);
        const double xy = unit::nearest_double(x * y), xyz = unit::nearest_double(x * y + z);
        ASSERT_EQ(bits(r.mul), bits(xy)) << a << " * " << b;
        ASSERT_EQ(bits(r.div), bits(unit::nearest_double(x * inverse(y)))) << a << " / " << b;
        ASSERT_EQ(bits(plain_zero(r.fma)), bits(xyz)) << a << " * " << b << " + " << c;
        ASSERT_TRUE(
            is_nearest_root(a < 0 ? -x : x, r.sqrt, std::nextafter(r.sqrt, 0.0), std::nextafter(r.sqrt, HUGE_VAL)))
            << "root of " << a;
        ASSERT_EQ(bits(r.as_float), bits(unit::nearest_float(x))) << a;
        ASSERT_EQ(r.high_word, static_cast<std::uint32_t>(bits(a) >> 32));
        fusing_shows += unit::nearest_double(exact(xy) + z) != xyz ? 1 : 0;
    }
    EXPECT_GT(fusing_shows, static_cast<int>(in.size() / 10));
}

TEST(RoundingToIntegers, TakesTheNearestEvenTheUpperOrTheLower) {
    splitmix64 random(23);
    std::vector<rounding_input> in(static_cast<std::size_t>(unit::cases(10'000)));
    for (rounding_input& i : in) {
        i.large = unit::spread_double(random, -3, 61);
        i.near = unit::spread_double(random, -3, 29);
        if (random.one_in(2)) { // ties
            i.large = static_cast<double>(random.between(-(1 << 30), 1 << 30)) + 0.5;
            i.near = static_cast<double>(random.between(-(1 << 29), 1 << 29)) + 0.5;
        }
        i.offset = 2 * random.between(0, std::int64_t{1} << random.below(39));
        i.fraction = std::ldexp(static_cast<float>(random.between(0, 1 << 20)), -20);
        i.factor = static_cast<float>(random.one_in(2) ? 64 : random.between(-16, 16));
        i.base = static_cast<float>(random.between(-2000, 2000));
        i.coordinate = static_cast<float>(unit::spread_double(random, -30, 20));
        if (random.one_in(4)) i.coordinate = std::floor(i.coordinate);
    }
    const auto out = evaluated<rounding_output>(in);
    for (std::size_t i = 0; i < in.size(); ++i) {
        const rounding_input& x = in[i];
        ASSERT_EQ(out[i].large, unit::round_to_integer(exact(x.large)).to_int64()) << x.large;
        const std::int64_t near = unit::round_to_integer(exact(x.near)).to_int64() - x.offset;
        ASSERT_EQ(out[i].near, static_cast<std::int32_t>(static_cast<std::uint32_t>(near)))
            << x.near << " - " << x.offset;
        const rational step = exact(x.fraction) * exact(x.factor) + exact(x.base);
        const std::int64_t down = unit::wide::floor_divide(step.numerator, step.denominator).to_int64();
        const bool whole = unit::wide(down) * step.denominator == step.numerator;
        ASSERT_EQ(out[i].down, static_cast<float>(down));
        ASSERT_EQ(out[i].up, static_cast<float>(down + (whole ? 0 : 1)));
        const rational at = exact(x.coordinate);
        const std::int64_t below = unit::wide::floor_divide(at.numerator, at.denominator).to_int64();
        ASSERT_EQ(out[i].below, below) << x.coordinate;
        ASSERT_EQ(out[i].over, difference(x.coordinate, static_cast<float>(below))) << x.coordinate;
        ASSERT_EQ(out[i].integer, static_cast<std::int32_t>(x.base));
    }
}

TEST(IntegerOperations, AreThoseOfTheirDefinitions) {
    splitmix64 random(24);
    std::vector<integer_input> in(static_cast<std::size_t>(unit::cases(5'000)));
    for (integer_input& i : in) {
        const int length = static_cast<int>(random.between(1, 126));
        i.wide = (static_cast<uint128>(random.next()) << 64 | random.next()) & ((uint128{1} << length) - 1);
        if (random.one_in(4)) i.wide = (uint128{1} << length) - 1; // carries through all bits
        if (random.one_in(4)) i.wide |= uint128{1} << (length / 2);
        i.narrow = static_cast<std::int64_t>(random.next()) >> random.below(63);
        i.shift = static_cast<int>(random.below(128));
    }
    const auto out = evaluated<integer_output>(in);
    for (std::size_t i = 0; i < in.size(); ++i) {
        const integer_output& r = out[i];
        const rational wide{unit::wide(static_cast<int128>(in[i].wide))};
        const rational scaled{wide.numerator, unit::power_of_two(in[i].shift)};
        ASSERT_EQ(unit::wide(static_cast<int128>(r.shifted)), unit::round_to_integer(scaled));
        ASSERT_EQ(r.half_bits, unit::nearest_bits(scaled, 10, 5));
        ASSERT_EQ(r.float_bits, unit::nearest_bits(scaled, 23, 8));
        ASSERT_EQ(r.double_bits, unit::nearest_bits(scaled, 52, 11));
        ASSERT_EQ(r.wide_as_double, unit::nearest_double(wide));
        ASSERT_EQ(r.narrow_as_double, unit::nearest_double({unit::wide(in[i].narrow)}));
        ASSERT_EQ(r.narrow_as_float, unit::nearest_float({unit::wide(in[i].narrow)}));
        ASSERT_EQ(r.wide_width, wide.numerator.sign() == 0 ? 0 : wide.numerator.bit_width());
        ASSERT_EQ(r.narrow_width, std::bit_width(static_cast<std::uint64_t>(in[i].narrow)));
        const auto word = static_cast<std::uint32_t>(in[i].narrow) | 1u << (in[i].shift & 31);
        ASSERT_EQ(r.highest, 31 - std::countl_zero(word));
        ASSERT_EQ(r.lowest, std::countr_zero(word));
        ASSERT_EQ(r.lowest_of_64, std::countr_zero(static_cast<std::uint64_t>(in[i].narrow) | std::uint64_t{1} << 63));
        ASSERT_EQ(r.ones, std::popcount(word));
    }
}

} // namespace
