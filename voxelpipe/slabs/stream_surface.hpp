// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Surfaces of meshes and grids that do not fit into memory: a stream (stream.hpp) draws solids or distances slab by
// slab, and pieces of the surface go to a sink as soon as their layers are known.
//
//   slabs::stream stream(backend, grid, vertex_shader, {.is_solid = true});
//   while (read(chunk)) stream.add(chunk).or_throw();
//   slabs::extract_solid(stream, sink).or_throw(); // sink(const surface_slab&, surface<Backend>&)

#include <voxelpipe/slabs/stream.hpp>
#include <voxelpipe/surfaces/surface_layers.hpp>

namespace voxelpipe::slabs {

namespace detail {

// What ends a stream whose surface has failed.
struct surface_failure {
    status why;
};

// draw(sink of slabs) draws the stream into targets of T, along z.
template <class T, class Backend, class Varyings, class Sink, class Draw>
[[nodiscard]] status extract_layers(Backend& backend, record_stream<Backend, Varyings>& from, const Sink& sink,
                                    const extract_options& options, const Draw& draw) {
    if (const status s = core::validate(options); !s.ok()) return s;
    if (options.border != border::closed || options.min_component != 0 || options.embedded)
        return core::failure(status_code::bad_surface_options);
    surface_layers<Backend, T> layers(backend, from.where(), options);
    from.keep_layers();
    status drawn;
    try {
        drawn = draw([&](const slab&, const auto& out) {
            const status s = layers.add(voxelpipe::get<0>(out.view().targets), sink);
            if (!s.ok()) throw surface_failure{s};
        });
    } catch (const surface_failure& failed) {
        return failed.why;
    }
    if (drawn.ok()) drawn.surface = layers.counts();
    return drawn;
}

} // namespace detail

// Makes the surface of a solid: the arrays and counts, components excepted, of one extract of the bits that draw_solid
// draws of the whole mesh, with any repair. The stream is made as for draw_solid, with slabs along z. `sink` gets the
// pieces as from surface_layers::add, from the lowest layers on. Held besides what draw_solid holds, which the budget
// does not count: a slab's bits once more with four layers of its neighbours, and what extract takes for a slab.
// bad_surface_options: border::open, min_component or embedded, which look at the whole, or a level. bad_crop: slabs
// along another axis. Otherwise fails and throws as draw_solid and extract; pieces before a failure have reached the
// sink.
template <class Backend, class Varyings, class Sink>
[[nodiscard]] status extract_solid(record_stream<Backend, Varyings>& from, const Sink& sink,
                                   const extract_options& options = {}, const solid_options& how = {}) {
    if (options.level != 0.0) return core::failure(status_code::bad_surface_options);
    Backend& backend = from.backend();
    return detail::extract_layers<bit>(backend, from, sink, options, [&](const auto& to) {
        const auto make = [&](glm::ivec3 extent) {
            return framebuffer<Backend, target<bit, blend::replace>>{backend, extent};
        };
        return from.draw_solid(constant(true), make, to, how);
    });
}

// Makes the surface where the distance of the whole mesh is options.level, in world units: the arrays and counts,
// components excepted, of one extract of the field that draw_distance draws, which without triangles is the band
// everywhere. The stream is made as for draw_distance, with slabs along z and a band beyond the level. Memory, sink and
// failures: as of extract_solid, with floats in place of bits.
template <class Backend, class Varyings, class Sink>
[[nodiscard]] status extract_distance(record_stream<Backend, Varyings>& from, const Sink& sink,
                                      const extract_options& options = {}, const distance_options& how = {}) {
    if (const status s = core::validate(how, from.where()); !s.ok()) return s;
    const float far = core::band_distance(how.band, from.where());
    Backend& backend = from.backend();
    return detail::extract_layers<float>(backend, from, sink, options, [&](const auto& to) {
        const auto make = [&](glm::ivec3 extent) {
            framebuffer<Backend, target<float, blend::replace>> field{backend, extent};
            voxelpipe::get<0>(field).clear(far); // a mesh without triangles draws nothing
            return field;
        };
        return from.draw_distance(distance{}, make, to, how);
    });
}

} // namespace voxelpipe::slabs
