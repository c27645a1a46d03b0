// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The one entry to all writers: takes a volume and a path, picks the format by the extension, writes whole files or
// none.

#include "model/volume.hpp"
#include "output_file.hpp" // write_error
#include "write/preview.hpp"

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace voxelize {

struct block_list; // blocks.hpp

// The axes of a patient that the model's x, y and z are: to the left, to the back and to the head as in DICOM, or to
// the right, to the front and to the head.
enum class patient_axes : std::uint8_t { lps, ras };

struct write_options {
    // zlib level of .npz, .vti, .vtu, .nrrd, .zarr, .3mf, {z}.png, .schem, .litematic, .nii.gz: 0 stores (the last
    // three: 1), 9 is smallest
    int compression = 1;
    bool zstd = false;                      // .zarr: Zstandard instead of gzip, where has_zstd()
    patient_axes space = patient_axes::lps; // .nrrd, .nii, .nii.gz
    int slice_bits = 0;                     // {z}.png: bits of a pixel, 8 or 16; 0: as slices.hpp says
    bool levels = false;                    // .zarr: each channel with its mip levels, an OME-Zarr multiscale group
    int pieces = 0; // .pvti, .nvdb: slabs along z, each a piece or a grid of each channel; 0: as these say:
    std::uint64_t piece_bytes = 1 << 30;         // .pvti: of values in a piece, about
    std::uint64_t leaves_per_grid = 0xffff'ffff; // .nvdb: most bricks in a grid; the format has no more
    up_axis up = up_axis::y;                     // stands upright in .vox, .schem, .litematic; glTF's is y
    int threads = 0;                             // 0 takes all cores. No output depends on it
    bool merge_faces = false;    // .ply, .obj, .glb, .stl, .3mf: coplanar faces of equal colour become one rectangle
    bool points = false;         // .ply holds the voxels' centres, not their outer sides
    bool half_distances = false; // .npy, .npz, .zarr: the channel "distance" in numbers of 16 bits
    bool lists = true;           // .npy, .npz of a sparse volume list its voxels; false: they hold the grid
    std::uint64_t faces_per_file =
        0; // .ply, .obj, .glb, .stl, .3mf: most faces in a file; 0: what the format can number
    // .vtu, .inp, .msh: the cells are the voxels whose channel "fraction" is at least this one, above 0, rounded to a
    // float; 0: the occupied voxels.
    double threshold = 0;
    // .vtu, .inp: the highest number of a node that 32 bits, or the format, hold; 0: as it is.
    std::uint64_t highest_number = 0;
    preview_options preview;                  // camera and light of .png
    std::shared_ptr<const block_list> blocks; // .schem, .litematic: what voxels become; null: default_blocks()
    std::function<void(double)> progress;     // called with 0..1 now and then, from the calling thread; may be empty
    // Called with a line that names the file, where it is written but readers of its format do not show all of it; from
    // the calling thread; may be empty.
    std::function<void(const std::string&)> warn;
};

// The facts of a format that --help shows and that are checked before the tool starts to compute.
struct format {
    std::string_view extension;   // lower case, with the dot
    std::string_view description; // one line
    bool needs_occupancy;         // without the "occupancy" channel the writer refuses
    bool all_channels;            // false: occupancy, with "color" where the format has colours
    bool shows_colors;            // takes the colours of find_colors() where there are any
    bool needs_cubes;             // knows one voxel size for all axes: without are_cubic() the writer refuses
    bool only_sparse = false;     // holds the voxels that are occupied and no others
    bool has_levels = false;      // obeys write_options::levels
    bool has_pieces = false;      // obeys write_options::pieces
    bool has_blocks = false;      // obeys write_options::blocks
    bool has_threshold = false;   // obeys write_options::threshold
    bool has_materials = false;   // holds the numbers of materials, whether it holds other channels or not
    bool has_layers = false;      // a file for each layer of one target: obeys write_options::slice_bits
    bool has_space = false;       // obeys write_options::space
    bool has_faces = false;       // holds volume::faces
    bool has_halves = false;      // obeys write_options::half_distances
    std::int64_t most_side = 0;   // voxels along an axis that it can number; 0: as many as there are
    std::int64_t most_voxels = 0; // voxels of a grid; 0: as many as there are
};

// True if voxels of this size are cubes, but for what fitting a grid loses by rounding.
[[nodiscard]] bool are_cubic(const std::array<double, 3>& voxel_size);

// True if this program was built with libzstd.
[[nodiscard]] bool has_zstd();

// In the order in which --help lists them.
[[nodiscard]] std::span<const format> formats();

// Why files of the format cannot go to standard output: "it ..."; empty if they can.
[[nodiscard]] std::string_view why_no_stream(const format& f);

// By the extension of the path, in either case; null when no writer has it.
[[nodiscard]] const format* find_format(const std::filesystem::path& path);

// Writes the volume and returns the paths of the files, in channel order: one, or several where the format holds one
// channel a file (OUT.CHANNEL.npy, OUT.CHANNEL.nii.gz). Throws write_error when the extension is unknown, a channel
// that the format needs is missing, the volume does not fit the format, or the disk refuses; std::invalid_argument when
// the volume itself is inconsistent. In all these cases no file of this call is left behind.
std::vector<std::filesystem::path> write(const volume& v, const std::filesystem::path& path,
                                         const write_options& options = {});

// Names that differ in a number alone: FOLDER/PREFIX1SUFFIX to FOLDER/PREFIXnSUFFIX, where n is `count`.
struct numbered_names {
    std::filesystem::path folder;
    std::string prefix, suffix;
    std::uint64_t count = UINT64_MAX;

    [[nodiscard]] std::filesystem::path name(std::uint64_t n) const {
        return folder / (prefix + std::to_string(n) + suffix);
    }
};

// The files that an output becomes.
struct written_names {
    std::vector<std::filesystem::path> files; // one for certain, or several
    std::vector<numbered_names> numbered;     // those that may be there, too, where their number is not known before
};

// How .npy and .npz hold a volume.
enum class held_as : std::uint8_t { grid, list, unknown };

// What write() and write_sparse() may write to `path`: asked for before anything is drawn, so that no output replaces
// another, or a file that is read. `shape` has extent and channels without values; an extent of 0 is not known yet.
[[nodiscard]] written_names names_of(const volume& shape, const std::filesystem::path& path,
                                     const write_options& options, held_as held);
// Throws write_error if the format of `path` cannot number the voxels of a grid of this extent, whatever is in it.
void check_extent(const std::filesystem::path& path, const std::array<std::int64_t, 3>& extent);
// Throws write_error if what is at `path` was not written by this tool and must not be replaced: a folder of .zarr.
void check_replaceable(const std::filesystem::path& path);

// Writes occupied voxels and their colours (voxel_shape.hpp), for formats that show those alone: all but .npy, .npz,
// .vti, .pvti, .nrrd, .nii, .nii.gz, .zarr, .png, .html, .nvdb and .vdb. There is no threshold here.
class voxel_shape;
std::vector<std::filesystem::path> write(const voxel_shape& v, const std::filesystem::path& path,
                                         const write_options& options);

} // namespace voxelize
