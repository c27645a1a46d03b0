// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The sort of (cell, primitive) pairs by cell, for keys of 32 and of 64 bits and any number of pairs that memory holds.
// It is stable and looks at just the key bits in use (paper section 4, tile sort). If only the device knows the number
// of pairs, the whole capacity is sorted, with keys in the unused end that come last. CUB sorts, but for keys of 32
// bits of which at most 18 are in use, as numbers of tiles are: two passes of nine bits take 0.72 to 0.94 of the time
// of CUB's three (docs/optimizations.md). fragments/radix_sort.cuh sorts fragments, whose number stays on the device.
// Key: std::uint32_t or std::uint64_t.

#include <voxelpipe/device/base/kernel_library.cuh>
#include <voxelpipe/device/scene/scene.cuh>

#include <bit>
#include <cstddef>
#include <cstdint>

namespace voxelpipe::device {

// Key bits that distinguish num_cells cells and the filler.
[[nodiscard]] inline int key_bits(std::uint64_t num_cells) { return static_cast<int>(std::bit_width(num_cells)); }

// Bytes of storage for sort_by_cell.
template <class Key>
[[nodiscard]] std::size_t sort_bytes(std::uint64_t capacity, int bits);

// Sorts the pairs of keys[0] and values[0]; keys[1] and values[1] are scratch. Returns which of the two holds the
// result.
template <class Key>
[[nodiscard]] int sort_by_cell(Key* const (&keys)[2], std::uint32_t* const (&values)[2], std::uint64_t capacity,
                               int bits, void* storage, std::size_t bytes, stage where, cudaStream_t stream);

// Overwrites the pairs beyond *num_pairs, or all if the call has failed, with fillers that sort to the end.
template <class Key>
void fill_end(Key* keys, std::uint32_t* values, const unsigned long long* num_pairs, std::uint64_t capacity,
              const pipeline_state* state, const capacities& limits, cudaStream_t stream);

} // namespace voxelpipe::device
