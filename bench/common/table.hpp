// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// A table of text cells, written as Markdown (columns lined up) and as CSV.

#include <string>
#include <vector>

namespace bench {

class table {
public:
    explicit table(std::vector<std::string> columns) : columns_(std::move(columns)) {}
    // One cell a column; missing ones stay empty. Throws std::invalid_argument where there are too many.
    void add_row(std::vector<std::string> cells);
    [[nodiscard]] bool empty() const { return rows_.empty(); }
    [[nodiscard]] std::string markdown() const;
    // Comma-separated; cells with commas, quotes or line ends are quoted.
    [[nodiscard]] std::string csv() const;

private:
    std::vector<std::string> columns_;
    std::vector<std::vector<std::string>> rows_;
};

// A number with `digits` significant digits and no exponent, thousands not grouped: 0.0123, 1.23, 1230.
std::string significant(double value, int digits = 3);

// A number as short as it can be read back to six digits, no exponent where it is whole: 972, 0.1, 100017228.
std::string plain(double value);

} // namespace bench
