// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "ply_records.hpp"

#include "model/model_error.hpp"
#include "number.hpp"
#include "read/gltf/text.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <string_view>
#include <utility>

namespace voxelize {
namespace {

template <class T>
double as(std::uint64_t bits) {
    if constexpr (sizeof(T) == 8)
        return static_cast<double>(std::bit_cast<T>(bits));
    else if constexpr (sizeof(T) == 4)
        return static_cast<double>(std::bit_cast<T>(static_cast<std::uint32_t>(bits)));
    else
        return static_cast<double>(static_cast<T>(bits));
}

double value_of(ply_type type, std::uint64_t bits) {
    switch (type) {
    case ply_type::int8:
        return as<std::int8_t>(bits);
    case ply_type::uint8:
        return as<std::uint8_t>(bits);
    case ply_type::int16:
        return as<std::int16_t>(bits);
    case ply_type::uint16:
        return as<std::uint16_t>(bits);
    case ply_type::int32:
        return as<std::int32_t>(bits);
    case ply_type::uint32:
        return as<std::uint32_t>(bits);
    case ply_type::int64:
        return as<std::int64_t>(bits);
    case ply_type::uint64:
        return as<std::uint64_t>(bits);
    case ply_type::float32:
        return as<float>(bits);
    case ply_type::float64:
        break;
    }
    return as<double>(bits);
}

} // namespace

ply_records::ply_records(const std::filesystem::path& path) : file_(path), header_(read_ply_header(file_)) {
    places_.resize(header_.elements.size() + 1);
    places_[0] = place{header_.data, header_.line};
}

bool ply_records::skip(std::size_t element) {
    const ply_element& e = header_.elements[element];
    if (e.properties.empty()) return true;
    if (!is_text() && !e.has_list()) {
        if (e.count > (file_.size() - file_.offset()) / e.bytes()) return false;
        file_.skip_bytes(e.count * e.bytes());
        return true;
    }
    for (std::uint64_t i = 0; i < e.count; ++i)
        if (!next(element, skipped_)) return false;
    return true;
}

bool ply_records::go_to(std::size_t element) {
    std::size_t from = element;
    while (!places_[from]) --from;
    file_.seek(places_[from]->offset, places_[from]->line);
    for (; from < element; ++from) {
        if (!skip(from)) return false;
        places_[from + 1] = place{file_.offset(), file_.line()};
    }
    return true;
}

std::optional<std::uint64_t> ply_records::offset_of(std::size_t element) {
    if (!go_to(element)) return std::nullopt;
    return places_[element]->offset;
}

bool ply_records::next(std::size_t element, ply_record& record) {
    const std::vector<ply_property>& properties = header_.elements[element].properties;
    record.resize(properties.size());
    record_ = {file_.offset(), file_.line()};
    bool is_first = true;
    for (std::size_t p = 0; p < properties.size(); ++p) {
        std::vector<double>& numbers = record[p];
        const ply_property& property = properties[p];
        const auto read = [&](ply_type type, double& number) {
            if (!next_number(property, type, number)) return false;
            if (std::exchange(is_first, false)) record_.line = file_.word_line();
            return true;
        };
        std::size_t count = 1;
        if (property.length) {
            double length = 0;
            if (!read(*property.length, length)) return false;
            if (!(length >= 0) || length != std::floor(length) || length > 1e15)
                throw model_error(record_place() + ": the length of the list " + gltf::in_quotes(property.name) +
                                  " is " + std::to_string(length) + ", and a number from 0 on was expected");
            // What the file cannot hold needs no memory.
            const auto least = static_cast<double>(is_text() ? 2 : bytes_of(property.type));
            if ((length - 1) * least > static_cast<double>(file_.size() - file_.offset())) {
                file_.seek(file_.size(), file_.line());
                return false;
            }
            count = static_cast<std::size_t>(length);
        }
        numbers.resize(count);
        for (double& number : numbers)
            if (!read(property.type, number)) return false;
    }
    return true;
}

bool ply_records::next_number(const ply_property& property, ply_type type, double& number) {
    if (is_text()) return next_text_number(property, number);
    const std::size_t count = bytes_of(type);
    const std::string_view bytes = file_.next_bytes(count);
    if (bytes.size() != count) return false;
    std::uint64_t bits = 0;
    if (header_.format == ply_header::encoding::little_endian)
        std::memcpy(&bits, bytes.data(), count);
    else
        for (const char byte : bytes) bits = bits << 8U | static_cast<unsigned char>(byte);
    number = value_of(type, bits);
    return true;
}

bool ply_records::next_text_number(const ply_property& property, double& number) {
    std::string_view word = file_.next_word();
    while (word == "comment" || word == "obj_info") {
        (void)file_.next_line(word);
        word = file_.next_word();
    }
    if (word.empty()) return false;
    const std::optional<double> found = number_of(word);
    if (!found)
        throw model_error("line " + std::to_string(file_.word_line()) + ": " + gltf::in_quotes(word) +
                          " is found where a number of the property " + gltf::in_quotes(property.name) +
                          " was expected");
    number = *found;
    return true;
}

std::string ply_records::record_place() const {
    return is_text() ? "line " + std::to_string(record_.line) : "byte " + std::to_string(record_.offset);
}

std::string ply_records::end_place() const {
    return is_text() ? "it ends in line " + std::to_string(file_.line())
                     : "it ends at byte " + std::to_string(file_.size());
}

} // namespace voxelize
