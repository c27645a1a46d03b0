// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// A file as memory, without a copy of it: pages come from the page cache when they are read.

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>

namespace voxelize::gltf {

class mapped_file {
public:
    // Refuses by name what is no regular file, cannot be read, or has more than MAX_BYTES; throws gltf_error. A file
    // that another program cuts short while it is mapped ends this one (SIGBUS), as with every mapping.
    mapped_file(const std::filesystem::path& file, std::uint64_t max_bytes);
    ~mapped_file();
    mapped_file(const mapped_file&) = delete;
    mapped_file& operator=(const mapped_file&) = delete;

    [[nodiscard]] std::span<const std::byte> bytes() const { return {static_cast<const std::byte*>(data_), size_}; }

private:
    void* data_ = nullptr; // null where the file is empty
    std::size_t size_ = 0;
};

} // namespace voxelize::gltf
