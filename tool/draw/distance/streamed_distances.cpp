// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
//
// --distance of a model whose triangles do not fit into the run's memory: they go from the file to the slabs whose band
// they reach, through temporary files, and one slab at a time is measured. All slabs together are the field of a run
// that holds the model.
#include "distance_voxelizer.hpp"

#include "distance_drawer.hpp"
#include "draw/cuda_device.hpp"
#include "draw/sparse/streamed_holes.hpp"
#include "draw/sparse/streamed_slab.hpp"
#include "model/memory.hpp"
#include "model/parallel.hpp"
#include "write/formats/output_file.hpp"

#include <cpu_ref/backend.hpp>

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <memory>
#include <new>
#include <optional>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

namespace voxelize {

namespace {

// The request whose solid decides the sign, for streamed_holes.
voxelize_request request_of_sign(const voxelize_request& request) {
    voxelize_request sign = request;
    sign.distance.reset();
    if (request.distance->is_signed) sign.solid = request.distance->sign;
    return sign;
}

// Calls work(), and names what it lacks: the folder of temporary files, or memory.
template <class Work>
auto named_failures(const std::filesystem::path& folder, const Work& work) {
    try {
        return work();
    } catch (const std::system_error& error) {
        throw write_error(folder, "temporary files for the triangles: " + error.code().message());
    } catch (const std::bad_alloc&) {
        throw memory_error(memory::shortage(memory::fewer_voxels_hint));
    }
}

// A model's triangles in the slabs that need them, which are measured in any order, any number of times.
template <class Varyings>
class binned_distances {
public:
    // is_kept: the whole field is held while slabs are drawn; otherwise two of them are. Adds counts and times. Throws
    // memory_error where a slab does not fit.
    binned_distances(triangle_stream& model, const stream_place& place, const voxelize_request& request, bool is_kept,
                     voxelize_stats& stats)
        : model_(model), folder_(place.folder), request_(request),
          stats_(stats), on_{static_cast<unsigned>(thread_count(request.threads))} {
        const auto start = std::chrono::steady_clock::now();
        const auto room = static_cast<double>(memory::room());
        const corner_placer classify(request, model);
        slabs::histogram layers(request.grid.extent);
        vp::counters counts;
        model.for_each_block([&](const triangle_stream::block& block) {
            for (std::size_t i = 0; i < block.corners.size(); i += 3) {
                const slabs::classified c = classify(block.part, block.corners.data() + i);
                vp::core::count_class(counts, c.kind);
                if (classify.takes(c)) layers.add(c.reach);
            }
        });
        cut(layers, room, is_kept);
        place.say(std::to_string(model.num_triangles()) + " triangles do not fit into " + memory::mebibytes(room) +
                  ": their distances are drawn in " + std::to_string(parts_.size()) +
                  " slabs, through temporary files in " + place.folder.string());
        bin_triangles(model, classify, place.folder.string(), room, request.grid.extent.z, parts_,
                      [](const triangle_stream::block&) {});
        holes_.emplace(model, request_of_sign(request), room, place.folder);
        stats_.triangles = model.num_triangles();
        stats_.slabs = static_cast<int>(parts_.size());
        const std::chrono::duration<double, std::milli> time = std::chrono::steady_clock::now() - start;
        stats_.milliseconds.emplace_back("bin", time.count());
        dropped_ = counts.triangles_dropped();
        stats_.triangles_dropped = dropped_;
        request_.progress = nullptr; // of slabs
    }

    // The last layers of all slabs, each one more.
    [[nodiscard]] std::vector<int> ends() const {
        std::vector<int> all;
        for (const auto& part : parts_) all.push_back(part.layers.end);
        return all;
    }
    // The field of a slab, whose counts are added.
    [[nodiscard]] volume draw(std::size_t i) {
        return named_failures(folder_, [&] {
            streamed_slab<Varyings>& slab = parts_[i];
            add_parts(slab.parts, holes_->parts());
            std::vector<std::size_t> numbers;
            for (const part_count& c : slab.parts) numbers.push_back(c.part);
            scene of_slab = scene_of(slab, model_);
            voxelize_request part = request_;
            part.grid = request_.grid.crop({0, 0, slab.layers.begin},
                                           {request_.grid.extent.x, request_.grid.extent.y, slab.layers.size()});
            const std::vector<vp::core::hole_cones> cones = holes_->of_bodies(numbers);
            if (!cones.empty()) part.distance->sign.cones = cones.data();
            const auto start = std::chrono::steady_clock::now();
            volume field = distance_drawer<vp::cpu_backend>{on_, of_slab, part, stats_}.run();
            const std::chrono::duration<double, std::milli> time = std::chrono::steady_clock::now() - start;
            if (stats_.milliseconds.empty() || stats_.milliseconds.back().first != "distance")
                stats_.milliseconds.emplace_back("distance", 0.0);
            stats_.milliseconds.back().second += time.count();
            stats_.triangles_dropped = dropped_;
            holes_->count(stats_);
            return field;
        });
    }

private:
    // Slabs that fit, by estimate.
    void cut(const slabs::histogram& layers, double room, bool is_kept) {
        const distance_bytes bytes(request_);
        const auto layers_of_grid = static_cast<double>(request_.grid.extent.z);
        // A triangle's record, and its part of the scene: three vertices, indices and a number.
        const double triangle = bytes.triangle + 3 * bytes.vertex + sizeof(corner_record<Varyings>) + 16;
        const double layer = (bytes.samples + (is_kept ? 0 : volume_bytes(request_))) / layers_of_grid;
        constexpr double read_bytes = 4 << 20; // of records at a time
        const double beside =
            bytes.threads + room / 8 + read_bytes + (is_kept ? volume_bytes(request_) : held_band_bytes(request_));
        constexpr double used = 0.65; // of the room: what is freed between slabs is not all given back
        slabs::plan_options how;
        how.align = std::max(1, request_.distance->slab_layers);
        how.layer_cost = static_cast<std::uint64_t>(layer / triangle);
        const auto most = static_cast<std::uint64_t>(std::max(1.0, (used * room - beside) / triangle));
        const slabs::plan plan = slabs::cover(layers, 2, most, how);
        const glm::ivec3 n = request_.grid.extent;
        const double need =
            std::max(beside + static_cast<double>(plan.bottleneck) * triangle, is_kept ? written_bytes(request_) : 0.0);
        memory::expect(need);
        memory::require(need,
                        "a distance field of " + std::to_string(n.x) + " x " + std::to_string(n.y) + " x " +
                            std::to_string(n.z) + " samples, of a model that is read in slabs",
                        memory::fewer_voxels_hint, need);
        for (const slabs::layer_range& range : plan.slabs) parts_.emplace_back().layers = range;
    }

    triangle_stream& model_;
    std::filesystem::path folder_;
    voxelize_request request_;
    voxelize_stats& stats_;
    vp::cpu_backend on_;
    std::vector<streamed_slab<Varyings>> parts_;
    std::optional<streamed_holes> holes_;
    std::uint64_t dropped_ = 0;
};

// All slabs in a volume's own memory.
template <class Distances>
volume whole_field(Distances& distances, const voxelize_request& request) {
    volume all = volume_of(request.grid);
    for (const target id : request.targets)
        all.add_unset(std::string(info_of(id).name), info_of(id).type, info_of(id).components);
    std::vector<std::size_t> at(all.channels.size(), 0); // bytes that are there
    const std::size_t slabs = distances.ends().size();
    for (std::size_t i = 0; i < slabs; ++i) {
        if (request.progress) request.progress(static_cast<double>(i) / static_cast<double>(slabs));
        const volume slab = distances.draw(i);
        all.distances = slab.distances;
        for (std::size_t c = 0; c < all.channels.size(); ++c) {
            const channel_bytes& data = slab.channels[c].data;
            std::memcpy(all.channels[c].data.data() + at[c], data.data(), data.size());
            at[c] += data.size();
        }
    }
    return all;
}

} // namespace

bool streams_distances(const voxelize_request& request) {
    const distance_request& distance = *request.distance;
    const bool sees_all = distance.is_signed && (distance.sign.rule == solid_rule::exterior || distance.sign.vote ||
                                                 distance.sign.winding); // of all triangles, not of a slab's
    return !distance.is_whole && !distance.at_corners && !sees_all && request.backend != backend_choice::cuda;
}

volume run_streamed_distances(triangle_stream& model, const stream_place& place, const voxelize_request& request,
                              voxelize_stats& stats) {
    if (request.devices != 1) throw backend_error("--devices: one GPU draws distances");
    stats.backend = "cpu";
    stats.threads = thread_count(request.threads);
    const bool is_kept = request.distance->slab_layers == 0; // an output needs the field whole
    volume field;
    with_varyings(model, [&]<class Varyings>(Varyings) {
        const auto drawn = named_failures(place.folder, [&] {
            return std::make_shared<binned_distances<Varyings>>(model, place, request, is_kept, stats);
        });
        if (is_kept)
            field = named_failures(place.folder, [&] { return whole_field(*drawn, request); });
        else
            field = make_late_volume(
                request, drawn->ends(), [drawn](std::size_t i) { return drawn->draw(i); }, stats);
    });
    if (is_kept) add_distance_warnings(request, stats);
    return field;
}

} // namespace voxelize
