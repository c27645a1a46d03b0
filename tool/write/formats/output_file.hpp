// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// A file that appears whole or not at all: bytes go to a temporary beside the target, commit() renames it into place,
// and the destructor removes what was never committed. Every failure is a write_error with one readable line.

#include "model/model_error.hpp"

#include <bit>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace voxelize {

static_assert(std::endian::native == std::endian::little, "the writers copy values in memory order, little end first");

// True for "npy:-", an output in that format on standard output. A file of this name is "./npy:-".
[[nodiscard]] bool is_standard_output(const std::filesystem::path& path);

// In the name of an output: what a layer's number takes the place of.
inline constexpr std::string_view layer_place = "{z}";

// The path's extension with its dot and in lower case ("A.NPZ": ".npz", "a.nii.gz": ".nii.gz"), as formats are found by
// it; of an output on standard output ("npy:-") that of its format; "{z}.png" where the file's name has a place for
// layers.
[[nodiscard]] std::string lower_extension(const std::filesystem::path& path);

// "out.npy" and "color": "out.color.npy", the name of a file that is one of several of an output.
[[nodiscard]] std::filesystem::path with_word(const std::filesystem::path& path, const std::string& word);

class output_file {
public:
    // Opens a temporary in the folder of `target`. A target that exists and is no regular file (a device, a pipe) is
    // opened itself, since nothing can be renamed over it. A symbolic link is followed and kept. A temporary that a
    // killed run left is taken. "npy:-" and the like are standard output, which cannot seek.
    explicit output_file(const std::filesystem::path& target);
    ~output_file();
    output_file(const output_file&) = delete;
    output_file& operator=(const output_file&) = delete;

    void write(std::span<const std::byte> bytes);
    void write(std::string_view text) { write(std::as_bytes(std::span{text})); }
    template <std::integral T>
    void write_value(T value) {
        write(std::as_bytes(std::span{&value, 1}));
    }

    [[nodiscard]] std::uint64_t tell() const { return at_; }
    void seek(std::uint64_t at); // from the start; for headers that are known only at the end

    // Flushes and closes: whatever the disk has to say of the bytes is said here.
    void close();
    // Closes and renames. To be called once, last; without it the target is left as it was.
    void commit();

    [[nodiscard]] const std::filesystem::path& target() const { return target_; }

private:
    [[noreturn]] void fail(std::string_view action, int error) const;

    std::filesystem::path target_;    // as given; this is what messages show
    std::filesystem::path real_;      // with symbolic links followed
    std::filesystem::path temporary_; // empty when real_ itself is open
    std::FILE* file_ = nullptr;
    int lock_ = -1; // the temporary again, whose lock (part.hpp) holds until it has its name
    std::uint64_t at_ = 0;
};

// Commits all files of one call, in this order and once all are closed, and returns their targets.
std::vector<std::filesystem::path> commit_all(std::span<const std::unique_ptr<output_file>> files);

} // namespace voxelize
