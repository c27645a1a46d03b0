// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "write/preview.hpp"

#include "test_volumes.hpp"
#include "write/formats/formats.hpp"
#include "write/page/page_text.hpp"
#include "write/preview_colors.hpp"
#include "write/sparse_formats.hpp"

#include <cmath>
#include <limits>

#define STB_IMAGE_IMPLEMENTATION
#define STB_IMAGE_STATIC
#define STBI_ONLY_PNG
#include <stb_image.h>

using namespace voxelize;
using namespace voxelize::testing;

namespace {

class Png : public in_folder {};

preview_options small_picture() {
    preview_options o;
    o.width = 97; // odd, so that the middle is a pixel
    o.height = 73;
    return o;
}

std::array<int, 4> pixel(const image& p, int x, int y) {
    const std::uint8_t* at = p.pixels.data() + (y * p.width + x) * p.components;
    return {at[0], at[1], at[2], p.components == 4 ? at[3] : 255};
}

// A ball with a different colour for each octant's side of x and y.
volume make_ball(std::int64_t n) {
    volume v;
    v.extent = {n, n, n};
    v.add("occupancy", scalar::bit);
    v.add("color", scalar::u8, 4);
    const double r = static_cast<double>(n) / 2;
    for (std::int64_t k = 0; k < n; ++k)
        for (std::int64_t j = 0; j < n; ++j)
            for (std::int64_t i = 0; i < n; ++i) {
                const double x = static_cast<double>(i) + 0.5 - r, y = static_cast<double>(j) + 0.5 - r,
                             z = static_cast<double>(k) + 0.5 - r;
                if (x * x + y * y + z * z > r * r) continue;
                v.set_bit(v.channels[0], i, j, k);
                std::byte* c = v.channels[1].data.data() + 4 * v.index(i, j, k);
                c[0] = static_cast<std::byte>(x > 0 ? 230 : 20);
                c[1] = static_cast<std::byte>(y > 0 ? 230 : 20);
                c[2] = static_cast<std::byte>(z > 0 ? 230 : 20);
                c[3] = std::byte{255};
            }
    return v;
}

// Mean absolute difference of two pictures of one size, in steps of 1/255.
double difference(const image& a, const image& b) {
    EXPECT_EQ(a.pixels.size(), b.pixels.size());
    double sum = 0;
    for (std::size_t n = 0; n < std::min(a.pixels.size(), b.pixels.size()); ++n)
        sum += std::abs(a.pixels[n] - b.pixels[n]);
    return sum / static_cast<double>(a.pixels.size());
}

} // namespace

TEST(Preview, SamePixelsForAnyNumberOfThreads) {
    const volume v = make_ball(40);
    preview_options o = small_picture();
    o.threads = 1;
    const image one = render_preview(v, o);
    for (const int threads : {2, 3, 8}) {
        o.threads = threads;
        EXPECT_TRUE(render_preview(v, o).pixels == one.pixels) << threads;
    }
}

TEST(Preview, ShowsTheModelInTheMiddleBeforeTheBackground) {
    const volume v = make_ball(40);
    preview_options o = small_picture();
    o.ground = false;
    const image with = render_preview(v, o);
    volume nothing = make_volume({40, 40, 40});
    nothing.add("occupancy", scalar::bit);
    const image without = render_preview(nothing, o);
    EXPECT_EQ(pixel(with, 1, 1), pixel(without, 1, 1));
    EXPECT_EQ(pixel(with, 95, 71), pixel(without, 95, 71));
    EXPECT_NE(pixel(with, 48, 36), pixel(without, 48, 36));
    EXPECT_GT(difference(with, without), 10);
    // It fills the height but for the margin, and touches no edge.
    int top = o.height, bottom = -1;
    for (int y = 0; y < o.height; ++y)
        for (int x = 0; x < o.width; ++x)
            if (pixel(with, x, y) != pixel(without, x, y)) {
                top = std::min(top, y);
                bottom = std::max(bottom, y);
            }
    EXPECT_NEAR(top, 0.05 * o.height, 2);
    EXPECT_NEAR(bottom, 0.95 * o.height, 2);
}

TEST(Preview, DirectionsAreThoseOfTheWorld) {
    const volume v = make_ball(32);
    preview_options o = small_picture();
    o.elevation = 0;
    // At azimuth 0 the viewer stands at +z (blue side) with +x (red side) on the right and +y (green side) on top.
    o.azimuth = 0;
    image p = render_preview(v, o);
    const auto right_top = pixel(p, 58, 26), left_bottom = pixel(p, 38, 46);
    EXPECT_GT(right_top[0], 2 * left_bottom[0]);
    EXPECT_GT(right_top[1], 2 * left_bottom[1]);
    EXPECT_GT(right_top[2], 100);
    // From azimuth 90 at +x, so +z lies on the left.
    o.azimuth = 90;
    p = render_preview(v, o);
    EXPECT_GT(pixel(p, 38, 26)[2], 2 * pixel(p, 58, 26)[2]);
    EXPECT_GT(pixel(p, 38, 26)[0], 100);
    // From above, azimuth 0: +x on the right, -z (not blue) at the top.
    o.azimuth = 0;
    o.elevation = 90;
    p = render_preview(v, o);
    EXPECT_GT(pixel(p, 58, 46)[0], 2 * pixel(p, 38, 46)[0]);
    EXPECT_GT(pixel(p, 58, 46)[2], 2 * pixel(p, 58, 26)[2]);
    EXPECT_GT(pixel(p, 58, 46)[1], 100);
}

TEST(Preview, AnUprightZIsTheTurnedModel) {
    // y up -> z up is the quarter turn (x, y, z) -> (x, -z, y).
    const volume v = make_ball(32);
    volume turned = v;
    for (std::int64_t k = 0; k < 32; ++k)
        for (std::int64_t j = 0; j < 32; ++j)
            for (std::int64_t i = 0; i < 32; ++i)
                std::memcpy(turned.channels[1].data.data() + 4 * turned.index(i, 31 - k, j),
                            v.channels[1].data.data() + 4 * v.index(i, j, k), 4);
    preview_options o = small_picture();
    const image y_up = render_preview(v, o);
    o.up = up_axis::z;
    EXPECT_LT(difference(y_up, render_preview(turned, o)), 0.5);
    EXPECT_GT(difference(y_up, render_preview(v, o)), 2);
}

TEST(Preview, VoxelSizesAndUnitsShape) {
    volume v = make_ball(32);
    const preview_options o = small_picture();
    const image cube = render_preview(v, o);
    v.voxel_size = {1e-9, 1e-9, 1e-9};
    v.origin = {1e6, -1e6, 3};
    EXPECT_LT(difference(cube, render_preview(v, o)), 0.01); // neither unit nor place is seen
    v.voxel_size = {1e-9, 4e-9, 1e-9};
    EXPECT_GT(difference(cube, render_preview(v, o)), 5); // but a ball becomes an egg
}

TEST(Preview, OrthographicAndZoom) {
    const volume v = make_ball(32);
    preview_options o = small_picture();
    o.backdrop = *parse_background("transparent");
    o.ground = false;
    const auto covered = [&] {
        const image p = render_preview(v, o);
        double sum = 0;
        for (int y = 0; y < p.height; ++y)
            for (int x = 0; x < p.width; ++x) sum += pixel(p, x, y)[3] / 255.0;
        return sum;
    };
    o.field_of_view = 0;
    const double fitted = covered();
    const double radius = 0.45 * o.height;
    EXPECT_NEAR(fitted, 3.14159 * radius * radius, 0.03 * fitted);
    o.zoom = 0.5;
    EXPECT_NEAR(covered(), fitted / 4, 0.02 * fitted);
    o.field_of_view = 40;
    EXPECT_NEAR(covered(), fitted / 4, 0.02 * fitted);
}

TEST(Preview, TransparentBackgroundKeepsTheShadow) {
    const volume v = make_ball(32);
    preview_options o = small_picture();
    o.backdrop = *parse_background("transparent");
    const image p = render_preview(v, o);
    ASSERT_EQ(p.components, 4);
    EXPECT_EQ(pixel(p, 0, 0)[3], 0);
    EXPECT_EQ(pixel(p, 48, 36)[3], 255);
    int shadow = 0;
    for (int y = 0; y < p.height; ++y)
        for (int x = 0; x < p.width; ++x) {
            const auto c = pixel(p, x, y);
            if (c[3] > 20 && c[3] < 240 && c[0] == 0 && c[1] == 0 && c[2] == 0) ++shadow;
        }
    EXPECT_GT(shadow, 100);
    o.ground = false;
    const image without = render_preview(v, o);
    int left = 0;
    for (int y = 0; y < p.height; ++y)
        for (int x = 0; x < p.width; ++x)
            if (pixel(without, x, y)[3] != 0) ++left;
    EXPECT_LT(left, 3600);
}

TEST(Preview, ColorIsFoundByName) {
    volume v = make_volume({4, 4, 4});
    v.add("occupancy", scalar::bit);
    EXPECT_EQ(find_colors(v), nullptr);
    v.add("color_max", scalar::u8, 3);
    EXPECT_EQ(find_colors(v)->name, "color_max");
    v.add("color", scalar::f32, 4);
    EXPECT_EQ(find_colors(v)->name, "color_max"); // floats are no 8-bit colour
    v.channels.pop_back();
    v.add("color", scalar::u8, 4);
    EXPECT_EQ(find_colors(v)->name, "color");
}

// A ball whose voxels have their height as "height", and the greatest of all but one.
volume make_heights(std::int64_t n) {
    volume v = make_ball(n);
    v.channels.pop_back();
    v.add("height", scalar::f32);
    for (std::int64_t i = 0; i < v.num_voxels(); ++i) {
        const float height = i == v.num_voxels() / 2 ? 1e6f : static_cast<float>(i / n % n);
        std::memcpy(v.channels[1].data.data() + 4 * i, &height, 4);
    }
    return v;
}

TEST(Preview, ValuesAreShownByAColorMapFromTheFirstToTheLastPercentile) {
    const volume v = make_heights(40);
    ASSERT_EQ(find_shown(v.channels), &v.channels[1]);
    const voxel_colors colors(&v.channels[1], &v);
    EXPECT_GT(colors.low(), 0.0);
    EXPECT_LT(colors.low(), 4.0);
    EXPECT_GT(colors.high(), 35.0);
    EXPECT_LT(colors.high(), 40.0); // the million is one voxel of many
    EXPECT_EQ(colors.of(v.index(20, 0, 20)), color_ramp.front());
    EXPECT_EQ(colors.of(v.index(20, 39, 20)), color_ramp.back());
    // The picture has the colours: its top is yellow, its bottom is violet.
    const image p = render_preview(v, small_picture());
    const std::array<int, 4> top = pixel(p, p.width / 2, 12), bottom = pixel(p, p.width / 2, p.height - 12);
    EXPECT_GT(top[1], top[2] + 60);
    EXPECT_GT(bottom[2], bottom[1] + 10);
    preview_options plain = small_picture();
    plain.use_color = false;
    EXPECT_GT(difference(render_preview(v, plain), p), 5.0);
}

TEST_F(Png, BricksShowTheSameValues) {
    volume v = make_heights(40);
    write_options o;
    o.preview = small_picture();
    write(v, folder_ / "dense.png", o);
    write_sparse(make_sparse(v, 1), folder_ / "bricks.png", o);
    EXPECT_EQ(read_file(folder_ / "dense.png"), read_file(folder_ / "bricks.png"));
    v.channels[1].name = "distance"; // about the same at every voxel of a surface
    EXPECT_EQ(find_shown(v.channels), nullptr);
}

TEST(Preview, ColorsOfNumbersDirectionsAndWhatIsNoNumber) {
    volume v = make_volume({3, 1, 1});
    v.add("occupancy", scalar::bit);
    for (std::int64_t i = 0; i < 3; ++i) v.set_bit(v.channels[0], i, 0, 0);
    const auto fill_with = [](channel& c, const auto& values) {
        std::memcpy(c.data.data(), values.data(), c.data.size());
    };
    fill_with(v.add("material", scalar::i32), std::array<std::int32_t, 3>{0, 1, 0});
    const voxel_colors materials(&v.channels[1], &v);
    EXPECT_EQ(materials.of(0), materials.of(2));
    EXPECT_NE(materials.of(0), materials.of(1));
    fill_with(v.add("normal", scalar::f32, 3), std::array<float, 9>{1, 0, 0, 0, -1, 0, 0, 0, 1});
    EXPECT_EQ(voxel_colors(&v.channels[2], &v).of(0), (rgb8{255, 127, 127}));
    EXPECT_EQ(voxel_colors(&v.channels[2], &v).of(1), (rgb8{127, 0, 127}));
    fill_with(v.add("depth", scalar::f32), std::array<float, 3>{1, std::numeric_limits<float>::quiet_NaN(), 1});
    const voxel_colors depths(&v.channels[3], &v);
    EXPECT_EQ(depths.of(1), (rgb8{128, 128, 128}));
    EXPECT_EQ(depths.of(0), color_ramp.front()); // one value alone
    fill_with(v.add("count", scalar::u32), std::array<std::uint32_t, 3>{1, 2, 3});
    EXPECT_EQ(voxel_colors(&v.channels[4], nullptr).of(2), color_ramp.back());
    EXPECT_EQ(find_shown(v.channels), &v.channels[1]);
}

TEST(Preview, TheColorMapIsThatOfThePage) {
    std::string ramp = "const ramp = [";
    for (const rgb8& c : color_ramp) {
        if (ramp.back() == ']') ramp += ", ";
        ramp += '[' + std::to_string(c[0]) + ", " + std::to_string(c[1]) + ", " + std::to_string(c[2]) + ']';
    }
    EXPECT_NE(std::string_view::npos, page_text.find(ramp + "];")) << ramp;
}

TEST(Preview, ClayWhenColorsAreNotWanted) {
    volume v = make_ball(16);
    preview_options o = small_picture();
    o.use_color = false;
    const image clay_picture = render_preview(v, o);
    v.channels.pop_back();
    o.use_color = true;
    EXPECT_TRUE(render_preview(v, o).pixels == clay_picture.pixels);
}

TEST(Preview, BackgroundsHaveNamesAndNumbers) {
    EXPECT_TRUE(parse_background("sky") && parse_background("white") && parse_background("dark"));
    EXPECT_TRUE(parse_background("transparent")->transparent);
    const auto two = parse_background("#102030,#a0b0c0");
    ASSERT_TRUE(two);
    EXPECT_EQ(two->top, (rgb8{16, 32, 48}));
    EXPECT_EQ(two->bottom, (rgb8{160, 176, 192}));
    EXPECT_EQ(parse_background("#ffffff")->bottom, (rgb8{255, 255, 255}));
    for (const char* bad :
         {"", "blue", "#12345", "#1234567", "#12345g", "#123456,", "#123456,#12", "#-12345", "#+12345"})
        EXPECT_FALSE(parse_background(bad)) << bad;
}

TEST(Preview, RefusesOptionsOutOfRange) {
    const volume v = make_ball(8);
    const auto refused = [&](const auto& spoil) {
        preview_options o = small_picture();
        spoil(o);
        try {
            (void)render_preview(v, o);
        } catch (const std::invalid_argument&) {
            return true;
        }
        return false;
    };
    EXPECT_FALSE(refused([](preview_options&) {}));
    EXPECT_TRUE(refused([](preview_options& o) { o.width = 0; }));
    EXPECT_TRUE(refused([](preview_options& o) { o.height = 20000; }));
    EXPECT_TRUE(refused([](preview_options& o) { o.samples = 9; }));
    EXPECT_TRUE(refused([](preview_options& o) { o.elevation = 91; }));
    EXPECT_TRUE(refused([](preview_options& o) { o.azimuth = std::nan(""); }));
    EXPECT_TRUE(refused([](preview_options& o) { o.zoom = 0; }));
    EXPECT_TRUE(refused([](preview_options& o) { o.field_of_view = -1; }));
    volume bare = make_volume({2, 2, 2});
    EXPECT_THROW((void)render_preview(bare, small_picture()), std::invalid_argument);
}

TEST(Preview, EveryViewOfALoneVoxelWorks) {
    const volume v = make_occupancy({1, 1, 1}, 1);
    preview_options o = small_picture();
    o.samples = 1;
    for (const double elevation : {-90.0, -30.0, 0.0, 45.0, 90.0})
        for (const double azimuth : {0.0, 90.0, 123.0, -720.0})
            for (const double fov : {0.0, 28.0}) {
                o.elevation = elevation;
                o.azimuth = azimuth;
                o.field_of_view = fov;
                const image p = render_preview(v, o);
                EXPECT_NE(pixel(p, 48, 36), pixel(p, 1, 36)) << elevation << " " << azimuth << " " << fov;
            }
}

TEST_F(Png, DecodesToTheRenderedPixels) {
    const volume v = make_ball(24);
    for (const char* backdrop : {"sky", "transparent"}) {
        write_options o;
        o.preview = small_picture();
        o.preview.backdrop = *parse_background(backdrop);
        write(v, folder_ / "a.png", o);
        const image want = render_preview(v, o.preview);
        int width = 0, height = 0, components = 0;
        stbi_uc* got = stbi_load((folder_ / "a.png").c_str(), &width, &height, &components, 0);
        ASSERT_NE(got, nullptr);
        EXPECT_EQ(width, want.width);
        EXPECT_EQ(height, want.height);
        ASSERT_EQ(components, want.components);
        EXPECT_TRUE(std::equal(want.pixels.begin(), want.pixels.end(), got));
        stbi_image_free(got);
    }
}
