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

#include <voxelpipe/slabs/bins.hpp>
#include <voxelpipe/slabs/plan.hpp>
#include <voxelpipe/slabs/records.hpp>
#include <voxelpipe/slabs/route.hpp>
#include <voxelpipe/slabs/slab_arrays.hpp>
#include <voxelpipe/solid.hpp>
#include <voxelpipe/sparse.hpp>
#include <voxelpipe/voxelize.hpp>

#include <algorithm>
#include <cstdint>
#include <deque>
#include <future>
#include <memory>
#include <new>
#include <stdexcept>
#include <string>
#include <thread>
#include <type_traits>
#include <utility>
#include <vector>

namespace voxelpipe::slabs {

// How a stream works.
struct stream_options {
    voxelize_options voxelize = {}; // of each slab's call
    // Bytes for binned triangles, a slab's mesh and its targets, together. Lists and sparse results, whose size only
    // the call finds out, come on top, and so does what source and sink hold.
    std::uint64_t memory = std::uint64_t{1} << 30;
    std::string folder = "/tmp"; // for bins that do not fit; about 40 bytes a triangle
    int num_slabs = 0;           // to begin with, of equal thickness; 0: as many as the targets need
    int align = 1;               // slabs begin at multiples of this: chunks of a file, or 8 for whole bricks
    // Bytes that the backend takes for a triangle beside its record, and for a voxel; 0: an estimate. The estimate of a
    // voxel is what the targets take.
    double triangle_bytes = 0, voxel_bytes = 0;
    bool is_solid = false; // for draw_solid: triangles beside the grid along x count too
    unsigned threads = 0;  // of the host, that shade, bin and read; 0: all cores. Results do not depend on it
};

// What a sink gets beside a slab's framebuffer or lists.
struct slab {
    grid where;   // a crop of the stream's grid
    status drawn; // of the slab's call: its fragments and voxels
    // Voxels and fragments in the slabs before this one. A-buffers of slabs along z follow each other: these are the
    // offsets at which this one's lists begin.
    std::uint64_t voxels_before = 0, fragments_before = 0;
};

namespace detail {

// Bytes of a voxel in what a call draws into; 0 if that depends on the mesh.
template <class Output>
inline constexpr double bytes_per_voxel = 0;
template <class... Targets>
inline constexpr double bytes_per_voxel<framebuffer_view<Targets...>> =
    ((std::is_same_v<typename Targets::map::element, std::uint32_t> && Targets::map::is_bit
          ? 0.125
          : static_cast<double>(sizeof(typename Targets::value_type))) +
     ...);
template <class Backend, class... Targets>
inline constexpr double bytes_per_voxel<framebuffer<Backend, Targets...>> =
    bytes_per_voxel<framebuffer_view<Targets...>>;

template <class Output>
inline constexpr bool is_abuffer = false;
template <class Backend, class Payload>
inline constexpr bool is_abuffer<abuffer<Backend, Payload>> = true;

} // namespace detail

// Varyings: those of the vertex shader. The stream refers to the backend. A stream is drawn once.
template <class Backend, class Varyings>
class record_stream {
public:
    using record_type = record<Varyings>; // what it is fed with

    // The grid may be a crop. Throws std::invalid_argument for one that is not valid.
    record_stream(Backend& backend, const grid& g, stream_options options)
        : backend_(backend), grid_(g), options_(std::move(options)),
          threads_(options_.threads != 0 ? options_.threads : std::max(1u, std::thread::hardware_concurrency())),
          router_(threads_, options_.memory / 16) {
        if (const status s = validate(g); !s.ok()) throw std::invalid_argument("voxelpipe::slabs: " + s.message());
        cut_into(equal_layers(g, 2, std::max(1, options_.num_slabs), options_.align));
    }

    // Slabs to begin with, in place of equal ones; before the first triangle.
    void cut_into(const plan& p) {
        pending_.clear();
        axis_ = slabs_.axis = p.axis;
        for (std::size_t i = 0; i < p.slabs.size(); ++i) {
            if (p.slabs[i].size() == 0) continue;
            pending_.push_back({p.crop(grid_, i), {}, {}});
        }
        bins_ = std::vector<bin<record_type>>(pending_.size());
        memory_ = std::make_unique<bin_memory<record_type>>(options_.memory / 4, bins_.size(), options_.folder);
        slabs_.of_layer.assign(static_cast<std::size_t>(grid_.extent[axis_]), 0);
        for (std::size_t i = 0; i < pending_.size(); ++i) {
            const int begin = pending_[i].where.offset[axis_] - grid_.offset[axis_];
            std::fill_n(slabs_.of_layer.begin() + begin, pending_[i].where.extent[axis_],
                        static_cast<std::uint32_t>(i));
        }
    }

    // The grid that all slabs together are.
    [[nodiscard]] const grid& where() const { return grid_; }
    // Counts of the triangles so far in the whole grid. Each is counted once, however many slabs it reaches.
    [[nodiscard]] const counters& counts() const { return counts_; }
    [[nodiscard]] counters& counts() { return counts_; }
    // Records come by ascending number. reach: see classify(). Throws std::bad_alloc, and std::system_error of files.
    void push(const record_type& r, const core::voxel_box& reach) {
        const auto [first, last] = slabs_(reach);
        for (std::uint32_t i = first; i <= last; ++i) memory_->push(bins_, i, r);
    }
    // The `count` triangles of a chunk, which are added to the counts: a chunk_records. Throws as push().
    template <class Chunk>
    [[nodiscard]] status push_all(const Chunk& chunk, std::size_t count) {
        return router_.route(chunk, count, slabs_, bins_, *memory_, counts_);
    }
    // Threads that work on the host.
    [[nodiscard]] unsigned threads() const { return threads_; }

    // Draws slab by slab. make(glm::ivec3 extent) gives what is drawn into, a framebuffer, A-buffer or sparse
    // framebuffer; sink(const slab&, that) gets it afterwards, by ascending voxels along the axis of the slabs. A slab
    // whose triangles and targets exceed the budget, or whose call runs out of memory, is cut again: along z, then y,
    // then x; A-buffers along z alone. Returns the counts of the whole, or the failure of a call; what earlier slabs
    // gave has reached the sink by then. Throws what make and sink throw, and std::system_error of files.
    template <class FragmentShader, class Make, class Sink>
    [[nodiscard]] status draw(const FragmentShader& shader, const Make& make, const Sink& sink) {
        return draw_slabs<false>(shader, make, sink, [&](const auto& draws, const grid& g, auto& out) {
            return voxelize(backend_, draws, g, out, options_.voxelize);
        });
    }
    // The same for solids, without repairs, in slabs along y and z. Counts of rows are sums over the slabs.
    template <class SolidShader, class Make, class Sink>
    [[nodiscard]] status draw_solid(const SolidShader& shader, const Make& make, const Sink& sink,
                                    const solid_options& how = {}) {
        if (how.repair != repair::none || !options_.is_solid || axis_ == 0)
            return core::failure(status_code::bad_solid_options);
        return draw_slabs<true>(shader, make, sink, [&](const auto& draws, const grid& g, auto& out) {
            return voxelize_solid(backend_, draws, g, out, how);
        });
    }

private:
    using arrays = detail::slab_arrays<Varyings>;
    struct pending_slab {
        grid where;
        bin<record_type> triangles;
        std::future<arrays> loading; // begun while another slab is drawn
    };
    using mesh_types = detail::slab_mesh<Varyings>;

    template <bool IsSolid, class Shader, class Make, class Sink, class Call>
    [[nodiscard]] status draw_slabs(const Shader& shader, const Make& make, const Sink& sink, const Call& call) {
        using output = std::remove_cvref_t<decltype(make(grid_.extent))>;
        if (detail::is_abuffer<output> && axis_ != 2) return core::failure(status_code::bad_crop);
        const costs cost = costs_of(options_, detail::bytes_per_voxel<output>);
        lists_ = detail::is_abuffer<output>;
        for (std::size_t i = 0; i < pending_.size(); ++i) pending_[i].triangles = std::move(bins_[i]);
        bins_.clear();
        status all;
        while (!pending_.empty()) {
            pending_slab& next = pending_.front();
            if (cost.of(next) > cost.limit && cut_front(cost, cost.limit)) continue;
            slab s;
            s.where = next.where;
            s.voxels_before = all.counts.voxels;
            s.fragments_before = all.counts.fragments;
            try {
                arrays triangles = next.loading.valid() ? next.loading.get() : arrays(next.triangles, threads_);
                begin_loading(cost);
                output out = make(s.where.extent);
                s.drawn = draw_one<IsSolid>(std::move(triangles), shader, s.where, out, call);
                if (s.drawn.ok()) {
                    add_drawn(all, s.drawn);
                    sink(std::as_const(s), out);
                }
            } catch (const std::bad_alloc&) {
                s.drawn = core::failure(status_code::out_of_memory);
            }
            if (s.drawn.code == status_code::out_of_memory && cut_front(cost, cost.of(next) / 2)) continue;
            if (!s.drawn.ok()) return s.drawn;
            pending_.pop_front();
        }
        const counters drawn = all.counts;
        all.counts = counts_;
        all.counts.fragments = drawn.fragments;
        all.counts.fragments_discarded = drawn.fragments_discarded;
        all.counts.voxels = drawn.voxels;
        return all;
    }

    template <bool IsSolid, class Shader, class Output, class Call>
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
            if constexpr (core::is_constant<Shader> || IsSolid)
                s = one_draw(shader);
            else
                s = one_draw(detail::numbered_shader<Shader>{shader, numbers});
            if constexpr (detail::is_abuffer<Output> && !IsSolid)
                if (s.ok())
                    backend_.for_each(out.primitives.size(), detail::renumber_list{out.primitives.data(), numbers});
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

    // Bytes of a slab.
    struct costs {
        double triangle, voxel, limit;
        [[nodiscard]] double of(const pending_slab& s) const {
            const glm::ivec3 e = s.where.extent;
            return triangle * static_cast<double>(s.triangles.size()) + voxel * static_cast<double>(e.x) * e.y * e.z;
        }
    };
    [[nodiscard]] static costs costs_of(const stream_options& options, double voxel_bytes) {
        // Twice a mesh of positions, varyings, indices and number, since the next slab's is read meanwhile, and a copy
        // of both for backends with a memory of their own.
        constexpr double mesh =
            3 * sizeof(glm::vec3) + sizeof(glm::uvec3) + 4 + (std::is_empty_v<Varyings> ? 0.0 : 3.0 * sizeof(Varyings));
        // Snapped positions, varyings and tile pairs of cpu_backend.
        constexpr double work = 3 * 24 + (std::is_empty_v<Varyings> ? 0.0 : 3.0 * sizeof(Varyings)) + 48;
        return {2 * sizeof(record_type) + 2 * mesh + (options.triangle_bytes > 0 ? options.triangle_bytes : work),
                options.voxel_bytes > 0 ? options.voxel_bytes : voxel_bytes,
                0.75 * static_cast<double>(options.memory)};
    }

    // Reads the slab behind the first one from its file, if it will be drawn as it is.
    void begin_loading(const costs& cost) {
        if (pending_.size() < 2) return;
        pending_slab& next = pending_[1];
        if (next.loading.valid() || next.triangles.in_file() == 0 || cost.of(next) > cost.limit) return;
        next.loading = std::async(
            std::launch::async, [&next, threads = std::min(4u, threads_)] { return arrays(next.triangles, threads); });
    }

    // Replaces the first slab by parts whose costs are at most `limit`, two at least. False if it cannot be cut.
    [[nodiscard]] bool cut_front(const costs& cost, double limit) {
        pending_slab whole = std::move(pending_.front());
        const int step = std::max(1, options_.align);
        int axis = axis_;
        for (const int a : {axis_, 2, 1, 0}) {
            axis = a;
            if (whole.where.extent[a] > step) break;
            if (lists_ || (options_.is_solid && a == 1)) break;
        }
        if (whole.where.extent[axis] <= step || (options_.is_solid && axis == 0)) {
            pending_.front() = std::move(whole);
            return false;
        }
        const glm::ivec3 extent = whole.where.extent;
        const core::snap_transform snap = core::make_snap_transform(whole.where);
        const auto reach_of = [&](const record_type& r) {
            return classify(snap, extent, options_.voxelize.rule, r.positions[0], r.positions[1], r.positions[2],
                            options_.is_solid)
                .reach;
        };
        histogram counts(extent);
        whole.triangles.for_each_block([&](std::span<const record_type> block) {
            for (const record_type& r : block)
                if (const core::voxel_box reach = reach_of(r); !reach.empty()) counts.add(reach);
        });
        plan_options how;
        how.align = step;
        const double layer = static_cast<double>(extent.x) * extent.y * extent.z / extent[axis] * cost.voxel;
        how.triangle_cost = static_cast<std::uint64_t>(cost.triangle);
        how.layer_cost = static_cast<std::uint64_t>(layer);
        plan parts = cover(counts, axis, static_cast<std::uint64_t>(std::max(1.0, limit)), how);
        if (parts.slabs.size() < 2) parts = equal_layers(whole.where, axis, 2, step);
        // Triangles that reach most of the slab would be in most of the parts, which makes nothing smaller.
        if (parts.triangles_cut > parts.triangles) parts = equal_layers(whole.where, axis, 2, step);

        std::vector<bin<record_type>> bins(parts.slabs.size());
        bin_memory<record_type> memory(options_.memory / 8, bins.size(), options_.folder);
        whole.triangles.for_each_block([&](std::span<const record_type> block) {
            for (const record_type& r : block) {
                const core::voxel_box reach = reach_of(r);
                if (reach.empty()) continue;
                for (std::size_t i = 0; i < bins.size(); ++i)
                    if (reach.lo[axis] < parts.slabs[i].end && reach.hi[axis] >= parts.slabs[i].begin)
                        memory.push(bins, i, r);
            }
        });
        pending_.pop_front();
        for (std::size_t i = bins.size(); i-- > 0;)
            pending_.push_front({parts.crop(whole.where, i), std::move(bins[i]), {}});
        return true;
    }

    Backend& backend_;
    grid grid_;
    stream_options options_;
    int axis_ = 2;
    bool lists_ = false;
    counters counts_;
    unsigned threads_;
    detail::slab_table slabs_;
    detail::chunk_router<record_type> router_;
    std::deque<pending_slab> pending_;
    std::vector<bin<record_type>> bins_; // of the pending slabs, until they are drawn
    std::unique_ptr<bin_memory<record_type>> memory_;
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
        : base(backend, g, options), shader_(shader), rule_(options.voxelize.rule), is_solid_(options.is_solid) {}

    // Adds triangles of host memory; they are numbered on from those before. Fails for an index that names no vertex,
    // for more than 2^32 - 1 triangles, and for instances. What was added before a failure stays.
    [[nodiscard]] status add(const Mesh& chunk) {
        const chunk_records<varyings, Mesh> records(chunk, shader_, this->where(), rule_, is_solid_, num_triangles_,
                                                    this->threads());
        const status s = records.valid().ok() ? this->push_all(records, chunk.triangles.size()) : records.valid();
        if (s.ok()) num_triangles_ += chunk.part.whole != 0 ? chunk.part.whole : chunk.triangles.size();
        return s;
    }
    // Triangles in the chunks so far.
    [[nodiscard]] std::uint64_t num_triangles() const { return num_triangles_; }

private:
    VertexShader shader_;
    coverage rule_;
    bool is_solid_;
    std::uint64_t num_triangles_ = 0;
};

// Appends the lists of a slab along z to those of the slabs before it, as one call with the whole grid orders them.
template <class Payload>
void append(host_abuffer<Payload>& whole, const grid& whole_grid, const slab& s, const host_abuffer<Payload>& part) {
    const glm::ivec3 e = whole_grid.extent, from = s.where.offset - whole_grid.offset;
    whole.extent = e;
    const auto area = static_cast<std::uint64_t>(e.x) * static_cast<std::uint64_t>(e.y);
    for (const std::uint64_t v : part.voxels) whole.voxels.push_back(v + area * static_cast<std::uint64_t>(from.z));
    if (!part.voxels.empty() && !whole.offsets.empty()) whole.offsets.pop_back();
    const std::uint64_t before = whole.primitives.size();
    for (const std::uint64_t o : part.offsets) whole.offsets.push_back(o + before);
    whole.primitives.insert(whole.primitives.end(), part.primitives.begin(), part.primitives.end());
    whole.payloads.insert(whole.payloads.end(), part.payloads.begin(), part.payloads.end());
}

} // namespace voxelpipe::slabs
