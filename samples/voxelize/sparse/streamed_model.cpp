// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "streamed_model.hpp"

#include "../formats/output_file.hpp"
#include "../memory.hpp"
#include "../parallel.hpp"
#include "../placement.hpp"
#include "../surface.hpp"
#include "sparse_voxelizer.hpp"

#include <voxelpipe/slabs/bins.hpp>
#include <voxelpipe/slabs/plan.hpp>
#include <voxelpipe/slabs/records.hpp>

#include <algorithm>
#include <cctype>
#include <chrono>
#include <new>
#include <system_error>
#include <utility>
#include <vector>

namespace voxelize {
namespace {

namespace slabs = voxelpipe::slabs;
using stl_record = slabs::record<vp::no_varyings>; // positions as the file has them

constexpr double load_bytes = 300; // for each triangle, at least, where the model is held
constexpr double draw_bytes = 220; // the same of a slab's: record, scene, snapped vertices, pairs with tiles
constexpr int brick = 8;

// The corners as the pipeline places them, in the request's grid.
class stl_placer {
public:
    stl_placer(const voxelize_request& request, double scale)
        : place_(affine::scaling(scale), reference_point(request.grid)), rule_(request.coverage) {
        grid_ = request.grid;
        grid_.origin -= reference_point(request.grid);
        snap_ = vp::core::make_snap_transform(grid_);
    }
    [[nodiscard]] slabs::classified operator()(const glm::vec3* corners) const {
        return slabs::classify(snap_, grid_.extent, rule_, place_(corners[0]), place_(corners[1]), place_(corners[2]));
    }

private:
    placed_vertex_shader place_;
    voxelpipe::coverage rule_;
    voxelpipe::grid grid_;
    vp::core::snap_transform snap_{};
};

// A slab's triangles as a scene of one primitive, which knows their numbers.
scene scene_of(const slabs::bin<stl_record>& triangles, std::uint64_t whole, double scale) {
    scene model;
    model.materials.emplace_back();
    primitive& part = model.primitives.emplace_back();
    const auto count = static_cast<std::size_t>(triangles.size());
    part.positions.reserve(3 * count);
    part.triangles.reserve(count);
    part.numbers.reserve(count);
    part.whole = whole;
    triangles.for_each_block([&](std::span<const stl_record> block) {
        for (const stl_record& r : block) {
            const auto first = static_cast<std::uint32_t>(part.positions.size());
            part.positions.insert(part.positions.end(), r.positions, r.positions + 3);
            part.triangles.emplace_back(first, first + 1, first + 2);
            part.numbers.push_back(r.number);
        }
    });
    model.instances.push_back({0, affine::scaling(scale)});
    return model;
}

} // namespace

std::optional<stl_file> streamed_input(const command_line& options) {
    std::string extension = options.input.extension().string();
    for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    const voxelize_request& request = options.voxelize;
    const bool is_drawn_here = request.backend != backend_choice::cuda &&
                               request.strategy == voxelpipe::strategy::automatic && !request.solid &&
                               options.storage != storage_choice::dense;
    const bool has_targets = std::all_of(request.targets.begin(), request.targets.end(), [](target t) {
        return t == target::occupancy || t == target::count || t == target::normal || t == target::triangle ||
               t == target::depth;
    });
    if (extension != ".stl" || !is_drawn_here || !has_targets) return std::nullopt;
    std::optional<stl_file> file = stl_file::open(options.input);
    if (file && load_bytes * static_cast<double>(file->num_triangles()) <= static_cast<double>(memory::room()))
        return std::nullopt;
    return file;
}

sparse_volume run_streamed_voxelizer(stl_file& model, double scale, const voxelize_request& request,
                                     const std::filesystem::path& folder, voxelize_stats& stats,
                                     const std::function<void(const std::string&)>& say) {
    const voxelpipe::grid& whole = request.grid;
    const stl_placer classify(request, scale);
    stats.backend = "cpu";
    stats.threads = thread_count(request.threads);
    stats.triangles = model.num_triangles();
    const auto room = static_cast<double>(memory::room());
    const auto start = std::chrono::steady_clock::now();

    slabs::histogram layers(whole.extent);
    vp::counters counts;
    model.for_each_block([&](std::span<const glm::vec3> corners, std::uint64_t) {
        for (std::size_t i = 0; i < corners.size(); i += 3) {
            const slabs::classified c = classify(corners.data() + i);
            vp::core::count_class(counts, c.kind);
            if (c.kind == vp::core::triangle_class::drawn) layers.add(c.reach);
        }
    });
    slabs::plan_options how;
    how.align = brick;
    const auto most = static_cast<std::uint64_t>(std::max(1.0, room / 4 / draw_bytes));
    const slabs::plan plan = slabs::cover(layers, 2, most, how);
    say(std::to_string(model.num_triangles()) + " triangles do not fit into " + memory::mebibytes(room) +
        ": they are drawn in " + std::to_string(plan.slabs.size()) + " slabs, through temporary files in " +
        folder.string());

    std::vector<slabs::bin<stl_record>> bins(plan.slabs.size());
    try {
        std::vector<std::uint32_t> slab_of(static_cast<std::size_t>(whole.extent.z));
        for (std::size_t s = 0; s < plan.slabs.size(); ++s)
            std::fill_n(slab_of.begin() + plan.slabs[s].begin, plan.slabs[s].size(), static_cast<std::uint32_t>(s));
        slabs::bin_memory<stl_record> spilled(static_cast<std::uint64_t>(room / 8), bins.size(), folder.string());
        model.for_each_block([&](std::span<const glm::vec3> corners, std::uint64_t first) {
            for (std::size_t i = 0; i < corners.size(); i += 3) {
                const slabs::classified c = classify(corners.data() + i);
                if (c.kind != vp::core::triangle_class::drawn) continue;
                const stl_record r{{corners[i], corners[i + 1], corners[i + 2]},
                                   static_cast<std::uint32_t>(first + i / 3)};
                for (std::uint32_t s = slab_of[static_cast<std::size_t>(c.reach.lo[2])];
                     s <= slab_of[static_cast<std::size_t>(c.reach.hi[2])]; ++s)
                    spilled.push(bins, s, r);
            }
        });
        const std::chrono::duration<double, std::milli> binning = std::chrono::steady_clock::now() - start;
        stats.milliseconds.emplace_back("bin", binning.count());

        // Nothing is drawn in the padding.
        const int padding = request.padding;
        std::vector<sparse_volume> parts;
        for (std::size_t s = 0; s < plan.slabs.size(); ++s) {
            const int begin = std::max(plan.slabs[s].begin, padding),
                      end = std::min(plan.slabs[s].end, whole.extent.z - padding);
            scene of_slab = scene_of(std::exchange(bins[s], {}), model.num_triangles(), scale);
            if (begin >= end || of_slab.triangle_count() == 0) continue;
            voxelize_request part = request;
            part.grid = whole.crop({padding, padding, begin},
                                   {whole.extent.x - 2 * padding, whole.extent.y - 2 * padding, end - begin});
            part.work_memory = request.work_memory != 0 ? request.work_memory : static_cast<std::uint64_t>(room / 8);
            const double done = static_cast<double>(s), all = static_cast<double>(plan.slabs.size());
            if (request.progress)
                part.progress = [&, done, all](double share) { request.progress((done + share) / all); };
            voxelize_stats of_part;
            parts.push_back(draw_sparse(of_slab, part, whole, of_part));
            stats.triangles_drawn += of_part.triangles_drawn;
            stats.fragments += of_part.fragments;
            stats.voxels += of_part.voxels;
            stats.normals_cancelled += of_part.normals_cancelled;
            for (const auto& stage : of_part.milliseconds) {
                const auto found = std::find_if(stats.milliseconds.begin(), stats.milliseconds.end(),
                                                [&](const auto& known) { return known.first == stage.first; });
                if (found == stats.milliseconds.end())
                    stats.milliseconds.push_back(stage);
                else
                    found->second += stage.second;
            }
        }
        stats.slabs = static_cast<int>(parts.size());
        stats.triangles_dropped = counts.triangles_dropped();
        stats.triangles_flat = counts.triangles_zero_area;
        if (parts.empty()) { // the whole grid without a triangle
            scene nothing = scene_of({}, 0, scale);
            voxelize_stats none;
            voxelize_request inside = request;
            inside.grid = whole.crop(glm::ivec3(padding), whole.extent - 2 * padding);
            return draw_sparse(nothing, inside, whole, none);
        }
        return join_slabs(std::move(parts));
    } catch (const std::system_error& error) {
        throw write_error(folder, "temporary files for the triangles: " + error.code().message());
    } catch (const std::bad_alloc&) {
        throw memory_error(memory::shortage("take fewer targets or voxels"));
    }
}

} // namespace voxelize
