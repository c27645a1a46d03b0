// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Grids of bits in rows along x, 32 to a word, for the repairs of solids: dilation by a box, and lines of words that a
// thread goes along. Neighbouring threads have neighbouring words, but for lines along x.

#include <voxelpipe/device/scene/scene.cuh>

#include <cstdint>

namespace voxelpipe::device {

struct bit_box {
    glm::ivec3 extent;

    [[nodiscard]] VOXELPIPE_HD std::uint32_t words_x() const { return static_cast<std::uint32_t>(extent.x + 31) / 32; }
    [[nodiscard]] VOXELPIPE_HD std::uint64_t num_words() const {
        return std::uint64_t{words_x()} * static_cast<std::uint32_t>(extent.y) * static_cast<std::uint32_t>(extent.z);
    }
    // Bits of word i of a row that belong to it.
    [[nodiscard]] VOXELPIPE_HD word valid_bits(std::uint32_t i) const {
        const std::uint32_t left = static_cast<std::uint32_t>(extent.x) - 32 * i;
        return left >= 32 ? ~word{0} : (word{1} << left) - 1;
    }
    [[nodiscard]] VOXELPIPE_HD std::uint64_t first_word(int y, int z) const {
        return (static_cast<std::uint64_t>(z) * static_cast<std::uint64_t>(extent.y) + static_cast<std::uint64_t>(y)) *
               words_x();
    }
    // The 32 bits from x on of a row; 0 beyond it.
    [[nodiscard]] __device__ VOXELPIPE_INLINE word bits_from(const word* bits, int x, int y, int z) const {
        if (y < 0 || z < 0 || y >= extent.y || z >= extent.z) return 0;
        const word* const row = bits + first_word(y, z);
        const int k = x >> 5, n = static_cast<int>(words_x());
        const auto at = [&](int i) { return i >= 0 && i < n ? row[i] : 0u; };
        return __funnelshift_r(at(k), at(k + 1), static_cast<unsigned>(x & 31));
    }
};

// Rows of a solid_slab begin with a new word of 64 bits: the words of a row, and of a box.
[[nodiscard]] inline std::size_t slab_words_x(const bit_box& box) { return (box.words_x() + 1) / 2; }
[[nodiscard]] inline std::size_t slab_words(const bit_box& box) {
    return slab_words_x(box) * static_cast<std::size_t>(box.extent.y) * static_cast<std::size_t>(box.extent.z);
}
// Copies the lowest layers of a box from a solid_slab's rows, which lie in host memory or this GPU's.
inline void copy_from_slab(word* to, const std::uint64_t* from, const bit_box& box, int layers, cudaStream_t stream) {
    const std::size_t row = box.words_x() * sizeof(word);
    check(cudaMemcpy2DAsync(to, row, from, slab_words_x(box) * sizeof(std::uint64_t), row,
                            static_cast<std::size_t>(box.extent.y) * static_cast<std::size_t>(layers),
                            cudaMemcpyDefault, stream),
          stage::fine_raster);
}
// Copies a box to such rows in this GPU's memory.
inline void copy_to_slab(std::uint64_t* to, const word* from, const bit_box& box, cudaStream_t stream) {
    const std::size_t row = box.words_x() * sizeof(word);
    check(cudaMemcpy2DAsync(to, slab_words_x(box) * sizeof(std::uint64_t), from, row, row,
                            static_cast<std::size_t>(box.extent.y) * static_cast<std::size_t>(box.extent.z),
                            cudaMemcpyDefault, stream),
          stage::fine_raster);
}

// A word's place.
struct word_at_box {
    std::uint32_t word_x;
    int y, z;
    __device__ VOXELPIPE_INLINE word_at_box(const bit_box& box, std::uint64_t i)
        : word_x(static_cast<std::uint32_t>(i % box.words_x())),
          y(static_cast<int>(i / box.words_x() % static_cast<std::uint32_t>(box.extent.y))),
          z(static_cast<int>(i / box.words_x() / static_cast<std::uint32_t>(box.extent.y))) {}
};

// Calls f(number) for the numbers below n, by all threads of a grid.
template <class F>
__device__ VOXELPIPE_INLINE void for_each_number(std::uint64_t n, F&& f) {
    for (std::uint64_t i = std::uint64_t{blockIdx.x} * blockDim.x + threadIdx.x; i < n;
         i += std::uint64_t{gridDim.x} * blockDim.x)
        f(i);
}

// Lines of words along y (axis 1) or z (axis 2): a thread goes along one. Calls step(i, at) for i = 0 .. length - 1,
// at: the number of the word.
struct word_lines {
    std::uint64_t count, stride, per_slice;
    int length;

    __device__ VOXELPIPE_INLINE word_lines(const bit_box& box, int axis)
        : count(std::uint64_t{box.words_x()} * static_cast<std::uint32_t>(axis == 1 ? box.extent.z : box.extent.y)),
          stride(axis == 1 ? box.words_x() : std::uint64_t{box.words_x()} * static_cast<std::uint32_t>(box.extent.y)),
          per_slice(std::uint64_t{box.words_x()} * static_cast<std::uint32_t>(box.extent.y)),
          length(axis == 1 ? box.extent.y : box.extent.z) {}
    // The first word of line l.
    [[nodiscard]] __device__ VOXELPIPE_INLINE std::uint64_t first(std::uint64_t l, const bit_box& box, int axis) const {
        return axis == 1 ? l / box.words_x() * per_slice + l % box.words_x() : l;
    }
};

// ---- dilation -------------------------------------------------------------------------------------------------------

inline constexpr int max_dilation = 64; // two words

// Sets every bit within r of a bit that is set along x.
template <class Word>
__global__ void dilate_x_kernel(const Word* from, Word* to, const __grid_constant__ bit_box box, int r) {
    for_each_number(box.num_words(), [&](std::uint64_t i) {
        const word_at_box at(box, i);
        const auto n = static_cast<int>(box.words_x()), x = static_cast<int>(at.word_x);
        constexpr int window = 2 * (max_dilation / 32) + 1, middle = window / 2;
        word w[window];
        for (int k = 0; k < window; ++k) {
            const int j = x + k - middle;
            w[k] = j >= 0 && j < n ? from[i + static_cast<std::uint64_t>(static_cast<std::int64_t>(k - middle))] : 0u;
        }
        const auto old = [&](int k) { return k >= 0 && k < window ? w[k] : 0u; };
        // Steps of k reach all distances up to r.
        for (int reached = 0; reached < r;) {
            const int k = reached + 1 < r - reached ? reached + 1 : r - reached;
            for (int j = window - 1; j >= 0; --j)
                w[j] |= __funnelshift_l(old(j - k / 32 - 1), old(j - k / 32), static_cast<unsigned>(k % 32));
            reached += k;
        }
        for (int reached = 0; reached < r;) {
            const int k = reached + 1 < r - reached ? reached + 1 : r - reached;
            for (int j = 0; j < window; ++j)
                w[j] |= __funnelshift_r(old(j + k / 32), old(j + k / 32 + 1), static_cast<unsigned>(k % 32));
            reached += k;
        }
        to[i] = w[middle] & box.valid_bits(at.word_x);
    });
}
// The same along y or z.
template <class Word>
__global__ void dilate_lines_kernel(const Word* from, Word* to, const __grid_constant__ bit_box box, int axis, int r) {
    for_each_number(box.num_words(), [&](std::uint64_t i) {
        const word_at_box at(box, i);
        const int mine = axis == 1 ? at.y : at.z, n = axis == 1 ? box.extent.y : box.extent.z;
        const auto stride = static_cast<std::int64_t>(
            axis == 1 ? box.words_x() : std::uint64_t{box.words_x()} * static_cast<std::uint32_t>(box.extent.y));
        const int low = mine < r ? -mine : -r, high = n - 1 - mine < r ? n - 1 - mine : r;
        word w = 0;
        for (int k = low; k <= high; ++k) w |= from[static_cast<std::int64_t>(i) + k * stride];
        to[i] = w;
    });
}
// In place, with `spare` of the same size.
template <int = 0>
void dilate(word* bits, word* spare, const bit_box& box, int r, cudaStream_t stream) {
    if (r == 0) return;
    const unsigned blocks = fill_device(box.num_words(), 16);
    dilate_x_kernel<word><<<blocks, threads_per_block, 0, stream>>>(bits, spare, box, r);
    dilate_lines_kernel<word><<<blocks, threads_per_block, 0, stream>>>(spare, bits, box, 1, r);
    dilate_lines_kernel<word><<<blocks, threads_per_block, 0, stream>>>(bits, spare, box, 2, r);
    check(cudaGetLastError(), stage::fine_raster);
    check(cudaMemcpyAsync(bits, spare, box.num_words() * sizeof(word), cudaMemcpyDeviceToDevice, stream),
          stage::fine_raster);
}

} // namespace voxelpipe::device
