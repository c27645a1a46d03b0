// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// voxelize_async of points and lines, in the caller's memory. Of the workspace's limits, `fragments` must hold the
// fragments of all elements, also those that the shader discards. A sparse_result uses `bricks`, `voxels` and `nodes`
// too.

#include <voxelpipe/programs/device/async_output.cuh>
#include <voxelpipe/programs/device/element_arrays.cuh>
#include <voxelpipe/programs/element_call.hpp>

#include <cstddef>
#include <span>
#include <type_traits>

namespace voxelpipe {
namespace device {

// The use that a call makes of the lists of all fragments. Payload: of the lists. has_room(out, limits): they are
// numbered.
template <class Output, class ShaderOutput>
struct element_output;
template <class... Targets, class ShaderOutput>
struct element_output<framebuffer_view<Targets...>, ShaderOutput> {
    using payload = typename core::outputs_payload<ShaderOutput>::type;
    element_output(const framebuffer_view<Targets...>&, const grid&, const workspace_limits&, arena&) {}
    [[nodiscard]] static bool has_room(const framebuffer_view<Targets...>&, const workspace_limits& l) {
        return l.fragments < core::max_numbered;
    }
    template <class Call>
    void store(const Call& call, const grid&, const voxelize_options&, const framebuffer_view<Targets...>& fb,
               cudaStream_t stream) const {
        call.fold(fb, stream);
    }
};
template <class Payload, class ShaderOutput>
struct element_output<abuffer_view<Payload>, ShaderOutput> {
    using payload = Payload;
    element_output(const abuffer_view<Payload>&, const grid&, const workspace_limits&, arena&) {}
    [[nodiscard]] static bool has_room(const abuffer_view<Payload>&, const workspace_limits& l) {
        return l.fragments < core::max_numbered;
    }
    template <class Call>
    void store(const Call& call, const grid&, const voxelize_options&, abuffer_view<Payload>& lists,
               cudaStream_t) const {
        lists = call.lists();
    }
};
template <class... Targets, class ShaderOutput>
struct element_output<sparse_result<Targets...>, ShaderOutput> {
    using payload = typename core::outputs_payload<ShaderOutput>::type;
    bounded_fold<payload, Targets...> fold;

    element_output(const sparse_result<Targets...>& result, const grid& g, const workspace_limits& limits,
                   arena& memory)
        : fold(g.whole_extent(), limits, result, memory) {}
    [[nodiscard]] static bool has_room(const sparse_result<Targets...>& result, const workspace_limits& l) {
        return l.fragments < core::max_numbered && are_numbered_bricks(l, result);
    }
    template <class Call>
    void store(const Call& call, const grid& g, const voxelize_options& options, sparse_result<Targets...>& result,
               cudaStream_t stream) const {
        fold.launch(call.lists(), g, options.count_voxels, call.state(), result, stream);
    }
};

// A call's memory, in the order of its arrays.
template <class View, class VertexShader, class FragmentShader, class Output>
struct element_memory {
    using draw_type = draw<View, VertexShader, FragmentShader>;
    using output_type = element_output<Output, core::shader_output<View, VertexShader, FragmentShader>>;
    async_elements<View, VertexShader, FragmentShader, typename output_type::payload> lists;
    output_type output;

    element_memory(std::span<const draw_type> draws, const grid& g, const Output& out, const workspace_limits& limits,
                   arena& memory)
        : lists(memory, draws, g, limits.fragments), output(out, g, limits, memory) {}
};

template <class View, class VertexShader, class FragmentShader, class Output>
[[nodiscard]] std::size_t element_bytes(std::span<const draw<View, VertexShader, FragmentShader>> draws, const grid& g,
                                        const Output& out, const workspace_limits& limits) {
    using memory_type = element_memory<View, VertexShader, FragmentShader, Output>;
    if (!validate(g).ok() || !core::validate_program_draws(draws).ok() ||
        !memory_type::output_type::has_room(out, limits))
        return 0;
    return bytes_or_none([&] {
        arena plan;
        (void)memory_type(draws, g, out, limits, plan);
        return plan.used();
    });
}
template <coverage... Known, class View, class VertexShader, class FragmentShader, class Output>
[[nodiscard]] status launch_elements(cuda_backend& backend,
                                     std::span<const draw<View, VertexShader, FragmentShader>> draws, const grid& g,
                                     Output& out, voxelize_options options, const workspace_view& workspace) {
    using output_type = std::remove_const_t<Output>;
    if constexpr (core::check_shaders<View, VertexShader, FragmentShader>()) {
        using shader_output = core::shader_output<View, VertexShader, FragmentShader>;
        if constexpr (core::output_kind<output_type>::template fits<shader_output>()) {
            using memory_type = element_memory<View, VertexShader, FragmentShader, output_type>;
            if (const status s = core::validate_call(draws, g, out); !s.ok()) return s;
            if (!memory_type::output_type::has_room(out, workspace.limits))
                return core::failure(status_code::size_overflow);
            return with_cuda_status([&] {
                status s;
                const std::size_t need =
                    element_bytes<View, VertexShader, FragmentShader, output_type>(draws, g, out, workspace.limits);
                if (workspace.memory == nullptr || workspace.bytes < need) {
                    s = core::failure(status_code::capacity_exceeded);
                    s.required = {0, workspace.limits.fragments, need};
                    return s;
                }
                core::known_coverage<Known...>::set(options);
                arena memory(workspace.memory);
                const memory_type call(draws, g, out, workspace.limits, memory);
                core::known_coverage<Known...>::dispatch(options.rule, [&]<coverage Rule>() {
                    call.lists.template launch<Rule>(options.count_voxels, backend.stream);
                });
                call.output.store(call.lists, g, options, out, backend.stream);
                return s;
            });
        }
    }
    return {}; // does not compile: a static_assert has said why
}

} // namespace device

// Bytes that voxelize_async needs for such a call on the current device; 0 if the arguments are invalid. Uses
// limits.fragments, and bricks, voxels and nodes of a sparse_result.
template <class View, class VertexShader, class FragmentShader, class... Targets>
requires core::is_elements_view<View>
[[nodiscard]] std::size_t workspace_bytes(std::span<const draw<View, VertexShader, FragmentShader>> draws,
                                          const grid& g, const framebuffer_view<Targets...>& out,
                                          const voxelize_options&, const workspace_limits& limits) {
    return device::element_bytes<View, VertexShader, FragmentShader, framebuffer_view<Targets...>>(draws, g, out,
                                                                                                   limits);
}
template <class View, class VertexShader, class FragmentShader, class Payload>
requires core::is_elements_view<View>
[[nodiscard]] std::size_t workspace_bytes(std::span<const draw<View, VertexShader, FragmentShader>> draws,
                                          const grid& g, const abuffer_view<Payload>& out, const voxelize_options&,
                                          const workspace_limits& limits) {
    return device::element_bytes<View, VertexShader, FragmentShader, abuffer_view<Payload>>(draws, g, out, limits);
}
template <class View, class VertexShader, class FragmentShader, class... Targets>
requires core::is_elements_view<View>
[[nodiscard]] std::size_t workspace_bytes(std::span<const draw<View, VertexShader, FragmentShader>> draws,
                                          const grid& g, const sparse_result<Targets...>& out, const voxelize_options&,
                                          const workspace_limits& limits) {
    return device::element_bytes<View, VertexShader, FragmentShader, sparse_result<Targets...>>(draws, g, out, limits);
}

// Puts a call of points or lines on the backend's stream and returns. Results are those of voxelize; `lists` and
// `result` are set to where they will be. A status other than ok means that nothing was launched, or that a launch
// failed; read_status reports what the device finds out.
template <coverage... Known, class View, class VertexShader, class FragmentShader, class... Targets>
requires core::is_elements_view<View>
[[nodiscard]] status voxelize_async(cuda_backend& backend,
                                    std::span<const draw<View, VertexShader, FragmentShader>> draws, const grid& g,
                                    const framebuffer_view<Targets...>& fb, voxelize_options options,
                                    const workspace_view& workspace) {
    return device::launch_elements<Known...>(backend, draws, g, fb, options, workspace);
}
template <coverage... Known, class View, class VertexShader, class FragmentShader, class Payload>
requires core::is_elements_view<View>
[[nodiscard]] status voxelize_async(cuda_backend& backend,
                                    std::span<const draw<View, VertexShader, FragmentShader>> draws, const grid& g,
                                    abuffer_view<Payload>& lists, voxelize_options options,
                                    const workspace_view& workspace) {
    return device::launch_elements<Known...>(backend, draws, g, lists, options, workspace);
}
template <coverage... Known, class View, class VertexShader, class FragmentShader, class... Targets>
requires core::is_elements_view<View>
[[nodiscard]] status voxelize_async(cuda_backend& backend,
                                    std::span<const draw<View, VertexShader, FragmentShader>> draws, const grid& g,
                                    sparse_result<Targets...>& result, voxelize_options options,
                                    const workspace_view& workspace) {
    return device::launch_elements<Known...>(backend, draws, g, result, options, workspace);
}

} // namespace voxelpipe
