// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// A first program as a user writes it, with none of the options that our own targets have: nvcc must not warn of it.
// Its second shader is for the device only, for it reads a texture object.

#include <voxelpipe/voxelpipe.hpp>

#include <vector>

namespace vp = voxelpipe;

struct textured {
    cudaTextureObject_t texture;
#if defined(WITHOUT_RESULT)
    __device__ auto
#else
    __device__ vp::output<float>
#endif
    operator()(const vp::fragment<>& f) const {
        return vp::outputs(tex2D<float>(texture, f.barycentric.x, f.barycentric.y));
    }
};

float sample(const std::vector<glm::vec3>& positions, const std::vector<glm::uvec3>& triangles,
             cudaTextureObject_t texture) {
    vp::cuda_backend backend;
    const vp::grid grid = vp::fit(positions, {64, 64, 64});
    const vp::mesh mesh{backend, positions, triangles};
    vp::abuffer<vp::cuda_backend, float> lists{backend};
    vp::voxelize(backend, mesh, grid, vp::passthrough{}, textured{texture}, lists, vp::coverage::thin).or_throw();
    const auto host = lists.to_host(backend);
    return host.empty() ? 0.0f : host[0].fragments[0].value;
}
