// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The crossings of a mesh with the edges that its surface crosses, on a GPU: a pass over the triangles for each axis
// lists their crossings with rows, in any order, since what is made of a row does not depend on the order of crossings
// between the same samples. The numbers of all three are waited for at once. Then each axis is sorted by row, and its
// edges look for theirs.

#include <voxelpipe/device/scene/key_sort.cuh>
#include <voxelpipe/surfaces/device/word_cells.cuh>
#include <voxelpipe/surfaces/remesh.hpp>

#include <algorithm>
#include <array>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace voxelpipe {

namespace device {

// Crossings of a block that go to memory together.
struct staged_crossings {
    static constexpr std::uint32_t room = 1024; // what a block has beyond it goes alone
    std::uint64_t keys[room];
    std::uint32_t triangles[room];
    std::uint32_t count;
    unsigned long long begin;
};
// Lists of one axis: `room` crossings, *total of them wanted.
struct row_crossing_list {
    std::uint64_t* keys;
    std::uint32_t* triangles;
    std::uint64_t room;
    unsigned long long* total;

    __device__ void store(unsigned long long at, std::uint64_t key, std::uint32_t triangle) const {
        if (at >= room) return;
        keys[at] = key;
        triangles[at] = triangle;
    }
};

// Appends the crossings of triangles with rows along an axis. A kernel for all axes takes more registers than two
// blocks have room for.
template <int Axis>
__global__ __launch_bounds__(threads_per_block, 2) void append_crossings_kernel(
    const __grid_constant__ core::passes::list_mesh_crossings<Axis> pass, row_crossing_list out) {
    await_stream();
    __shared__ staged_crossings staged;
    const std::uint64_t i = std::uint64_t{blockIdx.x} * threads_per_block + threadIdx.x;
    if (threadIdx.x == 0) staged.count = 0;
    __syncthreads();
    if (i < pass.mesh.count)
        pass.each(i, [&](std::uint64_t key) {
            const std::uint32_t at = atomicAdd(&staged.count, 1u);
            if (at < staged_crossings::room) {
                staged.keys[at] = key;
                staged.triangles[at] = static_cast<std::uint32_t>(i);
            } else {
                out.store(atomicAdd(out.total, 1ull), key, static_cast<std::uint32_t>(i));
            }
        });
    __syncthreads();
    const std::uint32_t count = staged.count < staged_crossings::room ? staged.count : staged_crossings::room;
    if (threadIdx.x == 0) staged.begin = atomicAdd(out.total, static_cast<unsigned long long>(count));
    __syncthreads();
    for (std::uint32_t k = threadIdx.x; k < count; k += threads_per_block)
        out.store(staged.begin + k, staged.keys[k], staged.triangles[k]);
}
template <int Axis>
void append_crossings(const core::passes::list_mesh_crossings<Axis>& pass, const row_crossing_list& out,
                      cudaStream_t stream) {
    launch_behind(append_crossings_kernel<Axis>, num_blocks(pass.mesh.count), threads_per_block, stream,
                  stage::coarse_raster, pass, out);
}

} // namespace device

namespace core {

// Finds crossings as find_mesh_crossings does, of all axes.
template <class Backend>
requires std::same_as<Backend, cuda_backend>
class mesh_crossing_search {
    template <class T>
    using buffer = typename Backend::template buffer<T>;

public:
    mesh_crossing_search(Backend& backend, const gathered_mesh<Backend>& mesh, const grid& samples,
                         const remesh_options& options)
        : backend_(backend), mesh_(mesh.view()), samples_(samples), options_(options), keys_(backend, 0),
          triangles_(backend, 0), totals_(backend, 3) {}

    // Waits once, and once more where there are more crossings along an axis than twice what a closed body without
    // insides has.
    void run(const surface_cells<Backend>& cells, edge_crossing* crossings, std::uint64_t* counts,
             const passes::counted_layers& counted) {
        const std::array<std::uint64_t, 3> totals = list(cells.num_edges() / 3 * 2 + 1024);
        const std::uint64_t most = std::max({totals[0], totals[1], totals[2]});
        std::size_t bytes = 0;
        const int bits = std::max({rows<0>().key_bits(), rows<1>().key_bits(), rows<2>().key_bits()});
        device::with_runtime_errors([&] { bytes = most < 2 ? 0 : device::sort_bytes<std::uint64_t>(most, bits); });
        const std::uint64_t num_rows = std::max({rows<0>().rows(), rows<1>().rows(), rows<2>().rows()});
        buffer<std::uint64_t> other_keys(backend_, most);
        buffer<std::uint32_t> other_triangles(backend_, most);
        buffer<std::uint8_t> storage(backend_, bytes);
        buffer<passes::row_range> ranges(backend_, num_rows);
        const auto find = [&]<int Axis>() {
            const passes::row_keys<Axis> keys = rows<Axis>();
            const std::uint64_t n = totals[Axis];
            const device::row_crossing_list l = list_of(Axis);
            std::uint64_t* const k[2] = {l.keys, other_keys.data()};
            std::uint32_t* const t[2] = {l.triangles, other_triangles.data()};
            int at = 0;
            if (n >= 2)
                device::with_runtime_errors([&] {
                    at = device::sort_by_cell<std::uint64_t>(k, t, n, keys.key_bits(), storage.data(), bytes,
                                                             stage::tile_sort, backend_.stream);
                });
            backend_.for_each(keys.rows(), passes::clear_rows{ranges.data()});
            backend_.for_each(n, passes::find_rows{k[at], n, keys.rows(), keys.bits, ranges.data()});
            cells.template for_each_edge<Axis>(passes::cross_mesh<Axis>{
                mesh_, keys, ranges.data(), k[at], n, t[at], crossing_rule(options_), options_.bodies == bodies::draw,
                samples_.fraction(), crossings, counts, counted});
        };
        find.template operator()<0>();
        find.template operator()<1>();
        find.template operator()<2>();
    }

private:
    template <int Axis>
    [[nodiscard]] passes::row_keys<Axis> rows() const {
        return passes::row_keys<Axis>(samples_.extent);
    }
    template <int Axis>
    [[nodiscard]] passes::list_mesh_crossings<Axis> pass() const {
        voxel_box whole{};
        for (int a = 0; a < 3; ++a) whole.hi[a] = samples_.extent[a] - 1;
        return {mesh_, rows<Axis>(), whole, samples_.fraction(), nullptr, nullptr, nullptr, nullptr};
    }
    [[nodiscard]] device::row_crossing_list list_of(int axis) {
        const std::uint64_t first = static_cast<std::uint64_t>(axis) * room_;
        return {keys_.data() + first, triangles_.data() + first, room_,
                reinterpret_cast<unsigned long long*>(totals_.data()) + axis};
    }
    // Makes the lists, with room for `room` crossings along an axis or for more; returns their numbers.
    [[nodiscard]] std::array<std::uint64_t, 3> list(std::uint64_t room) {
        for (;;) {
            room_ = room;
            keys_ = buffer<std::uint64_t>(backend_, 3 * room);
            triangles_ = buffer<std::uint32_t>(backend_, 3 * room);
            backend_.for_each(3, passes::clear_counts{totals_.data()});
            if (mesh_.count != 0)
                device::with_runtime_errors([&] {
                    device::append_crossings(pass<0>(), list_of(0), backend_.stream);
                    device::append_crossings(pass<1>(), list_of(1), backend_.stream);
                    device::append_crossings(pass<2>(), list_of(2), backend_.stream);
                });
            const std::vector<std::uint64_t> found = totals_.to_host(backend_);
            const std::uint64_t most = std::max({found[0], found[1], found[2]});
            if (most <= room) return {found[0], found[1], found[2]};
            room = most;
        }
    }

    Backend& backend_;
    passes::mesh_triangles mesh_;
    const grid& samples_;
    const remesh_options& options_;
    buffer<std::uint64_t> keys_;
    buffer<std::uint32_t> triangles_;
    buffer<std::uint64_t> totals_; // of crossings along each axis
    std::uint64_t room_ = 0;
};

// The overload of remesh.hpp's for cells that are words on a GPU.
template <class Backend>
requires std::same_as<Backend, cuda_backend>
void find_all_mesh_crossings(Backend& backend, const surface_cells<Backend>& cells, const gathered_mesh<Backend>& mesh,
                             const grid& samples, const remesh_options& options, edge_crossing* crossings,
                             std::uint64_t* counts, const passes::counted_layers& counted) {
    mesh_crossing_search<Backend>(backend, mesh, samples, options).run(cells, crossings, counts, counted);
}

} // namespace core
} // namespace voxelpipe
