// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "page.hpp"

#include "model/parallel.hpp"
#include "page_text.hpp"
#include "write/formats/deflate.hpp"
#include "write/formats/output_file.hpp"
#include "write/formats/progress.hpp"
#include "write/formats/text.hpp"

#include <voxelpipe/core/half.hpp>

#include <algorithm>
#include <cstring>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace voxelize {
namespace {

using bytes = std::span<const std::byte>;

// Base64 of all that is written, to a file.
class base64_stream {
public:
    explicit base64_stream(output_file& out) : out_(out) {}

    void write(bytes data) {
        text_.clear();
        for (const std::byte b : data) {
            held_ = held_ << 8 | std::to_integer<std::uint32_t>(b);
            if (++count_ == 3) put(4);
        }
        out_.write(text_);
    }
    void finish() {
        text_.clear();
        if (const int rest = count_; rest != 0) {
            held_ <<= 8 * (3 - rest);
            put(rest + 1);
            text_.append(static_cast<std::size_t>(3 - rest), '=');
        }
        out_.write(text_);
    }

private:
    void put(int digits) {
        constexpr std::string_view letters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
        for (int i = 0; i < digits; ++i) text_ += letters[held_ >> (18 - 6 * i) & 63u];
        held_ = 0;
        count_ = 0;
    }

    output_file& out_;
    std::string text_;
    std::uint32_t held_ = 0; // bytes that wait for a third one
    int count_ = 0;
};

template <class T>
void append_as_float(bytes data, std::vector<float>& values) {
    for (std::size_t at = 0; at < data.size(); at += sizeof(T)) {
        T value;
        std::memcpy(&value, data.data() + at, sizeof(T));
        values.push_back(static_cast<float>(value));
    }
}

// A channel as the page knows it: of type u8, u32, i32 or f32.
struct page_channel {
    std::string_view type;
    std::vector<float> converted;
    bytes data;
};

page_channel convert(const channel& c) {
    page_channel result;
    result.data = bytes(c.data);
    switch (c.type) {
    case scalar::u8:
    case scalar::u32:
    case scalar::i32:
    case scalar::f32:
        result.type = name_of(c.type);
        return result;
    case scalar::u16:
        append_as_float<std::uint16_t>(result.data, result.converted);
        break;
    case scalar::u64:
        append_as_float<std::uint64_t>(result.data, result.converted);
        break;
    case scalar::i64:
        append_as_float<std::int64_t>(result.data, result.converted);
        break;
    case scalar::f16:
        append_as_float<voxelpipe::half>(result.data, result.converted);
        break;
    case scalar::f64:
        append_as_float<double>(result.data, result.converted);
        break;
    case scalar::bit:
        break;
    }
    result.type = name_of(scalar::f32);
    result.data = std::as_bytes(std::span{result.converted});
    return result;
}

// As JSON in an element of HTML: nothing in it may end the string or the element.
std::string json_string(std::string_view text) {
    std::string result = "\"";
    for (const char c : text) {
        constexpr std::string_view digits = "0123456789abcdef";
        const auto code = static_cast<unsigned char>(c);
        if (code < 0x20 || c == '"' || c == '\\' || c == '<') {
            result += "\\u00";
            result += digits[code >> 4];
            result += digits[code & 15u];
        } else {
            result += c;
        }
    }
    return result + '"';
}

template <class T>
std::string list_of(const std::array<T, 3>& values) {
    return '[' + number(static_cast<double>(values[0])) + ',' + number(static_cast<double>(values[1])) + ',' +
           number(static_cast<double>(values[2])) + ']';
}

std::string describe(const sparse_volume& v, const std::vector<const channel*>& channels,
                     const std::vector<page_channel>& converted, const std::filesystem::path& path, up_axis up) {
    std::string text = "{\"name\":" + json_string(path.stem().string()) + ",\"extent\":" + list_of(v.shape.extent) +
                       ",\"voxel_size\":" + list_of(v.shape.voxel_size) + ",\"origin\":" + list_of(v.shape.origin) +
                       ",\"up\":" + (up == up_axis::y ? "\"y\"" : "\"z\"") +
                       ",\"bricks\":" + std::to_string(v.keys.size()) +
                       ",\"voxels\":" + std::to_string(v.num_voxels()) + ",\"channels\":[";
    for (std::size_t i = 0; i < channels.size(); ++i) {
        if (i != 0) text += ',';
        text += "{\"name\":" + json_string(channels[i]->name) + ",\"type\":" + json_string(converted[i].type) +
                ",\"components\":" + std::to_string(channels[i]->components) + '}';
    }
    return text + "]}";
}

// page.html around what is put into it.
struct page_parts {
    std::string_view before_shape, before_data, after_data;
};

page_parts split_page() {
    const std::string_view page = page_text;
    constexpr std::string_view shape_mark = "/*shape*/", data_mark = "/*data*/";
    const std::size_t shape_at = page.find(shape_mark), shape_end = shape_at + shape_mark.size();
    const std::size_t data_at = page.find(data_mark);
    return {page.substr(0, shape_at), page.substr(shape_end, data_at - shape_end),
            page.substr(data_at + data_mark.size())};
}

} // namespace

std::vector<std::filesystem::path> write_page(const sparse_volume& v, const std::filesystem::path& path,
                                              const write_options& options) {
    std::vector<std::uint32_t> positions(3 * v.keys.size()); // all x, then y, then z
    for (std::size_t b = 0; b < v.keys.size(); ++b) {
        const glm::ivec3 at = voxelpipe::core::morton_position(v.keys[b]);
        for (int a = 0; a < 3; ++a)
            positions[static_cast<std::size_t>(a) * v.keys.size() + b] = static_cast<std::uint32_t>(at[a]);
    }
    std::vector<const channel*> channels;
    std::vector<page_channel> converted;
    for (const channel& c : v.channels) {
        if (c.type == scalar::bit) continue;
        channels.push_back(&c);
        converted.push_back(convert(c));
    }
    std::vector<bytes> pieces;
    std::uint64_t total = 0;
    const auto cut = [&](bytes data) {
        constexpr std::size_t most = std::size_t{1} << 20;
        total += data.size();
        for (; data.size() > most; data = data.subspan(most)) pieces.push_back(data.first(most));
        if (!data.empty()) pieces.push_back(data);
    };
    cut(std::as_bytes(std::span{positions}));
    cut(std::as_bytes(std::span{v.masks}));
    for (const page_channel& c : converted) cut(c.data);

    output_file out(path);
    progress_meter meter(options.progress, total);
    const page_parts page = split_page();
    out.write(page.before_shape);
    out.write(describe(v, channels, converted, path, options.up));
    out.write(page.before_data);
    base64_stream encoded(out);
    piece_compressor compressor(piece_compressor::form::stream_part, std::max(1, options.compression));
    ordered_for(
        pieces.size(), thread_count(options.threads), [&](std::size_t i) { return compressor.compress(pieces[i], 4); },
        [&](std::size_t i, const std::shared_ptr<const compressed_piece>& piece) {
            encoded.write(piece->bytes);
            meter.advance(pieces[i].size());
        });
    encoded.write(deflate_end);
    encoded.finish();
    out.write(page.after_data);
    out.commit();
    return {path};
}

std::vector<std::filesystem::path> write_page(const volume& v, const std::filesystem::path& path,
                                              const write_options& options) {
    return write_page(make_sparse(v, options.threads), path, options);
}

void write_pages_beside(const std::vector<page_link>& pages, const std::filesystem::path& path) {
    std::string text =
        R"({"name":"","extent":[1,1,1],"voxel_size":[1,1,1],"up":"y","bricks":0,"voxels":0,"channels":[],)"
        R"("pages":[)";
    for (const page_link& page : pages) {
        if (&page != &pages.front()) text += ',';
        text += "{\"name\":" + json_string(page.name) + ",\"file\":" + json_string(page.file.generic_string()) + '}';
    }
    output_file out(path);
    const page_parts page = split_page();
    out.write(page.before_shape);
    out.write(text + "]}");
    out.write(page.before_data);
    out.write(page.after_data);
    out.commit();
}

} // namespace voxelize
