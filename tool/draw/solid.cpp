// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "solid.hpp"

#include "body_fill.hpp"
#include "model/parallel.hpp"
#include "model/srgb.hpp"
#include "model/targets.hpp"
#include "write/preview.hpp"

#include <voxelpipe/core/morton.hpp>

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <optional>
#include <string>
#include <utility>

namespace voxelize {

namespace {

using rgba8 = color_mean::rgba8;
constexpr double linear_scale = 65535;

// VISIT(number of a voxel) for every bit of WORD(w, j, k) of a layer.
template <class Word, class Visit>
void for_each_bit(const volume& v, std::int64_t k, const Word& word, const Visit& visit) {
    for (std::int64_t j = 0; j < v.extent[1]; ++j)
        for (std::int64_t w = 0; w < v.words_per_row(); ++w)
            for (std::uint32_t bits = word(w, j, k); bits != 0; bits &= bits - 1)
                visit(static_cast<std::size_t>(v.index(32 * w + std::countr_zero(bits), j, k)));
}

rgba8 mean_of(const volume& v, const channel& surface, const channel& colors, int threads) {
    const color_mean mean;
    std::array<std::atomic<std::uint64_t>, 4> sums{};
    parallel_for(static_cast<std::size_t>(v.extent[2]), threads, [&](std::size_t layer) {
        color_mean::sums own{};
        for_each_bit(
            v, static_cast<std::int64_t>(layer),
            [&](std::int64_t w, std::int64_t j, std::int64_t k) { return v.word(surface, w, j, k); },
            [&](std::size_t i) {
                rgba8 color;
                std::memcpy(color.data(), colors.data.data() + 4 * i, 4);
                mean.add(own, color);
            });
        for (std::size_t a = 0; a < 4; ++a) sums[a] += own[a];
    });
    return mean.mean_of({sums[0], sums[1], sums[2], sums[3]});
}

// Gives a channel's voxels of THOSE that are not of WITHOUT one value.
void set_voxels(const volume& v, const channel& those, const channel& without, channel& c,
                const std::array<std::byte, 16>& value, int threads) {
    const std::size_t bytes = size_of(c.type) * static_cast<std::size_t>(c.components);
    parallel_for(static_cast<std::size_t>(v.extent[2]), threads, [&](std::size_t layer) {
        for_each_bit(
            v, static_cast<std::int64_t>(layer),
            [&](std::int64_t w, std::int64_t j, std::int64_t k) {
                return v.word(those, w, j, k) & ~v.word(without, w, j, k);
            },
            [&](std::size_t i) { std::memcpy(c.data.data() + bytes * i, value.data(), bytes); });
    });
}

// Gives a channel's voxels of SOLID that are not of SURFACE the values of their bodies, brick by brick.
void set_by_body(const volume& v, const channel& solid, const channel& surface, channel& c, const fill_values& inside,
                 const std::array<int, 3>& offset, int threads) {
    constexpr int side = voxelpipe::core::sparse_brick_size;
    const std::size_t bytes = size_of(c.type) * static_cast<std::size_t>(c.components);
    const int first_layer = offset[2] / side,
              layers = (offset[2] + static_cast<int>(v.extent[2]) - 1) / side - first_layer + 1;
    // A bit for each of the voxels [i, i + n) of a row, of which there are no more than a brick's.
    const auto bits_of = [&](std::int64_t i, std::int64_t n, std::int64_t j, std::int64_t k) {
        const auto word = [&](std::int64_t w) -> std::uint64_t {
            return v.word(solid, w, j, k) & ~v.word(surface, w, j, k);
        };
        std::uint64_t bits = word(i / 32);
        if (i % 32 + n > 32) bits |= word(i / 32 + 1) << 32U;
        return static_cast<std::uint32_t>(bits >> (i % 32)) & ((1U << n) - 1U);
    };
    parallel_for(static_cast<std::size_t>(layers), threads, [&](std::size_t layer) {
        const int bz = first_layer + static_cast<int>(layer);
        body_map::labels each;
        const auto fill_brick = [&](int bx, int by) {
            // The brick's voxels in the volume.
            std::array<std::int64_t, 3> low{}, high{};
            const std::array<int, 3> brick{bx, by, bz};
            for (std::size_t a = 0; a < 3; ++a) {
                low[a] = std::max<std::int64_t>(brick[a] * side - offset[a], 0);
                high[a] = std::min<std::int64_t>((brick[a] + 1) * side - offset[a], v.extent[a]);
            }
            bool is_known = false; // what the brick's bodies are
            std::optional<std::uint32_t> one;
            for (std::int64_t k = low[2]; k < high[2]; ++k)
                for (std::int64_t j = low[1]; j < high[1]; ++j)
                    for (std::uint32_t bits = bits_of(low[0], high[0] - low[0], j, k); bits != 0; bits &= bits - 1) {
                        if (!std::exchange(is_known, true))
                            one = inside.bodies()->of_brick(voxelpipe::core::morton_key(bx, by, bz), each);
                        const std::int64_t i = low[0] + std::countr_zero(bits);
                        const auto within = [&](std::int64_t at, std::size_t a) {
                            return static_cast<int>(at + offset[a]) % side;
                        };
                        const std::uint32_t number =
                            one ? *one : each[voxelpipe::core::morton_key(within(i, 0), within(j, 1), within(k, 2))];
                        std::memcpy(c.data.data() + bytes * static_cast<std::size_t>(v.index(i, j, k)),
                                    inside.of(number).data(), bytes);
                    }
        };
        for (int by = offset[1] / side; by * side < offset[1] + static_cast<int>(v.extent[1]); ++by)
            for (int bx = offset[0] / side; bx * side < offset[0] + static_cast<int>(v.extent[0]); ++bx)
                fill_brick(bx, by);
    });
}

} // namespace

fill_values::fill_values(target id, const solid_request& request, const body_map* bodies,
                         const std::function<std::array<std::uint8_t, 4>()>& mean)
    : bodies_(request.fill == solid_fill::body ? bodies : nullptr) {
    const std::uint32_t empty = info_of(id).empty;
    for (std::size_t at = 0; at < none_.size(); at += 4) std::memcpy(none_.data() + at, &empty, 4);
    if (is_color(id)) {
        rgba8 color{clay[0], clay[1], clay[2], 255};
        if (request.fill == solid_fill::color)
            color = {request.fill_color[0], request.fill_color[1], request.fill_color[2], 255};
        else if (request.fill == solid_fill::mean || (bodies_ != nullptr && bodies_->leaves_voxels()))
            color = mean();
        std::memcpy(none_.data(), color.data(), color.size());
    }
    if (bodies_ == nullptr || (!is_color(id) && id != target::material)) {
        bodies_ = nullptr;
        return;
    }
    for (const body& b : bodies_->values()) {
        auto& value = of_bodies_.emplace_back(none_);
        if (is_color(id))
            std::memcpy(value.data(), b.color.data(), b.color.size());
        else
            std::memcpy(value.data(), &b.material, sizeof(b.material));
    }
    if (!bodies_->is_everywhere()) return;
    none_ = of_bodies_.front();
    bodies_ = nullptr;
}

color_mean::color_mean() {
    const color_tables tables = make_color_tables();
    for (std::size_t byte = 0; byte < linear_.size(); ++byte)
        linear_[byte] =
            static_cast<std::uint64_t>(std::lround(linear_scale * static_cast<double>(tables.linear[byte])));
}

color_mean::rgba8 color_mean::mean_of(const sums& s) const {
    if (s[3] == 0) return {clay[0], clay[1], clay[2], 255};
    const color_tables tables = make_color_tables();
    rgba8 mean{0, 0, 0, 255};
    for (std::size_t a = 0; a < 3; ++a)
        mean[a] = encode_srgb(
            tables, static_cast<float>(static_cast<double>(s[a]) / (linear_scale * static_cast<double>(s[3]))));
    return mean;
}

const char* to_string(solid_rule rule) {
    constexpr const char* names[] = {"nonzero", "even_odd", "positive", "each_draw", "exterior"};
    return names[static_cast<std::size_t>(rule)];
}

const char* to_string(solid_extent extent) {
    constexpr const char* names[] = {"centre", "outer", "inner"};
    return names[static_cast<std::size_t>(extent)];
}

namespace {

// What helps an open model: each option has been tried on it.
std::string advice(const solid_request& request, const solid_counts& counts) {
    if (!counts.is_examined) return "No repair was tried on it";
    std::string helps = counts.lids_balance ? "--close-holes" : "";
    if (!helps.empty() && request.close_holes != 0) helps += " without a number";
    if (!helps.empty()) helps += " leaves no such row";
    const voxelpipe::flood_counters& flood = counts.flood;
    if (flood.lost_voxels == 0 ? flood.enclosed_voxels != 0 : flood.closing != 0)
        helps += (helps.empty() ? "" : ", and ") + std::string("--solid exterior") +
                 (flood.closing != 0 ? " --closing " + std::to_string(flood.closing) : "") +
                 " keeps what other rows have inside";
    return helps.empty() ? "No repair that was tried helps" : "Tried on it: " + helps;
}

} // namespace

std::string open_warning(const solid_request& request, const solid_counts& counts) {
    if (counts.open_rows == 0 || request.vote || request.rule == solid_rule::exterior) return {};
    std::array<char, 32> share{};
    std::snprintf(share.data(), share.size(), "%.3g",
                  100 * static_cast<double>(counts.open_rows) / static_cast<double>(counts.rows));
    const bool each = request.rule == solid_rule::each_draw;
    const std::string rows = std::to_string(counts.open_rows) + " of the " + std::to_string(counts.rows) +
                             " rows of voxels along x (" + share.data() + " %" +
                             (each ? ", counted for each draw" : "") +
                             ") do not leave it as often as they enter it, so voxels behind a hole may be wrong. ";
    const std::string lids = request.close_holes == 0 ? ""
                                                      : ", after lids on " + std::to_string(counts.closed_holes) +
                                                            " of its " + std::to_string(counts.holes) + " holes";
    return "the model is not closed" + lids + ": " + rows + advice(request, counts);
}

std::string flood_warning(const solid_request& request, const solid_counts& counts, std::uint64_t voxels) {
    if (request.rule != solid_rule::exterior || voxels == 0) return {};
    const bool is_empty = voxels == counts.touched;
    const voxelpipe::flood_counters& flood = counts.flood;
    const std::string nothing = "--solid exterior finds nothing enclosed: all its voxels are the surface's";
    if (flood.lost_voxels == 0) return is_empty ? nothing : "";
    std::string entry;
    if (flood.entered_holes != 0)
        entry = " by " + std::to_string(flood.entered_holes) + (flood.entered_holes == 1 ? " hole" : " holes") +
                " of the model, of up to " + std::to_string(flood.hole_width) + " voxels,";
    if (flood.face_voxels != 0)
        entry +=
            (entry.empty() ? " where" : " and where") +
            std::string(" the model leaves the grid (what it takes there it would not take in a grid that holds the "
                        "model),");
    const std::string text = (is_empty ? nothing + ". Its flood" : std::string("the flood of --solid exterior")) +
                             " came in" + (entry.empty() ? " where no hole was found" : entry) + " and took " +
                             std::to_string(flood.lost_voxels) + " voxels that rows of voxels have inside. ";
    std::string keeping = flood.close_holes != 0 ? "--solid nonzero --close-holes" : "";
    if (flood.closing != 0)
        keeping += (keeping.empty() ? "" : " or ") + std::string("--closing ") + std::to_string(flood.closing);
    return text + (keeping.empty() ? "No repair that was tried keeps them" : "Tried on it: " + keeping + " keeps them");
}

void fill_inside(volume& v, const channel& solid, const channel& surface, const solid_request& request,
                 const body_map* bodies, const std::array<int, 3>& offset, int threads) {
    threads = thread_count(threads);
    for (channel& c : v.channels) {
        const std::optional<target> id = target_named(c.name);
        if (!id || c.type == scalar::bit || *id == target::count) continue;
        const std::size_t bytes = size_of(c.type) * static_cast<std::size_t>(c.components);
        std::array<std::byte, 16> empty{};
        for (std::size_t at = 0; at + 4 <= bytes; at += 4) std::memcpy(empty.data() + at, &info_of(*id).empty, 4);
        const fill_values inside(*id, request, bodies, [&] { return mean_of(v, surface, c, threads); });
        if (request.fill == solid_fill::nearest && (is_color(*id) || *id == target::material)) {
            // They are there already.
        } else if (inside.is_one()) {
            set_voxels(v, solid, surface, c, inside.of(body_map::none), threads);
        } else {
            set_by_body(v, solid, surface, c, inside, offset, threads);
        }
        set_voxels(v, surface, solid, c, empty, threads);
    }
}

void copy_part(volume& v, channel& to, const std::vector<std::uint32_t>& bits, const std::array<int, 3>& extent,
               const std::array<int, 3>& offset) {
    const auto words = static_cast<std::size_t>((extent[0] + 31) / 32);
    for (std::int64_t k = 0; k < v.extent[2]; ++k)
        for (std::int64_t j = 0; j < v.extent[1]; ++j) {
            const std::uint32_t* const row =
                bits.data() + words * static_cast<std::size_t>((k + offset[2]) * extent[1] + j + offset[1]);
            for (std::int64_t w = 0; w < v.words_per_row(); ++w) {
                const std::int64_t first = 32 * w + offset[0];
                const auto at = static_cast<std::size_t>(first / 32);
                const std::uint64_t high = at + 1 < words ? row[at + 1] : 0;
                auto word = static_cast<std::uint32_t>((high << 32 | row[at]) >> (first % 32));
                const std::int64_t left = v.extent[0] - 32 * w;
                if (left < 32) word &= (std::uint32_t{1} << left) - 1;
                std::memcpy(to.data.data() + 4 * ((k * v.extent[1] + j) * v.words_per_row() + w), &word, 4);
            }
        }
}

void count_bits(volume& v, const channel& solid, int threads) {
    channel& counts = *v.find(info_of(target::count).name);
    parallel_for(static_cast<std::size_t>(v.extent[2]), thread_count(threads), [&](std::size_t layer) {
        const auto k = static_cast<std::int64_t>(layer);
        for (std::int64_t j = 0; j < v.extent[1]; ++j)
            for (std::int64_t i = 0; i < v.extent[0]; ++i) {
                const std::uint32_t count = v.bit(solid, i, j, k) ? 1 : 0;
                std::memcpy(counts.data.data() + 4 * static_cast<std::size_t>(v.index(i, j, k)), &count, 4);
            }
    });
}

} // namespace voxelize
