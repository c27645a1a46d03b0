// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "bricks.hpp"

#include <cpu_ref/parallel.hpp>

#include <algorithm>
#include <atomic>
#include <cstring>
#include <stdexcept>
#include <thread>

namespace voxelpipe::python {
namespace {

using row_array = nb::ndarray<nb::ro, nb::c_contig, nb::device::cpu>;
using dense_array = nb::ndarray<nb::c_contig, nb::device::cpu>;

// Rows of `size` bytes, a constant where it is one that values have often.
template <std::size_t Size>
void put(std::byte* out, const std::byte* values, std::size_t size, const std::int32_t* voxels, const grid& g,
         std::size_t first, std::size_t last) {
    const std::size_t n = Size != 0 ? Size : size;
    const auto nx = static_cast<std::size_t>(g.extent.x), ny = static_cast<std::size_t>(g.extent.y);
    for (std::size_t i = first; i < last; ++i) {
        const std::int32_t* const p = voxels + 3 * i;
        const std::size_t at = (static_cast<std::size_t>(p[2]) * ny + static_cast<std::size_t>(p[1])) * nx +
                               static_cast<std::size_t>(p[0]);
        std::memcpy(out + at * n, values + i * n, n);
    }
}

// Writes row i of `values` to voxel voxels[i] of `out`, (nz, ny, nx, ...), whose values have the same bytes. Of two
// rows of one voxel either stays. Throws IndexError for a voxel outside the grid; nothing is written then.
void scatter(const voxel_array& voxels, const row_array& values, const grid& g, const dense_array& out,
             unsigned threads) {
    const std::size_t n = voxels.shape(0);
    const auto cells = static_cast<std::size_t>(g.extent.x) * static_cast<std::size_t>(g.extent.y) *
                       static_cast<std::size_t>(g.extent.z);
    if (values.ndim() < 1 || values.shape(0) != n) throw nb::value_error("values need one row for each voxel");
    const std::size_t size = n == 0 ? 0 : values.nbytes() / n;
    if (n != 0 && out.nbytes() != size * cells) throw nb::value_error("the dense array has other values than the list");
    const std::int32_t* const all = voxels.data();
    std::atomic<std::size_t> outside{n};
    {
        const nb::gil_scoped_release released;
        constexpr std::size_t block = std::size_t{1} << 15;
        const unsigned workers = threads != 0 ? threads : std::max(1u, std::thread::hardware_concurrency());
        const std::size_t blocks = (n + block - 1) / block;
        cpu::parallel_for(workers, blocks, [&](unsigned, std::size_t b) {
            for (std::size_t i = b * block; i < std::min(n, (b + 1) * block); ++i)
                if (!g.contains({all[3 * i], all[3 * i + 1], all[3 * i + 2]})) {
                    std::size_t least = outside;
                    while (i < least && !outside.compare_exchange_weak(least, i)) {
                    }
                    return;
                }
        });
        if (outside == n) {
            auto* const to = static_cast<std::byte*>(out.data());
            const auto* const from = static_cast<const std::byte*>(values.data());
            const auto write = size == 1    ? put<1>
                               : size == 3  ? put<3>
                               : size == 4  ? put<4>
                               : size == 8  ? put<8>
                               : size == 12 ? put<12>
                                            : put<0>;
            cpu::parallel_for(workers, blocks, [&](unsigned, std::size_t b) {
                write(to, from, size, all, g, b * block, std::min(n, (b + 1) * block));
            });
        }
    }
    if (const std::size_t i = outside; i != n)
        throw nb::index_error(("voxel " + std::to_string(i) + " is " + voxel_text(all + 3 * i) +
                               ", which lies outside the grid of " + std::to_string(g.extent.x) + " x " +
                               std::to_string(g.extent.y) + " x " + std::to_string(g.extent.z))
                                  .c_str());
}

} // namespace

void bind_lists(nb::module_& m) {
    m.def("scatter", &scatter, nb::arg("voxels"), nb::arg("values"), nb::arg("grid"), nb::arg("out"),
          nb::arg("threads"));
}

} // namespace voxelpipe::python
