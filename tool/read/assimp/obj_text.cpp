// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "obj_text.hpp"

#include "model/model_error.hpp"
#include "read/gltf/text.hpp"

#include <assimp/defs.h>
#include <assimp/fast_atof.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>

namespace voxelize::assimp {
namespace {

constexpr std::size_t block_bytes = std::size_t{1} << 20;
constexpr auto most_vertices = static_cast<std::uint64_t>(std::numeric_limits<std::int32_t>::max());

bool is_blank(char c) { return c == ' ' || c == '\t'; }
bool is_digit(char c) { return c >= '0' && c <= '9'; }

// The exception that assimp's conversion throws.
struct bad_number : obj_refusal {
    template <class... Text>
    explicit bad_number(Text&&...) : obj_refusal("what is no number") {}
};

const char* skip_blanks(const char* at, const char* end) {
    while (at != end && is_blank(*at)) ++at;
    return at;
}

// The index at `at`, which it moves behind: without leading zeros, and not 0.
std::int64_t read_index(const char*& at, const char* end) {
    const bool is_negative = at != end && *at == '-';
    if (is_negative) ++at;
    std::int64_t value = 0;
    if (at == end || *at == '0') throw obj_refusal("a face has what is no index");
    const char* const first = at;
    for (; at != end && is_digit(*at); ++at) {
        value = 10 * value + (*at - '0');
        if (value > static_cast<std::int64_t>(most_vertices)) throw obj_refusal("an index is too large");
    }
    if (at == first) throw obj_refusal("a face has what is no index");
    return is_negative ? -value : value;
}

// The numbers that follow the key of WHOSE line; how many there are.
template <std::size_t N>
std::size_t read_numbers(std::string_view text, const char* whose, std::array<ai_real, N>& numbers) {
    std::size_t count = 0;
    const char* const end = text.data() + text.size();
    try {
        for (const char* at = skip_blanks(text.data(), end); at != end; at = skip_blanks(at, end)) {
            if (count == N || (!is_digit(*at) && *at != '-' && *at != '+')) throw bad_number();
            at = Assimp::fast_atoreal_move<ai_real, bad_number>(at, numbers[count++]);
            if (at != end && !is_blank(*at)) throw bad_number();
        }
    } catch (const bad_number& what) {
        throw obj_refusal(std::string(whose) + " has " + what.what());
    }
    return count;
}

} // namespace

obj_lines::obj_lines(const std::filesystem::path& file) : file_(file, std::ios::binary), buffer_(block_bytes + 1) {}

bool obj_lines::read_more() {
    std::memmove(buffer_.data(), buffer_.data() + at_, end_ - at_);
    end_ -= at_;
    at_ = 0;
    if (end_ == block_bytes) throw obj_refusal("it has more than a megabyte");
    file_.read(buffer_.data() + end_, static_cast<std::streamsize>(block_bytes - end_));
    const auto got = static_cast<std::size_t>(file_.gcount());
    for (const char odd : {'\0', '\f'})
        if (std::memchr(buffer_.data() + end_, odd, got) != nullptr)
            throw obj_refusal("a byte behind it ends a line for assimp alone");
    end_ += got;
    return got != 0;
}

bool obj_lines::next(std::string_view& line) {
    const char* end = nullptr;
    std::size_t searched = 0;
    while (true) {
        const char* const from = buffer_.data() + at_;
        end = static_cast<const char*>(std::memchr(from + searched, '\n', end_ - at_ - searched));
        if (end != nullptr) break;
        searched = end_ - at_;
        if (read_more()) continue;
        if (searched == 0) return false;
        buffer_[end_++] = '\n';
    }
    ++number_;
    line = {buffer_.data() + at_, static_cast<std::size_t>(end - buffer_.data()) - at_};
    at_ += line.size() + 1;
    if (line.ends_with('\r')) line.remove_suffix(1);
    if (line.find('\r') != std::string_view::npos) throw obj_refusal("it has a line end within");
    if (line.ends_with('\\')) throw obj_refusal("continued lines are not streamed");
    return true;
}

obj_statement statement_of(std::string_view line) {
    if (line.empty() || line[0] == '#') return obj_statement::nothing;
    if (is_blank(line[0])) {
        if (std::all_of(line.begin(), line.end(), is_blank)) return obj_statement::nothing;
        throw obj_refusal("blanks before a statement");
    }
    const std::string_view key = line.substr(0, line.find_first_of(" \t"));
    if (key == "v") return obj_statement::vertex;
    if (key == "f") return obj_statement::face;
    if (key == "vt") return obj_statement::texcoord;
    if (key == "vn") return obj_statement::normal;
    if (key == "s" || key == "mg") return obj_statement::nothing;
    for (const char* const structure : {"g", "o", "usemtl", "mtllib"})
        if (key == structure) return obj_statement::structure;
    if (key == "l" || key == "p") throw obj_refusal("lines and points are not streamed");
    throw obj_refusal(gltf::in_quotes(std::string(key)) + " is not streamed");
}

obj_vertex vertex_of(std::string_view line) {
    std::array<ai_real, 6> n{};
    const std::size_t count = read_numbers(line.substr(1), "a vertex", n);
    obj_vertex v;
    if (count == 4) {
        if (n[3] == 0) throw obj_refusal("a vertex has the weight 0");
        for (std::size_t a = 0; a < 3; ++a) n[a] /= n[3];
    } else if (count == 6) {
        v.has_color = true;
        v.color = {n[3], n[4], n[5]};
    } else if (count != 3) {
        throw obj_refusal("a vertex has " + std::to_string(count) + " numbers");
    }
    v.position = {n[0], n[1], n[2]};
    return v;
}

glm::vec2 texcoord_of(std::string_view line) {
    std::array<ai_real, 3> n{};
    if (const std::size_t count = read_numbers(line.substr(2), "a texture coordinate", n); count < 2)
        throw obj_refusal("a texture coordinate has " + std::to_string(count) + " numbers");
    for (ai_real& value : n)
        if (!std::isfinite(value)) value = 0;
    return {n[0], 1 - n[1]};
}

void add_face(std::string_view line, const obj_counts& before, std::vector<obj_corner>& corners) {
    const std::size_t first = corners.size();
    // assimp takes an index behind one slash for that of a normal where the file has normals and no coordinates so far.
    const bool has_normals_alone = before.texcoords == 0 && before.normals != 0;
    const char* const end = line.data() + line.size();
    std::size_t num_texcoords = 0;
    for (const char* at = skip_blanks(line.data() + 1, end); at != end; at = skip_blanks(at, end)) {
        std::int64_t index = read_index(at, end);
        index = index > 0 ? index - 1 : static_cast<std::int64_t>(before.vertices) + index;
        if (index < 0) throw model_error("an index is out of range");
        corners.push_back({static_cast<std::uint32_t>(index)});
        bool has_texcoord = false;
        for (int other = 0; other < 2 && at != end && *at == '/'; ++other) {
            ++at;
            if (at == end || *at == '/' || is_blank(*at)) continue;
            const std::int64_t value = read_index(at, end);
            if (other == 1 && has_texcoord && has_normals_alone)
                throw obj_refusal("a face names texture coordinates before the first");
            if (other == 1) continue;
            has_texcoord = true;
            if (has_normals_alone) continue;
            const std::int64_t number = value > 0 ? value - 1 : static_cast<std::int64_t>(before.texcoords) + value;
            // In the order of the corners, from the first on, whichever of them name some.
            corners[first + num_texcoords++].texcoord =
                number < 0 ? obj_corner::out_of_range : static_cast<std::uint32_t>(number);
        }
        if (at != end && !is_blank(*at)) throw obj_refusal("a face has what is no index");
    }
    if (corners.size() - first < 3) throw obj_refusal("a face has fewer than three corners");
}

} // namespace voxelize::assimp
