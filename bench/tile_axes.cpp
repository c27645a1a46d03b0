// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// How many dominant axes meet in a warp of the fine raster if pairs are sorted by tile alone, and if they are sorted by
// tile and axis as in the paper. A raster with a copy of its code for each axis runs as many copies as a warp has axes.
// The counts are exact and the same on every machine; docs/design.md has the table.

#include "mesh_file.hpp"
#include "scene_choice.hpp"

#include <CLI/CLI.hpp>
#include <cpu_ref/backend.hpp>
#include <cpu_ref/stages.hpp>

#include <algorithm>
#include <bit>
#include <cstdio>
#include <iostream>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

namespace {

namespace vp = voxelpipe;
namespace core = voxelpipe::core;
namespace stages = voxelpipe::cpu_stages;

constexpr std::uint64_t lanes = 32;

struct axis_counts {
    std::uint64_t warps = 0;
    std::uint64_t axes = 0; // sum over the warps of the number of different axes
    [[nodiscard]] double mean() const { return static_cast<double>(axes) / static_cast<double>(warps); }
};

// Axes of the 32 consecutive pairs of one tile that a warp takes.
axis_counts count_axes(std::span<const stages::tile_range> tiles, std::span<const unsigned char> axis_of_pair) {
    axis_counts out;
    for (const stages::tile_range& t : tiles)
        for (std::uint64_t first = t.first; first < t.last; first += lanes) {
            unsigned met = 0;
            for (std::uint64_t i = first; i < std::min(t.last, first + lanes); ++i) met |= 1u << axis_of_pair[i];
            ++out.warps;
            out.axes += static_cast<std::uint64_t>(std::popcount(met));
        }
    return out;
}

void measure(const std::string& name, const bench::mesh_data& data, int resolution, int log2_tile_size) {
    const vp::grid g = vp::fit(data.positions, glm::ivec3(resolution));
    const auto shader = vp::constant(true);
    using draw_type = vp::draw<vp::mesh_view<>, vp::passthrough, std::remove_const_t<decltype(shader)>>;
    const draw_type draw{{data.positions, data.triangles}, {}, shader};
    const std::span<const draw_type> draws{&draw, 1};
    const auto pairs =
        stages::sorted_tile_pairs(stages::tile_pairs(draws, g, vp::coverage::conservative, log2_tile_size).pairs);
    const auto tiles = stages::tile_ranges(pairs);

    const core::snap_transform snap = core::make_snap_transform(g);
    const auto corner = [&](std::uint32_t v) {
        const glm::vec3& p = data.positions[v];
        return core::snap(snap, p.x, p.y, p.z);
    };
    std::vector<unsigned char> axes;
    axes.reserve(pairs.size());
    for (const stages::tile_pair& p : pairs) {
        const glm::uvec3& t = data.triangles[p.primitive];
        axes.push_back(
            static_cast<unsigned char>(core::dominant_axis(corner(t.x), corner(t.y), corner(t.z), snap.fraction)));
    }
    const axis_counts by_tile = count_axes(tiles, axes);
    for (const stages::tile_range& t : tiles)
        std::sort(axes.begin() + static_cast<std::ptrdiff_t>(t.first),
                  axes.begin() + static_cast<std::ptrdiff_t>(t.last));
    const axis_counts by_axis = count_axes(tiles, axes);
    const core::tile_grid all(g.extent, log2_tile_size);
    const int bits = static_cast<int>(std::bit_width(all.count() - 1));
    std::printf("%s,%d,%zu,%zu,%llu,%.2f,%.2f,%d,%d\n", name.c_str(), resolution, pairs.size(), tiles.size(),
                static_cast<unsigned long long>(by_tile.warps), by_tile.mean(), by_axis.mean(), bits, bits + 2);
}

} // namespace

int main(int argc, char** argv) {
    CLI::App app{"Dominant axes that meet in a warp, by the order of the tile sort. Writes CSV."};
    std::string scenes = VOXELPIPE_SCENES_DIR;
    std::vector<std::string> meshes;
    std::vector<int> resolutions{128, 512, 1024};
    int log2_tile_size = 4;
    app.add_option("--scenes", scenes, "folder of .vpm or .vpz files")->capture_default_str();
    app.add_option("--mesh", meshes, "only these meshes");
    app.add_option("--resolution", resolutions, "voxels along a side")->capture_default_str();
    app.add_option("--log2-tile-size", log2_tile_size, "voxels along a side of a tile")->capture_default_str();
    CLI11_PARSE(app, argc, argv);
    try {
        std::vector<std::string> notes;
        if (meshes.empty()) meshes = bench::available_scenes(scenes, notes);
        for (const std::string& note : notes) std::cerr << note << '\n';
        std::puts("scene,resolution,pairs,tiles,warps,axes_by_tile,axes_by_tile_and_axis,key_bits,key_bits_with_axis");
        for (const std::string& name : meshes) {
            const bench::mesh_data data = bench::find_mesh(scenes, name);
            for (const int n : resolutions) measure(name, data, n, log2_tile_size);
        }
    } catch (const std::exception& e) {
        std::cerr << "error: " << e.what() << '\n';
        return 1;
    }
    return 0;
}
