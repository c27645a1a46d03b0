// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "oracle_samples.hpp"

#include "bit_digest.hpp"
#include "generated_meshes.hpp"
#include "oracle.hpp"

#include <algorithm>
#include <array>
#include <bit>

namespace scenes {

namespace {

struct sample {
    std::array<int, 3> at;
    bool set;     // in the bit grid
    bool covered; // by a triangle, according to the oracle
};

class bit_grid {
public:
    bit_grid(const std::vector<std::uint32_t>& words, glm::ivec3 extent)
        : words_(words), extent_(extent), row_(static_cast<std::size_t>((extent.x + 31) / 32)) {}
    [[nodiscard]] bool inside(const std::array<int, 3>& v) const {
        return v[0] >= 0 && v[1] >= 0 && v[2] >= 0 && v[0] < extent_.x && v[1] < extent_.y && v[2] < extent_.z;
    }
    [[nodiscard]] bool at(const std::array<int, 3>& v) const {
        const std::size_t word =
            (static_cast<std::size_t>(v[2]) * static_cast<std::size_t>(extent_.y) + static_cast<std::size_t>(v[1])) *
                row_ +
            static_cast<std::size_t>(v[0] / 32);
        return ((words_[word] >> (v[0] % 32)) & 1u) != 0;
    }
    [[nodiscard]] std::array<int, 3> position(std::size_t word, int bit) const {
        const auto ny = static_cast<std::size_t>(extent_.y);
        return {static_cast<int>(word % row_) * 32 + bit, static_cast<int>(word / row_ % ny),
                static_cast<int>(word / row_ / ny)};
    }

private:
    const std::vector<std::uint32_t>& words_;
    glm::ivec3 extent_;
    std::size_t row_;
};

// `count` set voxels, each chosen with the same probability.
std::vector<std::array<int, 3>> pick_set(const std::vector<std::uint32_t>& words, const bit_grid& bits, int count,
                                         bench::random_numbers& random) {
    std::vector<std::array<int, 3>> picks;
    const std::uint64_t total = count_bits(words);
    if (total == 0) return picks;
    std::vector<std::uint64_t> ranks;
    for (int i = 0; i < count; ++i) ranks.push_back(random.below(total));
    std::sort(ranks.begin(), ranks.end());
    ranks.erase(std::unique(ranks.begin(), ranks.end()), ranks.end());
    std::size_t next = 0;
    std::uint64_t before = 0;
    for (std::size_t w = 0; w < words.size() && next < ranks.size(); ++w) {
        const auto n = static_cast<std::uint64_t>(std::popcount(words[w]));
        for (; next < ranks.size() && ranks[next] < before + n; ++next) {
            std::uint32_t word = words[w];
            for (std::uint64_t skip = ranks[next] - before; skip > 0; --skip) word &= word - 1;
            picks.push_back(bits.position(w, std::countr_zero(word)));
        }
        before += n;
    }
    return picks;
}

std::vector<sample> pick_samples(const std::vector<std::uint32_t>& words, const bit_grid& bits, int count,
                                 bench::random_numbers& random) {
    std::vector<sample> samples;
    for (const auto& v : pick_set(words, bits, count, random)) samples.push_back({v, true, false});
    // Empty voxels are sampled next to set ones, where mistakes are likely.
    for (const auto& v : pick_set(words, bits, count, random))
        for (int attempt = 0; attempt < 12; ++attempt) {
            std::array<int, 3> n = v;
            for (int& c : n) c += static_cast<int>(random.below(3)) - 1;
            if (!bits.inside(n) || bits.at(n)) continue;
            samples.push_back({n, false, false});
            break;
        }
    return samples;
}

// True if the triangle gives a thin fragment in the voxel: the column's square meets the projection, and the floor of
// the plane's depth at the column's centre is this voxel. `lo` and `hi`: the voxels that its bounds touch.
bool covers_thin(const oracle::grid& g, int fraction, const oracle::snapped_triangle& t, const std::array<int, 3>& v,
                 const std::array<int, 3>& lo, const std::array<int, 3>& hi) {
    const int axis = oracle::dominant_axis(t);
    if (axis < 0) return false;
    const auto w = static_cast<std::size_t>(axis);
    // The search extends beyond the triangle only along that axis. Across it, a voxel outside the bounds is not
    // covered.
    for (std::size_t a = 0; a < 3; ++a)
        if (a != w && (v[a] < lo[a] || v[a] > hi[a])) return false;
    std::array<int, 3> from = v, to = {v[0] + 1, v[1] + 1, v[2] + 1};
    from[w] = lo[w]; // the whole triangle along the dominant axis
    to[w] = hi[w] + 1;
    if (!oracle::box_meets_triangle(fraction, t, from, to)) return false;
    const oracle::ratio depth = oracle::depth(g, t, {v[0], v[1], v[2]});
    return oracle::wide::floor_divide(depth.numerator, depth.denominator) == oracle::wide(v[w]);
}

} // namespace

sample_result check_with_oracle(const bench::mesh_data& mesh, const voxelpipe::grid& grid, voxelpipe::coverage rule,
                                const std::vector<std::uint32_t>& words, int count, std::uint64_t seed) {
    bench::random_numbers random(seed);
    const bit_grid bits(words, grid.extent);
    std::vector<sample> samples = pick_samples(words, bits, count, random);

    oracle::grid g{};
    for (int a = 0; a < 3; ++a) {
        g.origin[a] = grid.origin[a];
        g.voxel_size[a] = grid.voxel_size[a];
        g.extent[a] = grid.extent[a];
    }
    const int fraction = oracle::fraction_bits(g);

    // Samples are sorted into cells of 4^3 voxels, larger in large grids, so that a triangle is compared only with near
    // ones.
    const auto cells_of = [&](int log2) { return (grid.extent + ((1 << log2) - 1)) >> log2; };
    int log2_cell = 2;
    for (glm::ivec3 n = cells_of(log2_cell); n.x * n.y > (1 << 18) / n.z; n = cells_of(log2_cell)) ++log2_cell;
    const glm::ivec3 cells = cells_of(log2_cell);
    std::vector<std::vector<std::uint32_t>> cell(static_cast<std::size_t>(cells.x * cells.y * cells.z));
    const auto cell_index = [&](int x, int y, int z) {
        return static_cast<std::size_t>((z * cells.y + y) * cells.x + x);
    };
    for (std::uint32_t i = 0; i < samples.size(); ++i) {
        const auto& v = samples[i].at;
        cell[cell_index(v[0] >> log2_cell, v[1] >> log2_cell, v[2] >> log2_cell)].push_back(i);
    }

    for (const glm::uvec3& triangle : mesh.triangles) {
        float p[3][3];
        for (int k = 0; k < 3; ++k)
            for (int a = 0; a < 3; ++a) p[k][a] = mesh.positions[triangle[k]][a];
        const oracle::snapped_triangle t = oracle::snap(g, p);
        if (t.dropped) continue;
        // Only voxels whose closed boxes touch the triangle's closed bounds can be covered. This test saves most exact
        // ones in a mesh with hundreds of triangles in a voxel. A thin fragment may lie at most one voxel beyond the
        // bounds; two are searched.
        const int margin = rule == voxelpipe::coverage::thin ? 2 : 0;
        std::array<int, 3> lo{}, hi{};
        bool outside = false;
        for (std::size_t a = 0; a < 3; ++a) {
            const std::int64_t low = (std::min({t.v[0][a], t.v[1][a], t.v[2][a]}) - 1) >> fraction; // ceil - 1
            const std::int64_t high = std::max({t.v[0][a], t.v[1][a], t.v[2][a]}) >> fraction;
            outside = outside || high < -1 || low > g.extent[a];
            lo[a] = static_cast<int>(std::clamp<std::int64_t>(low, -(1 << 29), 1 << 29));
            hi[a] = static_cast<int>(std::clamp<std::int64_t>(high, -(1 << 29), 1 << 29));
        }
        if (outside) continue;
        const auto low = [&](std::size_t a) { return std::max(lo[a] - margin, 0) >> log2_cell; };
        const auto high = [&](std::size_t a) { return std::min(hi[a] + margin, g.extent[a] - 1) >> log2_cell; };
        for (int z = low(2); z <= high(2); ++z)
            for (int y = low(1); y <= high(1); ++y)
                for (int x = low(0); x <= high(0); ++x)
                    for (const std::uint32_t i : cell[cell_index(x, y, z)]) {
                        sample& s = samples[i];
                        const auto& v = s.at;
                        if (s.covered || v[0] < lo[0] - margin || v[1] < lo[1] - margin || v[2] < lo[2] - margin ||
                            v[0] > hi[0] + margin || v[1] > hi[1] + margin || v[2] > hi[2] + margin)
                            continue;
                        s.covered = rule == voxelpipe::coverage::thin
                                        ? covers_thin(g, fraction, t, v, lo, hi)
                                        : oracle::covers_conservative(g, t, v[0], v[1], v[2]);
                    }
    }

    sample_result result;
    for (const sample& s : samples) {
        ++(s.set ? result.set : result.empty);
        if (s.set != s.covered && result.mistakes.size() < 20)
            result.mistakes.push_back(
                "voxel " + std::to_string(s.at[0]) + " " + std::to_string(s.at[1]) + " " + std::to_string(s.at[2]) +
                (s.set ? " is set, but no triangle covers it" : " is empty, but a triangle covers it"));
    }
    return result;
}

} // namespace scenes
