// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// Runs of one model with and without room for it, which give the same files, counts and warnings.

#include "tool_test.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <string>
#include <vector>

namespace tool_test {

// Vertices that no face names, so that a small PLY does not fit: a run that holds it has them all, one that streams it
// has none.
inline constexpr int spare_vertices = 1'200'000;

struct two_ways {
    const scratch_folder& folder;
    std::string model;
    std::vector<std::string> how; // options of all runs

    [[nodiscard]] outcome draw(const std::string& out, const std::vector<std::string>& more = {},
                               std::uint64_t address_space = 0) const {
        std::vector<std::string> arguments{model, "-o", folder / out, "-j", "2", "--stats=json", "--backend", "cpu"};
        arguments.insert(arguments.end(), how.begin(), how.end());
        arguments.insert(arguments.end(), more.begin(), more.end());
        return run(folder, arguments, address_space);
    }

    // Into tight.npz in so much memory, which is less than the model takes.
    [[nodiscard]] outcome draw_streamed(int mebibytes, std::uint64_t address_space = 0) const {
        const outcome tight = draw("tight.npz", {"--max-memory", std::to_string(mebibytes)}, address_space);
        EXPECT_EQ(0, tight.code) << tight.err;
        if (tight.code != 0) return tight;
        EXPECT_NE(std::string::npos, tight.err.find(" triangles do not fit")) << tight.err;
        const json stats = json::parse(tight.out);
        EXPECT_GE(mebibytes, static_cast<double>(stats["peak_memory_bytes"].get<std::uint64_t>()) / (1 << 20));
        EXPECT_LT(1, stats["slabs"].get<int>());
        return tight;
    }

    // The same, and into free.npz with the model in memory: the files are equal, and so are the statistics but for
    // memory, slabs and times. held: options of the run that holds the model.
    void expect_equal(int mebibytes, const std::vector<std::string>& held = {"--sparse"}) const {
        std::string text;
        for (const std::string& word : how) text += word + ' ';
        SCOPED_TRACE(text);
        const outcome tight = draw_streamed(mebibytes);
        if (tight.code != 0) return;
        const outcome free = draw("free.npz", held);
        ASSERT_EQ(0, free.code) << free.err;
        EXPECT_EQ(std::string::npos, free.err.find(" triangles do not fit")) << free.err;
        EXPECT_TRUE(read_file(folder / "free.npz") == read_file(folder / "tight.npz"));
        json a = json::parse(free.out);
        const json b = json::parse(tight.out);
        EXPECT_EQ(a.size(), b.size());
        // A model that is held as a whole may be examined, and its warnings then say more.
        const bool is_examined = a.contains("solid") && a["solid"].erase("flood") != 0;
        for (const auto& [name, value] : a.items()) {
            if (name == "slabs" || name == "ms" || name == "peak_memory_bytes" || name == "files") continue;
            if (name == "warnings" && is_examined) continue;
            EXPECT_EQ(value, b.value(name, json())) << name;
        }
    }
};

} // namespace tool_test
