// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Slabs over MPI ranks, run by mpiexec with 1 to 4 of them: each rank compares its slab with one call that draws the
// whole.

#include "broken_scene.hpp"

#include <voxelpipe/slabs/mpi.hpp>

namespace {

using namespace slab_scene;
using stream_type = slabs::mpi_stream<backend_type, moved, vp::mesh_view<glm::vec3>>;

int my_rank() {
    int rank = 0;
    MPI_Comm_rank(MPI_COMM_WORLD, &rank);
    return rank;
}
int num_ranks() {
    int n = 1;
    MPI_Comm_size(MPI_COMM_WORLD, &n);
    return n;
}
std::uint64_t sum_of_ranks(std::uint64_t n) {
    MPI_Allreduce(MPI_IN_PLACE, &n, 1, MPI_UINT64_T, MPI_SUM, MPI_COMM_WORLD);
    return n;
}

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

// Solids of meshes with holes, whose triangles the ranks have read in shares; of a crop, too.
TEST(RankSolids, RepairedSlabsAreTheWhole) {
    struct winding {
        auto operator()(const vp::solid_fragment& f) const {
            return vp::outputs(static_cast<std::int32_t>(f.winding + f.voxel.z + 100));
        }
    };
    using targets = vp::framebuffer<backend_type, vp::target<std::int32_t, vp::blend::add>>;
    using solid_stream = slabs::mpi_stream<backend_type, vp::passthrough>;
    backend_type backend = unit::make_backend(1);
    const vp::grid uncut = unit::unit_grid(extent);
    struct drawing {
        vp::grid grid;
        unit::small_mesh mesh;
        std::uint64_t memory;
    };
    for (const drawing& d : {drawing{uncut, broken_scene(extent), std::uint64_t{1} << 30},
                             {uncut, broken_scene(extent), 120'000},
                             {uncut, plates(extent), std::uint64_t{1} << 30},
                             {uncut.crop({3, 5, 9}, {30, 21, 22}), broken_scene(extent), 120'000}})
        for (const vp::solid_options& how :
             {vp::solid_options{}, vp::solid_options{.repair = vp::repair::close_holes},
              vp::solid_options{
                  .extent = vp::solid_extent::outer, .repair = vp::repair::close_holes, .max_hole_edges = 3},
              vp::solid_options{.repair = vp::repair::vote}}) {
            const vp::grid& grid = d.grid;
            const unit::small_mesh& mesh = d.mesh;
            targets whole{backend, grid.extent};
            const vp::status one =
                vp::voxelize_solid(backend, mesh.view(), grid, vp::passthrough{}, winding{}, whole, how);
            ASSERT_TRUE(one.ok()) << one.message();
            const auto expected = vp::get<0>(whole).to_host_target(backend);
            slabs::stream_options options;
            options.memory = d.memory;
            options.folder = ::testing::TempDir();
            options.is_solid = true;
            options.repair = how.repair;
            solid_stream stream(MPI_COMM_WORLD, backend, grid, {}, options);
            const auto [first, last] = slabs::share_of(mesh.triangles.size(), my_rank(), num_ranks());
            stream.add({mesh.positions, vp::array_view<const glm::uvec3>(mesh.triangles.data() + first, last - first)})
                .or_throw();
            std::uint64_t wrong = 0, voxels = 0;
            const vp::status s = stream.draw_solid(
                winding{},
                [&](glm::ivec3 size) {
                    return targets{backend, size};
                },
                [&](const slabs::slab& slab, const targets& fb) {
                    const auto part = vp::get<0>(fb).to_host_target(backend);
                    const glm::ivec3 o = slab.where.offset - grid.offset;
                    unit::for_each_voxel(slab.where.extent, [&](int x, int y, int z) {
                        wrong += part(x, y, z) != expected(o.x + x, o.y + y, o.z + z) ? 1 : 0;
                        ++voxels;
                    });
                },
                how);
            EXPECT_TRUE(s.ok()) << s.message();
            EXPECT_EQ(s.counts, one.counts);
            EXPECT_EQ(s.solid, one.solid);
            EXPECT_EQ(wrong, 0u);
            EXPECT_EQ(sum_of_ranks(voxels), static_cast<std::uint64_t>(grid.extent.x) *
                                                static_cast<std::uint64_t>(grid.extent.y) *
                                                static_cast<std::uint64_t>(grid.extent.z));
        }
    slabs::stream_options flood;
    flood.repair = vp::repair::exterior;
    solid_stream refused(MPI_COMM_WORLD, backend, uncut, {}, flood);
    EXPECT_EQ(refused
                  .draw_solid(
                      winding{},
                      [&](glm::ivec3 size) {
                          return targets{backend, size};
                      },
                      [](const slabs::slab&, const targets&) { FAIL(); }, {.repair = vp::repair::exterior})
                  .code,
              vp::status_code::crop_without_whole);
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
    MPI_Finalize();
    return failed;
}
