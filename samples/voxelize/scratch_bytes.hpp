// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// A temporary file that is first written, then read as the parts of a model are.

#include "vertex_cache.hpp"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <vector>

namespace voxelize {

// It has no name, and is gone when the object is, or the process. Members throw write_error.
class scratch_bytes {
public:
    // A new, empty file in FOLDER.
    explicit scratch_bytes(std::filesystem::path folder);
    scratch_bytes(const scratch_bytes&) = delete;
    scratch_bytes& operator=(const scratch_bytes&) = delete;
    ~scratch_bytes();

    void append(std::span<const std::byte> bytes);
    // Nothing is appended from here on.
    [[nodiscard]] model_bytes& reader();

private:
    void flush();
    [[noreturn]] void fail(int error) const;

    std::filesystem::path folder_;
    int file_ = -1;
    std::vector<std::byte> pending_;
    std::optional<model_bytes> reader_;
};

} // namespace voxelize
