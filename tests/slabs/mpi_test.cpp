// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Slabs over MPI ranks, run by mpiexec with 1 to 4 of them: each rank compares its slab with one call that draws the
// whole.

#include "box_mesh.hpp"
#include "broken_scene.hpp"
#include "rank_scene.hpp"

#include <voxelpipe/slabs/mpi.hpp>

namespace {

using namespace slab_scene;
using stream_type = slabs::mpi_stream<backend_type, moved, vp::mesh_view<glm::vec3>>;
using solid_stream = slabs::mpi_stream<backend_type, vp::passthrough>;

struct Ranks : ::testing::TestWithParam<vp::coverage> {
    colored_mesh mesh = make_scene();
    backend_type backend = unit::make_backend(1);
    vp::grid grid = unit::unit_grid(extent);

    [[nodiscard]] slabs::stream_options options(std::uint64_t memory = std::uint64_t{1} << 30) const {
        slabs::stream_options o;
        o.voxelize.rule = GetParam();
        o.memory = memory;
        o.folder = ::testing::TempDir();
        return o;
    }
    // The triangles that this rank would read, in chunks.
    void feed(stream_type& stream) const {
        const auto [first, last] = slabs::share_of(mesh.triangles.size(), my_rank(), num_ranks());
        for (std::uint64_t i = first; i < last; i += 30) {
            vp::mesh_view<glm::vec3> chunk = mesh.with_colors();
            chunk.triangles =
                vp::array_view<const glm::uvec3>(mesh.triangles.data() + i, std::min<std::uint64_t>(30, last - i));
            stream.add(chunk).or_throw();
        }
    }
    template <class Shader, class Output>
    vp::counters draw_whole(const Shader& shader, Output& out) {
        const vp::status s = vp::voxelize(backend, mesh.with_colors(), grid, moved{}, shader, out, GetParam());
        EXPECT_TRUE(s.ok()) << s.message();
        return s.counts;
    }
};
INSTANTIATE_TEST_SUITE_P(Coverages, Ranks,
                         ::testing::Values(vp::coverage::thin, vp::coverage::conservative, vp::coverage::crosshair));

TEST_P(Ranks, SlabsOfFramebuffersAreTheWhole) {
    dense expected{backend, extent};
    const vp::counters counts = draw_whole(all_kinds{}, expected);
    for (const std::uint64_t memory : {std::uint64_t{1} << 30, std::uint64_t{120'000}}) {
        stream_type stream(MPI_COMM_WORLD, backend, grid, moved{}, options(memory));
        feed(stream);
        std::uint64_t voxels = 0;
        const vp::status s = stream.draw(
            all_kinds{},
            [&](glm::ivec3 size) {
                return dense{backend, size};
            },
            [&](const slabs::slab& slab, const dense& fb) {
                expect_crop(backend, expected, grid, slab.where, fb);
                voxels += static_cast<std::uint64_t>(slab.where.extent.x) *
                          static_cast<std::uint64_t>(slab.where.extent.y) *
                          static_cast<std::uint64_t>(slab.where.extent.z);
            });
        EXPECT_TRUE(s.ok()) << s.message();
        EXPECT_EQ(s.counts, counts);
        EXPECT_EQ(sum_of_ranks(voxels), 37u * 33 * 42);
        EXPECT_EQ(stream.slabs().slabs.size(), static_cast<std::size_t>(num_ranks()));
    }
}

TEST_P(Ranks, ListsFollowEachOther) {
    vp::abuffer<backend_type, std::uint64_t> lists{backend};
    const vp::counters counts = draw_whole(payload{}, lists);
    const auto expected = lists.to_host(backend);
    stream_type stream(MPI_COMM_WORLD, backend, grid, moved{}, options(150'000));
    feed(stream);
    vp::host_abuffer<std::uint64_t> mine;
    const vp::status s = stream.draw(
        payload{}, [&](glm::ivec3) { return vp::abuffer<backend_type, std::uint64_t>{backend}; },
        [&](const slabs::slab& slab, const auto& part) { slabs::append(mine, grid, slab, part.to_host(backend)); });
    EXPECT_TRUE(s.ok()) << s.message();
    EXPECT_EQ(s.counts, counts);
    const auto before = stream.lists_before();
    ASSERT_LE(before.voxels + mine.voxels.size(), expected.voxels.size());
    ASSERT_LE(before.fragments + mine.primitives.size(), expected.primitives.size());
    for (std::size_t i = 0; i < mine.voxels.size(); ++i) {
        ASSERT_EQ(mine.voxels[i], expected.voxels[before.voxels + i]);
        ASSERT_EQ(mine.offsets[i] + before.fragments, expected.offsets[before.voxels + i]);
    }
    for (std::size_t i = 0; i < mine.primitives.size(); ++i) {
        ASSERT_EQ(mine.primitives[i], expected.primitives[before.fragments + i]);
        ASSERT_EQ(mine.payloads[i], expected.payloads[before.fragments + i]);
    }
    EXPECT_EQ(sum_of_ranks(mine.voxels.size()), expected.voxels.size());
    EXPECT_EQ(sum_of_ranks(mine.primitives.size()), expected.primitives.size());
}

TEST_P(Ranks, SparseSlabsAreCropsOfTheWhole) {
    sparse expected{backend, extent};
    const vp::counters counts = draw_whole(all_kinds{}, expected);
    stream_type stream(MPI_COMM_WORLD, backend, grid, moved{}, options());
    feed(stream);
    std::uint64_t voxels = 0;
    const vp::status s = stream.draw(
        all_kinds{},
        [&](glm::ivec3 size) {
            return sparse{backend, size};
        },
        [&](const slabs::slab& slab, const sparse& part) {
            sparse alone{backend, slab.where.extent};
            vp::voxelize(backend, mesh.with_colors(), slab.where, moved{}, all_kinds{}, alone, GetParam()).or_throw();
            EXPECT_TRUE(vp::same_contents(part.to_host(backend), alone.to_host(backend)));
            voxels += part.num_voxels();
        });
    EXPECT_TRUE(s.ok()) << s.message();
    EXPECT_EQ(s.counts, counts);
    EXPECT_EQ(sum_of_ranks(voxels), expected.num_voxels());
}

// Compares a solid in slabs of ranks, whose triangles they have read in shares, with one call. Returns the slabs.
slabs::plan expect_ranks(whole_solid& whole, std::uint64_t memory) {
    solid_stream stream(MPI_COMM_WORLD, whole.backend, whole.grid, {}, options_for(whole.how, 0, memory));
    stream.add(share_of(whole.mesh)).or_throw();
    EXPECT_EQ(sum_of_ranks(whole.expect_slabs(stream, whole.make()).voxels), whole.num_voxels());
    return stream.slabs();
}
slabs::plan expect_ranks(whole_solid&& whole, std::uint64_t memory) { return expect_ranks(whole, memory); }
constexpr std::uint64_t much = std::uint64_t{1} << 30, little = 120'000;

// Meshes with holes; of a crop, too.
TEST(RankSolids, RepairedSlabsAreTheWhole) {
    const vp::grid uncut = unit::unit_grid(extent), crop = uncut.crop({3, 5, 9}, {30, 21, 22});
    for (const vp::solid_options& how :
         {vp::solid_options{}, vp::solid_options{.repair = vp::repair::close_holes},
          vp::solid_options{.extent = vp::solid_extent::outer, .repair = vp::repair::close_holes, .max_hole_edges = 3},
          vp::solid_options{.repair = vp::repair::vote}}) {
        whole_solid broken{broken_scene(extent), uncut, how, 1};
        (void)expect_ranks(broken, much);
        (void)expect_ranks(broken, little);
        (void)expect_ranks(whole_solid{plates(extent), uncut, how, 1}, much);
        (void)expect_ranks(whole_solid{broken_scene(extent), crop, how, 1}, little);
    }
}

// Grids of odd sizes, the last two of which have fewer layers than ranks: slabs thinner than `closing`, and none.
TEST(RankSolids, FloodedSlabsAreTheWhole) {
    std::uint64_t voxels = 0;
    bool any_without = false;
    for (const glm::ivec3& size : {extent, glm::ivec3(65, 7, 11), glm::ivec3(70, 9, 3), glm::ivec3(8, 64, 1)})
        for (const int closing : {0, 1, 3}) {
            SCOPED_TRACE(std::to_string(size.z) + " layers, closing " + std::to_string(closing));
            const vp::solid_options how{.repair = vp::repair::exterior, .closing = closing};
            whole_solid broken{broken_scene(size), unit::unit_grid(size), how, 1};
            voxels += broken.one.counts.voxels;
            for (const slabs::layer_range& r : expect_ranks(broken, little).slabs) any_without |= r.size() == 0;
            if (closing != 1) continue;
            (void)expect_ranks(broken, much);
            (void)expect_ranks(whole_solid{plates(size), broken.grid, how, 1}, much);
            (void)expect_ranks(whole_solid{{}, broken.grid, how, 1}, much);
        }
    EXPECT_GT(voxels, 50'000u);
    EXPECT_TRUE(any_without || num_ranks() == 1);
}

// A box with walls across x, which leave a gap above and below in turns: a path from the open end goes up and down
// through all slabs, six times. The last wall has no gap.
TEST(RankSolids, FloodsWindThroughAllRanks) {
    const glm::ivec3 size(51, 13, 43);
    unit::small_mesh m;
    // In strips, so that slabs have about equal work.
    const auto across_x = [&](float x, float low, float high) {
        for (float z = low; z < high; ++z)
            add_quad(m, {x, 2.5f, z}, {x, 10.5f, z}, {x, 10.5f, z + 1}, {x, 2.5f, z + 1});
    };
    for (const float y : {2.5f, 10.5f})
        for (float z = 2.5f; z < 39; ++z) add_quad(m, {2.5f, y, z}, {47.5f, y, z}, {47.5f, y, z + 1}, {2.5f, y, z + 1});
    add_quad(m, {8.5f, 2.5f, 2.5f}, {47.5f, 2.5f, 2.5f}, {47.5f, 10.5f, 2.5f}, {8.5f, 10.5f, 2.5f});
    add_quad(m, {2.5f, 2.5f, 39.5f}, {47.5f, 2.5f, 39.5f}, {47.5f, 10.5f, 39.5f}, {2.5f, 10.5f, 39.5f});
    for (int k = 0; k < 8; ++k) {
        const bool full = k == 0 || k >= 6;
        across_x(2.5f + 6 * static_cast<float>(k), full || k % 2 == 1 ? 2.5f : 8.5f,
                 full || k % 2 == 0 ? 39.5f : 33.5f);
    }
    add_quad(m, {47.5f, 2.5f, 2.5f}, {47.5f, 10.5f, 2.5f}, {47.5f, 10.5f, 39.5f}, {47.5f, 2.5f, 39.5f});
    for (const int closing : {0, 1, 3}) {
        SCOPED_TRACE(closing);
        whole_solid box{m, unit::unit_grid(size), {.repair = vp::repair::exterior, .closing = closing}, 1};
        for (int k = 0; k < 6; ++k) EXPECT_EQ(box.expected(5 + 6 * k, 6, 20) != 0, closing == 3) << k;
        EXPECT_NE(box.expected(41, 6, 20), 0);
        for (const slabs::layer_range& r : expect_ranks(box, little).slabs) EXPECT_GT(r.size(), 6);
    }
}

TEST(RankSolids, SaysWhatIsWrong) {
    const vp::grid uncut = unit::unit_grid(extent);
    const auto code = [](const vp::grid& grid, vp::repair of_stream, const vp::solid_options& how) {
        backend_type backend = unit::make_backend(1);
        slabs::stream_options options = options_for(how, 0);
        options.repair = of_stream;
        solid_stream stream(MPI_COMM_WORLD, backend, grid, {}, options);
        return stream
            .draw_solid(
                winding{},
                [&](glm::ivec3 size) {
                    return solid_targets{backend, size};
                },
                [](const slabs::slab&, const solid_targets&) { FAIL(); }, how)
            .code;
    };
    using vp::status_code;
    const vp::solid_options flood{.repair = vp::repair::exterior};
    EXPECT_EQ(code(uncut.crop({0, 0, 1}, {9, 9, 9}), vp::repair::exterior, flood), status_code::crop_without_whole);
    EXPECT_EQ(code(uncut, vp::repair::none, flood), status_code::bad_solid_options) << "the stream was told of none";
    EXPECT_EQ(code(uncut, vp::repair::exterior, {.repair = vp::repair::exterior, .closing = 65}),
              status_code::bad_solid_options);
}

// Two bodies, one of which is open.
struct floats_of_ranks {
    using field = vp::framebuffer<backend_type, vp::target<float, vp::blend::replace>>;
    glm::ivec3 size{15, 14, 23};
    vp::grid g = unit::unit_grid(size);
    unit::small_mesh m;
    backend_type backend = unit::make_backend(1);
    slabs::stream_options options;

    floats_of_ranks() {
        unit::add_box(m, {2.25f, 1.5f, 1.75f}, {13.5f, 12.25f, 20.5f});
        unit::add_box(m, {9.5f, 9.25f, 8.5f}, {12.5f, 18.0f, 21.75f});
        m.triangles.erase(m.triangles.begin() + 3);
        options.folder = ::testing::TempDir();
    }
    [[nodiscard]] auto make() {
        return [this](glm::ivec3 extent) { return field{backend, extent}; };
    }

    // draw_one(view, framebuffer) is one call; draw(stream, make, sink) is the ranks'. Each rank's slab is a part of
    // the whole, and the status is that of one call on every rank.
    template <class DrawOne, class Draw>
    vp::status expect_whole(const DrawOne& draw_one, const Draw& draw) {
        const vp::mesh_view<> view{m.positions, m.triangles};
        field whole{backend, size};
        const vp::status expected = draw_one(view, whole);
        EXPECT_TRUE(expected.ok()) << expected.message();
        solid_stream stream(MPI_COMM_WORLD, backend, g, {}, options);
        const auto [first, last] = slabs::share_of(m.triangles.size(), my_rank(), num_ranks());
        vp::mesh_view<> mine = view;
        mine.triangles = vp::array_view<const glm::uvec3>(m.triangles.data() + first, last - first);
        EXPECT_TRUE(stream.add(mine).ok());
        const auto all = vp::get<0>(whole).to_host(backend);
        const std::size_t layer = static_cast<std::size_t>(size.x) * static_cast<std::size_t>(size.y);
        std::size_t layers = 0;
        const vp::status s = draw(stream, make(), [&](const slabs::slab& part, const field& out) {
            const auto values = vp::get<0>(out).to_host(backend);
            layers += values.size() / layer;
            EXPECT_TRUE(std::equal(values.begin(), values.end(),
                                   all.begin() + static_cast<std::ptrdiff_t>(layer) * part.where.offset.z));
        });
        EXPECT_TRUE(s.ok()) << s.message();
        EXPECT_EQ(s.counts, expected.counts);
        EXPECT_EQ(s.cells, expected.cells);
        EXPECT_EQ(s.distance, expected.distance);
        EXPECT_EQ(s.solid, expected.solid);
        EXPECT_EQ(layers, static_cast<std::size_t>(stream.slabs().slabs[static_cast<std::size_t>(my_rank())].size()));
        return s;
    }
    // The code of a call that is refused.
    template <class Draw>
    vp::status_code refusal(const Draw& draw) {
        solid_stream stream(MPI_COMM_WORLD, backend, g, {}, options);
        return draw(stream, make(), [](const slabs::slab&, const field&) { FAIL(); }).code;
    }
};

// Fractions, with holes closed.
TEST(RankCells, SlabsAreTheWhole) {
    for (const vp::repair repair : {vp::repair::none, vp::repair::close_holes}) {
        floats_of_ranks on;
        vp::cell_options how{.count_open_edges = false, .repair = repair};
        on.options.is_solid = true;
        on.options.repair = repair;
        const auto draw = [&](auto& stream, const auto& make, const auto& sink) {
            return stream.draw_cells(vp::fraction{}, make, sink, how);
        };
        const vp::status s = on.expect_whole(
            [&](const vp::mesh_view<>& view, auto& fb) {
                return vp::voxelize_cells(on.backend, view, on.g, vp::passthrough{}, vp::fraction{}, fb, how);
            },
            draw);
        EXPECT_EQ(s.cells.cones != 0, repair == vp::repair::close_holes);
        how.axis = 1;
        EXPECT_EQ(on.refusal(draw), vp::status_code::bad_cell_options);
    }
}

// Distances: bands and whole fields, with holes closed and by winding numbers.
TEST(RankDistances, SlabsAreTheWhole) {
    for (const vp::repair repair : {vp::repair::none, vp::repair::close_holes, vp::repair::winding})
        for (const vp::band& band : {vp::band(1.5), vp::band(vp::band::whole)}) {
            floats_of_ranks on;
            vp::distance_options how{.band = band, .repair = repair};
            on.options.band = band;
            on.options.repair = repair;
            const auto draw = [&](auto& stream, const auto& make, const auto& sink) {
                return stream.draw_distance(vp::distance{}, make, sink, how);
            };
            const vp::status s = on.expect_whole(
                [&](const vp::mesh_view<>& view, auto& fb) {
                    return vp::voxelize_distance(on.backend, view, on.g, vp::passthrough{}, vp::distance{}, fb, how);
                },
                draw);
            EXPECT_EQ(s.solid.cones != 0, repair != vp::repair::none);
            how.sample = vp::sample::corner;
            EXPECT_EQ(on.refusal(draw), vp::status_code::bad_distance_options);
        }
}

TEST_P(Ranks, AFailureOfOneRankEndsTheCallOnAll) {
    const auto make = [&](glm::ivec3 size) { return dense{backend, size}; };
    const bool last = my_rank() == num_ranks() - 1;
    {
        stream_type stream(MPI_COMM_WORLD, backend, grid, moved{}, options());
        feed(stream);
        if (last) {
            colored_mesh bad = mesh;
            bad.triangles[3].z = 1'000'000;
            EXPECT_EQ(stream.add(bad.with_colors()).code, vp::status_code::index_out_of_range);
        }
        const vp::status s = stream.draw(all_kinds{}, make, [](const slabs::slab&, const dense&) { FAIL(); });
        EXPECT_EQ(s.code, last ? vp::status_code::index_out_of_range : vp::status_code::other_rank_failed);
    }
    {
        stream_type stream(MPI_COMM_WORLD, backend, grid, moved{}, options());
        feed(stream);
        const auto sink = [&](const slabs::slab&, const dense&) {
            if (last) throw std::runtime_error("no room for the result");
        };
        if (last)
            EXPECT_THROW((void)stream.draw(all_kinds{}, make, sink), std::runtime_error);
        else
            EXPECT_EQ(stream.draw(all_kinds{}, make, sink).code, vp::status_code::other_rank_failed);
    }
}

TEST(ShareOf, IsContiguousAndEven) {
    for (const std::uint64_t count : {0u, 1u, 5u, 12u, 1000003u})
        for (int n = 1; n < 9; ++n) {
            std::uint64_t at = 0;
            for (int r = 0; r < n; ++r) {
                const auto [first, last] = slabs::share_of(count, r, n);
                EXPECT_EQ(first, at);
                EXPECT_LE(last - first, count / static_cast<std::uint64_t>(n) + 1);
                EXPECT_GE(last - first, count / static_cast<std::uint64_t>(n));
                at = last;
            }
            EXPECT_EQ(at, count);
        }
}

} // namespace

int main(int argc, char** argv) {
    MPI_Init(&argc, &argv);
    ::testing::InitGoogleTest(&argc, argv);
    if (my_rank() != 0) { // its failures are printed, its progress is not
        auto& listeners = ::testing::UnitTest::GetInstance()->listeners();
        class failures_only : public ::testing::EmptyTestEventListener {
            void OnTestPartResult(const ::testing::TestPartResult& result) override {
                if (result.failed())
                    std::fprintf(stderr, "rank %d: %s:%d: %s\n", my_rank(), result.file_name(), result.line_number(),
                                 result.summary());
            }
        };
        delete listeners.Release(listeners.default_result_printer());
        listeners.Append(new failures_only);
    }
    int failed = RUN_ALL_TESTS();
    MPI_Allreduce(MPI_IN_PLACE, &failed, 1, MPI_INT, MPI_MAX, MPI_COMM_WORLD);
    if (my_rank() == 0) {
        std::puts(failed == 0 ? "all ranks passed" : "a rank failed");
        std::fflush(stdout);
    }
    MPI_Finalize();
    return failed;
}
