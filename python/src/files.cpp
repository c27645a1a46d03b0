// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "bricks.hpp"

#include "write/formats/formats.hpp"
#include "write/preview.hpp"
#include "write/sparse_formats.hpp"

#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>

#include <optional>
#include <stdexcept>

namespace voxelpipe::python {
namespace {

using mask_array = array<const std::uint8_t, 3>;
using color_array = array<const std::uint8_t, 4>;
// Of (nz, ny, nx), or of the voxels of a list, with or without columns.
using any_array = nb::ndarray<nb::ro, nb::c_contig, nb::device::cpu>;
using named_arrays = std::vector<std::pair<std::string, any_array>>;

voxelize::volume shape_of_grid(const grid& g) {
    voxelize::volume v;
    for (int a = 0; a < 3; ++a) {
        const auto i = static_cast<std::size_t>(a);
        v.extent[i] = g.extent[a];
        v.origin[i] = g.part_origin()[a];
        v.voxel_size[i] = g.voxel_size[a];
    }
    return v;
}

void add_occupancy(voxelize::volume& v, const mask_array& occupied) {
    voxelize::channel& bits = v.add("occupancy", voxelize::scalar::bit);
    const std::uint8_t* at = occupied.data();
    const auto words_per_row = static_cast<std::size_t>(v.words_per_row());
    auto* words = reinterpret_cast<std::uint32_t*>(bits.data.data());
    for (std::int64_t row = 0; row < v.extent[1] * v.extent[2]; ++row, words += words_per_row)
        for (std::int64_t x = 0; x < v.extent[0]; ++x)
            if (*at++ != 0) words[x / 32] |= 1u << (x % 32);
}

// ---- pictures ------------------------------------------------------------------------------------------------------

nb::object render(const mask_array& occupied, const std::optional<color_array>& colors, const grid& g, int width,
                  int height, double azimuth, double elevation, double zoom, const std::string& up,
                  const std::string& background, unsigned threads) {
    expect_shape(occupied, g, "occupied");
    if (colors) expect_shape(*colors, g, "values", {colors->shape(3)});
    voxelize::preview_options options;
    options.width = width;
    options.height = height;
    options.azimuth = azimuth;
    options.elevation = elevation;
    options.zoom = zoom;
    options.threads = static_cast<int>(threads);
    options.up = named<voxelize::up_axis>("up", up, {{"y", voxelize::up_axis::y}, {"z", voxelize::up_axis::z}});
    const auto backdrop = voxelize::parse_background(background);
    if (!backdrop)
        throw nb::value_error(("background is 'sky', 'white', 'dark', 'transparent', '#rrggbb' or '#rrggbb,#rrggbb', "
                               "not '" +
                               background + "'")
                                  .c_str());
    options.backdrop = *backdrop;
    voxelize::image picture;
    {
        const nb::gil_scoped_release released;
        voxelize::volume v = shape_of_grid(g);
        add_occupancy(v, occupied);
        if (colors) {
            voxelize::channel& c = v.add_unset("color", voxelize::scalar::u8, static_cast<int>(colors->shape(3)));
            std::memcpy(c.data.data(), colors->data(), c.data.size());
        }
        picture = voxelize::render_preview(v, options);
    }
    return to_numpy(std::move(picture.pixels),
                    {static_cast<std::size_t>(picture.height), static_cast<std::size_t>(picture.width),
                     static_cast<std::size_t>(picture.components)});
}

// ---- the tool's formats --------------------------------------------------------------------------------------------

voxelize::scalar scalar_of(const std::string& name, const any_array& a) {
    const auto is = [&](const nb::dlpack::dtype& type) { return a.dtype() == type; };
    if (is(nb::dtype<std::uint8_t>())) return voxelize::scalar::u8;
    if (is(nb::dtype<std::uint16_t>())) return voxelize::scalar::u16;
    if (is(nb::dtype<std::uint32_t>())) return voxelize::scalar::u32;
    if (is(nb::dtype<std::uint64_t>())) return voxelize::scalar::u64;
    if (is(nb::dtype<std::int32_t>())) return voxelize::scalar::i32;
    if (is(nb::dtype<std::int64_t>())) return voxelize::scalar::i64;
    if (is(nb::dtype<float>())) return voxelize::scalar::f32;
    if (is(nb::dtype<double>())) return voxelize::scalar::f64;
    throw nb::value_error((name + ": files hold uint8, 16, 32 and 64, int32 and 64, float32 and 64").c_str());
}

// The components of values that have `axes` axes without them.
int components_of(const std::string& name, const any_array& a, std::size_t axes) {
    const std::size_t n = a.ndim() == axes ? 1 : a.shape(axes);
    if (n < 1 || n > 4) throw nb::value_error((name + ": files hold 1 to 4 values a voxel").c_str());
    return static_cast<int>(n);
}

struct write_settings {
    int compression;
    bool merge, points, levels;
    int pieces;
    std::string up;
    unsigned threads;

    [[nodiscard]] voxelize::write_options options(std::vector<std::string>& warnings) const {
        voxelize::write_options o;
        o.compression = compression;
        o.merge_faces = merge;
        o.points = points;
        o.levels = levels;
        o.pieces = pieces;
        o.up = named<voxelize::up_axis>("up", up, {{"y", voxelize::up_axis::y}, {"z", voxelize::up_axis::z}});
        o.threads = static_cast<int>(threads);
        o.warn = [&warnings](const std::string& text) { warnings.push_back(text); };
        return o;
    }
};

// (files, warnings). What the disk or the format refuses is WriteError, or the exception that stands for it.
template <class Write>
nb::tuple written(const nb::handle& write_error, const write_settings& settings, const Write& write) {
    std::vector<std::string> warnings;
    const voxelize::write_options options = settings.options(warnings);
    std::vector<std::filesystem::path> files;
    std::string refusal;
    {
        const nb::gil_scoped_release released;
        try {
            files = write(options);
        } catch (const voxelize::write_error& error) {
            refusal = error.what();
        }
    }
    if (!refusal.empty()) {
        PyErr_SetString(write_error.ptr(), refusal.c_str());
        throw nb::python_error();
    }
    std::vector<std::string> names;
    for (const std::filesystem::path& f : files) names.push_back(f.string());
    return nb::make_tuple(names, warnings);
}

// Dense arrays. `occupied` becomes the channel "occupancy", where it is there.
nb::tuple write_dense(const nb::handle& write_error, const std::string& path, const grid& g,
                      const std::optional<mask_array>& occupied, const named_arrays& channels, int compression,
                      bool merge, bool points, bool levels, int pieces, const std::string& up, unsigned threads) {
    voxelize::volume v = shape_of_grid(g);
    if (occupied) {
        expect_shape(*occupied, g, "occupied");
        add_occupancy(v, *occupied);
    }
    for (const auto& [name, a] : channels) {
        voxelize::channel& c = v.add_unset(name, scalar_of(name, a), components_of(name, a, 3));
        if (a.nbytes() != c.data.size()) throw nb::value_error((name + " does not have the grid's shape").c_str());
        std::memcpy(c.data.data(), a.data(), c.data.size());
    }
    return written(write_error, {compression, merge, points, levels, pieces, up, threads},
                   [&](const voxelize::write_options& options) { return voxelize::write(v, path, options); });
}

// A list of voxels (n, 3) with a row of each array for each. The channel "occupancy" is added.
nb::tuple write_list(const nb::handle& write_error, const std::string& path, const grid& g, const voxel_array& voxels,
                     const named_arrays& channels, int compression, bool merge, bool points, bool levels, int pieces,
                     const std::string& up, unsigned threads) {
    listed_bricks listed = bricks_of(voxels, g, glm::ivec3(0));
    const std::vector<std::uint64_t>& row_of = listed.row_of;
    voxelize::sparse_volume v;
    v.shape = shape_of_grid(g);
    v.keys = std::move(listed.keys);
    v.masks = std::move(listed.masks);
    v.offsets = std::move(listed.offsets);
    v.channels.push_back({"occupancy", voxelize::scalar::bit, 1, {}});
    for (const auto& [name, a] : channels) {
        if (a.ndim() < 1 || a.shape(0) != voxels.shape(0))
            throw nb::value_error((name + " needs one row for each voxel").c_str());
        voxelize::channel c{name, scalar_of(name, a), components_of(name, a, 1), {}};
        const std::size_t size = voxelize::size_of(c.type) * static_cast<std::size_t>(c.components);
        c.data.resize(size * row_of.size());
        const auto* const from = static_cast<const std::byte*>(a.data());
        for (std::size_t i = 0; i < row_of.size(); ++i)
            std::memcpy(c.data.data() + i * size, from + row_of[i] * size, size);
        v.channels.push_back(std::move(c));
    }
    return written(write_error, {compression, merge, points, levels, pieces, up, threads},
                   [&](const voxelize::write_options& options) { return voxelize::write_sparse(v, path, options); });
}

// (extension, description, needs the occupancy, holds all channels, shows colours, needs cubes, occupied voxels alone,
// holds materials)
nb::list formats() {
    nb::list all;
    for (const voxelize::format& f : voxelize::formats())
        all.append(nb::make_tuple(nb::str(f.extension.data(), f.extension.size()),
                                  nb::str(f.description.data(), f.description.size()), f.needs_occupancy,
                                  f.all_channels, f.shows_colors, f.needs_cubes, f.only_sparse, f.has_materials));
    return all;
}

// The files that an output of such channels, all of them of numbers, may become: names, and (folder, prefix, suffix) of
// those with a number between.
nb::tuple names_of(const std::string& path, const grid& g, const std::vector<std::string>& channels) {
    voxelize::volume shape = shape_of_grid(g);
    for (const std::string& name : channels) shape.channels.push_back({name, voxelize::scalar::u8, 1, {}});
    const voxelize::written_names names = voxelize::names_of(shape, path, {}, voxelize::held_as::unknown);
    nb::list files, numbered;
    for (const std::filesystem::path& f : names.files) files.append(f.string());
    for (const voxelize::numbered_names& n : names.numbered)
        numbered.append(nb::make_tuple(n.folder.string(), n.prefix, n.suffix));
    return nb::make_tuple(files, numbered);
}

} // namespace

void bind_files(nb::module_& m) {
    m.def("render", &render, nb::arg("occupied"), nb::arg("colors").none(), nb::arg("grid"), nb::arg("width"),
          nb::arg("height"), nb::arg("azimuth"), nb::arg("elevation"), nb::arg("zoom"), nb::arg("up"),
          nb::arg("background"), nb::arg("threads"));
    m.def("write_dense", &write_dense, nb::arg("write_error"), nb::arg("path"), nb::arg("grid"),
          nb::arg("occupied").none(), nb::arg("channels"), nb::arg("compression"), nb::arg("merge"), nb::arg("points"),
          nb::arg("levels"), nb::arg("pieces"), nb::arg("up"), nb::arg("threads"));
    m.def("write_list", &write_list, nb::arg("write_error"), nb::arg("path"), nb::arg("grid"), nb::arg("voxels"),
          nb::arg("channels"), nb::arg("compression"), nb::arg("merge"), nb::arg("points"), nb::arg("levels"),
          nb::arg("pieces"), nb::arg("up"), nb::arg("threads"));
    m.def("formats", &formats);
    m.def("names_of", &names_of, nb::arg("path"), nb::arg("grid"), nb::arg("channels"));
}

} // namespace voxelpipe::python
