// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// repair::exterior of slabs along z that lie on several GPUs: each GPU draws the cover of its slab, the first one
// floods all of them together, and each gets back what is inside its slab.

#include <voxelpipe/slabs/device_set.cuh>
#include <voxelpipe/slabs/stream.hpp>
#include <voxelpipe/voxelpipe.hpp>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

namespace voxelpipe::slabs::detail {

// The inside of each slab, in memory of its GPU.
class device_exterior {
    using word = device::word;

public:
    using cover_type = framebuffer<cuda_backend, target<bit, blend::bit_or>>;

    // slabs: of the grid g, which is whole, in order along z. draw_cover(i, gpu, cover): the conservative cover of slab
    // i. on_each(count, work): work(i, gpu) on each of the first GPUs, or the first status that is not ok. Takes a bit
    // a voxel of the grid on the first GPU, and as much again for the flood, three times that with `closing`; two bits
    // a voxel of its slab on every GPU, of which one stays. out_of_memory if there is no room.
    template <class OnEach, class DrawCover>
    [[nodiscard]] status find(const grid& g, const std::vector<slab>& slabs, int closing, const OnEach& on_each,
                              const DrawCover& draw_cover) {
        const device::bit_box box{g.extent};
        std::optional<cuda_backend::buffer<word>> whole;
        inside_.clear();
        inside_.resize(slabs.size());
        status s = on_each(1, [&](std::size_t, cuda_backend& gpu) {
            whole.emplace(gpu, box.num_words());
            wait(gpu); // others write there
            return status{};
        });
        const auto first_of = [&](std::size_t i) {
            return whole->data() + box.first_word(0, slabs[i].where.offset.z - g.offset.z);
        };
        if (s.ok())
            s = on_each(slabs.size(), [&](std::size_t i, cuda_backend& gpu) {
                const device::bit_box part{slabs[i].where.extent};
                cover_type cover(gpu, part.extent);
                status drawn = draw_cover(i, gpu, cover);
                if (!drawn.ok()) return drawn;
                copy(gpu, first_of(i), get<0>(cover.view().targets).elements, part.num_words());
                wait(gpu);
                return drawn;
            });
        if (s.ok())
            s = on_each(1, [&](std::size_t, cuda_backend& gpu) {
                device::arena sizes;
                (void)device::exterior_memory::take(sizes, g.extent, closing);
                cuda_backend::buffer<std::byte> bytes(gpu, sizes.used());
                device::arena memory(bytes.data());
                const auto flood = device::exterior_memory::take(memory, g.extent, closing);
                device::with_runtime_errors([&] { device::fill_to_exterior(flood, whole->data(), gpu.stream); });
                wait(gpu);
                return status{};
            });
        if (s.ok())
            s = on_each(slabs.size(), [&](std::size_t i, cuda_backend& gpu) {
                const device::bit_box part{slabs[i].where.extent};
                cuda_backend::buffer<word> rows(gpu, part.num_words());
                copy(gpu, rows.data(), first_of(i), part.num_words());
                inside_[i].emplace(gpu, device::slab_words(part));
                device::with_runtime_errors(
                    [&] { device::copy_to_slab(inside_[i]->data(), rows.data(), part, gpu.stream); });
                wait(gpu);
                return status{};
            });
        if (!s.ok()) inside_.clear();
        return s;
    }
    // The bits of slab i, for solid_slab::inside.
    [[nodiscard]] const std::uint64_t* inside(std::size_t i) const { return inside_[i]->data(); }

private:
    static void copy(cuda_backend& gpu, word* to, const word* from, std::uint64_t count) {
        device::with_runtime_errors(
            [&] { device::check(cudaMemcpyAsync(to, from, count * sizeof(word), cudaMemcpyDefault, gpu.stream)); });
    }
    static void wait(cuda_backend& gpu) {
        device::with_runtime_errors([&] { device::check(cudaStreamSynchronize(gpu.stream)); });
    }

    std::vector<std::optional<cuda_backend::buffer<std::uint64_t>>> inside_; // by slab
};

} // namespace voxelpipe::slabs::detail
