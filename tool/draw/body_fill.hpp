// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// --fill body: which body the voxels inside lie in. A body is a draw of the model (a mesh of a node, a group of an
// OBJ), or where the model is one draw whose colours differ, a connected part of it. A voxel belongs to the first one
// whose own winding number at the voxel's centre accepts it, by the rule in effect. Where a repair decides what is
// inside, each body's own holes are closed for that, and with --vote and --solid exterior, which have no rule for one
// body, it accepts by `nonzero`.

#include "body_colors.hpp"
#include "model/scene.hpp"
#include "model/sparse_volume.hpp"
#include "solid.hpp"
#include "surface.hpp"
#include "voxelizer.hpp"

#include <voxelpipe/core/brick_table.hpp>
#include <voxelpipe/solid/core/holes.hpp>

#include <glm/vec3.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <span>
#include <vector>

namespace voxelize {

// What the voxels inside a body get.
struct body {
    body_color color{};
    std::int32_t material = -1;
    friend bool operator==(const body&, const body&) = default;
};

// The bodies of a part of a model, whose draws say nothing of the whole: one for each draw, in their order.
struct known_bodies {
    std::vector<body> bodies;
    std::vector<voxelpipe::core::hole_cones> cones; // of each draw's own holes; empty if no hole is closed
};

// The most edges of a body's own hole that gets a lid when voxels are accepted; 0: no hole gets one.
[[nodiscard]] std::uint64_t lids_of_bodies(const solid_request& request);

// True if voxels inside may lie in no body: repairs make an inside of their own, and where masks discard colours the
// voxels that the surface touches are filled, too. Such voxels get the mean of the surface, and no material.
[[nodiscard]] bool leaves_voxels(const solid_request& solid, blend_alpha alpha, std::span<const material> materials);
// True if the mean of the surface's colours may be needed.
[[nodiscard]] bool needs_mean(const voxelize_request& request, std::span<const material> materials);

// True if --fill body shows in what is asked for.
[[nodiscard]] bool fills_bodies(const voxelize_request& request);
// The instance whose connected parts are bodies; null where draws are, or where nothing tells parts apart.
[[nodiscard]] const instance* instance_of_parts(const scene& model, const voxelize_request& request);

// Bodies by voxel in a part of the grid, as cubes of bricks.
class body_map {
public:
    static constexpr std::uint32_t none = ~std::uint32_t{0};
    // Bytes of a brick that a body's surface touches, in lists that grow.
    static constexpr double brick_bytes = 160;
    static constexpr std::size_t brick_voxels = voxelpipe::core::sparse_brick_voxels;
    using labels = std::array<std::uint32_t, brick_voxels>; // by the Morton order of voxels

    // The values of bodies, by their numbers.
    [[nodiscard]] const std::vector<body>& values() const { return values_; }
    // True if the first body is that of every voxel inside.
    [[nodiscard]] bool is_everywhere() const { return is_everywhere_; }
    // True if voxels inside may have no body.
    [[nodiscard]] bool leaves_voxels() const { return leaves_voxels_; }
    // The number that all voxels of a brick have; nothing where they differ, which `each` has then.
    [[nodiscard]] std::optional<std::uint32_t> of_brick(std::uint64_t key, labels& each) const;
    // The same volume, without channels, whose tiles have one value each: those of several bodies are cut into smaller
    // ones and bricks. Which bricks follows from the bodies alone. same(a, b): bodies of these numbers have one value.
    using same_values = std::function<bool(std::uint32_t, std::uint32_t)>;
    [[nodiscard]] sparse_volume with_whole_tiles(const sparse_volume& v, const same_values& same) const;

private:
    friend class model_bodies;
    struct cell {
        std::uint64_t key; // of its first brick
        std::uint32_t group;
    };
    struct partial {
        std::uint64_t key;
        std::uint32_t group;
        voxelpipe::brick_mask mask;
    };
    // The first group whose cells of this level or above hold the brick.
    [[nodiscard]] std::uint32_t group_over(std::uint64_t key, int level) const;
    // The number that all voxels of a cube have; nothing where they may differ.
    [[nodiscard]] std::optional<std::uint32_t> of_cube(std::uint64_t first, int level) const;
    void cut(voxelpipe::brick_tile tile, const same_values& same, sparse_volume& to,
             std::vector<std::uint32_t>& numbers) const;
    void add(const sparse_volume& voxels, std::uint32_t value);
    void sort();
    [[nodiscard]] std::uint32_t value_of(std::uint32_t group) const { return group == none ? none : groups_[group]; }

    std::vector<body> values_;
    std::vector<std::uint32_t> groups_;     // a value's number, by group: those of the first draws come first
    std::vector<std::vector<cell>> levels_; // cubes of 8^level bricks, by key; the first group of several
    std::vector<partial> partials_;         // bricks in part, by key and group
    bool is_everywhere_ = false, leaves_voxels_ = false;
};

// The values of a channel inside a solid where no triangle is.
class fill_values {
public:
    fill_values() = default; // of a channel that has none
    // bodies: null but with solid_fill::body, not owned. mean: the mean colour, which is asked for where it is needed.
    fill_values(target id, const solid_request& request, const body_map* bodies,
                const std::function<body_color()>& mean);

    // True if there is one value, of `none`.
    [[nodiscard]] bool is_one() const { return bodies_ == nullptr; }
    // Not null, unless there is one value.
    [[nodiscard]] const body_map* bodies() const { return bodies_; }
    [[nodiscard]] const std::array<std::byte, 16>& of(std::uint32_t number) const {
        return number == body_map::none || is_one() ? none_ : of_bodies_[number];
    }

private:
    const body_map* bodies_ = nullptr;
    std::array<std::byte, 16> none_{};
    std::vector<std::array<std::byte, 16>> of_bodies_;
};

// The bodies of a model that is drawn.
class model_bodies {
public:
    using draw = vp::draw<vp::mesh_view<>, instanced_vertex_shader, vp::constant_output<bool, std::uint32_t>>;

    // Takes what it needs of the scene but its triangles. Lists of those are copied for connected parts alone.
    model_bodies(const scene& model, const voxelize_request& request);
    model_bodies(const model_bodies&) = delete; // draws point into it
    model_bodies& operator=(const model_bodies&) = delete;

    // The model's draws in host memory, which last as long as this. One of the two is called.
    void take_draws(std::span<const draw> draws);
    // Makes the draws from the scene, whose lists last as long as this.
    void make_draws(const scene& model);

    // True if the first body is that of every voxel inside, so that none has to be found.
    [[nodiscard]] bool is_everywhere() const { return values_.size() == 1 && !leaves_voxels_; }
    // The bodies in PART, a grid that is relative to the request's reference point.
    [[nodiscard]] body_map find_in(const voxelpipe::grid& part) const;

private:
    // What the drawn vertices lie in; low > high where there are none.
    struct box {
        glm::dvec3 low{std::numeric_limits<double>::infinity()}, high{-std::numeric_limits<double>::infinity()};
    };
    // Draws of one body that follow each other, which are found at once.
    struct run {
        std::size_t first, end; // draws
        voxelpipe::grid part;   // that holds all voxels of theirs
        bool is_small;          // no work for several threads
    };
    void add_draw(const primitive& of, const placed_vertex_shader& place, bool mirrors);
    void measure(); // the boxes of draws_
    // Without those that have no voxel in PART.
    [[nodiscard]] std::vector<run> runs_in(const voxelpipe::grid& part) const;
    // Keys, masks and tiles of the voxels.
    [[nodiscard]] sparse_volume find(const run& bodies, int threads) const;

    const voxelize_request& request_;
    std::vector<body> values_;
    std::vector<std::uint32_t> numbers_; // of values, by draw
    bool leaves_voxels_ = false;
    std::vector<draw> draws_;
    std::vector<box> boxes_;                                  // of draws_
    std::vector<primitive> parts_;                            // connected parts in place of the draw
    std::vector<placed_vertex_shader> places_;                // of draws_ that are made here
    std::vector<std::vector<glm::uvec3>> mirrored_triangles_; // likewise
};

} // namespace voxelize
