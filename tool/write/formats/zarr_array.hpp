// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// One array of a Zarr group: its cut into chunks of 64^3 voxels, which lie in shards, and the files of these.

#include "formats.hpp"
#include "output_file.hpp"

#include "model/volume.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace voxelize {

using zyx = std::array<std::int64_t, 3>; // numbers along z, y, x

inline constexpr std::int64_t chunk_side = 64, most_chunks = 4; // voxels of a chunk, chunks of a shard, along each axis

// The cut of an array: chunks, in shards of the same number of them along each axis.
struct array_layout {
    zyx extent, shards, per_shard;

    explicit array_layout(const zyx& voxels) : extent(voxels), shards{}, per_shard{} {
        for (std::size_t a = 0; a < 3; ++a) {
            const std::int64_t chunks = (extent[a] + chunk_side - 1) / chunk_side;
            per_shard[a] = std::min(chunks, most_chunks);
            shards[a] = (chunks + per_shard[a] - 1) / per_shard[a];
        }
    }
    [[nodiscard]] static std::int64_t product(const zyx& n) { return n[0] * n[1] * n[2]; }
    [[nodiscard]] static zyx position(std::int64_t i, const zyx& n) {
        return {i / (n[1] * n[2]), i / n[2] % n[1], i % n[2]};
    }
    [[nodiscard]] static std::int64_t number(const zyx& at, const zyx& n) {
        return (at[0] * n[1] + at[1]) * n[2] + at[2];
    }
    // The first voxel of a chunk: `chunk` counts within `shard`.
    [[nodiscard]] zyx corner(std::int64_t shard, std::int64_t chunk) const {
        const zyx s = position(shard, shards), c = position(chunk, per_shard);
        zyx at{};
        for (std::size_t a = 0; a < 3; ++a) at[a] = (s[a] * per_shard[a] + c[a]) * chunk_side;
        return at;
    }
    [[nodiscard]] bool has(const zyx& corner) const {
        return corner[0] < extent[0] && corner[1] < extent[1] && corner[2] < extent[2];
    }
};

// The values of an array. `empty` has the bits of each component of an empty voxel; it is 0 or the type has 32 bits.
struct array_values {
    scalar type;
    int components;
    std::uint32_t empty;
    bool components_first; // the array is (c, z, y, x), otherwise (z, y, x, c); the bytes of its chunks are the same

    explicit array_values(const channel& c, bool components_are_first);
    // Bytes of a voxel in a chunk.
    [[nodiscard]] std::size_t voxel_bytes() const;
    // Makes all voxels empty.
    void clear(std::span<std::byte> voxels) const;
    // True if all voxels are empty.
    [[nodiscard]] bool are_empty(std::span<const std::byte> voxels) const;
};

// An array on its way into its folder, which exists. Chunks come shard by shard, in any order within a shard.
class array_file {
public:
    array_file(const array_layout& layout, const array_values& values, std::filesystem::path folder,
               const write_options& options);

    // A whole chunk as its shard holds it; nothing if all of its voxels are empty. Any thread may call it.
    [[nodiscard]] std::vector<std::byte> pack(std::vector<std::byte> voxels) const;
    // Adds what pack() made of a chunk, which counts within the shard. A shard without a chunk has no file.
    void add(std::int64_t shard, std::int64_t chunk, std::span<const std::byte> packed);
    void end_shard();
    // Writes the description, after the last shard.
    void finish() const;

    [[nodiscard]] const array_layout& layout() const { return layout_; }
    [[nodiscard]] const array_values& values() const { return values_; }

private:
    [[nodiscard]] std::string description() const;

    array_layout layout_;
    array_values values_;
    std::filesystem::path folder_;
    const write_options& options_;
    std::optional<output_file> file_;  // of the current shard, once it has a chunk
    std::vector<std::uint64_t> index_; // of the current shard: offset and size of each chunk
};

} // namespace voxelize
