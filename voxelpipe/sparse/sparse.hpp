// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// sparse_framebuffer takes the place of a framebuffer: made dense, it equals that bit for bit, but its memory is in
// proportion to the voxels that are drawn. Bricks of 8^3 voxels (core/brick_table.hpp), aligned with the whole grid,
// hold a mask of the voxels that exist; their values lie in the Morton order of the voxels, one array a target. The
// same input gives the same bytes.

#include <voxelpipe/solid/solid.hpp>
#include <voxelpipe/sparse/brick_lookup.hpp>
#include <voxelpipe/sparse/host_sparse.hpp>
#include <voxelpipe/sparse/sparse_merge.hpp>

#include <bitset>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <utility>

namespace voxelpipe {

// The most that a call may make of a sparse framebuffer; a call that needs more changes nothing and returns
// capacity_exceeded, with the numbers that it needs in status::required.
struct sparse_limits {
    std::uint64_t bricks = std::numeric_limits<std::uint64_t>::max(); // of 8 x 8 x 8 voxels, and tiles
    std::uint64_t voxels = std::numeric_limits<std::uint64_t>::max(); // that exist in bricks, and one a tile
};

// What calls are to do with one target.
template <class Target>
struct sparse_target {
    load_operation load = load_operation::clear; // what a voxel starts from
    bool enabled = true;                         // false: no memory
    bool keeps_sums = false;                     // keeps reproducible sums open for later calls
    typename Target::value_type clear_value = Target::traits::identity(); // what absent voxels read as
};

// The arrays of a sparse framebuffer in the memory of a backend.
template <class Backend, class... Targets>
struct sparse_contents {
    // The backend's memory.
    template <class T>
    using buffer = typename Backend::template buffer<T>;

    // Empty.
    explicit sparse_contents(Backend& backend)
        : keys(backend, 0), masks(backend, 0), offsets(backend, 0), tiles(backend, 0),
          values(core::make_pack(buffer<typename core::rank_map<Targets>::element>(backend, 0)...)),
          sums(core::make_pack(buffer<core::kept_sum<Targets>>(backend, 0)...)) {}

    buffer<std::uint64_t> keys;    // Morton keys of bricks, ascending
    buffer<brick_mask> masks;      // one per brick
    buffer<std::uint64_t> offsets; // one more than bricks; empty where there are none
    buffer<brick_tile> tiles;      // ascending
    std::uint64_t num_voxels = 0;  // that exist in bricks
    std::uint64_t tile_voxels = 0; // in tiles
    bool is_tiled = false;         // as host_sparse's
    core::pack<buffer<typename core::rank_map<Targets>::element>...> values; // empty for disabled targets
    core::pack<buffer<core::kept_sum<Targets>>...> sums;                     // empty where they are not kept

    // Ranks: a value of each target.
    [[nodiscard]] std::uint64_t num_values() const { return num_voxels + tiles.size(); }
    // Names the arrays.
    [[nodiscard]] brick_table table(const glm::ivec3& extent, const glm::ivec3& offset) const {
        return {keys.data(), masks.data(), offsets.data(), keys.size(), extent, offset, tiles.data(), tiles.size()};
    }
};

// Reads a sparse framebuffer where it lies: in device code, or on the host for a backend that runs there.
template <class... Targets>
struct sparse_view {
    brick_table table;                                                      // names the bricks
    core::pack<const typename core::rank_map<Targets>::element*...> values; // by rank; null for disabled targets
    core::pack<typename Targets::value_type...> clear_values;               // what absent voxels read as

    // Target I of a voxel of the part: the clear value, where it does not exist. The target is not disabled.
    template <std::size_t I>
    [[nodiscard]] VOXELPIPE_HD auto read(const glm::ivec3& voxel) const {
        using map = core::rank_map<typename core::pack_element<I, Targets...>::type>;
        const std::uint64_t rank = table.find(voxel);
        return rank == brick_table::none ? get<I>(clear_values) : map::load(get<I>(values), rank);
    }
};

// Owns its bricks and values on `Backend`; each call makes them as many as they must be. Empty before the first call;
// after one that failed it is as it was. New arrays are made before the old ones go.
// A call that clears all targets leaves the voxels that keep a fragment. Where a target loads, or is off, the voxels
// that exist stay, and new ones start from the clear value.
// The inside of a solid whose shader is constant becomes tiles (voxelize_solid). A later call that loads makes bricks
// of the parts of tiles that it draws in.
template <class Backend, class... Targets>
class sparse_framebuffer {
    static_assert(sizeof...(Targets) >= 1, "voxelpipe: a framebuffer needs at least one render target");
    static_assert(sizeof...(Targets) <= 8, "voxelpipe: a framebuffer takes at most 8 render targets in one pass");

public:
    using contents_type = sparse_contents<Backend, Targets...>;    // its arrays
    static constexpr std::size_t num_targets = sizeof...(Targets); // render targets

    // `enabled`: targets that are not start as load_operation::off and get no memory. Allocates nothing.
    sparse_framebuffer(Backend& backend, glm::ivec3 extent,
                       std::bitset<sizeof...(Targets)> enabled = ~std::bitset<sizeof...(Targets)>{})
        : contents_(backend) {
        where_.extent = extent;
        core::for_each_index<sizeof...(Targets)>([&]<std::size_t I>() {
            auto& t = get<I>(targets_);
            t.enabled = enabled[I];
            if (!t.enabled) t.load = load_operation::off;
        });
    }

    [[nodiscard]] glm::ivec3 extent() const { return where_.extent; } // Voxels, as the grid's.
    // The grid of the last call; only its extent means something before the first.
    [[nodiscard]] const grid& where() const { return where_; }
    [[nodiscard]] std::uint64_t num_bricks() const { return contents_.keys.size(); } // Bricks with a voxel.
    [[nodiscard]] std::uint64_t num_tiles() const { return contents_.tiles.size(); } // Cubes of full bricks, of solids.
    // Voxels that exist, those of tiles among them.
    [[nodiscard]] std::uint64_t num_voxels() const { return contents_.num_voxels + contents_.tile_voxels; }
    // Values of a target: one for each voxel that exists in a brick, and one for each tile.
    [[nodiscard]] std::uint64_t num_values() const { return contents_.num_values(); }
    // Bytes that bricks, tiles, values and kept sums take.
    [[nodiscard]] std::uint64_t num_bytes() const {
        std::uint64_t bytes = num_bricks() * (sizeof(std::uint64_t) + sizeof(brick_mask)) +
                              contents_.offsets.size() * sizeof(std::uint64_t) + num_tiles() * sizeof(brick_tile);
        core::for_each_index<sizeof...(Targets)>([&]<std::size_t I>() {
            using target = typename core::pack_element<I, Targets...>::type;
            bytes += get<I>(contents_.values).size() * sizeof(typename core::rank_map<target>::element) +
                     get<I>(contents_.sums).size() * sizeof(core::kept_sum<target>);
        });
        return bytes;
    }
    void limit(const sparse_limits& limits) { limits_ = limits; }         // Bounds later calls.
    [[nodiscard]] const sparse_limits& limits() const { return limits_; } // As set; without bounds by default.

    // True if the voxels' sums are kept in the format in which their blend adds, from the next call on; only targets
    // that sum floats (blend::add, add_quantum) or saturate signed integers have any. An octree rounds a parent's sum
    // once then. What the clear value adds is not among them.
    template <std::size_t I>
    void keep_sums(bool keep = true) {
        static_assert(core::has_wide_sums<typename core::pack_element<I, Targets...>::type>,
                      "voxelpipe: this target's blend keeps no sums");
        get<I>(targets_).keeps_sums = keep;
    }

    // Valid until the next call.
    [[nodiscard]] sparse_view<Targets...> view() const {
        sparse_view<Targets...> v{contents_.table(where_.extent, where_.offset), {}, background_};
        core::for_each_index<sizeof...(Targets)>(
            [&]<std::size_t I>() { get<I>(v.values) = get<I>(contents_.values).data(); });
        return v;
    }

    // Copies everything, then waits.
    [[nodiscard]] host_sparse<Targets...> to_host(Backend& backend) const {
        host_sparse<Targets...> h = bricks_to_host(backend);
        core::for_each_index<sizeof...(Targets)>([&]<std::size_t I>() {
            get<I>(h.values) = get<I>(contents_.values).to_host(backend);
            get<I>(h.sums) = get<I>(contents_.sums).to_host(backend);
        });
        return h;
    }

    // For backends.
    [[nodiscard]] const contents_type& contents() const { return contents_; }
    // What the next call does with each target.
    [[nodiscard]] const core::pack<sparse_target<Targets>...>& targets() const { return targets_; }
    // What absent voxels read as after the next call.
    [[nodiscard]] core::pack<typename Targets::value_type...> next_background() const {
        auto values = background_;
        core::for_each_index<sizeof...(Targets)>([&]<std::size_t I>() {
            const auto& t = get<I>(targets_);
            if (t.load == load_operation::clear) get<I>(values) = t.clear_value;
        });
        return values;
    }
    // For backends: replaces the contents by those of a finished call.
    void take(contents_type&& contents, const grid& where) {
        background_ = next_background();
        contents_ = std::move(contents);
        where_ = where;
    }

    // One target of a sparse framebuffer that cannot be changed: vp::get<I>(fb) of a const fb.
    template <std::size_t I>
    class const_reference {
    public:
        using target_type = typename core::pack_element<I, Targets...>::type; // the target's type
        // Refers to the framebuffer.
        explicit const_reference(const sparse_framebuffer& owner) : owner_(owner) {}

        // The dense target, as a dense framebuffer gives it. Throws std::length_error where it cannot be addressed.
        [[nodiscard]] host_target<target_type> to_host_target(Backend& backend) const {
            return get<I>(copy(backend)).to_dense();
        }
        // The dense part [begin, begin + size), addressed by the voxels of the whole. Copies the sparse target as a
        // whole. Throws std::out_of_range if the part is not within the extent.
        [[nodiscard]] host_region<target_type> to_host_region(Backend& backend, glm::ivec3 begin,
                                                              glm::ivec3 size) const {
            return get<I>(copy(backend)).to_dense_region(begin, size);
        }

    private:
        [[nodiscard]] host_sparse<Targets...> copy(Backend& backend) const {
            host_sparse<Targets...> h = owner_.bricks_to_host(backend);
            get<I>(h.values) = get<I>(owner_.contents_.values).to_host(backend);
            return h;
        }
        const sparse_framebuffer& owner_;
    };

    // One target of the framebuffer: vp::get<I>(fb).
    template <std::size_t I>
    class reference : public const_reference<I> {
    public:
        using target_type = typename core::pack_element<I, Targets...>::type; // the target's type
        explicit reference(sparse_framebuffer& owner) : const_reference<I>(owner), target_(get<I>(owner.targets_)) {}

        // Before the next voxelize: every voxel is `value`, which blends like a first fragment's.
        void clear(const typename target_type::value_type& value) {
            target_.load = load_operation::clear;
            target_.clear_value = value;
        }
        // Blend onto what the voxels hold.
        void load() { target_.load = load_operation::load; }
        // Take no part in the next voxelize; voxels keep their values.
        void off() { target_.load = load_operation::off; }

    private:
        sparse_target<target_type>& target_;
    };

private:
    [[nodiscard]] host_sparse<Targets...> bricks_to_host(Backend& backend) const {
        host_sparse<Targets...> h;
        h.keys = contents_.keys.to_host(backend);
        h.masks = contents_.masks.to_host(backend);
        h.offsets = contents_.offsets.to_host(backend);
        h.tiles = contents_.tiles.to_host(backend);
        h.clear_values = background_;
        h.where = where_;
        h.is_tiled = contents_.is_tiled;
        return h;
    }

    contents_type contents_;
    core::pack<sparse_target<Targets>...> targets_;
    core::pack<typename Targets::value_type...> background_ = core::make_pack(Targets::traits::identity()...);
    grid where_;
    sparse_limits limits_;
};

template <std::size_t I, class Backend, class... Targets>
[[nodiscard]] auto get(sparse_framebuffer<Backend, Targets...>& fb) {
    return typename sparse_framebuffer<Backend, Targets...>::template reference<I>(fb);
}
template <std::size_t I, class Backend, class... Targets>
[[nodiscard]] auto get(const sparse_framebuffer<Backend, Targets...>& fb) {
    return typename sparse_framebuffer<Backend, Targets...>::template const_reference<I>(fb);
}

namespace core {

// Names of the calls that a backend implements for this module, as run_module(tag, backend, ...), which
// argument-dependent lookup finds by the tag.
struct sparse_tag {}; // voxelize and voxelize_solid: draws, grid, framebuffer, options, triangles (and the coverage)
struct clear_sparse_tag {}; // voxelize of nothing: grid, framebuffer
struct store_sparse_tag {}; // lists with all outputs become the contents: grid, lists, framebuffer, status of the call

// Adds one wide sum to another, component by component where it is of a vector.
template <class Sum>
VOXELPIPE_HD void add_sums(Sum& a, const Sum& b) {
    if constexpr (requires { add_sum(a, b); }) {
        add_sum(a, b);
    } else {
        constexpr int n = static_cast<int>(sizeof(a.c) / sizeof(a.c[0])); // NOLINT(bugprone-sizeof-expression)
        for (int i = 0; i < n; ++i) add_sum(a.c[i], b.c[i]);
    }
}

// True if voxels that exist stay: some target keeps what it holds.
template <class Backend, class... Targets>
[[nodiscard]] bool keeps_voxels(const sparse_framebuffer<Backend, Targets...>& fb) {
    bool keeps = false;
    for_each_index<sizeof...(Targets)>([&]<std::size_t I>() {
        const auto& t = voxelpipe::get<I>(fb.targets());
        keeps = keeps || (t.enabled && t.load != load_operation::clear);
    });
    return keeps && fb.num_voxels() != 0;
}

template <class Backend, class... Targets>
[[nodiscard]] status validate_sparse(const sparse_framebuffer<Backend, Targets...>& fb, const grid& g) {
    if (fb.extent() != g.extent) return failure(status_code::extent_mismatch);
    status_code code = status_code::ok;
    for_each_index<sizeof...(Targets)>([&]<std::size_t I>() {
        const auto& t = voxelpipe::get<I>(fb.targets());
        if (!t.enabled && t.load != load_operation::off) code = status_code::null_view;
    });
    if (code != status_code::ok) return failure(code);
    // Bricks that stay have the keys of the grid that they were drawn in.
    if (keeps_voxels(fb) && (fb.where().offset != g.offset || fb.where().whole_extent() != g.whole_extent()))
        return failure(status_code::extent_mismatch);
    return {};
}

} // namespace core

// As for a framebuffer: the targets that are to be cleared hold their clear values. Where none is kept, no voxel is
// left.
template <class Backend, class... Targets>
[[nodiscard]] status clear(Backend& backend, sparse_framebuffer<Backend, Targets...>& fb) {
    if (const status s = validate(fb.where()); !s.ok()) return s;
    if (const status s = core::validate_sparse(fb, fb.where()); !s.ok()) return s;
    return run_module(core::clear_sparse_tag{}, backend, fb.where(), fb);
}

// Draws meshes into a sparse framebuffer: as into a framebuffer, with the same counts. A target that loads needs the
// grid of the call before (extent_mismatch otherwise): parts drawn apart are joined by merge().
template <coverage... Known, class Backend, core::triangle_mesh Mesh, class VertexShader, class FragmentShader,
          class... Targets>
[[nodiscard]] status voxelize(Backend& backend, std::span<const draw<Mesh, VertexShader, FragmentShader>> draws,
                              const grid& g, sparse_framebuffer<Backend, Targets...>& fb,
                              voxelize_options options = {}) {
    if constexpr (core::shaders_fit_targets<Mesh, VertexShader, FragmentShader, Targets...>()) {
        if (const status s = validate(g); !s.ok()) return s;
        if (const status s = core::validate_sparse(fb, g); !s.ok()) return s;
        const status s = core::validate_draws(draws);
        if (!s.ok()) return s;
        if (s.counts.triangles_in == 0) return run_module(core::clear_sparse_tag{}, backend, g, fb);
        core::known_coverage<Known...>::set(options);
        return core::name_bad_triangle(backend, draws,
                                       run_module(core::sparse_tag{}, backend, draws, g, fb, options,
                                                  s.counts.triangles_in, core::known_coverage<Known...>{}));
    } else {
        return {}; // does not compile: a static_assert has said why
    }
}

// Draws the inside of meshes into a sparse framebuffer: as into a framebuffer, with the same counts. Where the shader
// is vp::constant, all targets are cleared, no sums are kept and a voxel's value is the same however many bodies it
// lies in (bodies::call, a single draw, or blends that a repetition does not change), bricks that are wholly inside
// become tiles: the largest cubes of 8^n of them, aligned with the whole grid. Memory and time are in proportion to the
// surface then. Otherwise every voxel inside is kept: in proportion to the volume.
template <class Backend, class Mesh, class VertexShader, class SolidShader, class... Targets>
[[nodiscard]] status voxelize_solid(Backend& backend, std::span<const draw<Mesh, VertexShader, SolidShader>> draws,
                                    const grid& g, sparse_framebuffer<Backend, Targets...>& fb,
                                    const solid_options& options = {}) {
    if constexpr (core::solid_fits_targets<Mesh, VertexShader, SolidShader, Targets...>()) {
        if (const status s = validate(g); !s.ok()) return s;
        if (const status s = core::validate(options, g, core::takes_solid_slabs<Backend>); !s.ok()) return s;
        if (const status s = core::validate_sparse(fb, g); !s.ok()) return s;
        const status s = core::validate_draws(draws);
        if (!s.ok()) return s;
        if (s.counts.triangles_in == 0) return run_module(core::clear_sparse_tag{}, backend, g, fb);
        return core::name_bad_triangle(
            backend, draws, run_module(core::sparse_tag{}, backend, draws, g, fb, options, s.counts.triangles_in));
    } else {
        return {}; // does not compile: a static_assert has said why
    }
}

} // namespace voxelpipe
