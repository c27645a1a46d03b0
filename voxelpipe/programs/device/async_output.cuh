// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The outputs of asynchronous calls of programs, points and lines: framebuffer_view, abuffer_view and sparse_result.

#include <voxelpipe/device/abuffer_async.cuh>
#include <voxelpipe/programs/passes/outputs.hpp>
#include <voxelpipe/sparse/device/sparse_async.cuh>

namespace voxelpipe {

namespace device {

template <class... Targets>
[[nodiscard]] const framebuffer_view<Targets...>& async_output(const framebuffer_view<Targets...>& out) {
    return out;
}
template <class Payload>
[[nodiscard]] abuffer_view<Payload>& async_output(abuffer_view<Payload>& out) {
    return out;
}
template <class... Targets>
[[nodiscard]] sparse_result<Targets...>& async_output(sparse_result<Targets...>& out) {
    return out;
}
// True for fragment lists.
template <class Output>
inline constexpr bool is_lists = false;
template <class Payload>
inline constexpr bool is_lists<abuffer_view<Payload>> = true;

} // namespace device

namespace core {

template <class Payload>
struct output_kind<abuffer_view<Payload>> {
    static constexpr bool is_known = true;
    template <class ShaderOutput>
    [[nodiscard]] static constexpr bool fits() {
        return output_check<ShaderOutput>::template fits_payload<Payload>();
    }
    [[nodiscard]] static status validate(const abuffer_view<Payload>&, const grid&) { return {}; }
};
template <class... Targets>
struct output_kind<sparse_result<Targets...>> {
    static constexpr bool is_known = true;
    template <class ShaderOutput>
    [[nodiscard]] static constexpr bool fits() {
        return output_check<ShaderOutput>::template fits_targets<Targets...>();
    }
    [[nodiscard]] static status validate(const sparse_result<Targets...>& out, const grid& g) {
        return validate_start(out, g);
    }
};

} // namespace core
} // namespace voxelpipe
