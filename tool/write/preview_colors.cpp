// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "preview_colors.hpp"

#include <voxelpipe/core/half.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <string>
#include <string_view>
#include <vector>

namespace voxelize {
namespace {

template <class T>
double read_as(const std::byte* at) {
    T value;
    std::memcpy(&value, at, sizeof(T));
    return static_cast<double>(value);
}

// The number-th value of a channel, by its component.
double value_of(const channel& c, std::int64_t number, int component) {
    const std::int64_t at = number * c.components + component;
    const std::byte* const from = c.data.data() + static_cast<std::size_t>(at) * size_of(c.type);
    switch (c.type) {
    case scalar::u8:
        return read_as<std::uint8_t>(from);
    case scalar::u16:
        return read_as<std::uint16_t>(from);
    case scalar::u32:
        return read_as<std::uint32_t>(from);
    case scalar::u64:
        return read_as<std::uint64_t>(from);
    case scalar::i32:
        return read_as<std::int32_t>(from);
    case scalar::i64:
        return read_as<std::int64_t>(from);
    case scalar::f16: {
        voxelpipe::half value;
        std::memcpy(&value, from, sizeof(value));
        return static_cast<float>(value);
    }
    case scalar::f32:
        return read_as<float>(from);
    case scalar::f64:
        return read_as<double>(from);
    case scalar::bit:
        break;
    }
    return 0;
}

// True if equal values mean the same thing and their order means nothing.
bool is_number_of_a_part(const channel& c) {
    if (c.components != 1) return false;
    for (const std::string_view word : {"material", "triangle", "instance", "nearest"})
        if (c.name.find(word) != std::string::npos) return true;
    return c.name.ends_with("id");
}

rgb8 color_of_number(double value) {
    constexpr double most = 9e18; // about the limit of 64 bits, which NaN and some numbers of users do not fit
    const std::int64_t number = value > -most && value < most ? static_cast<std::int64_t>(value) : -1;
    const std::uint32_t hash = (static_cast<std::uint32_t>(number) + 1u) * 0x9e3779b1u;
    const double hue = (hash >> 8) / static_cast<double>(0xffffff) * 6, light = 0.62 + 0.25 * ((hash & 255u) / 255.0);
    rgb8 color{};
    for (std::size_t c = 0; c < 3; ++c) {
        const double k = std::abs(std::fmod(hue + 6 - 2 * static_cast<double>(c), 6.0) - 3) - 1;
        color[c] = static_cast<std::uint8_t>(255 * light * (0.35 + 0.65 * std::clamp(k, 0.0, 1.0)));
    }
    return color;
}

rgb8 color_of_share(double share) {
    constexpr std::size_t steps = color_ramp.size() - 1;
    const double x = std::clamp(share, 0.0, 1.0) * static_cast<double>(steps);
    const std::size_t i = std::min(static_cast<std::size_t>(x), steps - 1);
    rgb8 color{};
    for (std::size_t c = 0; c < 3; ++c) {
        const double from = color_ramp[i][c], to = color_ramp[i + 1][c];
        color[c] = static_cast<std::uint8_t>(from + (x - static_cast<double>(i)) * (to - from));
    }
    return color;
}

// Every n-th of the values that are added, in which n grows so that they stay few.
class value_sample {
public:
    void add(double value) {
        if (count_++ % every_ != 0 || !std::isfinite(value)) return;
        constexpr std::size_t most = std::size_t{1} << 18;
        if (values_.size() == most) {
            for (std::size_t i = 0; i < most / 2; ++i) values_[i] = values_[2 * i];
            values_.resize(most / 2);
            every_ *= 2;
            if ((count_ - 1) % every_ != 0) return;
        }
        values_.push_back(value);
    }
    [[nodiscard]] bool empty() const { return values_.empty(); }
    [[nodiscard]] double percentile(double share) {
        const auto at = std::lround(share * static_cast<double>(values_.size() - 1));
        const auto place = values_.begin() + at;
        std::nth_element(values_.begin(), place, values_.end());
        return *place;
    }

private:
    std::vector<double> values_;
    std::uint64_t count_ = 0, every_ = 1;
};

} // namespace

voxel_colors::voxel_colors(const channel* shown, const volume* dense) : shown_(shown) {
    if (shown == nullptr) return;
    if (shown->type == scalar::u8 && shown->components >= 3)
        kind_ = kind::color;
    else if (shown->type == scalar::f32 && shown->components == 3)
        kind_ = kind::direction;
    else if (is_number_of_a_part(*shown))
        kind_ = kind::number;
    else {
        kind_ = kind::scalar;
        find_range(dense);
    }
}

void voxel_colors::find_range(const volume* dense) {
    value_sample sample;
    if (dense == nullptr) {
        const std::size_t each = // not 0, of which the analyzer cannot know
            std::max<std::size_t>(size_of(shown_->type) * static_cast<std::size_t>(shown_->components), 1);
        const auto count = static_cast<std::int64_t>(shown_->data.size() / each);
        for (std::int64_t n = 0; n < count; ++n) sample.add(value_of(*shown_, n, 0));
    } else {
        const channel& bits = *dense->occupancy();
        for (std::int64_t k = 0; k < dense->extent[2]; ++k)
            for (std::int64_t j = 0; j < dense->extent[1]; ++j)
                for (std::int64_t w = 0; w < dense->words_per_row(); ++w)
                    for (std::uint32_t word = dense->word(bits, w, j, k); word != 0; word &= word - 1)
                        sample.add(value_of(*shown_, dense->index(32 * w + std::countr_zero(word), j, k), 0));
    }
    if (sample.empty()) return;
    low_ = sample.percentile(0.01);
    high_ = sample.percentile(0.99);
    if (low_ < high_) return;
    low_ = sample.percentile(0);
    high_ = sample.percentile(1);
}

rgb8 voxel_colors::of(std::int64_t number) const {
    switch (kind_) {
    case kind::clay:
        break;
    case kind::color: {
        const std::byte* const from = shown_->data.data() + number * shown_->components;
        return {std::to_integer<std::uint8_t>(from[0]), std::to_integer<std::uint8_t>(from[1]),
                std::to_integer<std::uint8_t>(from[2])};
    }
    case kind::direction: {
        std::array<double, 3> v{};
        for (std::size_t a = 0; a < 3; ++a) v[a] = value_of(*shown_, number, static_cast<int>(a));
        const double length = std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
        const bool is_unit = std::abs(length - 1) < 1e-3 || length == 0; // a normal is shown as it is
        rgb8 color{};
        for (std::size_t a = 0; a < 3; ++a) {
            const double value = is_unit ? v[a] : v[a] / length;
            color[a] =
                static_cast<std::uint8_t>(127.5 + 127.5 * (std::isnan(value) ? 0 : std::clamp(value, -1.0, 1.0)));
        }
        return color;
    }
    case kind::number:
        return color_of_number(value_of(*shown_, number, 0));
    case kind::scalar: {
        const double value = value_of(*shown_, number, 0);
        if (std::isnan(value)) return {128, 128, 128};
        return color_of_share(low_ < high_ ? (value - low_) / (high_ - low_) : 0);
    }
    }
    return clay;
}

} // namespace voxelize
