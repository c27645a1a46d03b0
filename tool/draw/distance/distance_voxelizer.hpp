// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// --distance: scene + options -> volume with the channel "distance", and beside it values of the nearest triangle, on
// the CPU. The whole grid is drawn at once into the volume's own memory, or slab by slab while outputs are written.

#include "draw/sparse/streamed_model.hpp"
#include "draw/voxelizer.hpp"
#include "model/scene.hpp"
#include "model/volume.hpp"
#include "read/triangle_stream.hpp"

#include <functional>
#include <vector>

namespace voxelize {

// Values that there are beside distances: those of the nearest triangle at its closest point, and `distance` itself.
[[nodiscard]] bool is_of_nearest(target id);

// Bytes that drawing the distances of a model comes to, beyond those that are held before it, about.
struct distance_bytes {
    double samples;     // the channels, and what lies beside them as long as they are drawn
    double vertex = 24; // as it is snapped, with what shaders hand on
    double triangle;    // its box, its number and its part of the tree
    double threads;     // of all

    explicit distance_bytes(const voxelize_request& request);
    [[nodiscard]] double of(double triangles, double vertices) const {
        return samples + vertex * vertices + triangle * triangles + threads;
    }
};

// Bytes of a field that is held whole and written, about; 0 where nothing is written.
[[nodiscard]] double written_bytes(const voxelize_request& request);
// Bytes of what holds the band of a field that is drawn in slabs, about; 0 where no output does.
[[nodiscard]] double held_band_bytes(const voxelize_request& request);

// request.distance is set; request.grid is that of the samples, not cropped. Lines and points have no distances: a
// warning counts them. A model without triangles gives the band's distance everywhere, or infinity, which a warning
// says. Where the field does not fit, but two slabs of distance_request::slab_layers layers do, the channels of the
// volume have no data: they draw slabs on the CPU as they are read, and keep two. Then `stats` has to outlive the
// volume, and its counts and warnings are whole once all of it has been read and add_distance_warnings was called;
// otherwise they are at once. Throws memory_error with need and limit before anything is drawn where neither fits,
// backend_error for a GPU.
[[nodiscard]] volume run_distance_voxelizer(scene&& model, const voxelize_request& request, voxelize_stats& stats);

// True if distances of this request can be drawn of a model that is read block by block: in a band, at centres, with a
// sign that each layer decides by itself, on the CPU.
[[nodiscard]] bool streams_distances(const voxelize_request& request);

// As run_distance_voxelizer for a model that does not fit, by request for which streams_distances() is true. Its
// triangles go through temporary files to the slabs whose band they reach. Where all outputs take slabs
// (distance_request::slab_layers), the volume's channels draw them as they are read, as above, and the model too has to
// outlive it; otherwise the field is held whole. Throws as draw_streamed, and so do channels that are read.
[[nodiscard]] volume run_streamed_distances(triangle_stream& model, const stream_place& place,
                                            const voxelize_request& request, voxelize_stats& stats);

// A volume whose channels are drawn slab by slab as they are read: draw(i) has those of the layers from ends[i - 1], or
// 0, to ends[i]. It is called as often as values of a slab are asked for that is not among the last two; only the first
// time its counts stay in `stats`, which has to outlive the volume.
[[nodiscard]] volume make_late_volume(const voxelize_request& request, std::vector<int> ends,
                                      const std::function<volume(std::size_t)>& draw, voxelize_stats& stats);

// The most layers of a slab, a multiple of `step` below extent_z + step, whose need in bytes, which grows with them, is
// well below the room: what slabs take beside is not all known.
template <class Need>
[[nodiscard]] int most_layers(int extent_z, int step, double room, const Need& need_of) {
    constexpr double used = 0.75; // of the room, by estimate
    int steps = 1;
    for (int more = (extent_z - 1) / step; more > 0; more /= 2)
        while (steps + more < (extent_z + step - 1) / step && need_of((steps + more) * step) <= used * room)
            steps += more;
    return steps * step;
}

// True if a volume's channels are drawn as they are read.
[[nodiscard]] bool is_drawn_late(const volume& v);

// Adds the warnings that follow from the counts of all samples.
void add_distance_warnings(const voxelize_request& request, voxelize_stats& stats);

} // namespace voxelize
