// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Voxelizes meshes and grids that do not fit into memory, on one backend. Meshes come in chunks; each triangle goes to
// the bins of the slabs that it reaches, on disk beyond the budget. Then one slab at a time is drawn, and handed to a
// sink. All slabs together are the result of one call with the whole mesh, bit for bit, and so are the counts.
//
//   slabs::stream stream(backend, grid, vertex_shader, {.memory = std::uint64_t{4} << 30});
//   while (read(chunk)) stream.add(chunk).or_throw();               // each a mesh_view in host memory
//   stream.draw(fragment_shader, make_framebuffer, sink).or_throw();
//
// The vertex shader runs on the host, once a vertex of a chunk, on several threads where the chunk is large (16384
// triangles and more); vertex::index counts in the chunk. The fragment shader
// sees what it sees in the whole call: triangle and primitive are numbers in the whole mesh.

#include <voxelpipe/cells/sparse_cells.hpp>
#include <voxelpipe/distance/sparse_distance.hpp>
#include <voxelpipe/slabs/bins.hpp>
#include <voxelpipe/slabs/plan.hpp>
#include <voxelpipe/slabs/records.hpp>
#include <voxelpipe/slabs/repairs.hpp>
#include <voxelpipe/slabs/route.hpp>
#include <voxelpipe/slabs/slab_arrays.hpp>
#include <voxelpipe/slabs/slab_lists.hpp>
#include <voxelpipe/slabs/slab_queue.hpp>
#include <voxelpipe/slabs/slab_sink.hpp>
#include <voxelpipe/slabs/stream_options.hpp>
#include <voxelpipe/solid/solid.hpp>
#include <voxelpipe/sparse/sparse.hpp>
#include <voxelpipe/voxelize.hpp>

#include <algorithm>
#include <cstdint>
#include <memory>
#include <stdexcept>
#include <thread>
#include <type_traits>
#include <utility>
#include <vector>

namespace voxelpipe::slabs {

// Varyings: those of the vertex shader. The stream refers to the backend. A stream is drawn once.
template <class Backend, class Varyings>
class record_stream {
public:
    using record_type = record<Varyings>; // what it is fed with

    // The grid may be a crop. Throws std::invalid_argument for one that is not valid.
    record_stream(Backend& backend, const grid& g, stream_options options)
        : backend_(backend), grid_(checked(g)), options_(std::move(options)),
          threads_(options_.threads != 0 ? options_.threads : std::max(1u, std::thread::hardware_concurrency())),
          router_(threads_, options_.memory / 16),
          repairs_(g, options_.repair, options_.memory / 8, options_.folder, threads_) {
        options_.is_solid = options_.binning(g).is_solid;
        cut_into(equal_layers(g, 2, std::max(1, options_.num_slabs), options_.align));
    }

    // Slabs to begin with, in place of equal ones; before the first triangle.
    void cut_into(const plan& p) {
        parts_.clear();
        axis_ = slabs_.axis = p.axis;
        for (std::size_t i = 0; i < p.slabs.size(); ++i)
            if (p.slabs[i].size() != 0) parts_.push_back(p.crop(grid_, i));
        bins_ = std::vector<bin<record_type>>(parts_.size());
        memory_ = std::make_unique<bin_memory<record_type>>(options_.memory / 4, bins_.size(), options_.folder);
        slabs_.of_layer.assign(static_cast<std::size_t>(grid_.extent[axis_]), 0);
        for (std::size_t i = 0; i < parts_.size(); ++i) {
            const int begin = parts_[i].offset[axis_] - grid_.offset[axis_];
            std::fill_n(slabs_.of_layer.begin() + begin, parts_[i].extent[axis_], static_cast<std::uint32_t>(i));
        }
    }

    // The grid that all slabs together are.
    [[nodiscard]] const grid& where() const { return grid_; }
    // Counts of the triangles so far in the whole grid. Each is counted once, however many slabs it reaches.
    [[nodiscard]] const counters& counts() const { return counts_; }
    [[nodiscard]] counters& counts() { return counts_; }
    // Records come by ascending number. reach: not empty, see binning. A repair is given what it needs apart. Throws
    // std::bad_alloc, and std::system_error of files.
    void push(const record_type& r, const core::voxel_box& reach) {
        const auto [first, last] = slabs_(reach);
        for (std::uint32_t i = first; i <= last; ++i) memory_->push(bins_, i, r);
    }
    // The `count` triangles of a chunk, which are added to the counts and the repair: a chunk_records. Throws as
    // push().
    template <class Chunk>
    [[nodiscard]] status push_all(const Chunk& chunk, std::size_t count) {
        if (repairs_.needs_triangles())
            chunk.visit_snapped([&](const auto& a, const auto& b, const auto& c) { repairs_.add(a, b, c); });
        return router_.route(chunk, count, slabs_, bins_, *memory_, counts_);
    }
    // Before draw_solid with repair::exterior, of layers of a grid whose others are on other machines: draws the walls.
    // Then the machines finish repairs().exterior() together. how: valid for the whole grid. Fails and throws as
    // draw_solid.
    [[nodiscard]] status find_walls(const solid_options& how) {
        if (const status s = repairs_.begin(how); !s.ok()) return s;
        enqueue(2);
        has_walls_ = true;
        return draw_walls();
    }
    // What stream_options::repair has found.
    [[nodiscard]] solid_repairs& repairs() { return repairs_; }
    // Slabs are cut along z alone from now on, so that each has whole layers. They have to be along z (bad_crop).
    void keep_layers() { keeps_layers_ = true; }
    // Where slabs are drawn.
    [[nodiscard]] Backend& backend() const { return backend_; }
    // Threads that work on the host.
    [[nodiscard]] unsigned threads() const { return threads_; }

    // Draws slab by slab. make(glm::ivec3 extent) gives what is drawn into, a framebuffer, A-buffer or sparse
    // framebuffer; sink(const slab&, that) gets it afterwards, by ascending voxels along the axis of the slabs. A slab
    // whose triangles and targets exceed the budget, or whose call runs out of memory, is cut again: along z, then y,
    // then x; A-buffers along z alone. Returns the counts of the whole, or the failure of a call; what earlier slabs
    // gave has reached the sink by then. bad_solid_options: the triangles were binned for solids, which count others as
    // drawn; bad_distance_options: for distances; bad_cell_options: for links. Throws what sink throws, what make
    // throws other than std::bad_alloc, which cuts the slab, and std::system_error of files.
    template <class FragmentShader, class Make, class Sink>
    [[nodiscard]] status draw(const FragmentShader& shader, const Make& make, const Sink& sink) {
        if (options_.band) return core::failure(status_code::bad_distance_options);
        if (options_.is_solid) return core::failure(status_code::bad_solid_options);
        if (options_.is_links) return core::failure(status_code::bad_cell_options);
        const auto call = [&](const auto& draws, const grid& g, auto& out) {
            return voxelize(backend_, draws, g, out, options_.voxelize);
        };
        return detail::with_sink(
            sink, [&](const auto& to) { return draw_slabs<kinds::surface>(shader, make, to, 0.75, call); });
    }
    // Draws solids: the voxels, the counts and the counts of rows of one call with the whole mesh, which is one draw.
    // Slabs are along y or z, with vote and exterior along z. how.repair is that of stream_options; how.cones and
    // how.slab are found by the stream, and not given. Held beside the budget:
    //   close_holes   the boundaries of the holes and their cones, about 100 bytes a boundary edge, and a slab's call
    //   or winding    its own copy of the cones
    //   vote          three layers of bits of the grid
    //   exterior      four layers of bits for each 8 layers of the grid at most, 40 layers more and 2 for each voxel of
    //                 `closing` (slab_exterior::least_bytes), and the cover of a slab in bricks. A crop is refused, as
    //                 by one call (crop_without_whole), unless find_walls came before
    template <class SolidShader, class Make, class Sink>
    [[nodiscard]] status draw_solid(const SolidShader& shader, const Make& make, const Sink& sink,
                                    const solid_options& how = {}) {
        if (!options_.is_solid || options_.is_links || options_.band || how.repair != options_.repair ||
            how.slab != nullptr || how.cones != nullptr || axis_ == 0 || (repairs_.is_along_z() && axis_ != 2))
            return core::failure(status_code::bad_solid_options);
        if (!has_walls_)
            if (const status s = core::validate(how, grid_); !s.ok()) return s;
        if (repairs_.is_along_z() && !core::takes_solid_slabs<Backend>)
            return core::failure(status_code::strategy_unavailable);
        return detail::with_sink(sink, [&](const auto& to) {
            if (!has_walls_)
                if (const status s = repairs_.begin(how); !s.ok()) return s;
            const auto call = [&](const auto& draws, const grid& g, auto& out) {
                return voxelize_solid(backend_, draws, g, out, repairs_.of(g, how));
            };
            return draw_slabs<kinds::solid>(shader, make, to, repairs_.needs_walls() ? share_beside_flood : 0.75, call);
        });
    }
    // Draws cut cells: the fractions, and the counts but for open_edges, of one voxelize_cells with the whole mesh,
    // which is one draw. The stream is made for solids (stream_options::is_solid), with how.repair as its repair;
    // make gives framebuffers, sparse framebuffers or A-buffers. Rows run along x (how.axis is 0), and slabs are along
    // y or z, those of A-buffers along z. how.cones are found by the stream, and not given. Memory beyond the targets,
    // which the budget does not count: as for voxelize_cells, of a slab's triangles. bad_cell_options: another stream
    // or option.
    template <class CellShader, class Make, class Sink>
    [[nodiscard]] status draw_cells(const CellShader& shader, const Make& make, const Sink& sink,
                                    const cell_options& how = {}) {
        if (const status s = core::validate(how); !s.ok()) return s;
        if (!options_.is_solid || options_.is_links || options_.band || how.repair != options_.repair ||
            how.cones != nullptr || how.axis != 0 || axis_ == 0)
            return core::failure(status_code::bad_cell_options);
        return detail::with_sink(sink, [&](const auto& to) {
            solid_options holes;
            holes.repair = how.repair;
            holes.max_hole_edges = how.max_hole_edges;
            if (const status s = repairs_.begin(holes); !s.ok()) return s;
            status all =
                draw_slabs<kinds::solid>(shader, make, to, 0.75, [&](const auto& draws, const grid& g, auto& out) {
                    cell_options of_slab = how;
                    of_slab.count_open_edges = false; // a slab has some of the triangles
                    of_slab.cones = repairs_.of(g, holes).cones;
                    return voxelize_cells(backend_, draws, g, out, of_slab);
                });
            move_holes_to_cells(all);
            return all;
        });
    }
    // Lists links: the records and the counts of one voxelize_links with the whole mesh, which is one draw. The stream
    // is made for links alone (stream_options::is_links), with slabs along z: their lists follow each other. sink(const
    // slab&, link_list<Backend>&) gets those of a slab, whose voxels count from the slab's corner, and whose primitives
    // are numbers of the whole mesh. Memory beyond the lists, which the budget does not count: as for voxelize_links,
    // of a slab's triangles. bad_cell_options: another stream or option; bad_crop: slabs along another axis.
    template <class Sink>
    [[nodiscard]] status draw_links(const Sink& sink, const link_options& how = {}) {
        if (const status s = core::validate(how); !s.ok()) return s;
        if (!options_.is_links || options_.is_solid || options_.band)
            return core::failure(status_code::bad_cell_options);
        const auto make = [&](const glm::ivec3&) { return link_list<Backend>(backend_); };
        const auto call = [&](const auto& draws, const grid& g, auto& out) {
            return voxelize_links(backend_, draws, g, out, how);
        };
        return detail::with_sink(
            sink, [&](const auto& to) { return draw_slabs<kinds::links>(none{}, make, to, 0.75, call); });
    }
    // Draws distances: the bytes and the counts of one voxelize_distance with the whole mesh, which is one draw. The
    // stream is made for how.band (stream_options::band), with how.repair as its repair: none, close_holes or winding.
    // make gives framebuffers or sparse framebuffers. Slabs are along y or z, samples are centres, and a slab has the
    // triangles within the band; with band::whole each has all of them. how.cones are found by the stream, and not
    // given. Memory beyond the targets, which the budget does not count: as for voxelize_distance, of a slab's
    // triangles. bad_distance_options: another stream or option.
    template <class DistanceShader, class Make, class Sink>
    [[nodiscard]] status draw_distance(const DistanceShader& shader, const Make& make, const Sink& sink,
                                       const distance_options& how = {}) {
        if (const status s = core::validate(how, grid_); !s.ok()) return s;
        if (options_.is_links || options_.band != how.band || how.repair != options_.repair || repairs_.is_along_z() ||
            how.cones != nullptr || how.sample != sample::centre || axis_ == 0)
            return core::failure(status_code::bad_distance_options);
        return detail::with_sink(sink, [&](const auto& to) {
            const solid_options holes = core::sign_options(how);
            if (const status s = repairs_.begin(holes); !s.ok()) return s;
            return draw_slabs<kinds::distance>(shader, make, to, 0.75,
                                               [&](const auto& draws, const grid& g, auto& out) {
                                                   distance_options of_slab = how;
                                                   of_slab.cones = repairs_.of(g, holes).cones;
                                                   return voxelize_distance(backend_, draws, g, out, of_slab);
                                               });
        });
    }

private:
    enum class kinds { surface, solid, distance, links }; // of calls that draw a slab
    static constexpr double share_beside_flood = 0.625;   // of the memory, an eighth of which the flood has
    using arrays = detail::slab_arrays<Varyings>;
    using queue_type = detail::slab_queue<Varyings>;
    using mesh_types = detail::slab_mesh<Varyings>;

    [[nodiscard]] static const grid& checked(const grid& g) {
        if (const status s = validate(g); !s.ok()) throw std::invalid_argument("voxelpipe::slabs: " + s.message());
        return g;
    }

    // share: of the memory, that a slab may take. call(draws, grid, output) draws a slab.
    template <kinds Kind, class Shader, class Make, class Sink, class Call>
    [[nodiscard]] status draw_slabs(const Shader& shader, const Make& make, const Sink& sink, double share,
                                    const Call& call) {
        using output = std::remove_cvref_t<decltype(make(grid_.extent))>;
        const bool layers = detail::is_abuffer<output> || detail::is_links<output> || keeps_layers_;
        if (layers && axis_ != 2) return core::failure(status_code::bad_crop);
        if (!has_walls_) enqueue(layers || repairs_.is_along_z() ? 2 : Kind != kinds::surface ? 1 : 0);
        if constexpr (Kind != kinds::surface)
            if (repairs_.needs_walls() && !has_walls_) {
                if (const status s = draw_walls(); !s.ok()) return s;
                repairs_.flood();
            }
        status all;
        const double voxel = detail::bytes_per_voxel<output> + repairs_.voxel_bytes();
        const status s =
            queue_.for_each(detail::costs_of<Varyings>(options_, voxel, share), false,
                            [&](const typename queue_type::entry& next, arrays triangles) {
                                slab part;
                                part.where = next.where;
                                part.voxels_before = all.counts.voxels;
                                part.fragments_before = all.counts.fragments;
                                output out = make(part.where.extent);
                                if constexpr (Kind != kinds::surface) {
                                    repairs_.enter(next.where, next.triangles);
                                    if (triangles.numbers.size() == 0 && repairs_.fills_without_triangles())
                                        triangles = arrays::dropped();
                                }
                                part.drawn = draw_one<Kind>(std::move(triangles), shader, part.where, out, call);
                                if (part.drawn.ok()) {
                                    add_drawn(all, part.drawn);
                                    if (!sink(std::as_const(part), out)) // any failure ends the loop; with_sink throws
                                        return core::failure(status_code::device_error);
                                    if constexpr (Kind != kinds::surface) repairs_.leave();
                                }
                                return part.drawn;
                            });
        if (!s.ok()) return s;
        if constexpr (Kind != kinds::surface) repairs_.count(all.solid);
        return with_triangles(all, counts_);
    }

    // Puts the slabs into the queue. last_axis: that they may be cut along.
    void enqueue(int last_axis) {
        queue_.start(options_, threads_, axis_, last_axis);
        for (std::size_t i = 0; i < parts_.size(); ++i) queue_.push_back(parts_[i], std::move(bins_[i]));
        bins_.clear();
        parts_.clear();
    }

    // Draws the cover of all slabs, for the flood.
    [[nodiscard]] status draw_walls() {
        using cover = sparse_framebuffer<Backend, target<bit, blend::bit_or>>;
        voxelize_options how;
        how.rule = coverage::conservative;
        how.count_voxels = false;
        return queue_.for_each(detail::costs_of<Varyings>(options_, repairs_.voxel_bytes(), share_beside_flood), true,
                               [&](const typename queue_type::entry& next, arrays triangles) -> status {
                                   if (triangles.numbers.size() == 0) return {};
                                   cover out(backend_, next.where.extent);
                                   const status drawn =
                                       draw_one<kinds::surface>(std::move(triangles), constant(true), next.where, out,
                                                                [&](const auto& draws, const grid& g, auto& to) {
                                                                    return voxelize(backend_, draws, g, to, how);
                                                                });
                                   if (drawn.ok()) repairs_.add_walls(out.to_host(backend_).table());
                                   return drawn;
                               });
    }

    template <kinds Kind, class Shader, class Output, class Call>
    [[nodiscard]] status draw_one(arrays triangles, const Shader& shader, const grid& g, Output& out,
                                  const Call& call) {
        const auto run = [&](const typename mesh_types::view& mesh, const std::uint32_t* numbers) {
            const auto one_draw = [&](const auto& numbered) {
                using draw_type = voxelpipe::draw<typename mesh_types::view, typename mesh_types::vertex_shader,
                                                  std::remove_cvref_t<decltype(numbered)>>;
                const draw_type d{mesh, {}, numbered};
                return call(std::span<const draw_type>(&d, 1), g, out);
            };
            status s;
            if constexpr (core::is_constant<Shader> || Kind == kinds::solid || Kind == kinds::links ||
                          std::is_same_v<Shader, distance>)
                s = one_draw(shader);
            else if constexpr (Kind == kinds::distance)
                s = one_draw(detail::numbered_distance<Shader>{shader, numbers});
            else
                s = one_draw(detail::numbered_shader<Shader>{shader, numbers});
            if constexpr (detail::is_abuffer<Output> && Kind == kinds::surface)
                if (s.ok())
                    backend_.for_each(out.primitives.size(), detail::renumber_list{out.primitives.data(), numbers});
            if constexpr (Kind == kinds::links)
                if (s.ok())
                    backend_.for_each(out.primitives.size(), detail::renumber_links{out.primitives.data(), numbers});
            return s;
        };
        if constexpr (requires { Backend::runs_on_host; }) {
            return run(mesh_types::view_of(triangles), triangles.numbers.data());
        } else {
            const typename Backend::template buffer<std::uint32_t> numbers(
                backend_, array_view<const std::uint32_t>(triangles.numbers));
            const auto mesh = mesh_types::copy(backend_, triangles);
            triangles = {};
            return run(mesh.view(), numbers.data());
        }
    }

    Backend& backend_;
    grid grid_;
    stream_options options_;
    int axis_ = 2;
    counters counts_;
    unsigned threads_;
    detail::slab_table slabs_;
    detail::chunk_router<record_type> router_;
    solid_repairs repairs_;
    std::vector<grid> parts_;            // slabs to begin with, until they are drawn
    std::vector<bin<record_type>> bins_; // of these
    std::unique_ptr<bin_memory<record_type>> memory_;
    queue_type queue_; // while they are drawn
    bool has_walls_ = false, keeps_layers_ = false;
};

namespace detail {
template <class Mesh, class VertexShader>
using varyings_of = typename core::shaded<Mesh, VertexShader>::varyings;
}

// A stream of meshes of one type, which a vertex shader places. Mesh: mesh_view<> or with attributes.
template <class Backend, class VertexShader, class Mesh = mesh_view<>>
class stream : public record_stream<Backend, detail::varyings_of<Mesh, VertexShader>> {
    using varyings = detail::varyings_of<Mesh, VertexShader>;
    using base = record_stream<Backend, varyings>;

public:
    // Throws std::invalid_argument for a grid that is not valid.
    stream(Backend& backend, const grid& g, const VertexShader& shader, const stream_options& options = {})
        : base(backend, g, options), shader_(shader), how_(options.binning(g)) {}

    // Adds triangles of host memory; they are numbered on from those before. Fails for an index that names no vertex,
    // for more than 2^32 - 1 triangles, and for instances. What was added before a failure stays.
    [[nodiscard]] status add(const Mesh& chunk) {
        const chunk_records<varyings, Mesh> records(chunk, shader_, this->where(), how_, num_triangles_,
                                                    this->threads());
        const status s = records.valid().ok() ? this->push_all(records, chunk.triangles.size()) : records.valid();
        if (s.ok()) num_triangles_ += chunk.part.whole != 0 ? chunk.part.whole : chunk.triangles.size();
        return s;
    }
    // Triangles in the chunks so far.
    [[nodiscard]] std::uint64_t num_triangles() const { return num_triangles_; }

private:
    VertexShader shader_;
    binning how_;
    std::uint64_t num_triangles_ = 0;
};

} // namespace voxelpipe::slabs
