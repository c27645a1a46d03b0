// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "text_scanner.hpp"

#include "model/model_error.hpp"
#include "read/gltf/resources.hpp"

#include <algorithm>
#include <cerrno>
#include <system_error>

namespace voxelize {
namespace {

constexpr std::size_t buffer_bytes = std::size_t{64} << 10;

bool is_line_end(int c) { return c == '\n' || c == '\r'; }
bool is_blank(int c) { return c == ' ' || c == '\t' || c == '\v' || c == '\f' || c == '\0'; }

} // namespace

text_scanner::text_scanner(const std::filesystem::path& path)
    : buffer_(buffer_bytes), size_(gltf::checked_file_size(path, UINT64_MAX)) {
    errno = 0;
    file_.open(path, std::ios::binary);
    if (!file_) throw model_error("cannot be read: " + std::generic_category().message(errno != 0 ? errno : EIO));
    if (size_ == 0) throw model_error("the file is empty");
}

void text_scanner::seek(std::uint64_t offset, std::uint64_t line) {
    line_ = word_line_ = line;
    if (offset >= buffer_offset_ && offset <= buffer_offset_ + end_) {
        at_ = static_cast<std::size_t>(offset - buffer_offset_);
        return;
    }
    file_.clear();
    file_.seekg(static_cast<std::streamoff>(std::min(offset, size_)));
    buffer_offset_ = offset;
    at_ = end_ = 0;
}

bool text_scanner::fill() {
    if (!file_.good()) return false;
    buffer_offset_ += end_;
    file_.read(buffer_.data(), static_cast<std::streamsize>(buffer_.size()));
    at_ = 0;
    end_ = static_cast<std::size_t>(file_.gcount());
    return end_ != 0;
}

void text_scanner::pass_line_end() {
    const int c = peek();
    if (!is_line_end(c)) return;
    ++at_;
    ++line_;
    ended_by_cr_ = c == '\r';
    ended_by_cr_lf_ = ended_by_cr_ && peek() == '\n';
    if (ended_by_cr_lf_) ++at_;
}

std::string_view text_scanner::next_word() {
    for (int c = peek(); c >= 0; c = peek()) {
        if (is_line_end(c))
            pass_line_end();
        else if (is_blank(c))
            ++at_;
        else
            break;
    }
    return next_word_of_line();
}

std::string_view text_scanner::next_word_of_line() {
    while (is_blank(peek())) ++at_;
    word_line_ = line_;
    const auto is_of_word = [](char c) {
        const int code = static_cast<unsigned char>(c);
        return !is_line_end(code) && !is_blank(code);
    };
    text_.clear();
    while (peek() >= 0) {
        const auto begin = buffer_.begin() + static_cast<std::ptrdiff_t>(at_);
        const auto last = buffer_.begin() + static_cast<std::ptrdiff_t>(end_);
        const auto stop = std::find_if_not(begin, last, is_of_word);
        at_ = static_cast<std::size_t>(stop - buffer_.begin());
        if (stop != last && text_.empty()) return {&*begin, static_cast<std::size_t>(stop - begin)}; // no copy
        text_.append(begin, stop);
        if (stop != last) break;
    }
    return text_;
}

bool text_scanner::next_line(std::string_view& line) {
    text_.clear();
    if (peek() < 0) return false;
    while (peek() >= 0) {
        const auto begin = buffer_.begin() + static_cast<std::ptrdiff_t>(at_);
        const auto last = buffer_.begin() + static_cast<std::ptrdiff_t>(end_);
        const auto stop = std::find_if(begin, last, [](char c) { return is_line_end(static_cast<unsigned char>(c)); });
        text_.append(begin, stop);
        at_ = static_cast<std::size_t>(stop - buffer_.begin());
        if (stop != last) break;
    }
    word_line_ = line_;
    pass_line_end();
    line = text_;
    return true;
}

std::string_view text_scanner::next_bytes(std::size_t count) {
    if (at_ + count <= end_) {
        at_ += count;
        return {buffer_.data() + at_ - count, count};
    }
    text_.clear();
    while (text_.size() < count && peek() >= 0) {
        const std::size_t take = std::min(count - text_.size(), end_ - at_);
        text_.append(buffer_.data() + at_, take);
        at_ += take;
    }
    return text_;
}

void text_scanner::skip_bytes(std::uint64_t count) {
    seek(offset() + std::min(count, size_ - std::min(size_, offset())));
}

} // namespace voxelize
