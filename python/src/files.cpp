// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "arrays.hpp"

#include "write/preview.hpp"

#include <voxelpipe/core/brick_table.hpp>
#include <voxelpipe/sparse/io/nanovdb.hpp>

#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>

#include <algorithm>
#include <fstream>
#include <optional>
#include <stdexcept>

namespace voxelpipe::python {
namespace {

// ---- pictures ------------------------------------------------------------------------------------------------------

using mask_array = array<const std::uint8_t, 3>;
using color_array = array<const std::uint8_t, 4>;

// The tool's volume: packed bits, and colours with alpha where there are any.
voxelize::volume volume_of(const mask_array& occupied, const std::optional<color_array>& colors, const grid& g) {
    voxelize::volume v;
    for (int a = 0; a < 3; ++a) {
        const auto i = static_cast<std::size_t>(a);
        v.extent[i] = g.extent[a];
        v.origin[i] = g.part_origin()[a];
        v.voxel_size[i] = g.voxel_size[a];
    }
    voxelize::channel& bits = v.add("occupancy", voxelize::scalar::bit);
    const std::uint8_t* at = occupied.data();
    const auto words_per_row = static_cast<std::size_t>(v.words_per_row());
    auto* words = reinterpret_cast<std::uint32_t*>(bits.data.data());
    for (int row = 0; row < g.extent.y * g.extent.z; ++row, words += words_per_row)
        for (int x = 0; x < g.extent.x; ++x)
            if (*at++ != 0) words[x / 32] |= 1u << (x % 32);
    if (colors) {
        const int components = static_cast<int>(colors->shape(3));
        voxelize::channel& c = v.add_unset("color", voxelize::scalar::u8, components);
        std::memcpy(c.data.data(), colors->data(), c.data.size());
    }
    return v;
}

nb::object render(const mask_array& occupied, const std::optional<color_array>& colors, const grid& g, int width,
                  int height, double azimuth, double elevation, double zoom, const std::string& up,
                  const std::string& background, unsigned threads) {
    expect_shape(occupied, g);
    if (colors) expect_shape(*colors, g, {colors->shape(3)});
    voxelize::preview_options options;
    options.width = width;
    options.height = height;
    options.azimuth = azimuth;
    options.elevation = elevation;
    options.zoom = zoom;
    options.threads = static_cast<int>(threads);
    if (up != "y" && up != "z") throw nb::value_error("up is 'y' or 'z'");
    options.up = up == "y" ? voxelize::up_axis::y : voxelize::up_axis::z;
    const auto backdrop = voxelize::parse_background(background);
    if (!backdrop)
        throw nb::value_error("background is 'sky', 'white', 'dark', 'transparent', '#rrggbb' or '#rrggbb,#rrggbb'");
    options.backdrop = *backdrop;
    voxelize::image picture;
    {
        const nb::gil_scoped_release released;
        picture = voxelize::render_preview(volume_of(occupied, colors, g), options);
    }
    return to_numpy(std::move(picture.pixels),
                    {static_cast<std::size_t>(picture.height), static_cast<std::size_t>(picture.width),
                     static_cast<std::size_t>(picture.components)});
}

// ---- NanoVDB -------------------------------------------------------------------------------------------------------

// Bricks of voxels that are listed in any order.
struct listed_bricks {
    std::vector<std::uint64_t> keys, offsets;
    std::vector<brick_mask> masks;
    std::vector<std::uint64_t> row_of; // by rank: where the voxel stands in the list
    grid where;

    [[nodiscard]] brick_table table() const {
        return {keys.data(), masks.data(), offsets.data(), keys.size(), where.extent, where.offset};
    }
};

listed_bricks make_bricks(const array<const std::int32_t, 2>& voxels, const grid& g) {
    const std::size_t n = voxels.shape(0);
    std::vector<std::pair<std::uint64_t, std::uint64_t>> order(n); // key of the voxel, row
    for (std::size_t i = 0; i < n; ++i) {
        const std::int32_t* p = voxels.data() + 3 * i;
        const glm::ivec3 voxel(p[0], p[1], p[2]);
        if (!g.contains(voxel)) throw std::out_of_range("a voxel lies outside the grid");
        order[i] = {core::morton_key(voxel + g.offset), i};
    }
    std::sort(order.begin(), order.end());
    listed_bricks b;
    b.where = g;
    b.row_of.reserve(n);
    for (std::size_t i = 0; i < n; ++i) {
        const auto [key, row] = order[i];
        if (i != 0 && order[i - 1].first == key) throw std::invalid_argument("a voxel is listed twice");
        if (b.keys.empty() || b.keys.back() != key >> 9) {
            b.keys.push_back(key >> 9);
            b.masks.emplace_back();
            b.offsets.push_back(i);
        }
        b.masks.back().words[(key & 511u) >> 6] |= std::uint64_t{1} << (key & 63u);
        b.row_of.push_back(row);
    }
    if (n != 0) b.offsets.push_back(n);
    return b;
}

template <class T>
void add_grid(io::nanovdb_file& file, const std::string& name, const listed_bricks& bricks, const void* values) {
    const auto* const rows = static_cast<const T*>(values);
    file.add<T>({name, bricks.table(), bricks.where, T{},
                 [rows, &bricks](std::uint64_t rank) { return rows[bricks.row_of[rank]]; }});
}

using any_array = nb::ndarray<nb::ro, nb::ndim<2>, nb::c_contig, nb::device::cpu>;

// Writes a grid for each name. A value of None is a mask.
void write_nvdb(const std::string& path, const grid& g, const array<const std::int32_t, 2>& voxels,
                const std::vector<std::pair<std::string, std::optional<any_array>>>& grids) {
    if (voxels.shape(1) != 3) throw nb::value_error("voxels are (n, 3): x, y, z");
    const listed_bricks bricks = make_bricks(voxels, g);
    io::nanovdb_file file;
    for (const auto& [name, values] : grids) {
        if (!values) {
            file.add<io::nanovdb::mask_value>({name, bricks.table(), g, false, {}});
            continue;
        }
        if (values->shape(0) != voxels.shape(0)) throw nb::value_error("values need one row for each voxel");
        const std::size_t columns = values->shape(1);
        const auto is = [&](const nb::dlpack::dtype& type, std::size_t n) {
            return values->dtype() == type && columns == n;
        };
        if (is(nb::dtype<float>(), 1))
            add_grid<float>(file, name, bricks, values->data());
        else if (is(nb::dtype<float>(), 3))
            add_grid<glm::vec3>(file, name, bricks, values->data());
        else if (is(nb::dtype<std::int32_t>(), 1))
            add_grid<std::int32_t>(file, name, bricks, values->data());
        else if (is(nb::dtype<std::uint32_t>(), 1))
            add_grid<std::uint32_t>(file, name, bricks, values->data());
        else if (is(nb::dtype<std::uint8_t>(), 4))
            add_grid<io::nanovdb::rgba8>(file, name, bricks, values->data());
        else
            throw nb::value_error(".nvdb holds float32 (1 or 3 columns), int32, uint32 (1) or uint8 (4)");
    }
    const nb::gil_scoped_release released;
    std::ofstream out(path, std::ios::binary);
    file.write(out);
    if (!out.flush()) throw std::runtime_error("the file could not be written");
}

} // namespace

void bind_files(nb::module_& m) {
    m.def("render", &render, nb::arg("occupied"), nb::arg("colors").none(), nb::arg("grid"), nb::arg("width"),
          nb::arg("height"), nb::arg("azimuth"), nb::arg("elevation"), nb::arg("zoom"), nb::arg("up"),
          nb::arg("background"), nb::arg("threads"));
    m.def("write_nvdb", &write_nvdb, nb::arg("path"), nb::arg("grid"), nb::arg("voxels"), nb::arg("grids"));
}

} // namespace voxelpipe::python
