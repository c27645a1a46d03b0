// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// A temporary file that is first written, then read as the parts of a model are.

#include <voxelpipe/slabs/bins.hpp>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

namespace voxelize {

// A slabs::scratch_file whose bytes come one after the other, and whose failures are the tool's: members throw
// write_error.
class scratch_bytes {
public:
    // A new, empty file in FOLDER.
    explicit scratch_bytes(std::filesystem::path folder);

    void append(std::span<const std::byte> bytes);
    // Bytes that were appended.
    void read(std::uint64_t offset, std::span<char> bytes);

private:
    void flush();
    // Does work(), whose std::system_error becomes a write_error.
    template <class Work>
    auto named(const Work& work) const;

    std::filesystem::path folder_;
    voxelpipe::slabs::scratch_file file_;
    std::vector<std::byte> pending_;
};

} // namespace voxelize
