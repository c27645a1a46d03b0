// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// No output may replace a file that the run reads, nor another output: told before anything is drawn or written.

#include "write/formats/formats.hpp"

#include <compare>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <unordered_map>
#include <vector>

namespace voxelize {

// An output would replace a file; the message, one line, names both.
struct output_conflict : std::runtime_error {
    using std::runtime_error::runtime_error;
};

// Files that are there are told by device and inode, so links and other spellings of a path make no difference; others
// by those of the nearest folder that is there, and the rest of the path. Devices and pipes are never replaced.
class output_check {
public:
    // outputs: all that will be added, or names with placeholders for them; those that are folders take more work.
    explicit output_check(std::span<const std::filesystem::path> outputs = {});

    // The run reads the file, whether or not it is there. what: as a message calls it, "the model". Throws
    // output_conflict.
    void add_input(const std::filesystem::path& file, const std::string& what);
    // The run reads a file that the model names. A message calls it a texture of the model, or what else it is.
    void add_named(const std::filesystem::path& file, const std::filesystem::path& model);
    // The run writes these files for an output. is_known: some of them may have been added before. Throws
    // output_conflict.
    void add_output(const std::filesystem::path& output, const written_names& names, bool is_known = false);

private:
    struct identity {
        std::uint64_t device = 0, inode = 0;
        std::string rest; // of a file that is not there: its path from the folder of these numbers
        auto operator<=>(const identity&) const = default;
    };
    struct user {
        std::string what, path; // of an input; of an output without `what`
        std::string called;     // what messages call it
    };
    // Names in a folder that differ in a number alone.
    struct pattern {
        identity folder;
        std::string prefix, suffix;
        auto operator<=>(const pattern&) const = default;
    };
    struct numbered_user {
        std::uint64_t number = 0; // of a file; the greatest of names
        std::size_t by = 0;       // index into users_
    };

    [[nodiscard]] static std::optional<identity> identify(const std::filesystem::path& path);
    [[nodiscard]] const std::optional<identity>& identify_folder(const std::filesystem::path& folder);
    [[nodiscard]] const std::vector<identity>& folders_around(const std::filesystem::path& file);
    void add(const std::filesystem::path& file, std::size_t by, bool is_known);
    void add_to_folders(const std::filesystem::path& file, const identity& id, std::size_t by);
    void add_numbered(const numbered_names& names, std::size_t by, bool is_known);
    // Throws where two users may not share a file.
    void check_pair(std::size_t before, std::size_t now, const std::filesystem::path& file, bool is_known) const;
    [[noreturn]] void refuse_folder(std::size_t folder, std::size_t inside) const;

    std::vector<user> users_;
    std::map<identity, std::size_t> files_;
    std::unordered_map<std::string, std::optional<identity>> folders_;         // by their paths
    std::unordered_map<std::string, std::vector<identity>> folders_around_;    // by the path of the innermost
    std::map<pattern, std::vector<numbered_user>> with_number_, with_numbers_; // files; numbered_names
    bool replaces_folders_;
    std::map<identity, std::size_t> replaced_folders_, folders_in_use_; // that outputs are; around files
};

} // namespace voxelize
