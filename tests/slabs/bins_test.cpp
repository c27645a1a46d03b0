// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Bins that several threads fill, and that go to files meanwhile, have the records of one thread in its order.

#include "slab_scene.hpp"

#include <voxelpipe/slabs/route.hpp>
#include <voxelpipe/slabs/slab_queue.hpp>

#include <sys/resource.h>

#include <algorithm>
#include <csignal>
#include <cstring>
#include <system_error>

namespace {

using namespace slab_scene;
using record_type = slabs::record<varyings>;
using mesh_type = vp::mesh_view<glm::vec3>;

// Larger than what one thread takes, small triangles all over the grid and beyond it.
colored_mesh make_large() {
    colored_mesh m;
    unit::splitmix64 random(3);
    for (std::uint32_t i = 0; i < 50'000; ++i) {
        const glm::vec3 first(random.uniform(-4, 40), random.uniform(-4, 36), random.uniform(-4, 46));
        for (int k = 0; k < 3; ++k) {
            m.positions.push_back(first +
                                  glm::vec3(random.uniform(-3, 3), random.uniform(-3, 3), random.uniform(-3, 3)));
            m.colors.emplace_back(random.uniform(0, 1), random.uniform(0, 1), random.uniform(0, 1));
        }
        m.triangles.emplace_back(3 * i, 3 * i + 1, 3 * i + 2);
    }
    return m;
}

struct filled {
    vp::status status;
    vp::counters counts;
    std::vector<slabs::bin<record_type>> bins{5};
    std::uint64_t in_files = 0;

    filled(const colored_mesh& m, unsigned threads) {
        const vp::grid grid = unit::unit_grid(extent);
        slabs::detail::slab_table table;
        for (int z = 0; z < extent.z; ++z) table.of_layer.push_back(static_cast<std::uint32_t>(z / 9));
        slabs::bin_memory<record_type> memory(400'000, bins.size(), ::testing::TempDir());
        slabs::detail::chunk_router<record_type> router(threads, 64 << 20);
        const mesh_type chunk = m.with_colors();
        const slabs::chunk_records<varyings, mesh_type> records(chunk, moved{}, grid, {}, 7, threads);
        status = router.route(records, chunk.triangles.size(), table, bins, memory, counts);
        for (const auto& b : bins) in_files += b.in_file();
    }
    [[nodiscard]] std::vector<record_type> records(std::size_t i) const {
        std::vector<record_type> all;
        bins[i].for_each_block([&](std::span<const record_type> b) { all.insert(all.end(), b.begin(), b.end()); });
        return all;
    }
};

void expect_same(const filled& a, const filled& b) {
    EXPECT_EQ(a.status.code, b.status.code);
    EXPECT_EQ(a.status.triangle, b.status.triangle);
    EXPECT_EQ(a.counts, b.counts);
    EXPECT_GT(a.in_files, 0u);
    EXPECT_GT(b.in_files, 0u);
    for (std::size_t i = 0; i < a.bins.size(); ++i) {
        const std::vector<record_type> x = a.records(i), y = b.records(i);
        ASSERT_EQ(x.size(), y.size());
        EXPECT_EQ(x.size(), b.bins[i].size());
        EXPECT_EQ(std::memcmp(x.data(), y.data(), x.size() * sizeof(record_type)), 0) << "bin " << i;
        // Any part of it.
        std::vector<record_type> part(x.size() - x.size() / 3);
        b.bins[i].copy(x.size() / 3, part);
        EXPECT_EQ(std::memcmp(x.data() + x.size() / 3, part.data(), part.size() * sizeof(record_type)), 0);
    }
}

TEST(Bins, ThreadsFillThemAsOneThreadDoes) {
    colored_mesh m = make_large();
    const filled one(m, 1);
    EXPECT_TRUE(one.status.ok());
    EXPECT_EQ(one.counts.triangles_in, m.triangles.size());
    expect_same(one, filled(m, 4));
    // Triangles behind a bad index are in no bin.
    m.triangles[20'001].y = 150'000;
    const filled bad(m, 1);
    EXPECT_EQ(bad.status.code, vp::status_code::index_out_of_range);
    EXPECT_EQ(bad.status.triangle, 20'001u);
    EXPECT_EQ(bad.counts.triangles_in, 20'001u);
    expect_same(bad, filled(m, 4));
}

TEST(Bins, LargeChunksGiveTheSlabsOfOneCall) {
    const colored_mesh m = make_large();
    backend_type backend = unit::make_backend(2);
    const vp::grid grid = unit::unit_grid(extent);
    using numbers = vp::framebuffer<backend_type, vp::target<std::uint32_t, vp::blend::replace>>;
    const auto number = [](const auto& f) { return vp::outputs(f.primitive); };
    numbers expected{backend, extent};
    const vp::status whole = vp::voxelize(backend, m.with_colors(), grid, moved{}, number, expected);
    slabs::stream_options how;
    how.num_slabs = 3;
    how.threads = 4;
    slabs::stream<backend_type, moved, mesh_type> stream(backend, grid, {}, how);
    stream.add(m.with_colors()).or_throw();
    const auto voxels = vp::get<0>(expected).to_host(backend);
    std::size_t seen = 0;
    const vp::status s = stream.draw(
        number,
        [&](glm::ivec3 size) {
            return numbers{backend, size};
        },
        [&](const slabs::slab&, const numbers& part) {
            const auto of_part = vp::get<0>(part).to_host(backend);
            ASSERT_LE(seen + of_part.size(), voxels.size());
            EXPECT_TRUE(std::equal(of_part.begin(), of_part.end(), voxels.begin() + static_cast<std::ptrdiff_t>(seen)));
            seen += of_part.size();
        });
    EXPECT_EQ(s.counts, whole.counts);
    EXPECT_EQ(seen, voxels.size());
}

TEST(Bins, AFullMediumIsReported) {
    rlimit before{};
    ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
    const auto signal = std::signal(SIGXFSZ, SIG_IGN);
    const rlimit little{100'000, before.rlim_max};
    ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &little), 0);
    std::string what;
    try {
        std::vector<slabs::bin<record_type>> bins(1);
        slabs::bin_memory<record_type> memory(20'000, 1, ::testing::TempDir());
        for (int i = 0; i < 5000; ++i) memory.push(bins, 0, {});
        bins[0].for_each_block([](auto) {});
    } catch (const std::system_error& e) {
        what = e.what();
        EXPECT_EQ(e.code().value(), EFBIG);
    }
    (void)setrlimit(RLIMIT_FSIZE, &before);
    (void)std::signal(SIGXFSZ, signal);
    EXPECT_NE(what.find("cannot write a temporary file"), std::string::npos) << what;
}

// More bins than files that a process may have open, in turns, so that each has pieces all over its file.
TEST(Bins, ManyShareAFewFiles) {
    rlimit before{};
    ASSERT_EQ(getrlimit(RLIMIT_NOFILE, &before), 0);
    const rlimit little{120, before.rlim_max};
    ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &little), 0);
    constexpr std::size_t count = 500, each = 60;
    std::vector<slabs::bin<std::uint64_t>> bins(count);
    std::string what;
    try {
        slabs::bin_memory<std::uint64_t> memory(count * 200, count, ::testing::TempDir());
        for (std::uint64_t n = 0; n < each; ++n)
            for (std::size_t i = 0; i < count; ++i) memory.push(bins, (7 * i) % count, 1000 * n + (7 * i) % count);
        for (std::size_t i = 0; i < count; ++i) {
            ASSERT_EQ(bins[i].size(), each);
            EXPECT_GT(bins[i].in_file(), 0u);
            std::uint64_t next = 0, wrong = 0;
            bins[i].for_each_block([&](std::span<const std::uint64_t> block) {
                for (const std::uint64_t r : block) wrong += r != 1000 * next++ + i ? 1 : 0;
            });
            for (std::size_t first = 0; first < each; first += 7) {
                std::vector<std::uint64_t> part(std::min<std::size_t>(13, each - first));
                bins[i].copy(first, part);
                for (std::size_t k = 0; k < part.size(); ++k) wrong += part[k] != 1000 * (first + k) + i ? 1 : 0;
            }
            EXPECT_EQ(wrong, 0u) << "bin " << i;
            EXPECT_EQ(next, each);
        }
    } catch (const std::system_error& e) {
        what = e.what();
    }
    (void)setrlimit(RLIMIT_NOFILE, &before);
    EXPECT_EQ(what, "");
}

// Slabs that are visited twice: parts of one that was cut do not stay in memory for the second time.
TEST(SlabQueue, PartsThatAreKeptAreInFiles) {
    using plain_record = slabs::record<vp::no_varyings>;
    const vp::grid grid = unit::unit_grid(extent);
    slabs::stream_options options;
    options.folder = ::testing::TempDir();
    std::vector<slabs::bin<plain_record>> bins(1);
    slabs::bin_memory<plain_record> memory(options.memory, 1, options.folder);
    const colored_mesh m = make_scene();
    const vp::mesh_view<> view = m.view();
    const slabs::chunk_records<vp::no_varyings, vp::mesh_view<>> chunk(view, vp::passthrough{}, grid, {}, 0);
    vp::counters counts;
    ASSERT_TRUE(
        chunk.visit(0, m.triangles.size(), counts, [&](const plain_record& r, const auto&) { memory.push(bins, 0, r); })
            .ok());
    slabs::detail::slab_queue<vp::no_varyings> queue;
    queue.start(options, 2, 2, 0);
    queue.push_back(grid, std::move(bins[0]));
    const auto visit = [&](bool is_second) {
        std::vector<std::uint32_t> numbers;
        const double room = 12'000; // voxels
        const vp::status s = queue.for_each({0, 1, room}, !is_second, [&](const auto& slab, const auto& triangles) {
            if (is_second) {
                EXPECT_EQ(slab.triangles.in_memory(), 0u);
            }
            numbers.push_back(0xffffffff); // a border
            numbers.insert(numbers.end(), triangles.numbers.begin(), triangles.numbers.end());
            return vp::status{};
        });
        EXPECT_TRUE(s.ok());
        return numbers;
    };
    const std::vector<std::uint32_t> first = visit(false);
    EXPECT_GT(std::count(first.begin(), first.end(), 0xffffffff), 3);
    EXPECT_GT(first.size(), m.triangles.size() / 2);
    EXPECT_EQ(visit(true), first);
}

} // namespace
