// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// A temporary file that is first written, then read as the parts of a model or of a mesh are.

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
    // A new, empty file in FOLDER, for WHAT, which messages name.
    explicit scratch_bytes(std::filesystem::path folder, const char* what = "the model");

    void append(std::span<const std::byte> bytes);
    // Bytes that were appended. Once all are, and flush() was called, any threads may read.
    void read(std::uint64_t offset, std::span<char> bytes);
    // Other bytes in the place of some that were appended. Nobody reads meanwhile.
    void replace(std::uint64_t offset, std::span<const std::byte> bytes);
    void flush();

private:
    // Does work(), whose std::system_error becomes a write_error.
    template <class Work>
    auto named(const Work& work) const;

    std::filesystem::path folder_;
    const char* what_;
    voxelpipe::slabs::scratch_file file_;
    std::vector<std::byte> pending_;
};

} // namespace voxelize
