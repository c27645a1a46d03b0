// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Voxelizes with several GPUs of one host. The grid is cut into slabs of about equal work, one a GPU; each GPU keeps
// the triangles that reach its slab, and draws them as often as it is asked to. All slabs together are the result of
// one call with one GPU, bit for bit, and so are the counts. Results stay where they were drawn, until they are
// gathered.
//
//   slabs::devices gpus;                                                       // all of the host
//   slabs::device_slabs slabs(gpus, grid, mesh_in_host_memory, vertex_shader); // cuts, copies, counts
//   auto parts = slabs.make([](vp::cuda_backend& gpu, glm::ivec3 extent) { return framebuffer{gpu, extent}; });
//   slabs.draw(fragment_shader, parts).or_throw();
//   slabs.gather<0>(parts, whole).or_throw();                                  // from GPU to GPU

#include <voxelpipe/slabs/device_bins.cuh>
#include <voxelpipe/slabs/device_exterior.cuh>
#include <voxelpipe/slabs/device_options.hpp>
#include <voxelpipe/slabs/device_set.cuh>
#include <voxelpipe/slabs/plan.hpp>
#include <voxelpipe/slabs/resident_repairs.hpp>
#include <voxelpipe/slabs/stream.hpp>
#include <voxelpipe/voxelpipe.hpp>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <new>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace voxelpipe::slabs {

// One mesh in the slabs of several GPUs. Each GPU has all vertices, which its vertex shader sees as in one call, and
// the triangles of its slab. An object is used by one thread at a time.
template <class VertexShader, class... Attributes>
class device_slabs {
public:
    using mesh_type = mesh_view<Attributes...>; // in host memory

    // Copies the mesh; refers to the devices. Throws std::invalid_argument with the status's message if grid or mesh
    // are not valid (no instances, no subset), and what the devices throw. For close_holes and vote it also searches
    // all triangles, once, see draw_solid: std::bad_alloc, and std::system_error of files.
    device_slabs(devices& gpus, const grid& g, const mesh_type& mesh, const VertexShader& shader,
                 const device_options& options = {})
        : gpus_(gpus), grid_(g), shader_(shader), options_(options), meshes_(gpus.size()) {
        if (options_.repair != voxelpipe::repair::none) options_.is_solid = true;
        status s = validate(g);
        if (s.ok()) s = core::validate_draws(std::span(&as_const(draw_of(mesh, constant_output<bool>{})), 1));
        if (s.ok() && (mesh.copies.count != 1 || mesh.part.whole != 0)) s = core::failure(status_code::bad_subset);
        if (s.ok()) s = cut(mesh);
        if (s.ok()) s = search(mesh);
        if (!s.ok()) throw std::invalid_argument("voxelpipe::slabs: " + s.message());
    }

    // Slabs that have layers: one for each of the first GPUs.
    [[nodiscard]] std::size_t size() const { return slabs_.size(); }
    // Where they are, and what was drawn into each by the last call.
    [[nodiscard]] const std::vector<slab>& slabs() const { return slabs_; }
    // The triangles of a slab, in its GPU's memory, with the numbers of the whole: for calls of another kind.
    [[nodiscard]] mesh_type mesh(std::size_t i) const { return meshes_[i]->view(); }
    // How the grid was cut.
    [[nodiscard]] const plan& cuts() const { return plan_; }
    // Counts of the triangles in the whole grid.
    [[nodiscard]] const counters& counts() const { return counts_; }

    // make(cuda_backend&, glm::ivec3 extent) for each slab, on its GPU: framebuffers, A-buffers or sparse framebuffers.
    template <class Make>
    [[nodiscard]] auto make(const Make& make_one) {
        using output = std::remove_cvref_t<std::invoke_result_t<const Make&, cuda_backend&, glm::ivec3>>;
        std::vector<std::optional<output>> made(size());
        gpus_.for_each(
            size(), [&](std::size_t i, cuda_backend& gpu) { made[i].emplace(make_one(gpu, slabs_[i].where.extent)); });
        std::vector<output> outputs;
        outputs.reserve(size());
        for (auto& o : made) outputs.push_back(std::move(*o));
        return outputs;
    }

    // Draws every slab into its output, at once, and waits. Returns the counts of the whole, or the first failure;
    // other slabs may have been drawn then. A-buffers need slabs along z (bad_crop otherwise). bad_solid_options: the
    // grid was cut for solids, which count other triangles as drawn.
    template <class FragmentShader, class Output>
    [[nodiscard]] status draw(const FragmentShader& shader, std::vector<Output>& outputs) {
        if (const status s = accepts<Output>(false); !s.ok()) return s;
        return draw_each(shader, outputs, [&](cuda_backend& gpu, auto draws, const grid& g, Output& out, std::size_t) {
            return voxelize(gpu, draws, g, out, options_.voxelize);
        });
    }
    // Draws solids, if device_options::is_solid: voxels, counts and counts of rows are those of one call. how.repair is
    // that of device_options; how.cones and how.slab are found here, and not given. What a repair takes, and holds as
    // long as the object lives:
    //   close_holes   the constructor copies all vertices to host memory, 24 bytes each, where one thread goes through
    //                 all triangles, in 24 bytes each; holds about 100 bytes a boundary edge there
    //   vote          the same copy, and all threads; holds a layer of bits of the grid for each slab, and one more
    //   exterior      the first call, and one with another `closing`: each GPU draws the cover of its slab, and the
    //                 first one floods, in 2 bits a voxel of the whole grid, 4 with `closing`. Each GPU holds a bit a
    //                 voxel of its slab. If there is no room, the host floods bricks, in device_options::memory and
    //                 slab_exterior::least_bytes at least, which takes far longer, and holds a bit a voxel of the
    //                 whole grid. A crop is refused, as by one call (crop_without_whole)
    // Each call copies its slab's part of what the host holds to its GPU. Throws std::system_error of files.
    template <class SolidShader, class Output>
    [[nodiscard]] status draw_solid(const SolidShader& shader, std::vector<Output>& outputs,
                                    const solid_options& how = {}) {
        if (const status s = accepts<Output>(true); !s.ok()) return s;
        if (how.repair != options_.repair || how.slab != nullptr || how.cones != nullptr)
            return core::failure(status_code::bad_solid_options);
        if (const status s = core::validate(how, grid_); !s.ok()) return s;
        if (const status s = find_repair(how); !s.ok()) return s;
        status s =
            draw_each(shader, outputs, [&](cuda_backend& gpu, auto draws, const grid& g, Output& out, std::size_t i) {
                const solid_options of_slab = repairs_ ? repairs_->of(i, how) : how;
                return voxelize_solid(gpu, draws, g, out, of_slab);
            });
        if (s.ok() && repairs_) repairs_->count(s.solid);
        return s;
    }

    // Draws cut cells, if device_options::is_solid: the values, and the counts but for open_edges, of one
    // voxelize_cells. Rows run along x (how.axis is 0). how.repair is that of device_options, none or close_holes;
    // how.cones are found here, as for draw_solid. The caller includes the module's header for GPUs (cells/device).
    // Outputs are framebuffers or sparse framebuffers. bad_cell_options: other slabs or options.
    template <class CellShader, class Output>
    [[nodiscard]] status draw_cells(const CellShader& shader, std::vector<Output>& outputs,
                                    const cell_options& how = {}) {
        if (const status s = core::validate(how); !s.ok()) return s;
        if (!options_.is_solid || options_.band || how.repair != options_.repair || how.cones != nullptr ||
            how.axis != 0)
            return core::failure(status_code::bad_cell_options);
        solid_options holes;
        holes.repair = how.repair;
        holes.max_hole_edges = how.max_hole_edges;
        if (const status s = find_repair(holes); !s.ok()) return s;
        status s =
            draw_each(shader, outputs, [&](cuda_backend& gpu, auto draws, const grid& g, Output& out, std::size_t i) {
                cell_options of_slab = how;
                of_slab.count_open_edges = false; // a slab has some of the triangles
                if (repairs_) of_slab.cones = repairs_->of(i, holes).cones;
                return voxelize_cells(gpu, draws, g, out, of_slab);
            });
        if (s.ok() && repairs_) repairs_->count(s.solid);
        move_holes_to_cells(s);
        return s;
    }

    // Draws distances: the values and the counts of one voxelize_distance. how.band is that of device_options, and
    // how.repair too: none, close_holes or winding; how.cones are found here, as for draw_solid. Samples are centres.
    // With band::whole each GPU has all triangles. The caller includes the module's header for GPUs (distance/device).
    // Outputs are framebuffers or sparse framebuffers. bad_distance_options: other slabs or options.
    template <class DistanceShader, class Output>
    [[nodiscard]] status draw_distance(const DistanceShader& shader, std::vector<Output>& outputs,
                                       const distance_options& how = {}) {
        if (const status s = core::validate(how, grid_); !s.ok()) return s;
        if (options_.band != how.band || how.repair != options_.repair || how.cones != nullptr ||
            detail::resident_repairs::is_along_z(how.repair) || how.sample != sample::centre)
            return core::failure(status_code::bad_distance_options);
        const solid_options holes = core::sign_options(how);
        if (const status s = find_repair(holes); !s.ok()) return s;
        status s =
            draw_each(shader, outputs, [&](cuda_backend& gpu, auto draws, const grid& g, Output& out, std::size_t i) {
                distance_options of_slab = how;
                if (repairs_) of_slab.cones = repairs_->of(i, holes).cones;
                return voxelize_distance(gpu, draws, g, out, of_slab);
            });
        if (s.ok() && repairs_) repairs_->count(s.solid);
        return s;
    }

    // ---- calls that never wait ----

    // Bytes that draw_async needs for slab i; 0 if the arguments are invalid. out: as voxelize_async's.
    template <class FragmentShader, class Output>
    [[nodiscard]] std::size_t workspace_bytes(std::size_t i, const FragmentShader& shader, const Output& out,
                                              const workspace_limits& limits) const {
        const detail::current_device device(gpus_.ordinal(i));
        const auto one = draw_of(meshes_[i]->view(), shader);
        return voxelpipe::workspace_bytes(std::span(&one, 1), slabs_[i].where, out, options_.voxelize, limits);
    }
    // Puts every slab's voxelize_async on its GPU's stream, and returns when all are launched. outputs, workspaces: one
    // a slab, in its GPU's memory; a sparse_result may go on from its own slab's. Returns the first call that was not
    // launched; what the GPUs find out is said by read_status. Outputs and conditions are those of draw(). Surfaces
    // alone: solids in slabs are draw_solid's, which waits.
    template <class FragmentShader, class Output>
    [[nodiscard]] status draw_async(const FragmentShader& shader, std::vector<Output>& outputs,
                                    std::span<const workspace_view> workspaces) {
        if (const status s = accepts<Output>(false); !s.ok()) return s;
        if (outputs.size() != size() || workspaces.size() != size()) return core::failure(status_code::extent_mismatch);
        return on_each(size(), [&](std::size_t i, cuda_backend& gpu) {
            const auto one = draw_of(meshes_[i]->view(), shader);
            return voxelize_async(gpu, std::span(&one, 1), slabs_[i].where, outputs[i], options_.voxelize,
                                  workspaces[i]);
        });
    }
    // Waits for all GPUs. Returns the counts of the whole, or the first slab that failed. need: as read_status of each
    // slab gives it.
    [[nodiscard]] status read_status(std::span<const workspace_view> workspaces,
                                     std::vector<workspace_limits>* need = nullptr) {
        if (workspaces.size() != size()) return core::failure(status_code::extent_mismatch);
        if (need != nullptr) {
            need->clear();
            for (const workspace_view& w : workspaces) need->push_back(w.limits);
        }
        const status s = on_each(size(), [&](std::size_t i, cuda_backend& gpu) {
            workspace_limits* const of_slab = need == nullptr ? nullptr : need->data() + i;
            return slabs_[i].drawn = voxelpipe::read_status(gpu, workspaces[i], of_slab);
        });
        return s.ok() ? count_whole() : s;
    }
    // Puts merge_async of what draw_async made on the stream of GPU `at`, behind all slabs' calls, and returns. Later
    // calls of the slabs begin when their results have been copied. whole, workspace: in memory of GPU `at`. Parts that
    // may have tiles, such as those that go on from solids, are refused (strategy_unavailable): see merge_async.
    template <class... Targets>
    [[nodiscard]] status merge_async(const std::vector<sparse_result<Targets...>>& parts,
                                     std::span<const workspace_view> workspaces, std::size_t at,
                                     sparse_result<Targets...>& whole, const workspace_view& workspace) {
        if (at >= size() || parts.size() != size()) return core::failure(status_code::extent_mismatch);
        for (std::size_t i = 0; i < size(); ++i) gpus_.order(i, at);
        const detail::current_device device(gpus_.ordinal(at));
        const status s = voxelpipe::merge_async(gpus_.backend(at), parts, workspaces, whole, workspace);
        for (std::size_t i = 0; i < size(); ++i) gpus_.order(at, i);
        return s;
    }

    // Copies target I of every slab into that of a framebuffer of the whole grid, on any of the GPUs or in host memory
    // that view() shows, and waits. Earlier work on the whole has ended. bad_crop: slabs are not along z, or do not
    // begin with a brick of a tiled target.
    template <std::size_t I, class Output, class... Targets>
    [[nodiscard]] status gather(const std::vector<Output>& parts, const framebuffer_view<Targets...>& whole) {
        using map = typename core::pack_element<I, Targets...>::type::map;
        const auto& to = get<I>(whole.targets);
        if (whole.extent != grid_.extent) return core::failure(status_code::extent_mismatch);
        for (const slab& s : slabs_)
            if (plan_.axis != 2 || (map::bricks && (s.where.offset.z - grid_.offset.z) % 8 != 0))
                return core::failure(status_code::bad_crop);
        gpus_.for_each(size(), [&](std::size_t i, cuda_backend& gpu) {
            const grid& where = slabs_[i].where;
            glm::ivec3 below = grid_.extent;
            below.z = where.offset.z - grid_.offset.z;
            const auto& from = get<I>(parts[i].view().targets);
            const std::size_t cells = map::cells(where.extent);
            device::with_runtime_errors([&] {
                for (std::size_t p = 0; p < map::elements(grid_.extent) / map::cells(grid_.extent); ++p)
                    device::check(cudaMemcpyAsync(to.elements + p * map::cells(grid_.extent) + map::cells(below),
                                                  from.elements + p * cells, cells * sizeof(*to.elements),
                                                  cudaMemcpyDefault, gpu.stream));
                device::check(cudaStreamSynchronize(gpu.stream));
            });
        });
        return {};
    }

private:
    template <class Shader>
    [[nodiscard]] auto draw_of(const mesh_type& mesh, const Shader& shader) const {
        return voxelpipe::draw<mesh_type, VertexShader, Shader>{mesh, shader_, shader};
    }
    template <class T>
    [[nodiscard]] static const T& as_const(const T& value) {
        return value;
    }

    // Ok if the grid was cut for calls of this kind.
    template <class Output>
    [[nodiscard]] status accepts(bool solid) const {
        if (options_.band) return core::failure(status_code::bad_distance_options);
        if (solid != options_.is_solid) return core::failure(status_code::bad_solid_options);
        if ((detail::is_abuffer<Output> || device::is_lists<Output>)&&plan_.axis != 2)
            return core::failure(status_code::bad_crop);
        return {};
    }

    // Uploads the mesh, counts its triangles by layers, each GPU a share, cuts, and bins.
    [[nodiscard]] status cut(const mesh_type& mesh) {
        const std::size_t n = gpus_.size();
        std::vector<histogram> layers(n, histogram(grid_.extent));
        std::vector<counters> counted(n);
        const status s = on_each(n, [&](std::size_t i, cuda_backend& gpu) {
            meshes_[i] = std::make_unique<detail::binned_mesh<Attributes...>>(gpu, mesh);
            const auto [first, last] = share_of(mesh.triangles.size(), static_cast<int>(i), static_cast<int>(n));
            return meshes_[i]->count_layers(gpu, shader_, rule(), first, last - first, layers[i], counted[i]);
        });
        if (!s.ok()) return s;
        for (std::size_t i = 0; i < n; ++i) {
            core::add_triangles(counts_, counted[i]);
            for (std::size_t w = 0; i != 0 && w < layers[0].words().size(); ++w)
                layers[0].words()[w] += layers[i].words()[w];
        }
        plan_options how;
        how.align = options_.align;
        how.may_turn = options_.may_turn && !detail::resident_repairs::is_along_z(options_.repair);
        how.may_be_along_x = !options_.is_solid && !options_.band;
        how.triangle_cost = static_cast<std::uint64_t>(8 * options_.triangle_bytes); // in bits
        how.voxel_cost = static_cast<std::uint64_t>(8 * options_.voxel_bytes);
        plan_ = split(layers[0], static_cast<int>(n), how);
        for (std::size_t i = 0; i < n; ++i) {
            if (plan_.slabs[i].size() == 0) continue;
            slab one;
            one.where = plan_.crop(grid_, i);
            slabs_.push_back(one);
        }
        return on_each(n, [&](std::size_t i, cuda_backend& gpu) {
            if (i >= size())
                meshes_[i].reset();
            else
                meshes_[i]->keep(gpu, shader_, rule(), plan_.axis, plan_.slabs[i],
                                 detail::resident_repairs::fills_without_triangles(options_.repair));
            return status{};
        });
    }
    [[nodiscard]] detail::bin_rule rule() const {
        return {core::make_snap_transform(grid_), grid_.extent, options_.binning(grid_)};
    }

    // Begins the repair: what follows from the triangles alone.
    [[nodiscard]] status search(const mesh_type& mesh) {
        if (options_.repair == voxelpipe::repair::none) return {};
        std::vector<grid> where;
        for (const slab& s : slabs_) where.push_back(s.where);
        repairs_.emplace(grid_, std::move(where), options_.repair, options_.memory, options_.folder);
        if (!detail::resident_repairs::needs_triangles(options_.repair)) return {};
        std::vector<core::snapped_position> vertices;
        const status s = on_each(1, [&](std::size_t i, cuda_backend& gpu) {
            vertices = meshes_[i]->snapped_vertices(gpu, shader_, rule().snap);
            return status{};
        });
        if (s.ok()) repairs_->add(vertices, mesh.triangles);
        return s;
    }
    // What the repair of a call takes of all slabs.
    [[nodiscard]] status find_repair(const solid_options& how) {
        try {
            return repairs_ ? search_repair(how) : status{};
        } catch (const std::bad_alloc&) {
            return core::failure(status_code::out_of_memory, stage::coarse_raster);
        }
    }
    [[nodiscard]] status search_repair(const solid_options& how) {
        if (!repairs_->needs_walls(how)) return repairs_->find(how, {});
        repairs_->drop_inside();
        if (!options_.floods_on_host) {
            const status s = exterior_.find(
                grid_, slabs_, how.closing, [&](std::size_t count, const auto& work) { return on_each(count, work); },
                [&](std::size_t i, cuda_backend& gpu, auto& cover) { return draw_cover(i, gpu, cover); });
            for (std::size_t i = 0; s.ok() && i < size(); ++i)
                repairs_->take_inside(how.closing, i, exterior_.inside(i));
            if (s.ok() || s.code != status_code::out_of_memory) return s;
        }
        using cover = sparse_framebuffer<cuda_backend, target<bit, blend::bit_or>>;
        std::vector<host_sparse<target<bit, blend::bit_or>>> covers(size());
        const status s = on_each(size(), [&](std::size_t i, cuda_backend& gpu) {
            cover out(gpu, slabs_[i].where.extent);
            status drawn = draw_cover(i, gpu, out);
            if (drawn.ok()) covers[i] = out.to_host(gpu);
            return drawn;
        });
        if (!s.ok()) return s;
        std::vector<brick_table> walls;
        for (const auto& c : covers) walls.push_back(c.table());
        return repairs_->find(how, walls);
    }
    // The conservative cover of slab i.
    template <class Output>
    [[nodiscard]] status draw_cover(std::size_t i, cuda_backend& gpu, Output& out) const {
        voxelize_options conservative;
        conservative.rule = coverage::conservative;
        conservative.count_voxels = false;
        const auto one = draw_of(meshes_[i]->view(), constant(true));
        return voxelize(gpu, std::span(&one, 1), slabs_[i].where, out, conservative);
    }

    template <class Shader, class Output, class Call>
    [[nodiscard]] status draw_each(const Shader& shader, std::vector<Output>& outputs, const Call& call) {
        if (outputs.size() != size()) return core::failure(status_code::extent_mismatch);
        const status s = on_each(size(), [&](std::size_t i, cuda_backend& gpu) {
            const auto one = draw_of(meshes_[i]->view(), shader);
            return slabs_[i].drawn = call(gpu, std::span(&one, 1), slabs_[i].where, outputs[i], i);
        });
        return s.ok() ? count_whole() : s;
    }
    // The counts of the whole, of what was drawn into the slabs.
    [[nodiscard]] status count_whole() {
        status all;
        for (slab& one : slabs_) {
            one.voxels_before = all.counts.voxels;
            one.fragments_before = all.counts.fragments;
            add_drawn(all, one.drawn);
        }
        return with_triangles(all, counts_);
    }

    // work(i, GPU) on the first `count` GPUs; the first failure.
    template <class Work>
    [[nodiscard]] status on_each(std::size_t count, const Work& work) {
        std::vector<status> found(count);
        gpus_.for_each(count,
                       [&](std::size_t i, cuda_backend& gpu) { found[i] = gpu.guard([&] { return work(i, gpu); }); });
        for (const status& s : found)
            if (!s.ok()) return s;
        return {};
    }

    devices& gpus_;
    grid grid_;
    VertexShader shader_;
    device_options options_;
    plan plan_;
    counters counts_;
    std::vector<slab> slabs_;
    std::vector<std::unique_ptr<detail::binned_mesh<Attributes...>>> meshes_; // by GPU
    std::optional<detail::resident_repairs> repairs_;                         // none without a repair
    detail::device_exterior exterior_;
};

} // namespace voxelpipe::slabs
