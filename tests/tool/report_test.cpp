// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// The progress bar: drawn on terminals only, and only for work that takes a while.
#include <model/memory.hpp>
#include <run/report.hpp>

#include <gtest/gtest.h>

#include <fcntl.h>
#include <stdlib.h>
#include <unistd.h>

#include <chrono>
#include <functional>
#include <string>
#include <thread>

namespace {

// The text that WORK writes to standard error while that is the slave end of a terminal, or of a pipe.
std::string standard_error_of(bool terminal, const std::function<void()>& work) {
    int reader = -1;
    int writer = -1;
    if (terminal) {
        reader = posix_openpt(O_RDWR | O_NOCTTY);
        EXPECT_EQ(0, grantpt(reader));
        EXPECT_EQ(0, unlockpt(reader));
        writer = open(ptsname(reader), O_RDWR | O_NOCTTY);
    } else {
        int ends[2];
        EXPECT_EQ(0, pipe(ends));
        reader = ends[0];
        writer = ends[1];
    }
    EXPECT_LE(0, reader);
    EXPECT_LE(0, writer);
    const int kept = dup(STDERR_FILENO);
    dup2(writer, STDERR_FILENO);
    work();
    dup2(kept, STDERR_FILENO);
    close(kept);
    fcntl(reader, F_SETFL, O_NONBLOCK);
    std::string text;
    char buffer[4096];
    for (ssize_t n = read(reader, buffer, sizeof buffer); n > 0; n = read(reader, buffer, sizeof buffer))
        text.append(buffer, static_cast<std::size_t>(n));
    close(writer);
    close(reader);
    return text;
}

void show_half(bool enabled, std::chrono::milliseconds wait) {
    voxelize::progress_bar bar{enabled};
    bar.start("working");
    std::this_thread::sleep_for(wait);
    bar.show(0.5);
    bar.show(0.501); // the same per cent: not drawn again
}

TEST(ProgressBar, IsDrawnOnATerminalAndTakenAwayAgain) {
    const std::string text = standard_error_of(true, [] { show_half(true, std::chrono::milliseconds(600)); });
    const std::size_t drawn = text.find("working [###############...............]  50 %");
    ASSERT_NE(std::string::npos, drawn) << text;
    EXPECT_EQ(std::string::npos, text.find("working", drawn + 1)) << text;
    EXPECT_EQ("\r\033[K", text.substr(text.size() - 4)) << text;
}

TEST(ProgressBar, IsNotDrawnElsewhere) {
    const auto shown = std::chrono::milliseconds(600);
    EXPECT_EQ("", standard_error_of(false, [&] { show_half(true, shown); })); // a pipe
    EXPECT_EQ("", standard_error_of(true, [&] { show_half(false, shown); })); // --quiet
    EXPECT_EQ("", standard_error_of(true, [&] { show_half(true, {}); }));     // quick work
}

TEST(PeakMemory, GrowsWithUse) {
    const std::uint64_t before = voxelize::memory::peak();
    const std::string block(std::size_t{64} << 20, 'x');
    EXPECT_LE(before, voxelize::memory::peak());
    EXPECT_LT(block.size(), voxelize::memory::peak());
}

} // namespace
