// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// What slabs of one model give a pass over all of them (sparse/slab_passes.hpp), kept as files beside the slabs, so
// that no other process and no later run has to find it again. A file is there as a whole or not at all, and one whose
// length or checksum is wrong counts as missing.

#include <cstddef>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace voxelize {

class pass_files {
public:
    // folder: of the slabs, which is there. first: the slab that this process begins its passes with; processes that
    // begin with others share them.
    pass_files(std::filesystem::path folder, std::size_t first) : folder_(std::move(folder)), first_(first) {}

    [[nodiscard]] const std::filesystem::path& folder() const { return folder_; }
    [[nodiscard]] std::size_t first() const { return first_; }
    // What was kept under a name. Throws std::bad_alloc.
    [[nodiscard]] std::optional<std::vector<std::byte>> read(const std::string& name) const;
    // Throws write_error.
    void write(const std::string& name, std::span<const std::byte> bytes) const;

private:
    [[nodiscard]] std::filesystem::path path_of(const std::string& name) const { return folder_ / ("pass." + name); }

    std::filesystem::path folder_;
    std::size_t first_;
};

} // namespace voxelize
