// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Meshes in chunks and grids in slabs: targets, lists, solids with every repair. The hashes are of what the slabs give
// one after the other.

#include "cases.hpp"

#include <voxelpipe/slabs/stream.hpp>

#include <algorithm>
#include <utility>

namespace golden {

struct slab_values {
    VOXELPIPE_HD auto operator()(const vp::fragment<>& f) const {
        return vp::outputs(f.normal, f.primitive).discard_if(f.primitive % 7u == 6u);
    }
};
struct slab_numbers {
    VOXELPIPE_HD auto operator()(const vp::fragment<>& f) const { return vp::outputs(f.barycentric); }
};
struct slab_windings {
    VOXELPIPE_HD auto operator()(const vp::solid_fragment& f) const {
        return vp::outputs(glm::vec3(static_cast<float>(f.winding), 0.0f, 0.0f), static_cast<std::uint32_t>(f.voxel.z));
    }
};

template <class Backend>
using slab_targets =
    vp::framebuffer<Backend, vp::target<glm::vec3, vp::blend::add>, vp::target<std::uint32_t, vp::blend::replace>>;

// Gives a stream the mesh in chunks of 100 triangles.
template <class Stream>
void feed(Stream& stream, const mesh_data& m) {
    for (std::size_t i = 0; i < m.triangles.size(); i += 100) {
        vp::mesh_view<> chunk{m.positions, m.triangles};
        const std::size_t count = std::min<std::size_t>(100, m.triangles.size() - i);
        chunk.triangles = vp::array_view<const glm::uvec3>(m.triangles.data() + i, count);
        stream.add(chunk).or_throw();
    }
}

template <class Backend>
void add_slabs(case_table<Backend>& cases) {
    using stream_type = vp::slabs::stream<Backend, vp::passthrough>;
    for (const char* const mesh : {"torus", "soup"}) {
        cases.push_back({std::string("slabs.targets.") + mesh, [mesh](Backend& backend, digest& d) {
                             vp::slabs::stream_options how;
                             how.num_slabs = 4;
                             stream_type stream(backend, odd_grid(), {}, how);
                             feed(stream, hashed_mesh(mesh));
                             const auto make = [&](glm::ivec3 size) { return slab_targets<Backend>{backend, size}; };
                             const auto sink = [&](const vp::slabs::slab&, const slab_targets<Backend>& part) {
                                 d.add(vp::get<0>(part).to_host(backend));
                                 d.add(vp::get<1>(part).to_host(backend));
                             };
                             add_counts(d, stream.draw(slab_values{}, make, sink));
                         }});
        cases.push_back({std::string("slabs.list.") + mesh, [mesh](Backend& backend, digest& d) {
                             vp::slabs::stream_options how;
                             how.num_slabs = 3;
                             how.voxelize.rule = vp::coverage::thin;
                             stream_type stream(backend, odd_grid(), {}, how);
                             feed(stream, hashed_mesh(mesh));
                             using lists_type = vp::abuffer<Backend, glm::vec3>;
                             vp::host_abuffer<glm::vec3> whole;
                             const auto make = [&](glm::ivec3) { return lists_type{backend}; };
                             const auto sink = [&](const vp::slabs::slab& s, const lists_type& part) {
                                 vp::slabs::append(whole, odd_grid(), s, part.to_host(backend));
                             };
                             add_counts(d, stream.draw(slab_numbers{}, make, sink));
                             add_list(d, whole);
                         }});
    }
    for (const auto& [name, repair] :
         {std::pair{"none", vp::repair::none}, std::pair{"close_holes", vp::repair::close_holes},
          std::pair{"vote", vp::repair::vote}, std::pair{"exterior", vp::repair::exterior},
          std::pair{"winding", vp::repair::winding}})
        for (const char* const mesh : {"open", "shells"})
            cases.push_back(
                {std::string("slabs.solid.") + name + '.' + mesh, [kind = repair, mesh](Backend& backend, digest& d) {
                     vp::slabs::stream_options how;
                     how.num_slabs = 3;
                     how.is_solid = true;
                     how.repair = kind;
                     stream_type stream(backend, odd_grid(), {}, how);
                     feed(stream, hashed_mesh(mesh));
                     vp::solid_options options;
                     options.repair = kind;
                     const auto make = [&](glm::ivec3 size) { return slab_targets<Backend>{backend, size}; };
                     const auto sink = [&](const vp::slabs::slab&, const slab_targets<Backend>& part) {
                         d.add(vp::get<0>(part).to_host(backend));
                     };
                     add_solid_counts(d, stream.draw_solid(slab_windings{}, make, sink, options));
                 }});
}

} // namespace golden
