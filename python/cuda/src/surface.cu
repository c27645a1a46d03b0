// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "on_device.cuh"

#include <memory>

namespace voxelpipe::python {
namespace {

using bits = target<bit, blend::bit_or>;

// The A-buffer's payload: where in its triangle a fragment lies.
struct weights {
    VOXELPIPE_HD auto operator()(const fragment<>& f) const { return outputs(f.clamped_barycentric()); }
};

struct expand_bits {
    const std::uint32_t* words;
    std::uint8_t* out;
    std::size_t row, words_a_row;
    VOXELPIPE_HD void operator()(std::size_t i) const {
        const std::size_t x = i % row;
        out[i] = static_cast<std::uint8_t>(words[i / row * words_a_row + x / 32] >> (x % 32) & 1U);
    }
};

struct coordinates_of_ids {
    const std::uint64_t* ids;
    std::int32_t* out;
    glm::ivec3 extent;
    VOXELPIPE_HD void operator()(std::size_t i) const {
        const auto nx = static_cast<std::uint64_t>(extent.x), ny = static_cast<std::uint64_t>(extent.y);
        const std::uint64_t id = ids[i];
        out[3 * i] = static_cast<std::int32_t>(id % nx);
        out[3 * i + 1] = static_cast<std::int32_t>(id / nx % ny);
        out[3 * i + 2] = static_cast<std::int32_t>(id / (nx * ny));
    }
};

} // namespace

status draw_bits(const device_stream& on, const mesh_view<>& mesh, const grid& g, coverage rule, std::uint32_t* out) {
    const current_device current(on);
    call_backend own(on);
    cuda_backend& backend = own.backend;
    return voxelize(backend, mesh, g, passthrough{}, constant(true), framebuffer_view<bits>::on(g.extent, out),
                    voxelize_options{rule});
}

// By way of bits, whose kernels the program has anyway.
status draw_mask(const device_stream& on, const mesh_view<>& mesh, const grid& g, coverage rule, std::uint8_t* out) {
    const current_device current(on);
    call_backend own(on);
    cuda_backend& backend = own.backend;
    framebuffer<cuda_backend, bits> fb{backend, g.extent};
    const status s = voxelize(backend, mesh, g, passthrough{}, constant(true), fb, voxelize_options{rule});
    if (!s.ok()) return s;
    const auto row = static_cast<std::size_t>(g.extent.x);
    const std::size_t n = row * static_cast<std::size_t>(g.extent.y) * static_cast<std::size_t>(g.extent.z);
    for_each(on, n, expand_bits{get<0>(fb.view().targets).elements, out, row, (row + 31) / 32});
    wait(on);
    return s;
}

fragment_lists list_fragments(const device_stream& on, const mesh_view<>& mesh, const grid& g, coverage rule) {
    const current_device current(on);
    using lists = abuffer<cuda_backend, glm::vec3>;
    struct kept {
        call_backend own;
        lists on_device;
        explicit kept(const device_stream& where) : own(where), on_device(own.backend) {}
    };
    const auto all = std::make_shared<kept>(on);
    fragment_lists made;
    made.result = voxelize(all->own.backend, mesh, g, passthrough{}, weights{}, all->on_device, voxelize_options{rule});
    if (!made.result.ok()) return made;
    made.num_voxels = all->on_device.num_voxels();
    made.num_fragments = all->on_device.num_fragments();
    made.copy = [all, on, extent = g.extent](std::int32_t* coordinates, std::int64_t* offsets, std::uint32_t* triangles,
                                             float* barycentrics) {
        const current_device again(on);
        const lists& from = all->on_device;
        const auto stream = reinterpret_cast<cudaStream_t>(on.stream);
        const auto copy = [&](void* to, const void* what, std::size_t bytes) {
            if (bytes != 0) check(cudaMemcpyAsync(to, what, bytes, cudaMemcpyDeviceToDevice, stream));
        };
        const std::size_t voxels = from.num_voxels(), fragments = from.num_fragments();
        for_each(on, voxels, coordinates_of_ids{from.voxels.data(), coordinates, extent});
        if (voxels == 0) // an empty list has no offsets
            check(cudaMemsetAsync(offsets, 0, sizeof(std::int64_t), stream));
        else
            copy(offsets, from.offsets.data(), (voxels + 1) * sizeof(std::int64_t));
        copy(triangles, from.primitives.data(), fragments * sizeof(std::uint32_t));
        copy(barycentrics, from.payloads.data(), fragments * sizeof(glm::vec3));
        wait(on);
    };
    return made;
}

} // namespace voxelpipe::python
