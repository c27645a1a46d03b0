// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "zarr_levels.hpp"

#include "output_file.hpp"
#include "text.hpp"
#include "zarr_level_arrays.hpp"

#include "model/parallel.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <memory>
#include <span>
#include <vector>

namespace voxelize {
namespace {

namespace fs = std::filesystem;

// Makes the levels of blocks by all threads; take(n, levels) gets those of block n, one after the other.
template <class Take>
void make_levels(const level_arrays& arrays, const volume& v, const channel& c, const std::vector<zyx>& blocks,
                 const write_options& options, const Take& take) {
    if (arrays.size() == 0) return;
    ordered_for(
        blocks.size(), thread_count(options.threads), [&](std::size_t n) { return arrays.make(v, c, blocks[n]); },
        take);
}

void make_level_folders(const volume& v, const fs::path& folder) {
    for (int l = 1; l <= num_zarr_levels(v); ++l) fs::create_directories(folder / std::to_string(l));
}

// ---- slabs

// A file of the levels of a slab's blocks: the blocks' bytes, each level's behind its length, then for each block in
// the order of level_blocks() the place of the first byte.
constexpr std::uint64_t empty_block = ~std::uint64_t{0};

std::uint64_t read_number(std::ifstream& file) {
    std::uint64_t value = 0;
    file.read(reinterpret_cast<char*>(&value), sizeof(value));
    return value;
}

// Reads such a file, block by block.
class slab_levels {
public:
    slab_levels(const fs::path& path, std::size_t num_blocks) : path_(path), file_(path, std::ios::binary) {
        file_.seekg(-static_cast<std::streamoff>(num_blocks * sizeof(std::uint64_t)), std::ios::end);
        places_.resize(num_blocks);
        file_.read(reinterpret_cast<char*>(places_.data()),
                   static_cast<std::streamsize>(num_blocks * sizeof(std::uint64_t)));
        check();
    }
    // The next block of the slab.
    [[nodiscard]] block_levels next(std::size_t levels) {
        const std::uint64_t place = places_.at(at_++);
        block_levels made;
        if (place == empty_block) return made;
        file_.seekg(static_cast<std::streamoff>(place));
        for (std::size_t l = 0; l < levels; ++l) {
            made.emplace_back(static_cast<std::size_t>(read_number(file_)));
            file_.read(reinterpret_cast<char*>(made.back().data()), static_cast<std::streamsize>(made.back().size()));
        }
        check();
        return made;
    }

private:
    void check() const {
        if (!file_) throw write_error(path_, "it ends too soon; remove it, and the slab's mark");
    }

    fs::path path_;
    std::ifstream file_;
    std::vector<std::uint64_t> places_;
    std::size_t at_ = 0;
};

} // namespace

std::uint64_t num_level_blocks(const volume& v) {
    return num_zarr_levels(v) == 0 ? 0 : static_cast<std::uint64_t>(array_layout::product(num_level_blocks_along(v)));
}

void write_zarr_levels(const volume& v, const channel& c, const fs::path& folder, const write_options& options,
                       const std::function<void()>& advance) {
    make_level_folders(v, folder);
    level_arrays arrays(v, c, folder, options);
    const std::vector<zyx> blocks = level_blocks(v, 0, num_level_blocks_along(v)[0]);
    make_levels(arrays, v, c, blocks, options, [&](std::size_t n, const block_levels& made) {
        arrays.add(blocks[n], made);
        advance();
    });
    arrays.finish();
}

void write_slab_levels(const volume& v, const channel& c, const fs::path& file, std::int64_t first_layer,
                       std::int64_t last_layer, const write_options& options) {
    const level_arrays arrays(v, c, {}, options); // writes none
    const std::vector<zyx> blocks =
        level_blocks(v, first_layer / level_block_side, (last_layer + level_block_side - 1) / level_block_side);
    std::vector<std::uint64_t> places(blocks.size(), empty_block);
    output_file out(file);
    make_levels(arrays, v, c, blocks, options, [&](std::size_t n, const block_levels& made) {
        if (made.empty()) return;
        places[n] = out.tell();
        for (const std::vector<std::byte>& level : made) {
            out.write_value(std::uint64_t{level.size()});
            out.write(level);
        }
    });
    out.write(std::as_bytes(std::span(places)));
    out.commit();
}

void join_slab_levels(const volume& v, const channel& c, const fs::path& folder, std::int64_t slab_layers,
                      const std::function<fs::path(std::int64_t slab)>& file, const write_options& options) {
    make_level_folders(v, folder);
    level_arrays arrays(v, c, folder, options);
    if (arrays.size() != 0) {
        const std::int64_t each = slab_layers / level_block_side, layers = num_level_blocks_along(v)[0];
        std::vector<std::unique_ptr<slab_levels>> slabs;
        for (std::int64_t first = 0; first < layers; first += each)
            slabs.push_back(
                std::make_unique<slab_levels>(file(static_cast<std::int64_t>(slabs.size())),
                                              level_blocks(v, first, std::min(layers, first + each)).size()));
        // Each slab's blocks come in the order of its file.
        for (const zyx& block : level_blocks(v, 0, layers))
            arrays.add(block, slabs[static_cast<std::size_t>(block[0] / each)]->next(arrays.size()));
    }
    arrays.finish();
}

std::string multiscale_description(const volume& v, const channel& c) {
    const bool several = c.components > 1;
    // A value for each axis of the arrays.
    const auto list = [&](const std::array<double, 3>& xyz, const char* component) {
        std::string text = several ? std::string(component) + ", " : "";
        return "[" + text + number(xyz[2]) + ", " + number(xyz[1]) + ", " + number(xyz[0]) + "]";
    };
    std::string axes = several ? R"({"name": "c", "type": "channel"}, )" : "", datasets;
    for (const char* const axis : {"z", "y", "x"})
        axes += std::string(R"({"name": ")") + axis + R"(", "type": "space"})" + (*axis == 'x' ? "" : ", ");
    for (int l = 0; l <= num_zarr_levels(v); ++l) {
        std::array<double, 3> scale{}, first{}; // the size of a voxel, the centre of the first one
        for (std::size_t a = 0; a < 3; ++a) {
            scale[a] = std::ldexp(v.voxel_size[a], l);
            first[a] = v.origin[a] + scale[a] / 2;
        }
        datasets += std::string(l == 0 ? "" : ",") + "\n      {\"path\": \"" + std::to_string(l) +
                    R"(", "coordinateTransformations": [{"type": "scale", "scale": )" + list(scale, "1") +
                    R"(}, {"type": "translation", "translation": )" + list(first, "0") + "}]}";
    }
    return "{\n  \"zarr_format\": 3,\n  \"node_type\": \"group\",\n  \"attributes\": {\"ome\": {\"version\": \"0.5\", "
           "\"multiscales\": [{\n    \"name\": \"" +
           c.name + "\",\n    \"axes\": [" + axes + "],\n    \"datasets\": [" + datasets + "]}]}}\n}\n";
}

} // namespace voxelize
