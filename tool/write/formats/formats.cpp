// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "formats.hpp"

#include "binvox.hpp"
#include "inp.hpp"
#include "litematic.hpp"
#include "mesh.hpp"
#include "msh.hpp"
#include "npy.hpp"
#include "png.hpp"
#include "scanner_images.hpp"
#include "schem.hpp"
#include "slices.hpp"
#include "text.hpp"
#include "vox.hpp"
#include "voxel_shape.hpp"
#include "vti.hpp"
#include "vtu.hpp"
#include "zarr.hpp"

#include "model/parallel.hpp"
#include "write/page/page.hpp"
#include "write/sparse_formats.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <string>

namespace voxelize {
namespace {

// A writer takes dense channels, or the occupied voxels and their colours.
struct writer {
    std::vector<std::filesystem::path> (*of_channels)(const volume&, const std::filesystem::path&,
                                                      const write_options&) = nullptr;
    std::vector<std::filesystem::path> (*of_shape)(const voxel_shape&, const std::filesystem::path&,
                                                   const write_options&) = nullptr;
    // The names of its files; null: the path alone.
    written_names (*names)(const volume&, const std::filesystem::path&, const write_options&, held_as) = nullptr;
};

// A format of arrays, those of faces among them.
template <class... Has>
constexpr format of_arrays(std::string_view extension, std::string_view description, Has... has) {
    format arrays{extension, description, false, true, false, false};
    arrays.has_faces = true;
    (void(arrays.*has = true), ...);
    return arrays;
}

// A format whose numbers of voxels have 16 or 32 bits.
constexpr format up_to(format limited, std::int64_t most_side, std::int64_t most_voxels = 0) {
    limited.most_side = most_side;
    limited.most_voxels = most_voxels;
    return limited;
}

constexpr auto all_formats = std::to_array<format>({
    of_arrays(".npy", "NumPy array (nz, ny, nx[, components]); OUT.CHANNEL.npy for several", &format::has_halves),
    of_arrays(".npz", "NumPy archive with one array for each channel", &format::has_halves),
    {".vox", "MagicaVoxel model, split above 256 voxels, 255 colours", true, false, true, true},
    up_to({".schem", "Minecraft schematic (Sponge 2, WorldEdit) of concrete, wool, terracotta, or see --blocks", true,
           false, true, true, false, false, false, true},
          INT16_MAX, INT32_MAX),
    up_to({".litematic", "the same blocks for Litematica", true, false, true, true, false, false, false, true}, 0,
          INT32_MAX),
    {".binvox", "binvox occupancy, padded to a cube", true, false, false, true},
    of_arrays(".vti", "VTK image data for ParaView, all channels as cell data"),
    {".pvti", "the same in pieces of some layers each, OUT.1.vti, ...; see --pieces", false, true, false, false, false,
     false, true},
    of_arrays(".nrrd", "NRRD for 3D Slicer and teem; OUT.CHANNEL.nrrd for several; see --space", &format::has_space),
    up_to(of_arrays(".nii", "NIfTI-1 for nibabel, FSL and 3D Slicer; OUT.CHANNEL.nii for several; see --space",
                    &format::has_space),
          INT16_MAX),
    up_to(of_arrays(".nii.gz", "the same, compressed", &format::has_space), INT16_MAX),
    of_arrays(".zarr", "Zarr 3 group with a compressed array for each channel, in shards of 256^3; see --levels",
              &format::has_levels, &format::has_halves),
    {".glb", "glTF mesh of the voxels' outer sides, with colours; see --merge", true, false, true, false},
    {".obj", "the same as a Wavefront OBJ of quads, colours at the vertices", true, false, true, false},
    {".ply", "the same as a PLY of quads; with --points the centres of the voxels", true, false, true, false},
    {".stl", "the same as a binary STL of triangles, without colours", true, false, false, false},
    {".3mf", "the same as a 3MF of triangles for printing, in millimetres, colours of the faces", true, false, true,
     false},
    {".xyz", "centres of the voxels as text: x y z and red green blue, 0 to 255", true, false, true, false},
    {".vtu", "VTK unstructured grid of a hexahedron for each voxel, with all channels; see --threshold", true, true,
     false, false, false, false, false, false, true, true},
    {".inp", "the same for Abaqus and CalculiX, with sets of materials, sides and their nodes", true, false, false,
     false, false, false, false, false, true, true},
    {".msh", "the same for Gmsh 4.1, with a physical group for each material", true, false, false, false, false, false,
     false, false, true, true},
    {".png", "shaded picture of the voxels", true, false, true, false},
    {"{z}.png", "grey slices along z, OUT/0000.png, ...: occupancy, or fractions; see --slice-bits", false, true, false,
     false, false, false, false, false, false, false, true},
    {".html", "a page that shows the voxels in a browser: turn, cut, choose values", true, true, true, false},
    {".nvdb", "NanoVDB: a grid for each channel, of the occupied voxels alone", true, true, true, false, true, false,
     true},
#ifdef VOXELIZE_HAS_OPENVDB
    {".vdb", "the same for OpenVDB, colours in linear light", true, true, true, false, true},
#endif
});
constexpr auto all_writers = std::to_array<writer>({
    {write_npy, nullptr, npy_names},
    {write_npz},
    {nullptr, write_vox},
    {nullptr, write_schem},
    {nullptr, write_litematic},
    {nullptr, write_binvox},
    {write_vti, nullptr, vti_names},
    {write_pvti, nullptr, pvti_names},
    {write_nrrd, nullptr, channel_names},
    {write_nii, nullptr, channel_names},
    {write_nii, nullptr, channel_names},
    {write_zarr, nullptr, zarr_names},
    {nullptr, write_glb, mesh_names},
    {nullptr, write_obj, mesh_names},
    {nullptr, write_ply, mesh_names},
    {nullptr, write_stl, mesh_names},
    {nullptr, write_3mf, mesh_names},
    {nullptr, write_xyz},
    {nullptr, write_vtu},
    {nullptr, write_inp},
    {nullptr, write_msh},
    {write_png},
    {write_slices, nullptr, slice_names},
    {write_page},
    {write_nvdb},
#ifdef VOXELIZE_HAS_OPENVDB
    {write_vdb},
#endif
});
static_assert(all_formats.size() == all_writers.size());

std::size_t number_of(const format& f) { return static_cast<std::size_t>(&f - all_formats.data()); }

const format& known_format(const std::filesystem::path& path) {
    if (const format* const f = find_format(path); f != nullptr) return *f;
    std::string known;
    for (const format& each : all_formats) known += (known.empty() ? "" : ", ") + std::string(each.extension);
    throw write_error(path, "no writer for this extension; there are " + known);
}

void check_cubes(const format& f, const std::array<double, 3>& voxel_size, const std::filesystem::path& path) {
    if (!f.needs_cubes || are_cubic(voxel_size)) return;
    const auto& [x, y, z] = voxel_size;
    throw write_error(path, std::string(f.extension) + " has one voxel size for all axes, but this grid's are " +
                                number(x) + ", " + number(y) + " and " + number(z));
}

// The voxels of a volume whose fraction is at least the threshold, as the occupancy of a volume without others.
volume above_threshold(const volume& v, const std::filesystem::path& path, const write_options& options) {
    const channel* const fractions = v.find("fraction");
    if (fractions == nullptr || fractions->type != scalar::f32 || fractions->components != 1)
        throw write_error(path, "a threshold needs the channel \"fraction\", of one float a voxel");
    volume result;
    result.extent = v.extent;
    result.origin = v.origin;
    result.voxel_size = v.voxel_size;
    result.add("occupancy", scalar::bit);
    const auto least = static_cast<float>(options.threshold);
    parallel_for(static_cast<std::size_t>(v.extent[2]), thread_count(options.threads), [&](std::size_t plane) {
        const auto k = static_cast<std::int64_t>(plane);
        for (std::int64_t j = 0; j < v.extent[1]; ++j)
            for (std::int64_t i = 0; i < v.extent[0]; ++i) {
                float value;
                std::memcpy(&value, fractions->data.data() + 4 * v.index(i, j, k), sizeof(value));
                if (value >= least) result.set_bit(result.channels.front(), i, j, k);
            }
    });
    return result;
}

} // namespace

bool are_cubic(const std::array<double, 3>& voxel_size) {
    constexpr double tolerance = 1e-9; // relative
    const auto [x, y, z] = voxel_size;
    return std::abs(x - y) <= tolerance * x && std::abs(x - z) <= tolerance * x;
}

std::span<const format> formats() { return all_formats; }

const format* find_format(const std::filesystem::path& path) {
    const std::string extension = lower_extension(path);
    for (const format& f : all_formats)
        if (f.extension == extension) return &f;
    return nullptr;
}

void check_extent(const std::filesystem::path& path, const std::array<std::int64_t, 3>& extent) {
    const format* const f = find_format(path);
    if (f == nullptr) return;
    const auto [x, y, z] = extent;
    const bool is_long = f->most_side > 0 && std::max({x, y, z}) > f->most_side;
    // By doubles, which hold the product of any three sides.
    const bool is_large =
        f->most_voxels > 0 &&
        static_cast<double>(x) * static_cast<double>(y) * static_cast<double>(z) > static_cast<double>(f->most_voxels);
    if (!is_long && !is_large) return;
    const std::string limit = is_long ? std::to_string(f->most_side) + " voxels along an axis"
                                      : std::to_string(f->most_voxels) + " voxels in all";
    throw write_error(path, "too large for " + std::string(f->extension) + ", which ends at " + limit +
                                ": this grid has " + std::to_string(x) + " x " + std::to_string(y) + " x " +
                                std::to_string(z) + "; use .npz, .zarr or .nrrd");
}

std::string_view why_no_stream(const format& f) {
    constexpr std::array<std::string_view, 5> seek{".npz", ".vti", ".vtu", ".3mf", ".vdb"};
    if (std::find(seek.begin(), seek.end(), f.extension) != seek.end())
        return "it has what is known only at the end before what comes earlier";
    if (f.extension == ".pvti" || f.extension == ".zarr" || f.has_layers) return "it is several files";
    return {};
}

std::vector<std::filesystem::path> write(const volume& v, const std::filesystem::path& path,
                                         const write_options& options) {
    const format& f = known_format(path);
    v.check();
    if (v.num_channels() == 0) throw write_error(path, "there is no channel to write");
    if (!v.faces.empty() && !f.has_faces)
        throw write_error(path, std::string(f.extension) + " holds voxels, but no faces between them");
    const bool is_band = v.distances && f.only_sparse; // the band stands for it
    const bool has_threshold = f.has_threshold && options.threshold > 0;
    if (f.needs_occupancy && !is_band && !has_threshold && v.occupancy() == nullptr)
        throw write_error(path, std::string(f.extension) + " needs the occupancy");
    check_cubes(f, v.voxel_size, path);
    const writer& w = all_writers[number_of(f)];
    if (has_threshold) {
        const volume cells = above_threshold(v, path, options);
        if (options.warn && cells.popcount() == 0)
            options.warn("\"" + path.string() + "\": no voxel has a fraction of at least " + number(options.threshold));
        return w.of_shape(voxel_shape(v, cells, options.threads), path, options);
    }
    if (w.of_shape != nullptr) return w.of_shape(voxel_shape(v, options.threads), path, options);
    return w.of_channels(v, path, options);
}

written_names names_of(const volume& shape, const std::filesystem::path& path, const write_options& options,
                       held_as held) {
    const writer& w = all_writers[number_of(known_format(path))];
    return w.names != nullptr ? w.names(shape, path, options, held) : written_names{{path}, {}};
}

void check_replaceable(const std::filesystem::path& path) {
    if (const std::filesystem::path target = zarr_target(path); lower_extension(target) == ".zarr")
        check_zarr_target(target);
}

std::vector<std::filesystem::path> write(const voxel_shape& v, const std::filesystem::path& path,
                                         const write_options& options) {
    const format& f = known_format(path);
    check_cubes(f, v.voxel_size, path);
    return all_writers[number_of(f)].of_shape(v, path, options);
}

} // namespace voxelize
