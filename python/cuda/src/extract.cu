// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "kept_surface.cuh"

namespace voxelpipe::python {
namespace {

template <class Target>
surface_result extract_view(const device_stream& on, const std::shared_ptr<kept_surface<surface<cuda_backend>>>& kept,
                            const target_view<Target>& values, const grid& g, const extract_options& options) {
    const status s = extract(kept->own.backend, values, g, kept->made, options);
    return result_of(on, kept, g, s, [](const surface<cuda_backend>&, const surface_arrays&) {});
}

} // namespace

surface_result extract_mask(const device_stream& on, const std::uint8_t* values, const grid& g,
                            const extract_options& options) {
    using bits = target<bit, blend::replace>;
    const current_device current(on);
    const auto kept = std::make_shared<kept_surface<surface<cuda_backend>>>(on);
    framebuffer<cuda_backend, bits> inside{kept->own.backend, g.extent};
    const target_view<bits>& view = get<0>(inside.view().targets);
    pack_bits_of(on, values, g.extent, view.elements);
    return extract_view(on, kept, view, g, options);
}

surface_result extract_field(const device_stream& on, const float* values, const grid& g,
                             const extract_options& options) {
    const current_device current(on);
    const auto kept = std::make_shared<kept_surface<surface<cuda_backend>>>(on);
    // The view is of a target that could be written; extract reads it.
    const target_view<target<float, blend::replace>> view{const_cast<float*>(values), // NOLINT(*-const-cast)
                                                          g.extent};
    return extract_view(on, kept, view, g, options);
}

} // namespace voxelpipe::python
