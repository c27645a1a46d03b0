// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "arrays.hpp"

namespace voxelpipe::python {
namespace {

using mask = target<std::uint8_t, blend::replace>;
using bits = target<bit, blend::bit_or>;

nb::dict voxelize_mask(const position_array& positions, const triangle_array& triangles, const grid& g,
                       const std::string& rule, const array<std::uint8_t, 3>& out, unsigned threads) {
    expect_shape(out, g, "the result");
    const voxelize_options options{coverage_named(rule)};
    status s;
    {
        const nb::gil_scoped_release released;
        cpu_backend backend{threads};
        s = voxelize(backend, view_of(positions, triangles), g, passthrough{}, constant(std::uint8_t{1}),
                     framebuffer_view<mask>::on(g.extent, out.data()), options);
    }
    return report(s);
}

nb::dict voxelize_bits(const position_array& positions, const triangle_array& triangles, const grid& g,
                       const std::string& rule, const array<std::uint32_t, 3>& out, unsigned threads) {
    expect_shape(out, g, "the result", {}, (static_cast<std::size_t>(g.extent.x) + 31) / 32);
    const voxelize_options options{coverage_named(rule)};
    status s;
    {
        const nb::gil_scoped_release released;
        cpu_backend backend{threads};
        s = voxelize(backend, view_of(positions, triangles), g, passthrough{}, constant(true),
                     framebuffer_view<bits>::on(g.extent, out.data()), options);
    }
    return report(s);
}

// The A-buffer's payload: where in its triangle a fragment lies.
struct weights {
    VOXELPIPE_HD auto operator()(const fragment<>& f) const { return outputs(f.clamped_barycentric()); }
};

nb::tuple list_fragments(const position_array& positions, const triangle_array& triangles, const grid& g,
                         const std::string& rule, unsigned threads) {
    const voxelize_options options{coverage_named(rule)};
    host_abuffer<glm::vec3> lists;
    std::vector<std::int32_t> voxels;
    status s;
    {
        const nb::gil_scoped_release released;
        cpu_backend backend{threads};
        abuffer<cpu_backend, glm::vec3> on_backend{backend};
        s = voxelize(backend, view_of(positions, triangles), g, passthrough{}, weights{}, on_backend, options);
        lists = on_backend.to_host(backend);
        voxels.reserve(3 * lists.size());
        for (const std::uint64_t id : lists.voxels) {
            const glm::ivec3 p = lists.position(id);
            voxels.insert(voxels.end(), {p.x, p.y, p.z});
        }
        if (lists.offsets.empty()) lists.offsets.push_back(0);
    }
    nb::dict counts = report(s);
    const std::size_t num_voxels = lists.voxels.size(), num_fragments = lists.primitives.size();
    std::vector<std::int64_t> offsets(lists.offsets.begin(), lists.offsets.end());
    std::vector<float> barycentrics(3 * num_fragments);
    static_assert(sizeof(glm::vec3) == 3 * sizeof(float));
    if (num_fragments != 0) std::memcpy(barycentrics.data(), lists.payloads.data(), num_fragments * sizeof(glm::vec3));
    return nb::make_tuple(to_numpy(std::move(voxels), {num_voxels, 3}), to_numpy(std::move(offsets), {num_voxels + 1}),
                          to_numpy(std::move(lists.primitives), {num_fragments}),
                          to_numpy(std::move(barycentrics), {num_fragments, 3}), counts);
}

} // namespace

void bind_surface(nb::module_& m) {
    m.def("voxelize_mask", &voxelize_mask, nb::arg("positions"), nb::arg("triangles"), nb::arg("grid"),
          nb::arg("coverage"), nb::arg("out"), nb::arg("threads"));
    m.def("voxelize_bits", &voxelize_bits, nb::arg("positions"), nb::arg("triangles"), nb::arg("grid"),
          nb::arg("coverage"), nb::arg("out"), nb::arg("threads"));
    m.def("fragments", &list_fragments, nb::arg("positions"), nb::arg("triangles"), nb::arg("grid"),
          nb::arg("coverage"), nb::arg("threads"));
}

} // namespace voxelpipe::python
