// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "preview.hpp"

#include "model/parallel.hpp"
#include "preview_camera.hpp"
#include "preview_scene.hpp"
#include "preview_shade.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <stdexcept>
#include <string>

namespace voxelize {
namespace {

void check(const preview_options& o) {
    const auto require = [](bool good, const char* message) {
        if (!good) throw std::invalid_argument(message);
    };
    constexpr int most_pixels = 16384;
    require(o.width >= 1 && o.height >= 1 && o.width <= most_pixels && o.height <= most_pixels,
            "the picture must have 1 to 16384 pixels a side");
    require(o.samples >= 1 && o.samples <= 8, "the samples of the picture must be 1 to 8");
    require(std::isfinite(o.azimuth), "the azimuth must be a number");
    require(o.elevation >= -90 && o.elevation <= 90, "the elevation must be -90 to 90 degrees");
    require(o.zoom >= 1e-3 && o.zoom <= 1e3, "the zoom must be 0.001 to 1000");
    require(o.field_of_view >= 0 && o.field_of_view <= 150, "the field of view must be 0 to 150 degrees");
}

} // namespace

std::optional<rgb8> parse_color(std::string_view text) {
    if (text.size() != 7 || text[0] != '#') return std::nullopt;
    std::uint32_t value = 0;
    const auto [end, error] = std::from_chars(text.data() + 1, text.data() + text.size(), value, 16);
    if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
    return rgb8{static_cast<std::uint8_t>(value >> 16), static_cast<std::uint8_t>(value >> 8),
                static_cast<std::uint8_t>(value)};
}

std::optional<background> parse_background(std::string_view text) {
    if (text == "sky") return background{};
    if (text == "white") return background{{255, 255, 255}, {255, 255, 255}, false};
    if (text == "dark") return background{{24, 27, 33}, {52, 57, 66}, false};
    if (text == "transparent") return background{{255, 255, 255}, {255, 255, 255}, true};
    const std::size_t comma = text.find(',');
    const auto top = parse_color(text.substr(0, comma));
    const auto bottom = comma == std::string_view::npos ? top : parse_color(text.substr(comma + 1));
    if (!top || !bottom) return std::nullopt;
    return background{*top, *bottom, false};
}

const channel* find_colors(std::span<const channel> channels) {
    const channel* found = nullptr;
    for (const channel& c : channels) {
        if (!c.name.starts_with("color") || c.type != scalar::u8 || c.components < 3) continue;
        if (c.name == "color") return &c;
        if (found == nullptr) found = &c;
    }
    return found;
}

const channel* find_shown(std::span<const channel> channels) {
    if (const channel* const colors = find_colors(channels)) return colors;
    for (const channel& c : channels)
        if (c.type != scalar::bit && !c.data.empty() && c.name != "distance") return &c;
    return nullptr;
}

const channel* find_colors(const volume& v) { return find_colors(std::span<const channel>(v.channels)); }

namespace {

image render(const volume& v, const preview_scene& scene, const channel* colors, const preview_options& options,
             const std::function<void(double)>& progress) {
    const int threads = thread_count(options.threads);
    const preview_shader shader(v, scene, options, colors);

    image picture{options.width, options.height, options.backdrop.transparent ? 4 : 3, {}};
    const auto row_bytes = static_cast<std::size_t>(picture.width) * static_cast<std::size_t>(picture.components);
    picture.pixels.resize(row_bytes * static_cast<std::size_t>(picture.height));
    shader.render(picture.components, picture.pixels.data(), threads, [&](int rows) {
        if (progress) progress(static_cast<double>(rows) / options.height);
    });
    return picture;
}

} // namespace

image render_preview(const volume& v, const preview_options& options, const std::function<void(double)>& progress) {
    if (v.occupancy() == nullptr) throw std::invalid_argument("the preview needs the occupancy");
    check(options);
    const preview_scene scene(v, thread_count(options.threads));
    return render(v, scene, find_shown(v.channels), options, progress);
}

image render_preview(const volume& v, const preview_bricks& bricks, const channel* shown,
                     const preview_options& options, const std::function<void(double)>& progress) {
    check(options);
    const preview_scene scene(v, bricks);
    return render(v, scene, shown, options, progress);
}

} // namespace voxelize
