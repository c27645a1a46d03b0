// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "arrays.hpp"

#include <voxelpipe/label/label.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace voxelpipe::python {
namespace {

// (number of components, names, voxels, lowest voxels, highest voxels); the arrays are empty unless they are wanted.
nb::tuple listed(std::uint64_t count, const std::vector<voxel_component>& components) {
    std::vector<std::int64_t> names, voxels;
    std::vector<std::int32_t> lowest, highest;
    for (const voxel_component& c : components) {
        names.push_back(c.name);
        voxels.push_back(static_cast<std::int64_t>(c.voxels));
        lowest.insert(lowest.end(), {c.min.x, c.min.y, c.min.z});
        highest.insert(highest.end(), {c.max.x, c.max.y, c.max.z});
    }
    const std::size_t n = components.size();
    return nb::make_tuple(count, to_numpy(std::move(names), {n}), to_numpy(std::move(voxels), {n}),
                          to_numpy(std::move(lowest), {n, 3}), to_numpy(std::move(highest), {n, 3}));
}

// Words of 32 voxels along x, into labels (nz, ny, nx).
template <class Label>
nb::tuple label_words(const array<const std::uint32_t, 3>& words, const array<Label, 3>& out, int connectivity,
                      bool wants_list, unsigned threads) {
    if (words.shape(0) != out.shape(0) || words.shape(1) != out.shape(1) || words.shape(2) != (out.shape(2) + 31) / 32)
        throw nb::value_error("the words of bits are not those of the labels");
    // What is larger than any grid stays so.
    const auto side = [](std::size_t n) { return static_cast<int>(std::min<std::size_t>(n, 2 * grid::max_extent)); };
    const glm::ivec3 extent(side(out.shape(2)), side(out.shape(1)), side(out.shape(0)));
    cpu_backend backend{threads};
    cpu_backend::buffer<voxel_component> components(backend, 0);
    status s;
    {
        const nb::gil_scoped_release released;
        // The view is of a target that could be written; label reads it.
        const target_view<target<bit, blend::replace>> bits{const_cast<std::uint32_t*>(words.data()),
                                                            extent}; // NOLINT(*-const-cast)
        const target_view<target<Label, blend::replace>> labels{out.data(), extent};
        const label_options options{connectivity};
        s = wants_list ? label(backend, bits, labels, components, options) : label(backend, bits, labels, options);
    }
    (void)report(s); // throws where the call failed
    return listed(s.label.components, components.to_host(backend));
}

} // namespace

void bind_label(nb::module_& m) {
    m.def("label", &label_words<std::int32_t>, nb::arg("words"), nb::arg("out"), nb::arg("connectivity"),
          nb::arg("components"), nb::arg("threads"));
    m.def("label", &label_words<std::int64_t>, nb::arg("words"), nb::arg("out"), nb::arg("connectivity"),
          nb::arg("components"), nb::arg("threads"));
}

} // namespace voxelpipe::python
