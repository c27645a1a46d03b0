// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "voxelizer.hpp"

#include "backend_estimate.hpp"
#include "cuda_device.hpp"
#include "padding.hpp"
#include "pipeline_solid.hpp"
#include "pipeline_surface.hpp"

#include <cpu_ref/backend.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <new>
#include <optional>
#include <span>
#include <utility>

namespace voxelize {

double volume_bytes(const voxelize_request& request) {
    double voxel = 0;
    for (const target id : request.targets) {
        const target_info& info = info_of(id);
        voxel += info.type == scalar::bit ? 0.125 : static_cast<double>(size_of(info.type)) * info.components;
    }
    return voxel * request.grid.extent.x * request.grid.extent.y * request.grid.extent.z;
}

namespace {

// Bytes for each vertex and triangle of every instance, while a slab is drawn.
struct scene_bytes {
    double vertices = 0;  // as they are snapped: at least
    double varyings = 0;  // what shaders hand on
    double triangles = 0; // their pairs with tiles, one for most, listed and sorted
    double lines = 0;     // the fragments of a voxel each, listed and sorted: at least
};

scene_bytes bytes_of(const scene& model, const voxelize_request& request) {
    bool shaded = false;
    for (const target id : request.targets)
        shaded = shaded || (id != target::occupancy && id != target::count && !is_of_cells(id));
    for (const material& m : model.materials) shaded = shaded || m.alpha == alpha_mode::mask;
    const auto vertices = static_cast<double>(model.vertex_count());
    return {vertices * sizeof(vp::core::snapped_position), shaded ? vertices * sizeof(surface_varyings) : 0,
            static_cast<double>(model.triangle_count()) * 24, static_cast<double>(model.line_count()) * 128};
}

// Bytes of drawing cut cells beside the result, after the other targets: snapped vertices and triangles; and the edges
// that are sorted, or those of holes, or the pairs of a triangle and a voxel that meet, of a surface somewhat larger
// than that of the grid. Other values alone are drawn beside fractions that nobody keeps.
double fraction_bytes(const voxelize_request& request, double vertices, double triangles) {
    if (!request.wants_cells()) return 0;
    const glm::dvec3 n(request.grid.extent);
    constexpr double triangle_bytes = 36, edges_bytes = 72;
    const double pair_bytes = request.wants(target::area) || request.wants(target::centroid) ? 208 : 64;
    const double pairs = 2 * triangles + 2.5 * (n.x * n.y + n.y * n.z + n.z * n.x);
    const double holes = request.close_holes != 0 ? 40 * vertices + 36 * triangles : 0; // on the host
    const double scratch = request.wants(target::fraction) ? 0 : sizeof(float) * n.x * n.y * n.z;
    return scratch + sizeof(vp::core::snapped_position) * vertices + triangle_bytes * triangles +
           std::max({edges_bytes * triangles, pair_bytes * pairs, holes});
}
double fraction_bytes(const scene& model, const voxelize_request& request) {
    return fraction_bytes(request, static_cast<double>(model.vertex_count()),
                          static_cast<double>(model.triangle_count()));
}

// Bytes that --fill takes.
struct fill_bytes {
    double held = 0;    // while the model is drawn: its connected parts
    double made = 0;    // while these are found, before anything is drawn
    double filling = 0; // while values are found for the voxels inside, after all is drawn
};

fill_bytes fill_bytes_of(const voxelize_request& request, double vertices, double triangles) {
    fill_bytes bytes;
    const glm::dvec3 n(request.grid.extent);
    if (fills_bodies(request)) {
        // Bricks of surfaces that are twice that of the grid, and the rows of one body that is as large as it.
        constexpr double brick_area = 64, crossing_bytes = 64;
        bytes.filling = body_map::brick_bytes * 4 * (n.x * n.y + n.y * n.z + n.z * n.x) / brick_area +
                        2 * crossing_bytes * n.y * n.z + sizeof(vp::core::snapped_position) * vertices;
    } else if (request.solid && request.solid->fill == solid_fill::nearest &&
               (request.wants_colors() || request.wants(target::material))) {
        // Triangles as they are placed, once more while they are sorted, and their order; those that each thread looks
        // at for a brick, which lie within three bricks, in lists that grow; one layer of the slab whose nearest
        // triangles and colours are found at once.
        constexpr double triangle_bytes = 190, near_bytes = 600, near_voxels = 24, thread_bytes = 1 << 20,
                         sample_bytes = 8, least_work = 1 << 20;
        const double side = near_voxels / std::max({n.x, n.y, n.z});
        const double near = triangles * std::min(1.0, side * side);
        bytes.filling =
            (sizeof(vp::core::snapped_position) + sizeof(surface_varyings)) * vertices + triangle_bytes * triangles +
            thread_count(request.threads) * (thread_bytes + near_bytes * near) + least_work + sample_bytes * n.x * n.y;
    }
    return bytes;
}
fill_bytes fill_bytes_of(const scene& model, const voxelize_request& request) {
    fill_bytes bytes =
        fill_bytes_of(request, static_cast<double>(model.vertex_count()), static_cast<double>(model.triangle_count()));
    if (const instance* const whole = instance_of_parts(model, request)) {
        const primitive& of = model.primitives[whole->primitive];
        constexpr double found_vertex_bytes = 16; // order, root, part and number
        const auto vertices = static_cast<double>(of.positions.size());
        const std::size_t vertex = sizeof(glm::vec3) + (of.texcoords.empty() ? 0 : sizeof(glm::vec2)) +
                                   (of.colors.empty() ? 0 : sizeof(glm::vec4));
        bytes.held =
            static_cast<double>(vertex) * vertices + sizeof(glm::uvec3) * static_cast<double>(of.triangles.size());
        bytes.made = bytes.held + found_vertex_bytes * vertices;
    }
    return bytes;
}

// Bytes of the result, of its largest channel once more while a ring is put around it, and of a solid's bits.
struct result_bytes {
    double volume = 0, ring = 0, bits = 0;
};

result_bytes result_of(const voxelize_request& request) {
    result_bytes bytes{volume_bytes(request), 0, 0};
    if (request.padding != 0)
        for (const target id : request.targets) {
            voxelize_request alone = request;
            alone.targets = {id};
            bytes.ring = std::max(bytes.ring, volume_bytes(alone));
        }
    const glm::ivec3 extent = request.grid.extent;
    if (request.solid) bytes.bits = 0.25 * extent.x * extent.y * extent.z; // of the surface and of the inside
    return bytes;
}

// Bytes of a voxel while it is drawn. Cut cells are drawn into the result.
double drawn_bytes(std::span<const target> targets) {
    double bytes = 0;
    for (const target id : targets) {
        if (is_of_cells(id)) continue;
        const double value = static_cast<double>(size_of(info_of(id).type)) * info_of(id).components;
        bytes += id == target::color ? 20 : id == target::color_outer ? 8 : std::max(value, 0.125);
    }
    return bytes;
}

// Voxels of the grid's own surface: an estimate for a model that is not known.
double surface_voxels(const voxelize_request& request) {
    const glm::dvec3 n(request.grid.extent);
    return 2 * (n.x * n.y + n.y * n.z + n.z * n.x);
}

// The voxels of a model, where they are fewer. A plane touches |x| + |y| + |z| voxels for each of its area, (x, y, z)
// being its normal; triangles that lie apart touch one each at least.
double surface_voxels(const scene& model, const voxelize_request& request) {
    const double of_grid = surface_voxels(request);
    if (!request.write_bytes) return of_grid;
    const auto apart = static_cast<double>(model.triangle_count() + model.line_count());
    if (apart >= of_grid) return of_grid;
    constexpr double margin = 1.05;
    double voxels = 0;
    for (const instance& shown : model.instances) {
        const primitive& drawn = model.primitives[shown.primitive];
        const auto at = [&](std::uint32_t vertex) {
            return shown.to_world(drawn.positions[vertex]) / glm::dvec3(request.grid.voxel_size);
        };
        for (const glm::uvec3& t : drawn.triangles) {
            const glm::dvec3 a = at(t.x), twice = glm::cross(at(t.y) - a, at(t.z) - a);
            voxels += margin / 2 * (std::abs(twice.x) + std::abs(twice.y) + std::abs(twice.z));
        }
        for (const glm::uvec2& l : drawn.lines) {
            const glm::dvec3 along = glm::abs(at(l.y) - at(l.x));
            voxels += along.x + along.y + along.z;
        }
    }
    return std::min(of_grid, std::max(voxels, apart));
}

// An estimate of what writers of bricks find in a dense result, given the voxels of the surface.
double written_bytes(const voxelize_request& request, double voxels) {
    if (!request.write_bytes) return 0;
    const glm::dvec3 n(request.grid.extent);
    constexpr double brick_area = 64, brick_voxels = 512;
    const double all = n.x * n.y * n.z;
    if (request.solid) return request.write_bytes(all / brick_voxels, all, 0);
    return request.write_bytes(std::min(voxels / brick_area, all / brick_voxels), std::min(voxels, all), 0);
}

// The result has to fit; `likely` is what the run comes to.
void require_volume(const voxelize_request& request, double likely) {
    const auto [volume, ring, bits] = result_of(request);
    const glm::ivec3 extent = request.grid.extent;
    memory::require(volume + ring + bits,
                    "a result of " + std::to_string(extent.x) + " x " + std::to_string(extent.y) + " x " +
                        std::to_string(extent.z) + " voxels",
                    memory::fewer_voxels_hint, likely);
}

volume run_on_cpu(scene& model, voxelize_request request, voxelize_stats& stats) {
    const int threads = thread_count(request.threads);
    const scene_bytes parts = bytes_of(model, request);
    const double least = parts.vertices + volume_bytes(request);
    const fill_bytes fill = fill_bytes_of(model, request);
    const double likely = fill.held + std::max({least + parts.varyings + parts.triangles + parts.lines,
                                                volume_bytes(request) + fraction_bytes(model, request),
                                                volume_bytes(request) + fill.filling});
    require_vertices(model, request, volume_bytes(request));
    const auto room = static_cast<double>(memory::room());
    const double likely_in_all = static_cast<double>(memory::limit()) - room + likely;
    if (request.work_memory == 0) {
        constexpr double most_work = 128 << 20, least_work = 1 << 20;
        request.work_memory = static_cast<std::uint64_t>(std::clamp((room - likely) / 4, least_work, most_work));
    }
    vp::cpu_backend backend{static_cast<unsigned>(threads)};
    vp::stage_times times;
    backend.times = &times;
    stats.backend = "cpu";
    stats.threads = threads;
    volume result;
    try {
        result = pipeline<vp::cpu_backend>{backend, model, request, stats}.run();
    } catch (const std::bad_alloc&) {
        throw memory_error(
            memory::shortage(memory::fewer_voxels_hint, likely_in_all + static_cast<double>(request.work_memory)));
    }

    constexpr std::string_view absent[] = {"tile_split", "tile_resolve", "abuffer_emit"};
    show_stages(stats, times, absent, "");
    return result;
}

volume with_ring(volume inside, const voxelize_request& request) {
    volume result = padded(std::move(inside), request.padding);
    for (std::size_t axis = 0; axis < 3; ++axis) // without the rounding of a way there and back
        result.origin[axis] = request.grid.part_origin()[static_cast<glm::length_t>(axis)];
    for (volume& faces : result.faces) {
        faces.origin = result.origin;
        center_on_faces(faces, request.grid, axis_of_faces(*target_named(faces.channels.front().name)));
    }
    return result;
}

} // namespace

namespace {

// Bytes beyond those of the model's vertices and triangles: `parts` are those, `fractions` with those of fractions,
// `written` those of writing.
double dense_need_beside(const voxelize_request& request, double parts, double fractions, const fill_bytes& fill,
                         double written) {
    const auto [volume, ring, bits] = result_of(request);
    // A slab of one layer, and each thread's tile with its sums.
    constexpr double least_work = 1 << 20, thread_bytes = 1 << 20, tile_voxels = 32768, sums = 2.5;
    const double voxel = drawn_bytes(request.targets);
    const double threads = thread_count(request.threads) * (thread_bytes + tile_voxels * (sums * voxel + 8));
    const double layer = voxel * request.grid.extent.x * request.grid.extent.y;
    const double drawn = fill.held + bits +
                         std::max({parts + least_work + layer + threads, fractions, least_work + layer + fill.filling});
    return std::max(fill.made, volume + std::max({ring, drawn, written}));
}

} // namespace

double dense_need(const scene& model, const voxelize_request& request) {
    const scene_bytes parts = bytes_of(model, request);
    return dense_need_beside(request, parts.vertices + parts.varyings + parts.triangles + parts.lines,
                             fraction_bytes(model, request), fill_bytes_of(model, request),
                             written_bytes(request, surface_voxels(model, request)));
}

double dense_need(const voxelize_request& request) {
    return dense_need_beside(request, 0, fraction_bytes(request, 0, 0), fill_bytes_of(request, 0, 0),
                             written_bytes(request, surface_voxels(request)));
}

void require_vertices(const scene& model, const voxelize_request& request, double result) {
    const scene_bytes parts = bytes_of(model, request);
    const double least = parts.vertices + result;
    memory::require(least,
                    "a scene of " + std::to_string(model.vertex_count()) + " vertices and " +
                        std::to_string(model.triangle_count()) + " triangles",
                    memory::fewer_voxels_hint, least + parts.varyings + parts.triangles + parts.lines);
}

void require_cpu(const voxelize_request& request, const std::string& why, voxelize_stats& stats) {
    if (request.backend == backend_choice::cuda) throw backend_error("--backend cuda: " + why + "; use --backend cpu");
    if (request.strategy != voxelpipe::strategy::automatic || request.devices != 1)
        throw backend_error(std::string(request.devices != 1 ? "--devices" : "--strategy") + " needs a GPU: " + why);
    if (request.backend == backend_choice::automatic) stats.no_cuda = why;
}

void take_outside(volume& result, int threads) {
    const auto turn = [threads](channel& c) {
        auto* const values = reinterpret_cast<float*>(c.data.data());
        const std::size_t count = c.data.size() / sizeof(float);
        constexpr std::size_t piece = std::size_t{1} << 16;
        parallel_for((count + piece - 1) / piece, thread_count(threads), [=](std::size_t n) {
            const std::size_t end = std::min(count, (n + 1) * piece);
            for (std::size_t i = n * piece; i < end; ++i) values[i] = 1.0F - values[i];
        });
    };
    if (channel* const fractions = result.find(info_of(target::fraction).name); fractions != nullptr) turn(*fractions);
    for (volume& faces : result.faces) turn(faces.channels.front());
}

volume run_voxelizer(scene&& model, const voxelize_request& request, voxelize_stats& stats) {
    if (request.wants_cells())
        require_cpu(request, "--target " + name_of_cells(request) + " is drawn on the CPU alone", stats);
    if (std::optional<volume> slabs = cells_in_slabs(model, request, stats)) return std::move(*slabs);
    const double need = dense_need(model, request);
    memory::expect(need);
    require_volume(request, need);
    try {
        voxelize_request inside = request;
        inside.grid = request.grid.crop(glm::ivec3(request.padding), request.grid.extent - 2 * request.padding);
        if (inside.solid) inside.solid->is_whole = true;
        const bool only_cpu = request.wants_cells() || (request.solid && request.solid->fill == solid_fill::nearest);
        if (only_cpu && !request.wants_cells()) require_cpu(request, "--fill nearest is drawn on the CPU alone", stats);
        if (request.backend != backend_choice::cpu && !only_cpu)
            if (std::optional<volume> result = draw_on_cuda(model, inside, false, stats,
                                                            [&](const cuda_facts& facts, const voxelize_request& how) {
                                                                return run_on_cuda(facts, model, how, stats);
                                                            }))
                return with_ring(std::move(*result), request);
        volume result = with_ring(run_on_cpu(model, inside, stats), request);
        if (request.outside) take_outside(result, request.threads); // the ring, too
        return result;
    } catch (const std::bad_alloc&) {
        throw memory_error(memory::shortage(memory::fewer_voxels_hint));
    }
}

} // namespace voxelize
