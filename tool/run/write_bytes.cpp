// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "write_bytes.hpp"

#include "model/parallel.hpp"
#include "write/formats/output_file.hpp"
#include "write/formats/voxel_mesh.hpp"

#include <algorithm>
#include <cstddef>
#include <initializer_list>
#include <string>
#include <string_view>

namespace voxelize {

namespace {

// Bytes of a brick of a volume, without values.
constexpr double brick_bytes = 80;

// Bytes of a voxel: all its values, and those of its largest channel.
struct value_bytes {
    double all = 0, largest = 1;
};
value_bytes bytes_of_values(std::span<const target> targets) {
    value_bytes bytes;
    for (const target id : targets) {
        const double value = static_cast<double>(size_of(info_of(id).type)) * info_of(id).components;
        bytes.all += value;
        bytes.largest = std::max(bytes.largest, value);
    }
    return bytes;
}

// What was measured of each kind of writer, on top of its volume.

// Two sides of each voxel of a surface: lists of faces, then quads and vertices.
double bytes_of_mesh(const expected_result& result, double voxels, double threads) {
    constexpr double of_voxel = 190, of_corner = 4;
    const double places = std::min(1.0 * result.extent.x * result.extent.y,
                                   static_cast<double>(most_places(static_cast<std::size_t>(2 * voxels))));
    return of_voxel * voxels + threads * of_corner * places;
}

// A list of the bricks by their rows, first numbers of the parts, and what threads make of parts that wait to be
// written.
double bytes_of_hexahedra(const std::string& extension, const expected_result& result, double bricks, double voxels,
                          double threads) {
    constexpr double of_brick = 24, of_part = 64, rows_of_part = 8, parts_of_thread = 5, least_voxels_of_part = 4096;
    const double parts = std::min(1.0 * result.extent.z * result.extent.y / rows_of_part, double{1 << 22});
    const double waiting =
        std::min(voxels, threads * parts_of_thread * std::max(least_voxels_of_part, rows_of_part * result.extent.x));
    // Lists of the parts with each kind of sides, which are found before anything waits.
    const bool has_materials =
        std::find(result.targets.begin(), result.targets.end(), target::material) != result.targets.end();
    constexpr double of_sides = 30, of_sides_of_materials = 100;
    const double sides = has_materials && extension != ".vtu" ? of_sides_of_materials
                         : extension == ".msh"                ? of_sides
                                                              : 0;
    constexpr double of_line = 200, of_element = 150, of_corners = 40; // in strings that grow, but for .vtu
    const double of_voxel = extension == ".inp" ? of_line : extension == ".msh" ? of_element : of_corners;
    return of_brick * bricks + of_part * parts + std::max(of_voxel * waiting, sides * parts);
}

double bytes_of_picture(const preview_options& options) {
    constexpr double of_pixel = 100, of_first_pixels = 200, most_of_these = 12 << 20;
    const double pixels = static_cast<double>(options.width) * options.height;
    return of_pixel * pixels + std::min(of_first_pixels * pixels, most_of_these);
}

// Text of a vertex with its colour, and of a voxel, in strings that grow.
constexpr double of_line_of_mesh = 75, of_line_of_point = 40;

// Bytes of memory that writing a triangle of .stl adds to the peak. The file has 50 bytes a triangle, but 20 of them
// take the memory of the lists of faces, which are freed before.
constexpr double of_triangle_of_stl = 30;

// A count and an index for each colour of 24 bits.
constexpr double bytes_of_palette = 80 << 20;

// What is compressed at once, and waits to be written, of each thread; and what any writer takes.
constexpr double bytes_of_thread = 2 << 20, bytes_of_any = 3 << 20;

bool is_one_of(const std::string& extension, std::initializer_list<std::string_view> list) {
    return std::find(list.begin(), list.end(), extension) != list.end();
}

} // namespace

double bytes_to_write(const std::filesystem::path& output, const expected_result& result,
                      const write_options& options) {
    const std::string extension = lower_extension(output);
    const value_bytes values = bytes_of_values(result.targets);
    const double threads = thread_count(options.threads);
    double bricks = result.bricks, voxels = result.voxels, bytes = bytes_of_any;
    const bool is_hexahedra = is_one_of(extension, {".vtu", ".inp", ".msh"});
    if (is_hexahedra && options.threshold > 0) { // any voxel may be one, and has a bit
        constexpr double brick_voxels = 512, bits_of_byte = 8;
        voxels = static_cast<double>(result.extent.x) * result.extent.y * result.extent.z;
        bricks = voxels / brick_voxels;
        bytes += voxels / bits_of_byte;
    }
    if (is_one_of(extension,
                  {".npz", ".vti", ".pvti", ".nrrd", ".nii.gz", ".schem", ".litematic", ".3mf", ".html", ".vtu"}))
        bytes += threads * bytes_of_thread;
    // Blocks of .vtu are gathered for all threads, in memory that grows.
    if (extension == ".vtu") bytes += std::min(threads * bytes_of_thread, 64 * voxels);
    if (extension == ".zarr") {
        constexpr double chunk_voxels = 64 * 64 * 64, copies = 2.3; // as it is, and with room for what it becomes
        bytes += threads * (bytes_of_thread / 2 + copies * chunk_voxels * values.largest);
    }
    const bool reads_tiles =
        is_one_of(extension, {".nvdb", ".vdb", ".vti", ".pvti", ".nrrd", ".nii", ".nii.gz", ".zarr", "{z}.png"});
    if (extension == "{z}.png") { // a layer's values, its pixels and the file of them, and files that wait
        constexpr double waiting = 4, of_pixel = 2;
        const double pixels = static_cast<double>(result.extent.x) * result.extent.y;
        bytes += threads * pixels * (std::max(1.0, values.largest) + (2 + waiting) * of_pixel);
    }
    if (!reads_tiles && result.in_tiles > 0) { // a second volume, and a list of its bricks
        constexpr double source_bytes = 24, brick_voxels = 512;
        bricks += result.in_tiles / brick_voxels;
        voxels += result.in_tiles;
        bytes += (brick_bytes + source_bytes) * bricks + values.all * voxels;
    }
    const bool shows_shape = is_one_of(extension, {".vox", ".schem", ".litematic", ".binvox", ".glb", ".obj", ".ply",
                                                   ".stl", ".3mf", ".xyz", ".vtu", ".inp", ".msh"});
    if (!result.is_sparse && (shows_shape || is_one_of(extension, {".html", ".nvdb", ".vdb"}))) {
        constexpr double found_bytes = 90; // the bricks of each layer before they are sorted
        bytes += (brick_bytes + found_bytes) * bricks;
        if (!shows_shape) bytes += values.all * voxels;
    }
    if (is_one_of(extension, {".glb", ".obj", ".stl", ".3mf"}) || (extension == ".ply" && !options.points))
        bytes += bytes_of_mesh(result, voxels, threads);
    constexpr double items_at_once = 4 * 8192; // formatted by each thread
    if (extension == ".obj") bytes += of_line_of_mesh * std::min(2 * voxels, threads * items_at_once);
    if (extension == ".stl") {
        bytes += of_triangle_of_stl * std::min(4 * voxels, threads * items_at_once);
        // Corners of sides where sheets part, which stand apart: 6 a voxel were counted on thin balls, 0.03 to 0.1 on
        // others.
        constexpr double of_corner = 32, corners_of_thin = 6, corners = 0.1;
        bytes += of_corner * (result.is_thin ? corners_of_thin : corners) * voxels;
    }
    if (extension == ".3mf") bytes += of_line_of_mesh * std::min(3 * voxels, threads * items_at_once);
    if (is_hexahedra) bytes += bytes_of_hexahedra(extension, result, bricks, voxels, threads);
    // A piece of the blocks as numbers and as bytes, and 64 rows at least.
    if (is_one_of(extension, {".schem", ".litematic"})) bytes += threads * 4 * std::max(1 << 19, 64 * result.extent.x);
    if (extension == ".xyz") bytes += of_line_of_point * std::min(voxels, threads * items_at_once);
    const bool has_colors = std::any_of(result.targets.begin(), result.targets.end(), is_color);
    if (extension == ".vox" && has_colors) bytes += bytes_of_palette;
    if (extension == ".png") bytes += bytes_of_picture(options.preview);
    if (extension == ".zarr" && options.levels) {
        constexpr double block_voxels = 128 * 128 * 128, levels = 1.2;
        bytes += threads * block_voxels * levels * values.largest;
    }
    return bytes;
}

} // namespace voxelize
