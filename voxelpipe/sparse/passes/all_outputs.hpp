// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// All outputs of a fragment shader as one value, the payload of an A-buffer: for calls that list their fragments before
// they fold them.

#include <voxelpipe/shader.hpp>

#include <type_traits>

namespace voxelpipe::core {

template <class Output>
struct outputs_payload;
template <class... Ts>
struct outputs_payload<output<Ts...>> {
    using type = pack<Ts...>;
};

template <class FragmentShader>
struct payload_shader {
    FragmentShader shader;
    VOXELPIPE_ANY_CALLABLE
    template <class Fragment>
    VOXELPIPE_HD auto operator()(const Fragment& f) const {
        const auto out = shader(f);
        output<std::remove_cvref_t<decltype(out.values)>> payload{};
        payload.values = make_pack(out.values);
        payload.keep = out.keep;
        return payload;
    }
};

} // namespace voxelpipe::core
