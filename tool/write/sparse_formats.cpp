// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "sparse_formats.hpp"

#ifdef VOXELIZE_HAS_OPENVDB
#include "vdb.hpp"
#endif

#include "write/formats/npy.hpp"
#include "write/formats/output_file.hpp"
#include "write/formats/png.hpp"
#include "write/formats/progress.hpp"
#include "write/formats/voxel_shape.hpp"
#include "write/formats/zip.hpp"
#include "write/level_set.hpp"
#include "write/page/page.hpp"

#include <voxelpipe/sparse/host_sparse.hpp>
#include <voxelpipe/sparse/io/nanovdb.hpp>

#include <algorithm>
#include <cstring>
#include <functional>
#include <iterator>
#include <memory>
#include <string>
#include <utility>

namespace voxelize {
namespace {

using voxelpipe::io::nanovdb_file;
namespace nanovdb = voxelpipe::io::nanovdb;

// ---- .nvdb
// ------------------------------------------------------------------------------------------------------------

voxelpipe::grid grid_of(const volume& shape) {
    voxelpipe::grid g;
    for (int a = 0; a < 3; ++a) {
        const auto i = static_cast<std::size_t>(a);
        g.origin[a] = shape.origin[i];
        g.voxel_size[a] = shape.voxel_size[i];
        g.extent[a] = static_cast<int>(shape.extent[i]);
    }
    return g;
}

// Bricks of some layers of a volume, by their numbers in a table of their own.
struct brick_slab {
    std::vector<std::uint64_t> keys, offsets{0};
    std::vector<voxelpipe::brick_mask> masks;
    std::vector<std::pair<std::uint64_t, std::uint64_t>> runs; // from this rank on, what to add for the volume's

    void add(const sparse_volume& v, std::uint64_t brick) {
        const std::uint64_t rank = offsets.back(), from = v.offsets[brick];
        if (runs.empty() || from - rank != runs.back().second) runs.emplace_back(rank, from - rank);
        keys.push_back(v.keys[brick]);
        masks.push_back(v.masks[brick]);
        offsets.push_back(rank + v.offsets[brick + 1] - from);
    }
    [[nodiscard]] std::uint64_t rank_in_volume(std::uint64_t rank) const {
        const auto after = std::upper_bound(runs.begin(), runs.end(), rank,
                                            [](std::uint64_t r, const auto& run) { return r < run.first; });
        return rank + std::prev(after)->second;
    }
    [[nodiscard]] voxelpipe::brick_table table(const sparse_volume& v) const {
        voxelpipe::brick_table t = v.table();
        t.keys = keys.data();
        t.masks = masks.data();
        t.offsets = offsets.data();
        t.count = keys.size();
        return t;
    }
};

// The ends of the slabs, in layers of bricks: as many slabs as the options say, or as few as hold leaves_per_grid
// bricks each.
std::vector<std::uint64_t> slab_ends(const sparse_volume& v, const write_options& options) {
    const auto layers = static_cast<std::uint64_t>((v.shape.extent[2] + 7) / 8);
    std::vector<std::uint64_t> ends;
    if (options.pieces > 0) {
        const auto slabs = std::min(layers, static_cast<std::uint64_t>(options.pieces));
        for (std::uint64_t n = 1; n <= slabs; ++n) ends.push_back(n * layers / slabs);
        return ends;
    }
    if (v.keys.size() <= options.leaves_per_grid) return {layers};
    std::vector<std::uint64_t> bricks(layers);
    for (const std::uint64_t key : v.keys) ++bricks[static_cast<std::size_t>(voxelpipe::core::morton_position(key).z)];
    std::uint64_t held = 0;
    for (std::uint64_t z = 0; z < layers; ++z) {
        if (held != 0 && held + bricks[z] > options.leaves_per_grid) {
            ends.push_back(z);
            held = 0;
        }
        held += bricks[z];
    }
    ends.push_back(layers);
    return ends;
}

std::vector<brick_slab> cut_into_slabs(const sparse_volume& v, const std::vector<std::uint64_t>& ends) {
    std::vector<brick_slab> slabs(ends.size());
    for (std::uint64_t b = 0; b < v.keys.size(); ++b) {
        const auto z = static_cast<std::uint64_t>(voxelpipe::core::morton_position(v.keys[b]).z);
        slabs[static_cast<std::size_t>(std::upper_bound(ends.begin(), ends.end(), z) - ends.begin())].add(v, b);
    }
    return slabs;
}

// A grid of the bricks of `table`, whose ranks `rank_of` turns into those of the volume.
template <class T, class RankOf>
void add_grid(nanovdb_file& file, const sparse_volume& v, const channel& c, const std::string& name,
              const voxelpipe::brick_table& table, const RankOf& rank_of) {
    T background;
    const std::uint32_t empty = empty_value(c);
    for (std::size_t at = 0; at < sizeof(T); at += sizeof(empty))
        std::memcpy(reinterpret_cast<std::byte*>(&background) + at, &empty, sizeof(empty));
    const std::byte* const data = c.data.data();
    nanovdb::source<T> grid{name, table, grid_of(v.shape), background, [data, rank_of](std::uint64_t rank) {
                                T value;
                                std::memcpy(&value, data + rank_of(rank) * sizeof(T), sizeof(T));
                                return value;
                            }};
    if (is_fog(c)) grid.meaning = nanovdb::grid_class::fog_volume;
    file.add<T>(std::move(grid));
}

template <class RankOf>
void add_channel(nanovdb_file& file, const sparse_volume& v, const channel& c, const std::string& name,
                 const voxelpipe::brick_table& table, const RankOf& rank_of, const std::filesystem::path& path) {
    if (c.type == scalar::bit)
        file.add<nanovdb::mask_value>({name, table, grid_of(v.shape), false, {}});
    else if (c.type == scalar::u8 && c.components == 4)
        add_grid<nanovdb::rgba8>(file, v, c, name, table, rank_of);
    else if (c.type == scalar::u32 && c.components == 1)
        add_grid<std::uint32_t>(file, v, c, name, table, rank_of);
    else if (c.type == scalar::i32 && c.components == 1)
        add_grid<std::int32_t>(file, v, c, name, table, rank_of);
    else if (c.type == scalar::i64 && c.components == 1)
        add_grid<std::int64_t>(file, v, c, name, table, rank_of);
    else if (c.type == scalar::f32 && c.components == 1)
        add_grid<float>(file, v, c, name, table, rank_of);
    else if (c.type == scalar::f32 && c.components == 3)
        add_grid<glm::vec3>(file, v, c, name, table, rank_of);
    else
        throw write_error(path, ".nvdb has no type for the values of channel " + c.name);
}

std::vector<std::filesystem::path> write_grids(const nanovdb_file& file, const std::filesystem::path& path,
                                               const write_options& options) {
    output_file out(path);
    progress_meter meter(options.progress, file.size());
    file.write([&](const void* bytes, std::size_t count) {
        out.write(std::span{static_cast<const std::byte*>(bytes), count});
        meter.advance(count);
    });
    out.commit();
    return {path};
}

std::vector<std::filesystem::path> write_nvdb(const sparse_volume& v, const std::filesystem::path& path,
                                              const write_options& options) {
    nanovdb_file file;
    const std::vector<std::uint64_t> ends = slab_ends(v, options);
    if (ends.size() > 1 && !v.tiles.empty()) return write_nvdb(open_tiles(v), path, options);
    std::vector<brick_slab> slabs;
    if (ends.size() > 1) slabs = cut_into_slabs(v, ends);
    for (const channel& c : v.channels) {
        if (slabs.empty())
            add_channel(
                file, v, c, c.name, v.table(), [](std::uint64_t rank) { return rank; }, path);
        for (std::size_t n = 0; n < slabs.size(); ++n)
            add_channel(
                file, v, c, c.name + "." + std::to_string(n + 1), slabs[n].table(v),
                [&slab = slabs[n]](std::uint64_t rank) { return slab.rank_in_volume(rank); }, path);
    }
    return write_grids(file, path, options);
}

// The distances of a field, as a level set where they are one.
void add_distances(nanovdb_file& file, const band_bricks& b, const channel& c) {
    const float* const values = reinterpret_cast<const float*>(c.data.data());
    nanovdb::source<float> grid{c.name, b.band.table(), grid_of(b.band.shape), b.background,
                                [values](std::uint64_t rank) { return values[rank]; }};
    grid.meaning = b.is_level_set ? nanovdb::grid_class::level_set : nanovdb::grid_class::unknown;
    if (b.is_level_set) {
        grid.inside = b.inside.data();
        grid.table.tiles = b.in_inside.data();
        grid.table.num_tiles = b.in_inside.size();
    }
    file.add<float>(std::move(grid));
}

// What readers of level sets should know of a field.
void warn_of_band(const volume& v, const band_bricks& field, const std::filesystem::path& path,
                  const write_options& options) {
    if (!options.warn) return;
    if (v.distances->is_signed && !are_cubic(v.voxel_size))
        options.warn("\"" + path.string() +
                     "\": level sets have cubic voxels, and this grid's are not: its class is unknown");
    else if (const std::string warning = cut_band_warning(field); !warning.empty())
        options.warn("\"" + path.string() + "\": " + warning);
}

// ---- .npz and .npy
// ----------------------------------------------------------------------------------------------------

// One array: a row of `columns` values for each voxel; one column has no dimension of its own.
struct array {
    std::string name;
    scalar type;
    int columns;
    std::uint64_t bytes;
    std::function<void(const entry_sink&)> stream; // hands out all bytes in order
};

std::string header_of(const array& a, std::uint64_t voxels) {
    std::string shape = "(";
    shape += std::to_string(voxels);
    shape += ',';
    if (a.columns > 1) shape += ' ';
    if (a.columns > 1) shape += std::to_string(a.columns);
    shape += ')';
    return npy_header(a.type, shape);
}

std::vector<array> arrays_of(const sparse_volume& v) {
    std::vector<array> arrays;
    const std::uint64_t n = v.num_voxels();
    const auto coords = [&v](const entry_sink& sink) {
        std::vector<std::int32_t> rows;
        const voxelpipe::brick_table table = v.table();
        for (std::uint64_t b = 0; b < table.count; ++b) {
            voxelpipe::for_each_voxel_in(table, b, [&](const glm::ivec3& p, std::uint64_t) {
                for (int a = 0; a < 3; ++a) rows.push_back(p[a]);
            });
            constexpr std::size_t piece = 1 << 18;
            if (rows.size() < piece && b + 1 < table.count) continue;
            sink(std::as_bytes(std::span{rows}));
            rows.clear();
        }
    };
    arrays.push_back({"coords", scalar::i32, 3, n * 12, coords});
    for (const channel& c : v.channels) {
        if (c.type == scalar::bit) continue; // every row is a voxel that is occupied
        const auto values = [&c](const entry_sink& sink) {
            constexpr std::size_t piece = 1 << 20;
            for (std::size_t at = 0; at < c.data.size(); at += piece)
                sink(std::span{c.data}.subspan(at, std::min(piece, c.data.size() - at)));
        };
        arrays.push_back({c.name, c.type, c.components, c.data.size(), values});
    }
    return arrays;
}

std::uint64_t bytes_of(const std::vector<array>& arrays) {
    std::uint64_t bytes = 0;
    for (const array& a : arrays) bytes += a.bytes;
    return bytes;
}

std::vector<std::filesystem::path> write_sparse_npz(const sparse_volume& v, const std::filesystem::path& path,
                                                    const write_options& options) {
    const std::vector<array> arrays = arrays_of(v);
    progress_meter meter(options.progress, bytes_of(arrays));
    output_file out(path);
    zip_archive archive(out, options.compression);
    for (const array& a : arrays)
        archive.add(a.name + ".npy", [&](const entry_sink& sink) {
            const std::string header = header_of(a, v.num_voxels());
            sink(std::as_bytes(std::span{header}));
            a.stream([&](std::span<const std::byte> piece) {
                sink(piece);
                meter.advance(piece.size());
            });
        });
    archive.finish();
    out.commit();
    return {path};
}

std::vector<std::filesystem::path> write_sparse_npy(const sparse_volume& v, const std::filesystem::path& path,
                                                    const write_options& options) {
    const std::vector<array> arrays = arrays_of(v);
    progress_meter meter(options.progress, bytes_of(arrays));
    std::vector<std::unique_ptr<output_file>> files;
    for (const array& a : arrays) {
        const bool beside = &a != &arrays.front();
        files.push_back(std::make_unique<output_file>(beside ? with_word(path, a.name) : path));
        files.back()->write(header_of(a, v.num_voxels()));
        a.stream([&](std::span<const std::byte> piece) {
            files.back()->write(piece);
            meter.advance(piece.size());
        });
    }
    return commit_all(files);
}

// ---- .png
// -------------------------------------------------------------------------------------------------------------

std::vector<std::filesystem::path> write_sparse_png(const sparse_volume& v, const std::filesystem::path& path,
                                                    const write_options& options) {
    static_assert(sizeof(voxelpipe::brick_mask) == 8 * sizeof(std::uint64_t));
    const preview_bricks bricks{v.keys.data(), v.masks.empty() ? nullptr : v.masks.front().words, v.offsets.data(),
                                v.keys.size()};
    return write_picture(path, options, [&](const preview_options& preview) {
        return render_preview(v.shape, bricks, find_shown(v.channels), preview, options.progress);
    });
}

// ---- the others
// -------------------------------------------------------------------------------------------------------

} // namespace

bool is_streamed(const std::string& extension) {
    return extension == ".npy" || extension == ".npz" || extension == ".vti" || extension == ".pvti" ||
           extension == ".nrrd" || extension == ".nii" || extension == ".nii.gz" || extension == ".zarr" ||
           extension == "{z}.png";
}

bool is_sparse_format(const std::filesystem::path& path) {
    const format* const f = find_format(path);
    return f != nullptr && f->only_sparse;
}

std::vector<std::filesystem::path> write_nvdb(const volume& v, const std::filesystem::path& path,
                                              const write_options& options) {
    if (!v.distances) return write_nvdb(make_sparse(v, options.threads), path, options);
    const band_bricks bricks = find_band(v, options.threads);
    nanovdb_file file;
    for (const channel& c : bricks.band.channels) {
        if (c.name == "distance")
            add_distances(file, bricks, c);
        else
            add_channel(
                file, bricks.band, c, c.name, bricks.band.table(), [](std::uint64_t rank) { return rank; }, path);
    }
    std::vector<std::filesystem::path> files = write_grids(file, path, options);
    warn_of_band(v, bricks, path, options);
    return files;
}

#ifdef VOXELIZE_HAS_OPENVDB
std::vector<std::filesystem::path> write_vdb(const volume& v, const std::filesystem::path& path,
                                             const write_options& options) {
    if (!v.distances) return write_vdb(make_sparse(v, options.threads), path, options);
    const band_bricks bricks = find_band(v, options.threads);
    std::vector<std::filesystem::path> files = write_vdb(bricks, path, options);
    warn_of_band(v, bricks, path, options);
    return files;
}
#endif

std::vector<std::filesystem::path> write_sparse(const sparse_volume& v, const std::filesystem::path& path,
                                                const write_options& options) {
    const std::string extension = lower_extension(path);
    if (extension == ".nvdb") return write_nvdb(v, path, options);
#ifdef VOXELIZE_HAS_OPENVDB
    if (extension == ".vdb") return write_vdb(v, path, options);
#endif
    const bool is_listed = options.lists && (extension == ".npz" || extension == ".npy");
    if (is_streamed(extension) && !is_listed)
        return write(as_dense(v, v.channels), path, options);                // they hold all channels
    if (!v.tiles.empty()) return write_sparse(open_tiles(v), path, options); // the others name every voxel
    if (is_listed && extension == ".npz") return write_sparse_npz(v, path, options);
    if (is_listed) return write_sparse_npy(v, path, options);
    if (extension == ".png") return write_sparse_png(v, path, options);
    if (extension == ".html") return write_page(v, path, options);
    return write(voxel_shape(v), path, options); // they show the occupied voxels
}

} // namespace voxelize
