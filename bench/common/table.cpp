// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "table.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <stdexcept>

namespace bench {

namespace {

// Characters, not bytes: UTF-8 continuation bytes take no column.
std::size_t width(const std::string& s) {
    return static_cast<std::size_t>(std::count_if(s.begin(), s.end(), [](char c) { return (c & 0xc0) != 0x80; }));
}

bool is_number(const std::string& s) {
    return !s.empty() && s.find_first_not_of("0123456789.,-+×% ") == std::string::npos;
}

std::string quoted(const std::string& s) {
    if (s.find_first_of(",\"\n") == std::string::npos) return s;
    std::string out = "\"";
    for (const char c : s) {
        if (c == '"') out += '"';
        out += c;
    }
    return out + '"';
}

} // namespace

void table::add_row(std::vector<std::string> cells) {
    if (cells.size() > columns_.size()) throw std::invalid_argument("table: more cells than columns");
    cells.resize(columns_.size());
    rows_.push_back(std::move(cells));
}

std::string table::markdown() const {
    std::vector<std::size_t> widths;
    std::vector<bool> right;
    for (std::size_t c = 0; c < columns_.size(); ++c) {
        std::size_t w = std::max<std::size_t>(3, width(columns_[c]));
        bool numbers = !rows_.empty();
        for (const auto& row : rows_) {
            w = std::max(w, width(row[c]));
            numbers = numbers && (row[c].empty() || is_number(row[c]));
        }
        widths.push_back(w);
        right.push_back(numbers);
    }
    std::string out;
    const auto line = [&](const std::vector<std::string>& cells) {
        out += '|';
        for (std::size_t c = 0; c < cells.size(); ++c) {
            const std::size_t pad = widths[c] - width(cells[c]);
            out.append(1 + (right[c] ? pad : 0), ' ').append(cells[c]).append(1 + (right[c] ? 0 : pad), ' ');
            out += '|';
        }
        out += '\n';
    };
    line(columns_);
    out += '|';
    for (std::size_t c = 0; c < columns_.size(); ++c) {
        out.append(widths[c] + 1, '-');
        out += right[c] ? ":|" : "-|";
    }
    out += '\n';
    for (const auto& row : rows_) line(row);
    return out;
}

std::string table::csv() const {
    std::string out;
    const auto line = [&](const std::vector<std::string>& cells) {
        for (std::size_t c = 0; c < cells.size(); ++c) {
            if (c != 0) out += ',';
            out += quoted(cells[c]);
        }
        out += '\n';
    };
    line(columns_);
    for (const auto& row : rows_) line(row);
    return out;
}

std::string significant(double value, int digits) {
    if (value == 0 || !std::isfinite(value)) return value == 0 ? "0" : "-";
    const int magnitude = static_cast<int>(std::floor(std::log10(std::fabs(value))));
    char text[64];
    std::snprintf(text, sizeof text, "%.*f", std::max(0, digits - 1 - magnitude), value);
    return text;
}

std::string plain(double value) {
    char text[64];
    if (value == std::rint(value) && std::fabs(value) < 0x1p53)
        std::snprintf(text, sizeof text, "%.0f", value);
    else
        std::snprintf(text, sizeof text, "%.6g", value);
    return text;
}

} // namespace bench
