// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "on_device.cuh"
#include "surface_calls.hpp"

#include <voxelpipe/label/device/label.cuh>

#include <memory>

namespace voxelpipe::python {
namespace {

using component_buffer = cuda_backend::buffer<voxel_component>;

struct put_components {
    const voxel_component* from;
    std::int64_t *names, *voxels;
    std::int32_t *lowest, *highest;
    VOXELPIPE_HD void operator()(std::size_t i) const {
        const voxel_component c = from[i];
        names[i] = c.name;
        voxels[i] = static_cast<std::int64_t>(c.voxels);
        put(lowest + 3 * i, c.min);
        put(highest + 3 * i, c.max);
    }

private:
    VOXELPIPE_HD static void put(std::int32_t* to, const glm::ivec3& v) {
        to[0] = v.x;
        to[1] = v.y;
        to[2] = v.z;
    }
};

struct kept_components {
    call_backend own;
    component_buffer list;
    explicit kept_components(const device_stream& on) : own(on), list(own.backend, 0) {}
};

template <class Label>
status label_words(kept_components& kept, const target_view<target<bit, blend::replace>>& bits, Label* out,
                   const label_options& options, bool wants_list) {
    const target_view<target<Label, blend::replace>> labels{out, bits.extent};
    return wants_list ? label(kept.own.backend, bits, labels, kept.list, options)
                      : label(kept.own.backend, bits, labels, options);
}

} // namespace

label_result label_mask(const device_stream& on, const std::uint8_t* values, const glm::ivec3& extent, int connectivity,
                        bool wants_list, const label_arrays& out) {
    const current_device current(on);
    const auto kept = std::make_shared<kept_components>(on);
    framebuffer<cuda_backend, target<bit, blend::replace>> set{kept->own.backend, extent};
    const auto& bits = get<0>(set.view().targets);
    pack_bits_of(on, values, extent, bits.elements);
    const label_options options{connectivity};
    label_result r;
    r.result = out.wide_labels != nullptr ? label_words(*kept, bits, out.wide_labels, options, wants_list)
                                          : label_words(*kept, bits, out.labels, options, wants_list);
    if (!r.result.ok()) return r;
    r.copy = [kept, on](std::int64_t* names, std::int64_t* voxels, std::int32_t* lowest, std::int32_t* highest) {
        const current_device again(on);
        for_each(on, kept->list.size(), put_components{kept->list.data(), names, voxels, lowest, highest});
        wait(on);
    };
    return r;
}

} // namespace voxelpipe::python
