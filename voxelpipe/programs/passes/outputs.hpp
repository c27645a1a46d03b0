// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// The outputs of calls with programs, points and lines: what is checked of each kind, and what fragments are listed of.

#include <voxelpipe/programs/passes/fragment_pool.hpp>
#include <voxelpipe/programs/passes/types.hpp>
#include <voxelpipe/sparse/passes/all_outputs.hpp>
#include <voxelpipe/sparse/sparse.hpp>
#include <voxelpipe/voxelize.hpp>

#include <span>
#include <utility>

namespace voxelpipe::core {

// What is checked of each kind of output before a call runs.
template <class Output>
struct output_kind {
    static constexpr bool is_known = false;
};
template <class... Targets>
struct output_kind<framebuffer_view<Targets...>> {
    static constexpr bool is_known = true;
    template <class ShaderOutput>
    [[nodiscard]] static constexpr bool fits() {
        return output_check<ShaderOutput>::template fits_targets<Targets...>();
    }
    [[nodiscard]] static status validate(const framebuffer_view<Targets...>& fb, const grid& g) {
        return validate_framebuffer(fb, g);
    }
};
template <class Backend, class Payload>
struct output_kind<abuffer<Backend, Payload>> {
    static constexpr bool is_known = true;
    template <class ShaderOutput>
    [[nodiscard]] static constexpr bool fits() {
        return output_check<ShaderOutput>::template fits_payload<Payload>();
    }
    [[nodiscard]] static status validate(const abuffer<Backend, Payload>&, const grid&) { return {}; }
};
template <class Backend, class... Targets>
struct output_kind<sparse_framebuffer<Backend, Targets...>> {
    static constexpr bool is_known = true;
    template <class ShaderOutput>
    [[nodiscard]] static constexpr bool fits() {
        return output_check<ShaderOutput>::template fits_targets<Targets...>();
    }
    [[nodiscard]] static status validate(const sparse_framebuffer<Backend, Targets...>& fb, const grid& g) {
        return validate_sparse(fb, g);
    }
};
template <class Backend, class... Targets, class ShaderOutput>
struct pooled<sparse_framebuffer<Backend, Targets...>, ShaderOutput> {
    using payload = typename outputs_payload<ShaderOutput>::type;
};
template <class Backend, class Payload, class... Targets>
[[nodiscard]] status store_pooled(Backend& backend, const grid& g, abuffer<Backend, Payload>&& lists,
                                  sparse_framebuffer<Backend, Targets...>& fb, bool count_voxels, status s) {
    s.counts.fragments = lists.num_fragments();
    s.counts.voxels = count_voxels ? lists.num_voxels() : 0;
    return run_module(store_sparse_tag{}, backend, g, lists, fb, s);
}

// A framebuffer is drawn into through its view.
template <class Output>
[[nodiscard]] Output& drawn_output(Output& out) {
    return out;
}
template <class Backend, class... Targets>
[[nodiscard]] const framebuffer_view<Targets...>& drawn_output(framebuffer<Backend, Targets...>& fb) {
    return fb.view();
}

// What every call with programs, points or lines checks first.
template <class Mesh, class VertexShader, class FragmentShader, class Amplify, class Output>
[[nodiscard]] status validate_call(std::span<const draw<Mesh, VertexShader, FragmentShader, Amplify>> draws,
                                   const grid& g, const Output& out) {
    if (const status s = validate(g); !s.ok()) return s;
    if (const status s = output_kind<Output>::validate(out, g); !s.ok()) return s;
    return validate_program_draws(draws);
}

// The shader of lists for an output: the lists' payload is a shader's one output, or all of them.
template <class Output>
struct listing {
    template <class FragmentShader>
    using shader = payload_shader<FragmentShader>;
};
template <class Backend, class Payload>
struct listing<abuffer<Backend, Payload>> {
    template <class FragmentShader>
    using shader = FragmentShader;
};

} // namespace voxelpipe::core
