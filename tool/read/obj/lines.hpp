// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// The lines of an OBJ or MTL file and the words in them, however a program ends, continues and indents them.

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>
#include <vector>

namespace voxelize::obj {

// A file's lines, of which a block is held at a time. Lines end with LF, CR LF or CR. A byte order mark is passed over.
// A line whose last character is a backslash goes on with the next one, unless it has a comment.
class line_reader {
public:
    // Throws model_error where the file cannot be opened.
    explicit line_reader(const std::filesystem::path& file);

    // The next line without its end, valid until the next call. Returns false behind the last. Throws model_error for
    // text in UTF-16, a line of more than 64 MiB, and a file that cannot be read to its end.
    [[nodiscard]] bool next(std::string_view& line);
    // Number of the last line, from 1; of its first part where it is continued.
    [[nodiscard]] std::uint64_t number() const { return number_; }

private:
    // The next line as the file has it.
    [[nodiscard]] bool next_in_file(std::string_view& line);
    [[nodiscard]] bool read_more();
    void check_start();

    std::ifstream file_;
    std::vector<char> buffer_;
    std::size_t at_ = 0, end_ = 0; // the unfinished line in the buffer
    std::uint64_t lines_ = 0;      // that the file has up to here
    std::uint64_t number_ = 0;
    bool has_started_ = false, ended_with_cr_ = false;
    std::string joined_;
};

[[nodiscard]] inline bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\v' || c == '\f' || c == '\0'; }

// TEXT without blanks around it.
[[nodiscard]] std::string_view trimmed(std::string_view text);

// Cuts the first word off REST and returns it; empty for a REST of blanks.
[[nodiscard]] std::string_view next_word(std::string_view& rest);

// A name of one or more words as a line has it: without blanks around it, and without a pair of quotes.
[[nodiscard]] std::string name_of(std::string_view rest);

// TEXT before a comment: up to a '#' that begins a word.
[[nodiscard]] std::string_view before_comment(std::string_view text);

// TEXT in lower case, as far as it is ASCII.
[[nodiscard]] std::string lower(std::string_view text);

// "line 12: 'f 1//x'", with what cannot be printed replaced and long lines cut.
[[nodiscard]] std::string cited(std::uint64_t number, std::string_view line);

} // namespace voxelize::obj
