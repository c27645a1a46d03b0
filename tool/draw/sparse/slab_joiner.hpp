// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// One volume of parts of a grid that are drawn one after the other. Their values wait in a temporary file, so that
// memory holds each of them once: in its part until that is there, in the whole at the end.

#include "model/scratch_bytes.hpp"
#include "model/sparse_volume.hpp"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <vector>

namespace voxelize {

// Members throw std::bad_alloc, and write_error.
class slab_joiner {
public:
    // num_parts: that will come. folder: for the file; one part needs none.
    slab_joiner(std::size_t num_parts, const std::filesystem::path& folder);

    // Parts share no brick and have the same channels.
    void add(sparse_volume&& part);
    // As join_slabs() gives it, once all parts have come.
    [[nodiscard]] sparse_volume finish();

private:
    // Values of a part's channel: where they lie in the file, and some of them.
    struct window {
        std::uint64_t begin = 0, end = 0; // bytes of the file
        std::uint64_t first = 0;          // byte of the file
        std::vector<char> bytes;
    };
    void read(window& from, std::uint64_t offset, std::span<std::byte> to);

    std::optional<scratch_bytes> file_;
    std::uint64_t size_ = 0; // bytes of the file
    std::vector<sparse_volume> parts_;
    std::vector<std::vector<window>> values_; // by part and channel
};

} // namespace voxelize
