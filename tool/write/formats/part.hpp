// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Files and folders beside an output that become the output at the end: OUT.part0, OUT.part1, ... The process that
// writes one holds a lock, which the system takes back however the process ends. A part without a lock is one that a
// killed run left: it is taken, or removed.

#include <filesystem>
#include <utility>

namespace voxelize {

// A part that this process holds. Neither its destructor nor release() removes it from the disk.
class locked_part {
public:
    locked_part() = default;
    locked_part(std::filesystem::path path, int file) : path_(std::move(path)), file_(file) {}
    locked_part(locked_part&& other) noexcept
        : path_(std::exchange(other.path_, {})), file_(std::exchange(other.file_, -1)) {}
    locked_part& operator=(locked_part&& other) noexcept;
    locked_part(const locked_part&) = delete;
    locked_part& operator=(const locked_part&) = delete;
    ~locked_part() { release(); }

    // Empty for none.
    [[nodiscard]] const std::filesystem::path& path() const { return path_; }
    // The open file whose lock this is: of a file's part the part itself, empty and open for writing.
    [[nodiscard]] int file() const { return file_; }
    // Gives the lock back.
    void release();
    // Hands over the open file and with it the lock.
    [[nodiscard]] int take_file() { return std::exchange(file_, -1); }

private:
    std::filesystem::path path_;
    int file_ = -1;
};

// The name of the file in a folder that is a part, whose lock is the lock of the folder.
inline constexpr const char* part_folder_lock = ".voxelize.part";

// A part of the file `target` or of the folder `target`, which is empty but for the lock of a folder. Throws
// std::system_error where there can be none.
[[nodiscard]] locked_part open_part_file(const std::filesystem::path& target);
[[nodiscard]] locked_part make_part_folder(const std::filesystem::path& target);

} // namespace voxelize
