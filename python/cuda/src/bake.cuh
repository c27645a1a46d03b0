// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "on_device.cuh"

#include <bindings/value_rows.hpp>

#include <memory>

namespace voxelpipe::python {

template <class T, int Components>
[[nodiscard]] counted_value_shader<T, Components> shader_of(const mesh_view<>& mesh, const device_values<T>& v) {
    return {{v.values + v.first, v.columns, v.count, v.per_triangle ? nullptr : mesh.triangles.data()}};
}

// Draws `Components` at a time, into memory of the call.
template <class T, int Components>
[[nodiscard]] status bake_columns(const device_stream& on, const mesh_view<>& mesh, const grid& g, coverage rule,
                                  const device_values<T>& values, T fill, T* out) {
    const current_device current(on);
    call_backend own(on);
    cuda_backend& backend = own.backend;
    return with_blend(values.how, [&]<class Blend>() {
        framebuffer<cuda_backend, target<value_of<T, Components>, Blend>, number_of_fragments> fb{backend, g.extent};
        const status s = voxelize(backend, mesh, g, passthrough{}, shader_of<T, Components>(mesh, values), fb,
                                  voxelize_options{rule});
        if (!s.ok()) return s;
        const std::size_t n = static_cast<std::size_t>(g.extent.x) * static_cast<std::size_t>(g.extent.y) *
                              static_cast<std::size_t>(g.extent.z);
        for_each(on, n,
                 finish<T, value_of<T, Components>>{get<0>(fb.view().targets).elements,
                                                    get<1>(fb.view().targets).elements, out + values.first,
                                                    values.columns, values.count, values.how == combine::mean, fill});
        wait(on);
        return s;
    });
}

// A thread for each of a brick's eight words.
struct coordinates_of_bricks {
    brick_table table;
    std::int32_t* out;
    VOXELPIPE_HD void operator()(std::size_t i) const {
        const std::size_t brick = i / 8;
        const auto w = static_cast<unsigned>(i % 8);
        std::uint64_t rank = table.offsets[brick] + table.masks[brick].before(64 * w);
        const glm::ivec3 origin = table.brick_origin(brick);
        for (unsigned b = 0; b < 64; ++b) {
            if (!table.masks[brick].has(64 * w + b)) continue;
            const glm::ivec3 p = origin + core::morton_position(64 * w + b);
            for (int a = 0; a < 3; ++a) out[3 * rank + static_cast<std::uint64_t>(a)] = p[a];
            ++rank;
        }
    }
};

// The drawn framebuffer, kept with its backend.
template <class... Targets>
struct kept_bricks {
    call_backend own;
    sparse_framebuffer<cuda_backend, Targets...> fb;
    kept_bricks(const device_stream& on, glm::ivec3 extent) : own(on), fb(own.backend, extent) {}
};

template <class T, class Kept>
void give_voxels(const device_stream& on, const std::shared_ptr<Kept>& all, sparse_result<T>& made) {
    made.num_voxels = all->fb.num_voxels();
    made.copy_voxels = [all, on](std::int32_t* coordinates) {
        const current_device again(on);
        for_each(on, 8 * all->fb.num_bricks(), coordinates_of_bricks{all->fb.view().table, coordinates});
        wait(on);
    };
}

template <class T, int Components>
[[nodiscard]] sparse_result<T> bake_sparse_columns(const device_stream& on, const mesh_view<>& mesh, const grid& g,
                                                   coverage rule, const device_values<T>& values) {
    const current_device current(on);
    return with_blend(values.how, [&]<class Blend>() {
        using kept = kept_bricks<target<value_of<T, Components>, Blend>, number_of_fragments>;
        const auto all = std::make_shared<kept>(on, g.extent);
        sparse_result<T> made;
        made.result = voxelize(all->own.backend, mesh, g, passthrough{}, shader_of<T, Components>(mesh, values),
                               all->fb, voxelize_options{rule});
        if (!made.result.ok()) return made;
        give_voxels(on, all, made);
        made.copy_values = [all, on, values](T* out) {
            const current_device again(on);
            const auto view = all->fb.view();
            for_each(on, all->fb.num_voxels(),
                     finish<T, value_of<T, Components>>{get<0>(view.values), get<1>(view.values), out + values.first,
                                                        values.columns, values.count, values.how == combine::mean,
                                                        T{0}});
            wait(on);
        };
        return made;
    });
}

} // namespace voxelpipe::python
