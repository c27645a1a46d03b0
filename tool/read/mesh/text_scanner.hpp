// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// A file read once from front to back through a small buffer: as bytes, words or lines. Lines end with LF, CR LF or CR.

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>
#include <vector>

namespace voxelize {

class text_scanner {
public:
    // Throws model_error where the file cannot be opened or is empty.
    explicit text_scanner(const std::filesystem::path& path);

    // Goes on at a byte, in the line of that number (from 1).
    void seek(std::uint64_t offset, std::uint64_t line = 1);

    // The next word: bytes between blanks and line ends. Empty at the end of the file. Valid until the next call.
    [[nodiscard]] std::string_view next_word();
    // The rest of this line, without its end. False at the end of the file. Valid until the next call.
    [[nodiscard]] bool next_line(std::string_view& line);
    // True if the last line's end was CR, alone or with the LF behind it; true if it was both.
    [[nodiscard]] bool ended_by_cr() const { return ended_by_cr_; }
    [[nodiscard]] bool ended_by_cr_lf() const { return ended_by_cr_lf_; }
    // The next word of this line; empty where the line ends, which stays unread.
    [[nodiscard]] std::string_view next_word_of_line();
    // Bytes of the file, which may be fewer than asked for at its end. Valid until the next call.
    [[nodiscard]] std::string_view next_bytes(std::size_t count);
    void skip_bytes(std::uint64_t count);

    // The byte that is read next, and the number of the line that it is in.
    [[nodiscard]] std::uint64_t offset() const { return buffer_offset_ + at_; }
    [[nodiscard]] std::uint64_t line() const { return line_; }
    // The line that the last word was in.
    [[nodiscard]] std::uint64_t word_line() const { return word_line_; }
    [[nodiscard]] std::uint64_t size() const { return size_; }
    // True where all bytes have been read.
    [[nodiscard]] bool at_end() { return at_ == end_ && !fill(); }

private:
    // Reads on. False at the end of the file.
    bool fill();
    // The byte that is read next, or -1.
    [[nodiscard]] int peek() { return at_ == end_ && !fill() ? -1 : static_cast<unsigned char>(buffer_[at_]); }
    // Reads a line's end, where there is one.
    void pass_line_end();

    std::ifstream file_;
    std::vector<char> buffer_;
    std::uint64_t size_ = 0, buffer_offset_ = 0;
    std::size_t at_ = 0, end_ = 0;
    std::uint64_t line_ = 1, word_line_ = 1;
    bool ended_by_cr_ = false, ended_by_cr_lf_ = false;
    std::string text_; // of the last word, line or bytes
};

} // namespace voxelize
