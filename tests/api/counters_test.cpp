// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// status::counts over several draws and several blocks of triangles. Every field has a part in every block of 8192
// triangles, in other numbers each time: a block that is lost, counted twice or put in place of the sum shows. Most
// triangles are flat and lie along a row of voxels, so the expected numbers are known without a rasterizer. The oracle
// says which voxels the few larger ones cover, which a GPU draws by other kernels.

#include "api_model.hpp"

#include <gtest/gtest.h>

#include <array>
#include <limits>
#include <map>
#include <set>
#include <string>

namespace {

namespace vp = voxelpipe;
namespace blend = voxelpipe::blend;
using unit::backend_type;

const glm::ivec3 extent{130, 97, 70}; // 5 x 4 x 3 tiles of 32 voxels
constexpr std::uint32_t block = 8192; // triangles that one thread of cpu_backend sets up at a time

enum class kind { drawn, no_area, nonfinite, too_far, outside };

// Five draws. The shares of the kinds change from block to block; blocks count on through all draws.
class scene {
public:
    scene() {
        for (const std::uint32_t count : {block / 2 + 809, 0u, block + 77, 3u, block / 2 + 1500}) add_draw(count);
    }

    // keep(primitive, voxel): whether the fragment shader keeps the fragment.
    template <class Keep>
    [[nodiscard]] vp::counters expected(vp::coverage rule, Keep&& keep) const {
        const bool thin = rule == vp::coverage::thin;
        vp::counters c;
        std::set<std::size_t> occupied;
        for (std::uint32_t primitive = 0; primitive < kinds_.size(); ++primitive) {
            ++c.triangles_in;
            switch (kinds_[primitive]) {
            case kind::nonfinite:
                ++c.triangles_nonfinite;
                continue;
            case kind::too_far:
                ++c.triangles_too_far;
                continue;
            case kind::outside:
                ++c.triangles_outside;
                continue;
            case kind::no_area:
                if (thin) {
                    ++c.triangles_zero_area;
                    continue;
                }
                break;
            case kind::drawn:
                break;
            }
            ++c.triangles_drawn;
            const auto count_fragment = [&](glm::ivec3 voxel) {
                if (keep(primitive, voxel)) {
                    ++c.fragments;
                    occupied.insert(unit::linear(extent, voxel));
                } else {
                    ++c.fragments_discarded;
                }
            };
            const row& r = rows_[primitive];
            for (int i = 0; i < r.length; ++i) {
                glm::ivec3 voxel = r.first;
                voxel[r.axis] += i;
                count_fragment(voxel);
            }
            if (r.length != 0) continue;
            for (const glm::ivec3& voxel : large_.at(primitive)[thin ? 1 : 0]) count_fragment(voxel);
        }
        c.voxels = occupied.size();
        return c;
    }

    // Triangles of a kind in the block of the scene.
    [[nodiscard]] std::uint64_t count(kind k, std::size_t of_block) const {
        const std::size_t first = of_block * block, last = std::min(kinds_.size(), first + block);
        return static_cast<std::uint64_t>(std::count(kinds_.begin() + static_cast<std::ptrdiff_t>(first),
                                                     kinds_.begin() + static_cast<std::ptrdiff_t>(last), k));
    }
    [[nodiscard]] std::size_t num_blocks() const { return (kinds_.size() + block - 1) / block; }
    [[nodiscard]] const std::vector<unit::small_mesh>& meshes() const { return meshes_; }

private:
    struct row { // voxels that the triangle covers, by both rules
        glm::ivec3 first;
        int axis, length; // length 0: not along a row, see large_
    };
    using by_rule = std::array<std::vector<glm::ivec3>, 2>; // conservative, thin

    void add_draw(std::uint32_t count) {
        unit::small_mesh& m = meshes_.emplace_back();
        for (std::uint32_t i = 0; i < count; ++i) {
            const kind k = next_kind();
            const std::array<glm::vec3, 3> corners = make_triangle(k);
            const auto n = static_cast<std::uint32_t>(m.positions.size());
            m.positions.insert(m.positions.end(), corners.begin(), corners.end());
            m.triangles.emplace_back(n, n + 1, n + 2);
            kinds_.push_back(k);
        }
    }

    kind next_kind() {
        // Percent for each kind but the drawn.
        const std::uint64_t share = 5 + kinds_.size() / block, roll = random_.below(100);
        for (const kind k : {kind::no_area, kind::nonfinite, kind::too_far, kind::outside})
            if (roll < share * static_cast<std::uint64_t>(k)) return k;
        return kind::drawn;
    }

    std::array<glm::vec3, 3> make_triangle(kind k) {
        if ((k == kind::drawn || k == kind::no_area) && random_.one_in(150)) return make_large_triangle(k);
        row r{};
        r.axis = static_cast<int>(random_.below(3));
        r.length = static_cast<int>(random_.between(1, 9));
        for (int a = 0; a < 3; ++a)
            r.first[a] = static_cast<int>(random_.between(0, extent[a] - (a == r.axis ? r.length : 1)));
        rows_.push_back(r);
        // In the plane through the middle of the row's voxels, a quarter of a voxel from their faces.
        const int across = (r.axis + 1) % 3;
        glm::vec3 a = glm::vec3(r.first) + 0.5f;
        a[r.axis] -= 0.25f;
        glm::vec3 b = a, c = a;
        b[r.axis] += static_cast<float>(r.length) - 0.5f;
        if (k != kind::no_area) c[across] += 0.25f;
        const auto axis = static_cast<glm::length_t>(random_.below(3));
        if (k == kind::nonfinite) b[axis] = random_.one_in(2) ? std::numeric_limits<float>::quiet_NaN() : HUGE_VALF;
        if (k == kind::too_far) c[axis] = random_.one_in(2) ? 3e30f : -3e30f;
        if (k == kind::outside) {
            const float by = static_cast<float>((random_.one_in(2) ? 2 : -2) * extent[axis]);
            for (glm::vec3* const p : {&a, &b, &c}) (*p)[axis] += by;
        }
        return {a, b, c};
    }

    // Up to 40 voxels a side, in the grid.
    std::array<glm::vec3, 3> make_large_triangle(kind k) {
        std::array<glm::vec3, 3> corners{};
        for (int a = 0; a < 3; ++a) {
            const std::int64_t size = 8 * random_.between(2, 40), first = random_.between(0, 8 * extent[a] - size);
            for (glm::vec3& p : corners) p[a] = static_cast<float>(first + random_.between(0, size)) / 8;
        }
        if (k == kind::no_area) corners[2] = (corners[0] + corners[1]) / 2.0f; // exact
        unit::small_mesh one;
        one.positions.assign(corners.begin(), corners.end());
        one.triangles = {{0, 1, 2}};
        by_rule& voxels = large_[static_cast<std::uint32_t>(rows_.size())];
        for (const vp::coverage rule : {vp::coverage::conservative, vp::coverage::thin})
            for (const auto& f : unit::fragments_of(unit::unit_grid(extent), rule, {one}))
                voxels[rule == vp::coverage::thin ? 1 : 0].push_back(f.voxel);
        rows_.push_back({});
        return corners;
    }

    unit::splitmix64 random_{7};
    std::vector<unit::small_mesh> meshes_; // one a draw
    std::vector<kind> kinds_;              // by primitive, through all draws
    std::vector<row> rows_;
    std::map<std::uint32_t, by_rule> large_; // by primitive
};

const scene& shared_scene() {
    static const scene s;
    return s;
}

// The scene's meshes in the backend's memory, drawn by copies of one shader or by a shader each.
template <class Shader>
class draws_of {
public:
    using draw = vp::draw<vp::mesh_view<>, vp::passthrough, Shader>;
    template <class MakeShader>
    draws_of(backend_type& backend, const scene& s, MakeShader&& shader_of) {
        for (const unit::small_mesh& m : s.meshes()) meshes_.push_back(m.on(backend));
        for (std::size_t d = 0; d < meshes_.size(); ++d) draws_.push_back({meshes_[d].view(), {}, shader_of(d)});
    }
    [[nodiscard]] std::span<const draw> view() const { return draws_; }

private:
    std::vector<vp::mesh<backend_type>> meshes_;
    std::vector<draw> draws_;
};

#if defined(__CUDACC__)
constexpr unsigned numbers_of_threads[] = {0}; // not the caller's to choose
#else
constexpr unsigned numbers_of_threads[] = {1, 3, 8};
#endif

// Both rules, every number of threads.
template <class MakeOutput, class Draws, class Keep>
void expect_counts(Draws&& make_draws, MakeOutput&& make_output, Keep&& keep, bool count_voxels = true) {
    const scene& s = shared_scene();
    const vp::grid grid = unit::unit_grid(extent);
    for (const vp::coverage rule : {vp::coverage::conservative, vp::coverage::thin}) {
        vp::counters expected = s.expected(rule, keep);
        if (!count_voxels) expected.voxels = 0;
        for (const unsigned threads : numbers_of_threads) {
            backend_type backend = unit::make_backend(threads);
            const auto draws = make_draws(backend, s);
            auto out = make_output(backend);
            const vp::status result = vp::voxelize(backend, draws.view(), grid, out, {rule, count_voxels});
            ASSERT_TRUE(result.ok()) << result.message();
            const std::string where = std::string(rule == vp::coverage::thin ? "thin, " : "conservative, ") +
                                      std::to_string(threads) + " threads";
            EXPECT_EQ(result.counts.triangles_in, expected.triangles_in) << where;
            EXPECT_EQ(result.counts.triangles_nonfinite, expected.triangles_nonfinite) << where;
            EXPECT_EQ(result.counts.triangles_too_far, expected.triangles_too_far) << where;
            EXPECT_EQ(result.counts.triangles_zero_area, expected.triangles_zero_area) << where;
            EXPECT_EQ(result.counts.triangles_outside, expected.triangles_outside) << where;
            EXPECT_EQ(result.counts.triangles_drawn, expected.triangles_drawn) << where;
            EXPECT_EQ(result.counts.fragments, expected.fragments) << where;
            EXPECT_EQ(result.counts.fragments_discarded, expected.fragments_discarded) << where;
            EXPECT_EQ(result.counts.voxels, expected.voxels) << where;
            EXPECT_EQ(result.counts.triangles_dropped(), expected.triangles_nonfinite + expected.triangles_too_far);
        }
    }
}

VOXELPIPE_HD bool is_kept(std::uint32_t primitive, glm::ivec3 voxel) { return unit::mark(primitive, voxel) % 5 != 0; }

constexpr auto keep_all = [](std::uint32_t, glm::ivec3) { return true; };
constexpr auto keep_most = [](std::uint32_t primitive, glm::ivec3 voxel) { return is_kept(primitive, voxel); };

// The tests below rely on this: no two blocks are alike in any kind, so no block's count stands for another's or for
// the sum.
TEST(CountersScene, HasEveryKindInEveryBlockInOtherNumbers) {
    const scene& s = shared_scene();
    ASSERT_GE(s.num_blocks(), 3u);
    for (const kind k : {kind::drawn, kind::no_area, kind::nonfinite, kind::too_far, kind::outside}) {
        std::set<std::uint64_t> seen;
        for (std::size_t b = 0; b < s.num_blocks(); ++b) {
            EXPECT_GT(s.count(k, b), 20u);
            EXPECT_TRUE(seen.insert(s.count(k, b)).second) << "two blocks have as many";
        }
    }
    const vp::counters c = s.expected(vp::coverage::thin, keep_most);
    EXPECT_LT(c.voxels, c.fragments); // some voxels have several
    EXPECT_GT(c.fragments_discarded, 5'000u);
}

using bits = vp::framebuffer<backend_type, vp::target<vp::bit, blend::bit_or>>;
using sums = vp::framebuffer<backend_type, vp::target<std::uint32_t, blend::add>>;

TEST(Counters, AddUpOverBlocksAndDrawsOfAConstantBit) {
    expect_counts(
        [](auto& b, const scene& s) {
            return draws_of<decltype(vp::constant(true))>(b, s, [](std::size_t) { return vp::constant(true); });
        },
        [](auto& b) {
            return bits{b, extent};
        },
        keep_all);
}

TEST(Counters, AddUpOverBlocksAndDrawsOfAConstantSum) {
    using shader = decltype(vp::constant(1u));
    expect_counts(
        [](auto& b, const scene& s) { return draws_of<shader>(b, s, [](std::size_t) { return vp::constant(1u); }); },
        [](auto& b) {
            return sums{b, extent};
        },
        keep_all);
    // Draws that add different constants cannot share one count a voxel.
    expect_counts(
        [](auto& b, const scene& s) {
            return draws_of<shader>(b, s, [](std::size_t d) { return vp::constant(static_cast<std::uint32_t>(d)); });
        },
        [](auto& b) {
            return sums{b, extent};
        },
        keep_all);
}

struct keeps_most {
    VOXELPIPE_HD auto operator()(const vp::fragment<>& f) const {
        return vp::outputs(f.barycentric.x, f.primitive).discard_if(!is_kept(f.primitive, f.voxel));
    }
};
using computed = vp::framebuffer<backend_type, vp::target<float, blend::add>, vp::target<std::uint32_t, blend::max>>;

TEST(Counters, AddUpOverBlocksAndDrawsOfAShaderThatDiscards) {
    const auto draws = [](auto& b, const scene& s) {
        return draws_of<keeps_most>(b, s, [](std::size_t) { return keeps_most{}; });
    };
    for (const bool count_voxels : {true, false})
        expect_counts(
            draws,
            [](auto& b) {
                return computed{b, extent};
            },
            keep_most, count_voxels);
}

struct lists_most {
    VOXELPIPE_HD auto operator()(const vp::fragment<>& f) const {
        return vp::outputs(f.primitive).discard_if(!is_kept(f.primitive, f.voxel));
    }
};

TEST(Counters, AddUpOverBlocksAndDrawsOfAnABuffer) {
    expect_counts(
        [](auto& b, const scene& s) { return draws_of<lists_most>(b, s, [](std::size_t) { return lists_most{}; }); },
        [](auto& b) { return vp::abuffer<backend_type, std::uint32_t>{b}; }, keep_most);
}

// A call that fails says how many triangles it was given, wherever the bad one lies, and counts nothing else.
TEST(Counters, OfACallThatFailsAreTheTrianglesItWasGiven) {
    std::uint32_t total = 0;
    for (const unit::small_mesh& m : shared_scene().meshes()) total += static_cast<std::uint32_t>(m.triangles.size());
    for (const unsigned threads : numbers_of_threads)
        for (const std::size_t bad_draw : {std::size_t{0}, std::size_t{2}, std::size_t{4}}) {
            std::vector<unit::small_mesh> meshes = shared_scene().meshes();
            meshes[bad_draw].triangles.back().y = static_cast<std::uint32_t>(meshes[bad_draw].positions.size());
            backend_type backend = unit::make_backend(threads);
            std::vector<vp::mesh<backend_type>> on_backend;
            for (const unit::small_mesh& m : meshes) on_backend.push_back(m.on(backend));
            using draw = vp::draw<vp::mesh_view<>, vp::passthrough, lists_most>;
            std::vector<draw> draws;
            for (const auto& m : on_backend) draws.push_back({m.view(), {}, {}});
            vp::abuffer<backend_type, std::uint32_t> lists{backend};
            const vp::status s = vp::voxelize(backend, std::span<const draw>(draws), unit::unit_grid(extent), lists);
            EXPECT_EQ(s.code, vp::status_code::index_out_of_range);
            vp::counters expected;
            expected.triangles_in = total;
            EXPECT_EQ(s.counts, expected) << "bad triangle in draw " << bad_draw << ", " << threads << " threads";
        }
}

} // namespace
