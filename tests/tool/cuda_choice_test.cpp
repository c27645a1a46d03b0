// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// --backend cuda and auto where there is no GPU to use: what the program says, what it ends with, and that auto gives
// the CPU's bytes. Machines that are not at hand are played by facts, and by driver libraries that the tests bring.
#include "tool_test.hpp"

#include <draw/backend_estimate.hpp>
#include <draw/cuda_device.hpp>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <algorithm>

using namespace tool_test;

namespace {

// A machine on which everything is as it should be.
voxelize::cuda_facts good_facts() {
    voxelize::cuda_facts facts;
    facts.built_in = true;
    facts.runtime = 13000;
    facts.driver = 13010;
    facts.devices = 1;
    facts.name = "NVIDIA Test";
    facts.capability = 90;
    facts.has_kernel = true;
    facts.free_memory = std::uint64_t{8} << 30;
    facts.total_memory = std::uint64_t{10} << 30;
    facts.architectures = "8.0, 9.0";
    return facts;
}

TEST(CudaFacts, EveryReasonHasALineOfItsOwn) {
    using voxelize::why_not;
    EXPECT_EQ("", why_not(good_facts()));
    EXPECT_EQ("this program was built without CUDA", why_not({}));
    voxelize::cuda_facts facts = good_facts();
    facts.driver = 0;
    facts.devices = 0;
    EXPECT_EQ("there is no NVIDIA driver", why_not(facts));
    facts = good_facts();
    facts.driver = 12040;
    facts.driver_too_old = true;
    EXPECT_EQ("the NVIDIA driver serves CUDA 12.4 and this program needs CUDA 13.0, so the driver is too old",
              why_not(facts));
    facts = good_facts();
    facts.devices = 0;
    facts.has_kernel = false;
    EXPECT_EQ("the NVIDIA driver finds no GPU", why_not(facts));
    facts = good_facts();
    facts.capability = 75;
    facts.has_kernel = false;
    EXPECT_EQ("this program has no code for the NVIDIA Test (compute capability 7.5), only for 8.0, 9.0",
              why_not(facts));
    facts = good_facts();
    facts.error = "unknown error";
    EXPECT_EQ("CUDA says: unknown error", why_not(facts));
}

TEST(CudaFacts, AModelLargerThanTheGpusMemoryIsSeenBeforehand) {
    voxelize::scene model;
    model.primitives.resize(2);
    model.primitives[1].positions.resize(100000); // 1.2 MB
    model.images.resize(1);
    model.images[0].rgba.resize(3 << 20);
    voxelize::voxelize_request request;
    voxelize::cuda_facts facts = good_facts();
    EXPECT_EQ("", why_too_large(facts, model, request));
    facts.free_memory = 4 << 20;
    EXPECT_EQ("the model needs 5 MiB of GPU memory, and of the 10240 MiB of the NVIDIA Test 4 MiB may be used",
              why_too_large(facts, model, request));
    facts = good_facts();
    request.device_memory = 2 << 20;
    EXPECT_NE(std::string::npos, why_too_large(facts, model, request).find("NVIDIA Test 2 MiB may be used"));
    request.device_memory = 5 << 20;
    EXPECT_EQ("", why_too_large(facts, model, request));
}

// The estimates of auto: whole orders, not milliseconds.
TEST(BackendEstimate, CountsTheWork) {
    voxelize::voxelize_request request;
    const auto both = [&](int n, double triangles, bool shaded, int threads, double started = 0) {
        request.grid.extent = glm::ivec3(n);
        request.targets = {shaded ? voxelize::target::color : voxelize::target::occupancy};
        const voxelize::work_size work = voxelize::work_of(request, triangles, 50 * triangles);
        return std::pair{cpu_milliseconds(work, threads), cuda_milliseconds(work, started)};
    };
    const auto quicker_on_cpu = [&](int n, double triangles, bool shaded, int threads, double started = 0) {
        const auto [cpu, cuda] = both(n, triangles, shaded, threads, started);
        return cpu < cuda;
    };
    EXPECT_TRUE(quicker_on_cpu(128, 1e4, false, 2));
    EXPECT_TRUE(quicker_on_cpu(512, 7e4, false, 16));
    EXPECT_FALSE(quicker_on_cpu(1024, 7e6, true, 2));
    EXPECT_FALSE(quicker_on_cpu(512, 7e4, true, 2));
    EXPECT_FALSE(quicker_on_cpu(512, 7e6, false, 1));
    // Once CUDA has started, far less work pays.
    EXPECT_TRUE(quicker_on_cpu(200, 1e5, true, 16, 0));
    EXPECT_FALSE(quicker_on_cpu(200, 1e5, true, 2, 1000));
    // More threads, less time; more work, more.
    EXPECT_GT(both(256, 1e6, true, 1).first, 1.9 * both(256, 1e6, true, 2).first);
    EXPECT_LT(both(256, 1e6, false, 1).first, both(256, 1e6, true, 1).first);
    EXPECT_LT(both(256, 1e6, true, 1).second, both(1024, 1e6, true, 1).second);
    EXPECT_EQ("about 12 ms on the CPU, about 255 ms with CUDA, its start included", voxelize::in_words(12.2, 254.9));
}

// Bricks are a small part of the grid that a dense result holds; distances take long on the CPU.
TEST(BackendEstimate, KnowsBricksAndDistances) {
    voxelize::voxelize_request request;
    request.grid.extent = glm::ivec3(1024);
    request.targets = {voxelize::target::color};
    EXPECT_GT(work_of(request, 1e5, 1e6).result_bytes, 20 * work_of(request, 1e5, 1e6, true).result_bytes);
    request.grid.extent = glm::ivec3(512);
    request.targets = {voxelize::target::distance};
    EXPECT_EQ(0, work_of(request, 1e5, 1e6).samples);
    request.distance.emplace();
    request.distance->band = 3;
    const voxelize::work_size band = work_of(request, 1e5, 1e6);
    request.distance->is_whole = true;
    const voxelize::work_size whole = work_of(request, 1e5, 1e6);
    EXPECT_EQ(512.0 * 512 * 512, whole.samples);
    EXPECT_LT(3 * band.samples, whole.samples);
    EXPECT_GT(cpu_milliseconds(whole, 16), cuda_milliseconds(whole, 0));
}

TEST(BackendEstimate, CudaStartsEarlyOnlyWhereItMayPay) {
    voxelize::voxelize_request request;
    request.threads = 2;
    voxelize::grid_request grid;
    EXPECT_FALSE(voxelize::cuda_may_pay(grid, request, 1e5));
    EXPECT_TRUE(voxelize::cuda_may_pay(grid, request, 130e6));
    grid.resolution = 2048;
    EXPECT_TRUE(voxelize::cuda_may_pay(grid, request, 1e5));
    request.threads = 64;
    EXPECT_FALSE(voxelize::cuda_may_pay(grid, request, 1e5));
}

TEST(CudaStart, FindsWhatALookFinds) {
    voxelize::cuda_start start;
    EXPECT_EQ(why_not(voxelize::look_for_cuda()), why_not(start.facts()));
    EXPECT_TRUE(start.ready());
    EXPECT_LE(0, start.milliseconds_ago());
}

TEST(CudaFacts, SlabsAreAQuarterOfTheFreeMemoryWithinBounds) {
    voxelize::cuda_facts facts = good_facts();
    EXPECT_EQ(std::uint64_t{1} << 30, default_work_memory(facts));
    facts.free_memory = 400 << 20;
    EXPECT_EQ(100U << 20, default_work_memory(facts));
    facts.free_memory = 0;
    EXPECT_EQ(16U << 20, default_work_memory(facts));
}

// The program with --backend cuda ends with 5 and one line that names the reason; auto does the CPU's work, without a
// warning, and --stats gives the reason.
void expect_no_cuda(const std::string& reason) {
    const scratch_folder folder;
    const std::string model = folder / "m.glb";
    gltf_test::small_world().write_glb(model);
    // A large grid with little in it: auto expects the CPU to take long, and looks for a GPU.
    const std::vector<std::string> common{
        "--origin", "-1,-1,0", "--voxel-size", "0.001", "--extent", "3000,3000,1", "-q", "-t", "occupancy,triangle"};
    const auto arguments = [&](const std::string& out, const std::string& backend) {
        std::vector<std::string> list{model, "-o", out, "--backend", backend};
        list.insert(list.end(), common.begin(), common.end());
        return list;
    };
    const outcome cuda = run(folder, arguments(folder / "cuda.npz", "cuda"));
    EXPECT_EQ(5, cuda.code);
    EXPECT_EQ("", cuda.out);
    EXPECT_EQ("voxelize: --backend cuda: " + reason + "; use --backend cpu\n", cuda.err);
    EXPECT_FALSE(std::filesystem::exists(folder / "cuda.npz"));
    // Bricks, distances and remeshes have the same way to a GPU.
    for (const char* drawn : {"--sparse", "--distance", "--remesh"}) {
        const std::vector<std::string> small{model, "-o", folder / "small.glb", "--backend", "cuda", "-r", "16",
                                             "-q",  drawn};
        const outcome refused = run(folder, small);
        EXPECT_EQ(5, refused.code) << drawn;
        EXPECT_EQ("voxelize: --backend cuda: " + reason + "; use --backend cpu\n", refused.err) << drawn;
    }

    ASSERT_EQ(0, run(folder, arguments(folder / "cpu.npz", "cpu")).code);
    std::vector<std::string> list = arguments(folder / "auto.npz", "auto");
    list.insert(list.end(), {"--stats", "json"});
    const outcome automatic = run(folder, list);
    ASSERT_EQ(0, automatic.code) << automatic.err;
    EXPECT_EQ("", automatic.err);
    const auto stats = nlohmann::json::parse(automatic.out);
    EXPECT_EQ("cpu", stats["backend"]);
    EXPECT_EQ(reason, stats["no_cuda"].get<std::string>());
    EXPECT_FALSE(stats.contains("device"));
    EXPECT_EQ(read_file(folder / "cpu.npz"), read_file(folder / "auto.npz"));

    list.back() = "text";
    EXPECT_NE(std::string::npos, run(folder, list).out.find("(not cuda: " + reason + ")\n"));

    // A strategy is a GPU's: what is asked for is not silently left out.
    list.insert(list.end(), {"--strategy", "tiled"});
    const outcome forced = run(folder, list);
    EXPECT_EQ(5, forced.code);
    EXPECT_EQ("voxelize: --strategy tiled needs a GPU: " + reason + "\n", forced.err);
    std::vector<std::string> on_cpu = arguments(folder / "cpu.npz", "cpu");
    on_cpu.insert(on_cpu.end(), {"--strategy", "tiled"});
    EXPECT_EQ(1, run(folder, on_cpu).code);
}

#if VOXELPIPE_TOOL_HAS_CUDA

// Runs the rest of the test with this folder's libcuda.so.1 in place of a driver.
class driver_from {
public:
    explicit driver_from(const char* folder) {
        if (const char* before = std::getenv("LD_LIBRARY_PATH")) kept_ = before;
        setenv("LD_LIBRARY_PATH", folder, 1);
    }
    ~driver_from() { setenv("LD_LIBRARY_PATH", kept_.c_str(), 1); }
    driver_from(const driver_from&) = delete;
    driver_from& operator=(const driver_from&) = delete;

private:
    std::string kept_;
};

TEST(CudaChoice, WithoutADriver) {
    if (voxelize::look_for_cuda().driver != 0) GTEST_SKIP() << "there is a driver";
    expect_no_cuda("there is no NVIDIA driver");
}
TEST(CudaChoice, WithADriverThatIsTooOld) {
    const driver_from old(VOXELPIPE_OLD_DRIVER);
    const int runtime = voxelize::look_for_cuda().runtime;
    expect_no_cuda("the NVIDIA driver serves CUDA 10.1 and this program needs CUDA " + std::to_string(runtime / 1000) +
                   '.' + std::to_string(runtime % 1000 / 10) + ", so the driver is too old");
}
TEST(CudaChoice, WithADriverThatFindsNoGpu) {
    const driver_from idle(VOXELPIPE_IDLE_DRIVER);
    expect_no_cuda("the NVIDIA driver finds no GPU");
}

#else

TEST(CudaChoice, WithoutCudaInTheProgram) { expect_no_cuda("this program was built without CUDA"); }

#endif

} // namespace
