// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// surface_layers: the surface of a grid whose layers come one after the other, as they are drawn. It holds four layers
// of what came before, and gives the surface piece by piece. On any backend.

#include <voxelpipe/surfaces/extract_slab.hpp>

#include <algorithm>
#include <cstddef>

namespace voxelpipe {

// T: bit or float, of the targets whose layers come. The object refers to the backend.
template <class Backend, class T>
class surface_layers {
public:
    // whole: the grid of all samples. options: as of extract_slab. What is not valid is what add() returns.
    surface_layers(Backend& backend, const grid& whole, const extract_options& options = {})
        : backend_(backend), whole_(whole), options_(options), held_(backend, 0) {}

    // Adds the next layers along z, one or more, from the lowest ones on, of the extent of the grid along x and y.
    // Calls sink(const surface_slab&, surface<Backend>&) once if that completes layers, with their part of the surface:
    // two layers above have to be known, unless they are the last. The arrays of all pieces, one after the other, are
    // those of extract, and slab.first_vertex is the number of vertices before. extent_mismatch: layers of another
    // extent, or more than are left; otherwise as extract_slab. A call that fails leaves the object as it is. Throws
    // what sink throws.
    template <class Blend, class Sink>
    [[nodiscard]] status add(const target_view<target<T, Blend>>& layers, const Sink& sink) {
        surface<Backend> piece(backend_);
        surface_slab slab;
        const status s = backend_.guard([&] { return take(layers, slab, piece); });
        if (s.ok() && slab.layers > 0) sink(static_cast<const surface_slab&>(slab), piece);
        return s;
    }
    // Layers that add() has taken.
    [[nodiscard]] int num_layers() const { return end_; }
    // Counts of all pieces so far, components excepted.
    [[nodiscard]] const surface_counters& counts() const { return counts_; }

private:
    using map = core::storage_map<T, layout::linear>;
    using element = typename target<T, blend::replace>::element_type;
    using buffer = typename Backend::template buffer<element>;

    [[nodiscard]] std::size_t elements(int layers) const {
        return map::elements(glm::ivec3(whole_.extent.x, whole_.extent.y, layers));
    }
    void copy(const element* from, std::size_t first, std::size_t count, element* to) {
        backend_.for_each(count, core::passes::copy_part<element>{from, first, to});
    }

    template <class Blend>
    [[nodiscard]] status take(const target_view<target<T, Blend>>& layers, surface_slab& slab,
                              surface<Backend>& piece) {
        if (const status s = validate(whole_); !s.ok()) return s;
        if (const status s = core::validate(options_); !s.ok()) return s;
        const glm::ivec3 e = layers.extent;
        if (e.x != whole_.extent.x || e.y != whole_.extent.y || e.z <= 0 || e.z > whole_.extent.z - end_)
            return core::failure(status_code::extent_mismatch);
        if (layers.elements == nullptr) return core::failure(status_code::null_view);

        surface_slab next = next_;
        const int lowest = next.lowest(), end = end_ + e.z, known = end - lowest;
        const int ready = end == whole_.extent.z ? end : end - surface_slab::beyond;
        buffer all(backend_, elements(known));
        copy(held_.data(), 0, held_.size(), all.data());
        copy(layers.elements, 0, elements(e.z), all.data() + held_.size());
        status s;
        if (ready > next.first) {
            next.layers = ready - next.first;
            const target_view<target<T, Blend>> view{all.data(), glm::ivec3(e.x, e.y, known)};
            s = extract_slab(backend_, view, whole_, next, piece, options_);
            if (!s.ok()) return s;
            slab = next;
            next = {ready, 0, next.first_vertex + s.surface.vertices};
        }
        const std::size_t gone = elements(next.lowest() - lowest);
        buffer held(backend_, all.size() - gone);
        copy(all.data(), gone, held.size(), held.data());
        held_ = std::move(held);
        next_ = next;
        end_ = end;
        counts_.vertices += s.surface.vertices;
        counts_.faces += s.surface.faces;
        counts_.nan_samples += s.surface.nan_samples;
        counts_.made_crossings += s.surface.made_crossings;
        return s;
    }

    Backend& backend_;
    grid whole_;
    extract_options options_;
    buffer held_;       // layers next_.lowest() to end_ - 1
    surface_slab next_; // the layers that are not complete yet
    int end_ = 0;       // of the layers that have come
    surface_counters counts_;
};

} // namespace voxelpipe
