// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// The records of a PLY file's elements, as numbers, whatever they are encoded in.

#include "ply_header.hpp"
#include "text_scanner.hpp"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace voxelize {

// One record: the numbers of each property, one where it is no list.
using ply_record = std::vector<std::vector<double>>;

class ply_records {
public:
    // Throws model_error where there is no header that can be read.
    explicit ply_records(const std::filesystem::path& path);

    [[nodiscard]] const ply_header& header() const { return header_; }
    [[nodiscard]] bool is_text() const { return header_.format == ply_header::encoding::text; }
    [[nodiscard]] std::uint64_t file_bytes() const { return file_.size(); }

    // Goes to the first record of an element. False where the file ends before it.
    [[nodiscard]] bool go_to(std::size_t element);
    // The byte of its first record; nothing where the file ends before it.
    [[nodiscard]] std::optional<std::uint64_t> offset_of(std::size_t element);
    // Reads the next record of an element. False where the file ends within or before it. Throws model_error for text
    // that is no number.
    [[nodiscard]] bool next(std::size_t element, ply_record& record);

    // "line 3" or "byte 70": where the last record begins.
    [[nodiscard]] std::string record_place() const;
    // "it ends in line 20" or "it ends at byte 400".
    [[nodiscard]] std::string end_place() const;

private:
    struct place {
        std::uint64_t offset, line;
    };
    [[nodiscard]] bool next_number(const ply_property& property, ply_type type, double& number);
    [[nodiscard]] bool next_text_number(const ply_property& property, double& number);
    [[nodiscard]] bool skip(std::size_t element);

    text_scanner file_;
    ply_header header_;
    std::vector<std::optional<place>> places_; // of elements
    place record_{0, 1};
    ply_record skipped_;
};

} // namespace voxelize
