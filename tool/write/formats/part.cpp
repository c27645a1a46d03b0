// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "part.hpp"

#include "model/system.hpp"

#include <cerrno>
#include <string>
#include <system_error>

namespace voxelize {
namespace {

namespace fs = std::filesystem;

constexpr int most_parts = 1000;
constexpr int looked_at = 4; // names after the one that is taken, which killed runs may have left

fs::path name_of_part(const fs::path& target, int n) {
    return target.parent_path() / (target.filename().string() + ".part" + std::to_string(n));
}

// True if the path still leads to the open file.
bool is_at(const fs::path& path, int file) {
    const auto mine = os::facts_of(file), there = os::facts_of(path, os::links::keep);
    return mine && there && mine->id == there->id;
}

// A new file and its lock. A file system without locks gives the file alone. None if there is a file of this name,
// which errno says to be EEXIST, or if another process was quicker to take it.
locked_part create(const fs::path& path) {
    const int file = os::open_file(path, os::opening::create);
    if (file < 0) return {};
    if ((os::lock_file(file, false) || errno != EWOULDBLOCK) && is_at(path, file)) return {path, file};
    os::close_file(file);
    errno = EEXIST;
    return {};
}

// The lock of a file that a process left which has ended: a regular file of this user, with this name alone.
locked_part take(const fs::path& path) {
    const auto there = os::facts_of(path, os::links::keep);
    if (!there || there->kind != os::file_kind::regular || !there->is_only_name) return {};
    const int file = os::open_file(path, os::opening::read_write);
    if (file < 0) return {};
    if (os::lock_file(file, false) && is_at(path, file)) return {path, file};
    os::close_file(file);
    return {};
}

// Removes a folder that a killed run left. False if it is another's.
bool remove_left_folder(const fs::path& path) {
    if (os::remove_empty_folder(path)) return true; // it ended before it made the lock
    locked_part left = take(path / part_folder_lock);
    if (left.path().empty()) return false;
    if constexpr (os::open_files_keep_folders) left.release();
    std::error_code error;
    fs::remove_all(path, error);
    return !error;
}

[[noreturn]] void fail(int error, const char* what) { throw std::system_error(error, std::generic_category(), what); }

} // namespace

locked_part& locked_part::operator=(locked_part&& other) noexcept {
    if (this != &other) {
        release();
        path_ = std::exchange(other.path_, {});
        file_ = std::exchange(other.file_, -1);
    }
    return *this;
}

void locked_part::release() {
    if (file_ >= 0) os::close_file(std::exchange(file_, -1));
    path_.clear();
}

locked_part open_part_file(const fs::path& target) {
    for (int n = 0; n < most_parts; ++n) {
        const fs::path path = name_of_part(target, n);
        locked_part part = create(path);
        if (part.path().empty() && errno != EEXIST) fail(errno, "open");
        if (part.path().empty()) {
            part = take(path);
            if (part.path().empty() || !os::empty_file(part.file())) continue;
        }
        for (int m = n + 1; m <= n + looked_at; ++m)
            if (const locked_part left = take(name_of_part(target, m)); !left.path().empty()) {
                std::error_code ignored;
                fs::remove(left.path(), ignored);
            }
        return part;
    }
    fail(EEXIST, "open");
}

locked_part make_part_folder(const fs::path& target) {
    for (int n = 0; n < most_parts; ++n) {
        const fs::path path = name_of_part(target, n);
        bool is_new = os::make_folder(path);
        if (!is_new && errno != EEXIST) fail(errno, "make a folder");
        if (!is_new && remove_left_folder(path)) is_new = os::make_folder(path);
        if (!is_new) continue;
        locked_part part = create(path / part_folder_lock);
        if (part.path().empty()) continue; // another process has taken it for one that was left
        for (int m = n + 1; m <= n + looked_at; ++m) (void)remove_left_folder(name_of_part(target, m));
        return part;
    }
    fail(EEXIST, "make a folder");
}

} // namespace voxelize
