// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "lines.hpp"

#include "model/model_error.hpp"
#include "read/gltf/text.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <system_error>

namespace voxelize::obj {
namespace {

constexpr std::size_t first_block_bytes = std::size_t{1} << 18, most_line_bytes = std::size_t{64} << 20;

bool ends_line(char c) { return c == '\n' || c == '\r'; }

} // namespace

line_reader::line_reader(const std::filesystem::path& file) {
    errno = 0;
    file_.open(file, std::ios::binary);
    if (!file_.is_open())
        throw model_error("cannot be read: " + std::generic_category().message(errno != 0 ? errno : EIO));
    buffer_.resize(first_block_bytes);
}

bool line_reader::read_more() {
    if (at_ != 0) {
        std::memmove(buffer_.data(), buffer_.data() + at_, end_ - at_);
        end_ -= at_;
        at_ = 0;
    }
    if (end_ == buffer_.size()) {
        if (end_ >= most_line_bytes)
            throw model_error("line " + std::to_string(lines_ + 1) + " has more than 64 MiB: the file is no text");
        buffer_.resize(2 * buffer_.size());
    }
    file_.read(buffer_.data() + end_, static_cast<std::streamsize>(buffer_.size() - end_));
    if (file_.bad()) throw model_error("cannot be read to its end: " + std::generic_category().message(errno));
    const auto got = static_cast<std::size_t>(file_.gcount());
    end_ += got;
    return got != 0;
}

void line_reader::check_start() {
    has_started_ = true;
    while (end_ - at_ < 3 && read_more()) {
    }
    const std::string_view start{buffer_.data() + at_, std::min<std::size_t>(end_ - at_, 3)};
    if (start.starts_with("\xFE\xFF") || start.starts_with("\xFF\xFE"))
        throw model_error("the file is text in UTF-16, not UTF-8");
    if (start == "\xEF\xBB\xBF") at_ += start.size();
}

bool line_reader::next_in_file(std::string_view& line) {
    if (!has_started_) check_start();
    if (ended_with_cr_ && (at_ != end_ || read_more())) {
        if (buffer_[at_] == '\n') ++at_;
        ended_with_cr_ = false;
    }
    std::size_t searched = 0;
    while (true) {
        const char *const from = buffer_.data() + at_ + searched, *const to = buffer_.data() + end_;
        const char* const found = std::find_if(from, to, ends_line);
        if (found != to) {
            line = {buffer_.data() + at_, searched + static_cast<std::size_t>(found - from)};
            at_ += line.size() + 1;
            ended_with_cr_ = *found == '\r';
            break;
        }
        searched = end_ - at_;
        if (read_more()) continue;
        if (searched == 0) return false;
        line = {buffer_.data() + at_, searched};
        at_ = end_;
        break;
    }
    ++lines_;
    return true;
}

bool line_reader::next(std::string_view& line) {
    const auto is_continued = [](std::string_view& part) {
        if (part.find('\\') == std::string_view::npos) return false;
        const std::string_view text = trimmed(part);
        if (!text.ends_with('\\') || text.find('#') != std::string_view::npos) return false;
        part = text;
        return true;
    };
    if (!next_in_file(line)) return false;
    number_ = lines_;
    if (!is_continued(line)) return true;
    joined_.clear();
    std::string_view part = line;
    while (is_continued(part)) {
        joined_.append(part.substr(0, part.size() - 1)).push_back(' ');
        if (joined_.size() > most_line_bytes)
            throw model_error("line " + std::to_string(number_) + " goes on for more than 64 MiB");
        if (!next_in_file(part)) part = {};
    }
    joined_.append(part);
    line = joined_;
    return true;
}

std::string_view trimmed(std::string_view text) {
    while (!text.empty() && is_blank(text.front())) text.remove_prefix(1);
    while (!text.empty() && is_blank(text.back())) text.remove_suffix(1);
    return text;
}

std::string_view next_word(std::string_view& rest) {
    std::size_t begin = 0;
    while (begin < rest.size() && is_blank(rest[begin])) ++begin;
    std::size_t end = begin;
    while (end < rest.size() && !is_blank(rest[end])) ++end;
    const std::string_view word = rest.substr(begin, end - begin);
    rest.remove_prefix(end);
    return word;
}

std::string name_of(std::string_view rest) {
    rest = trimmed(rest);
    if (rest.size() > 1 && rest.front() == '"' && rest.back() == '"') rest = rest.substr(1, rest.size() - 2);
    return std::string(rest);
}

std::string_view before_comment(std::string_view text) {
    for (std::size_t at = text.find('#'); at != std::string_view::npos; at = text.find('#', at + 1))
        if (at == 0 || is_blank(text[at - 1])) return text.substr(0, at);
    return text;
}

std::string lower(std::string_view text) {
    std::string result(text);
    for (char& c : result)
        if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
    return result;
}

std::string cited(std::uint64_t number, std::string_view line) {
    return "line " + std::to_string(number) + ": '" + gltf::printable(trimmed(line), 60) + '\'';
}

} // namespace voxelize::obj
