// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "brick_need.hpp"

#include "model/memory.hpp"
#include "model/parallel.hpp"
#include "model/targets.hpp"

#include <algorithm>
#include <cmath>
#include <string>

namespace voxelize {

namespace {

constexpr int brick_side = 8, tile_side = 32;

// Bytes of a brick: in a volume; in it and in the parts that it is joined of, with the places of these; once the parts
// have none but the offsets of their values.
constexpr double held_brick = 80, joined_brick = 176, joined_offsets = 104;
// Bytes of a brick in a list of those that a thread has found, and in the framebuffer's arrays.
constexpr double listed_brick = 152;
// Bytes of each thread for the tile that it draws, whose sums are wider than their targets.
constexpr double thread_bytes = 1 << 20, tile_voxels = 32768, tile_sums = 2.5;
// Voxels of a surface in the tiles whose values each thread collects at once.
constexpr double list_voxels = 32 * 1200, list_growth = 1.5;

// With what lists take beyond what they hold, and what the heap keeps.
double with_lists(double need) {
    constexpr double more = 1.03, least_more = 2 << 20;
    return more * need + least_more;
}

} // namespace

surface_layers::surface_layers(const voxelpipe::grid& part)
    : first_(part.offset.z % tile_side), depth_(part.extent.z),
      layers_(static_cast<std::size_t>((part.extent.z + first_ + tile_side - 1) / tile_side)) {}

// Evenly between two heights.
void surface_layers::add(double voxels, double low, double high) {
    ++primitives_;
    if (!std::isfinite(voxels) || high < 0 || low > depth_) return;
    const double height = high - low;
    if (height > 0) voxels *= (std::min(high, depth_) - std::max(low, 0.0)) / height;
    voxels_ += voxels;
    const auto layer = [&](double z) {
        return std::min(layers_.size() - 1,
                        static_cast<std::size_t>((std::clamp(z, 0.0, depth_) + first_) / tile_side));
    };
    const std::size_t begin = layer(low), end = layer(high);
    if (begin == end) {
        layers_[begin] += voxels;
        return;
    }
    const double inside = std::min(high, depth_) - std::max(low, 0.0);
    for (std::size_t n = begin; n <= end; ++n) {
        const double bottom = static_cast<double>(n) * tile_side - first_;
        const double shared = std::min({high, depth_, bottom + tile_side}) - std::max({low, 0.0, bottom});
        layers_[n] += voxels * std::max(shared, 0.0) / inside;
    }
}

void surface_layers::add_triangle(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c) {
    const glm::dvec3 u = b - a, v = c - a;
    const glm::dvec3 across{u.y * v.z - u.z * v.y, u.z * v.x - u.x * v.z, u.x * v.y - u.y * v.x};
    const double volume = (a.x * across.x + a.y * across.y + a.z * across.z) / 6;
    if (std::isfinite(volume)) volume_ += volume;
    add((std::abs(across.x) + std::abs(across.y) + std::abs(across.z)) / 2, std::min({a.z, b.z, c.z}),
        std::max({a.z, b.z, c.z}));
}

void surface_layers::add(const surface_layers& other) {
    for (std::size_t n = 0; n < layers_.size(); ++n) layers_[n] += other.layers_[n];
    voxels_ += other.voxels_;
    volume_ += other.volume_;
    primitives_ += other.primitives_;
}

void surface_layers::add_line(const glm::dvec3& a, const glm::dvec3& b) {
    add(1 + std::abs(b.x - a.x) + std::abs(b.y - a.y) + std::abs(b.z - a.z), std::min(a.z, b.z), std::max(a.z, b.z));
}

value_sizes value_sizes_of(const voxelize_request& request, double targets) {
    value_sizes bytes{targets, 0, 0, 0};
    for (const target id : request.targets) {
        const double value = static_cast<double>(size_of(info_of(id).type)) * info_of(id).components;
        bytes.values += value;
        bytes.largest = std::max(bytes.largest, value);
    }
    return bytes;
}

brick_counts at_most(const surface_layers& surface) {
    // Whatever lies alone touches a voxel and a brick, and up to seven more at their corners.
    const double alone = 8 * surface.primitives();
    return {2 * surface.voxels() / (brick_side * brick_side) + alone, 1.2 * surface.voxels() + alone};
}

double needed_bytes(const voxelize_request& request, const surface_layers& surface, const brick_counts& counts,
                    const value_sizes& bytes) {
    const auto [bricks, voxels] = counts;
    double written_voxels = voxels;
    const double found = list_growth * bytes.targets * std::min(voxels, list_voxels);
    const double threads =
        thread_count(request.threads) * (thread_bytes + tile_voxels * (tile_sums * bytes.targets + 8) + found);
    // One layer of tiles after the other, on top of those that are there.
    double drawn = 0, held = 0;
    for (const double layer : surface.layers()) {
        const double share = surface.voxels() > 0 ? layer / surface.voxels() : 0;
        const double b = share * bricks, v = share * voxels;
        drawn = std::max(drawn, held + std::max(listed_brick * b + 2 * bytes.targets * v,
                                                drawn_brick_bytes * b + (bytes.targets + bytes.values) * v));
        held += held_brick * b + bytes.values * v;
    }
    double need = threads + drawn;
    if (surface.layers().size() > 1)
        need = std::max({need, joined_brick * bricks + bytes.values * voxels,
                         joined_offsets * bricks + (bytes.values + bytes.largest) * voxels});
    if (request.solid) {
        // Half of each brick of the surface is inside, and the rest is tiles. They are drawn while the surface is held.
        constexpr double half_a_brick = 256;
        written_voxels = half_a_brick * bricks;
        need = std::max(need, threads + held + (listed_brick + held_brick) * bricks + bytes.values * written_voxels);
        // The bodies are found where the solid lies in the framebuffer and in the result. They may share bricks.
        const double of_bodies = bytes.bodies * std::max(bricks, surface.voxels() / (brick_side * brick_side));
        need = std::max(need, held + 2 * held_brick * bricks + of_bodies + bytes.values * written_voxels);
    }
    const double result = held_brick * bricks + bytes.values * written_voxels;
    const double in_tiles = request.solid ? std::max(0.0, std::abs(surface.volume()) - written_voxels) : 0;
    if (request.write_bytes) need = std::max(need, result + request.write_bytes(bricks, written_voxels, in_tiles));
    return with_lists(need);
}

namespace {

// What is drawn, and what is there to be written.
struct drawn_cells {
    double drawn = 0, result = 0; // bytes
    double bricks = 0, voxels = 0, in_tiles = 0;
};

// Rows of the voxels that a link is crossed of, which lie on both sides of the surface. A voxel that this touches has
// as many crossings as where it is a plane across an axis, at most.
drawn_cells drawn_links(const voxelize_request& request, const brick_counts& counts) {
    constexpr double listed = 24, found = 20;              // of a crossing: while they are sorted, and then
    constexpr double voxel = 12, link = 12, place = 20;    // of the library's rows, and while these are put in order
    constexpr double sides = 2.2, bricks = 1.5, value = 4; // of the result
    const double links = request.neighbours, crossings = (request.neighbours == 18 ? 10 : 18) * counts.voxels;
    drawn_cells cells{0, 0, bricks * counts.bricks, sides * counts.voxels, 0};
    const double rows = (voxel + link * links) * cells.voxels;
    cells.result =
        held_brick * cells.bricks + value * links * static_cast<double>(request.targets.size()) * cells.voxels;
    cells.drawn = std::max({listed * crossings, found * crossings + rows, rows + place * cells.voxels + cells.result});
    return cells;
}

// Half of each brick of the surface is inside, and the rest is tiles.
drawn_cells drawn_fractions(const voxelize_request& request, const surface_layers& surface,
                            const brick_counts& counts) {
    constexpr double half_a_brick = 256, run = 28, runs_of_voxel = 1.5;
    const bool has_area = request.wants(target::area), has_centroid = request.wants(target::centroid);
    // A triangle meets voxels by its area, by its edges and by itself.
    const double triangles = surface.primitives();
    const double pairs = surface.voxels() + 2 * std::sqrt(surface.voxels() * triangles) + triangles;
    const bool measures = has_area || has_centroid;
    const double sorted = (measures ? 208 : 64) * pairs, listed = (measures ? 104 : 34) * pairs;
    const double targets = 4 + (has_area ? 4 : 0) + (has_centroid ? 12 : 0);
    drawn_cells cells{0, 0, counts.bricks, half_a_brick * counts.bricks, 0};
    cells.in_tiles = std::max(0.0, std::abs(surface.volume()) - cells.voxels);
    cells.result = held_brick * cells.bricks + value_sizes_of(request, 0).values * cells.voxels;
    const double of_runs = run * runs_of_voxel * counts.voxels + listed_brick * cells.bricks;
    const double values = targets * cells.voxels;
    cells.drawn = std::max({sorted, listed + of_runs + values, held_brick * cells.bricks + cells.result + values});
    return cells;
}

} // namespace

double needed_for_cells(const voxelize_request& request, const surface_layers& surface, const brick_counts& counts,
                        double vertices) {
    constexpr double of_vertex = 24, of_triangle = 36, of_edges = 72;
    const double triangles = surface.primitives();
    double before = request.wants_links() ? 0 : of_edges * triangles;
    if (request.close_holes != 0) before = std::max(before, 40 * vertices + 36 * triangles); // on the host
    const drawn_cells cells =
        request.wants_links() ? drawn_links(request, counts) : drawn_fractions(request, surface, counts);
    double need = of_vertex * vertices + of_triangle * triangles + std::max(before, cells.drawn);
    if (request.write_bytes)
        need = std::max(need, cells.result + request.write_bytes(cells.bricks, cells.voxels, cells.in_tiles));
    return with_lists(need);
}

int counted_side(const surface_layers& surface) {
    constexpr double most = 2e7; // cubes in about a second of two cores
    if (surface.voxels() + surface.primitives() <= most) return 1;
    int side = brick_side;
    while (surface.voxels() > most * side * side) side *= 2;
    return side;
}

voxelpipe::grid counted_grid(const voxelpipe::grid& part, int side) {
    voxelpipe::grid cubes = part;
    cubes.voxel_size *= side;
    cubes.whole = (part.whole_extent() + (side - 1)) / side;
    cubes.offset = part.offset / side;
    cubes.extent = (part.offset + part.extent + (side - 1)) / side - cubes.offset;
    return cubes;
}

brick_counts counts_of(const surface_layers& surface, const brick_counts& touched, int side) {
    if (side == 1) return touched;
    const double area = static_cast<double>(side) * side;
    const double of_bricks = touched.voxels * area / (brick_side * brick_side);
    // Surfaces that lie in the same cubes may lie in the same voxels.
    return {of_bricks, std::min(surface.voxels(), touched.voxels * area)};
}

namespace {

// `certain`: the share of the bytes that has to fit.
void require_share(const voxelize_request& request, double bytes, double certain) {
    const glm::ivec3 extent = request.grid.extent;
    memory::require(certain * bytes,
                    "a sparse grid of " + std::to_string(extent.x) + " x " + std::to_string(extent.y) + " x " +
                        std::to_string(extent.z) + " voxels",
                    memory::fewer_voxels_hint, bytes);
}

} // namespace

void require_streamed(const voxelize_request& request, const surface_layers& surface) {
    const brick_counts counts{surface.voxels() / (brick_side * brick_side), surface.voxels()};
    require_share(request, needed_bytes(request, surface, counts, value_sizes_of(request, 0)), 0.5);
}

void require_bricks(const voxelize_request& request, double bytes) {
    memory::expect(bytes);
    require_share(request, bytes, 0.85); // what an estimate is too high by may fit after all
}

} // namespace voxelize
