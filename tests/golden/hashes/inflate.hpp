// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Reads deflate (RFC 1951), so that a file's hash does not depend on who compressed it. Without a library, because the
// program has to build for any machine; not quick.

#include <array>
#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace golden {

class inflater {
public:
    // Decodes the stream that `data` begins with. Throws std::runtime_error where it is none.
    static std::string inflate(std::string_view data) {
        inflater in{data};
        while (!in.read_block()) {
        }
        return std::move(in.out_);
    }

private:
    // A prefix code by the number of codes of each length and their symbols in order.
    struct code {
        std::array<int, 16> count{};
        std::vector<int> symbols;

        explicit code(const std::vector<int>& lengths) {
            for (int length = 1; length < 16; ++length)
                for (std::size_t s = 0; s < lengths.size(); ++s) {
                    if (lengths[s] != length) continue;
                    ++count[static_cast<std::size_t>(length)];
                    symbols.push_back(static_cast<int>(s));
                }
        }
    };

    explicit inflater(std::string_view data) : data_(data) {}

    int bit() {
        if (at_ / 8 >= data_.size()) throw std::runtime_error("compressed data ends early");
        const int b = static_cast<unsigned char>(data_[at_ / 8]) >> (at_ % 8) & 1;
        ++at_;
        return b;
    }
    int bits(int n) {
        int value = 0;
        for (int i = 0; i < n; ++i) value |= bit() << i;
        return value;
    }
    int symbol(const code& c) {
        int value = 0, first = 0;
        std::size_t before = 0;
        for (const int count : c.count) { // count[0] is 0: no bit is read for it
            if (count != 0 && value - first < count && value >= first)
                return c.symbols[before + static_cast<std::size_t>(value - first)];
            before += static_cast<std::size_t>(count);
            first = (first + count) << 1;
            value = value << 1 | bit();
        }
        throw std::runtime_error("compressed data has an unknown code");
    }

    // Returns true after the last one.
    bool read_block() {
        const bool last = bit() != 0;
        const int kind = bits(2);
        if (kind == 0) {
            at_ = (at_ + 7) / 8 * 8;
            const int length = bits(16);
            if ((length ^ bits(16)) != 0xffff) throw std::runtime_error("compressed data has a wrong length");
            for (int i = 0; i < length; ++i) out_ += static_cast<char>(bits(8));
        } else if (kind == 1) {
            std::vector<int> lengths(288, 8);
            for (std::size_t s = 144; s < 280; ++s) lengths[s] = s < 256 ? 9 : 7;
            read_codes(code(lengths), code(std::vector<int>(30, 5)));
        } else if (kind == 2) {
            const int literals = bits(5) + 257, distances = bits(5) + 1, described = bits(4) + 4;
            constexpr std::array<std::size_t, 19> order{16, 17, 18, 0, 8,  7, 9,  6, 10, 5,
                                                        11, 4,  12, 3, 13, 2, 14, 1, 15};
            std::vector<int> of_lengths(19);
            for (int i = 0; i < described; ++i) of_lengths[order[static_cast<std::size_t>(i)]] = bits(3);
            const code for_lengths(of_lengths);
            std::vector<int> lengths;
            while (lengths.size() < static_cast<std::size_t>(literals + distances)) {
                const int s = symbol(for_lengths);
                if (s < 16) {
                    lengths.push_back(s);
                    continue;
                }
                if (s == 16 && lengths.empty()) throw std::runtime_error("compressed data repeats nothing");
                const int repeated = s == 16 ? lengths.back() : 0;
                const int times = s == 16 ? 3 + bits(2) : s == 17 ? 3 + bits(3) : 11 + bits(7);
                lengths.insert(lengths.end(), static_cast<std::size_t>(times), repeated);
            }
            const auto middle = lengths.begin() + literals;
            read_codes(code({lengths.begin(), middle}), code({middle, lengths.end()}));
        } else {
            throw std::runtime_error("compressed data has a block of an unknown kind");
        }
        return last;
    }
    void read_codes(const code& literals, const code& distances) {
        for (int s = symbol(literals); s != 256; s = symbol(literals)) {
            if (s < 256) {
                out_ += static_cast<char>(s);
                continue;
            }
            // Lengths 3 to 258: eight of one each, then four for each number of further bits.
            const int l = s - 257, l_bits = l < 8 || l == 28 ? 0 : l / 4 - 1;
            const int length = l == 28 ? 258 : l < 8 ? l + 3 : ((4 + l % 4) << l_bits) + 3 + bits(l_bits);
            const int d = symbol(distances), d_bits = d < 4 ? 0 : d / 2 - 1;
            const int distance = d < 4 ? d + 1 : ((2 + d % 2) << d_bits) + 1 + bits(d_bits);
            if (static_cast<std::size_t>(distance) > out_.size())
                throw std::runtime_error("compressed data refers to what is not there");
            for (int i = 0; i < length; ++i) out_ += out_[out_.size() - static_cast<std::size_t>(distance)];
        }
    }

    std::string_view data_;
    std::size_t at_ = 0; // in bits
    std::string out_;
};

} // namespace golden
