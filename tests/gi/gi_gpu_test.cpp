// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Pictures of samples/gi on a GPU: the CPU's bytes. Not run without a device (exit code 77).

#include "parts.hpp"
#include "renderer.hpp"

#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>

namespace {

void expect_same_pictures(gi::scene (*make)(), const gi::settings& how) {
    if (const std::string why = gi::why_no_cuda(); !why.empty()) {
        std::printf("not run: %s\n", why.c_str());
        std::exit(77);
    }
    const std::unique_ptr<gi::renderer> cpu = gi::make_cpu_renderer(make(), how),
                                        gpu = gi::make_cuda_renderer(make(), how);
    for (const double time : {0.0, 0.01, 0.5}) EXPECT_EQ(gpu->render(time).pixels, cpu->render(time).pixels) << time;
}

gi::settings picture(int width, int height, int resolution, gi::view_choice view = gi::view_choice::final) {
    gi::settings s;
    s.width = width;
    s.height = height;
    s.resolution = resolution;
    s.view = view;
    return s;
}

TEST(GiOnAGpu, PicturesAreTheCpus) {
    expect_same_pictures(gi::make_cornell, picture(320, 180, 128));
    expect_same_pictures(gi::make_atrium, picture(320, 180, 128));
}

TEST(GiOnAGpu, ViewsAreTheCpus) {
    for (const gi::view_choice view :
         {gi::view_choice::direct, gi::view_choice::ao, gi::view_choice::indirect, gi::view_choice::level})
        expect_same_pictures(gi::make_cornell, picture(97, 55, 48, view));
    gi::settings samples = picture(33, 17, 32);
    samples.samples = 3;
    expect_same_pictures(gi::make_atrium, samples);
    samples.thorough = true;
    expect_same_pictures(gi::make_cornell, samples);
}

} // namespace
