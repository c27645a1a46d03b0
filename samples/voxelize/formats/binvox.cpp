// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "binvox.hpp"

#include "progress.hpp"
#include "text.hpp"

#include <algorithm>
#include <array>
#include <bit>

namespace voxelize {
namespace {

// Collects runs of equal voxels and writes them as (value, length) byte pairs, each at most 255 long.
class run_writer {
public:
    explicit run_writer(output_file& out) : out_(out) { pairs_.reserve(flush_bytes + 2); }

    void add(bool value, std::uint64_t length) {
        if (length == 0) return; // must not end a run of the other value
        if (value != value_) {
            put();
            value_ = value;
        }
        length_ += length;
    }

    void finish() {
        put();
        out_.write(pairs_);
    }

private:
    static constexpr std::size_t flush_bytes = std::size_t{1} << 16;

    void put() {
        for (; length_ > 0; length_ -= std::min<std::uint64_t>(length_, 255)) {
            pairs_.push_back(static_cast<std::byte>(value_));
            pairs_.push_back(static_cast<std::byte>(std::min<std::uint64_t>(length_, 255)));
            if (pairs_.size() >= flush_bytes) {
                out_.write(pairs_);
                pairs_.clear();
            }
        }
    }

    output_file& out_;
    std::vector<std::byte> pairs_;
    bool value_ = false;
    std::uint64_t length_ = 0;
};

// Transposes a 32 x 32 bit matrix in place: bit c of row r becomes bit r of row c.
void transpose(std::array<std::uint32_t, 32>& rows) {
    std::uint32_t mask = 0x0000ffffu;
    for (unsigned half = 16; half != 0; half >>= 1, mask ^= mask << half)
        for (unsigned r = 0; r < 32; r = (r + half + 1) & ~half) {
            const std::uint32_t swapped = (rows[r] >> half ^ rows[r + half]) & mask;
            rows[r] ^= swapped << half;
            rows[r + half] ^= swapped;
        }
}

// Adds the first n bits of a word, run by run.
void add_bits(run_writer& runs, std::uint32_t bits, int n) {
    for (int at = 0; at < n;) {
        const bool value = (bits >> at & 1u) != 0;
        const std::uint32_t rest = bits >> at;
        const int length = std::min(value ? std::countr_one(rest) : std::countr_zero(rest), n - at);
        runs.add(value, static_cast<std::uint64_t>(length));
        at += length;
    }
}

} // namespace

std::vector<std::filesystem::path> write_binvox(const volume& v, const std::filesystem::path& path,
                                                const write_options& options) {
    const channel& bits = *v.occupancy();
    const std::int64_t nx = v.extent[0], ny = v.extent[1], nz = v.extent[2];
    const std::int64_t side = std::max({nx, ny, nz});
    const auto empty = [](std::int64_t n) { return static_cast<std::uint64_t>(n); };

    output_file out(path);
    const std::string n = std::to_string(side);
    out.write("#binvox 1\ndim " + n + " " + n + " " + n + "\n");
    out.write("translate " + number(v.origin[0]) + " " + number(v.origin[1]) + " " + number(v.origin[2]) + "\n");
    out.write("scale " + number(v.voxel_size[0] * static_cast<double>(side)) + "\ndata\n");

    // The file wants x slowest and the bits have it fastest. So take one column of words, 32 slices of x, at a time,
    // and transpose it in blocks of 32 rows along y: then slice x reads as nz rows of ny packed bits.
    const std::int64_t row_words = (ny + 31) / 32;
    std::vector<std::uint32_t> slices(static_cast<std::size_t>(32 * nz * row_words));
    const auto slice_word = [&](std::int64_t x, std::int64_t k, std::int64_t w) -> std::uint32_t& {
        return slices[static_cast<std::size_t>((x * nz + k) * row_words + w)];
    };
    progress_meter meter(options.progress, static_cast<std::uint64_t>(nx));
    run_writer runs(out);
    for (std::int64_t column = 0; column < v.words_per_row(); ++column) {
        for (std::int64_t k = 0; k < nz; ++k)
            for (std::int64_t w = 0; w < row_words; ++w) {
                std::array<std::uint32_t, 32> block{};
                for (std::int64_t j = 32 * w; j < std::min(32 * w + 32, ny); ++j)
                    block[static_cast<std::size_t>(j - 32 * w)] = v.word(bits, column, j, k);
                transpose(block);
                for (std::int64_t x = 0; x < 32; ++x) slice_word(x, k, w) = block[static_cast<std::size_t>(x)];
            }
        const std::int64_t count = std::min<std::int64_t>(32, nx - 32 * column);
        for (std::int64_t x = 0; x < count; ++x) {
            for (std::int64_t k = 0; k < nz; ++k) {
                for (std::int64_t w = 0; w < row_words; ++w)
                    add_bits(runs, slice_word(x, k, w), static_cast<int>(std::min<std::int64_t>(32, ny - 32 * w)));
                runs.add(false, empty(side - ny));
            }
            runs.add(false, empty((side - nz) * side));
        }
        meter.advance(static_cast<std::uint64_t>(count));
    }
    for (std::int64_t x = nx; x < side; ++x) runs.add(false, empty(side * side));
    runs.finish();
    out.commit();
    return {path};
}

} // namespace voxelize
