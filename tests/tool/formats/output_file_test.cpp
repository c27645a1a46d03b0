// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "write/formats/output_file.hpp"

#include "test_volumes.hpp"
#include "write/formats/formats.hpp"

using namespace voxelize;
using namespace voxelize::testing;

namespace {

class OutputFile : public in_folder {
protected:
    static std::string message_of(const std::function<void()>& action) {
        try {
            action();
        } catch (const write_error& e) {
            return e.what();
        }
        return "no error";
    }
};

} // namespace

TEST_F(OutputFile, IsNotThereBeforeCommit) {
    const auto path = folder_ / "a.bin";
    {
        output_file out(path);
        out.write("half");
        EXPECT_FALSE(std::filesystem::exists(path));
    }
    EXPECT_TRUE(names().empty());
    output_file out(path);
    out.write("whole");
    out.commit();
    EXPECT_EQ(names(), std::vector<std::string>{"a.bin"});
    EXPECT_EQ(read_file(path), "whole");
}

TEST_F(OutputFile, AFailedRunKeepsTheOldFile) {
    const auto path = folder_ / "a.bin";
    std::ofstream(path) << "old";
    {
        output_file out(path);
        out.write("new");
    }
    EXPECT_EQ(read_file(path), "old");
    EXPECT_EQ(names().size(), 1u);
}

TEST_F(OutputFile, SeekOverwritesInPlace) {
    output_file out(folder_ / "a.bin");
    out.write("0123456789");
    EXPECT_EQ(out.tell(), 10u);
    out.seek(2);
    out.write("ab");
    out.seek(10);
    out.write_value<std::uint16_t>(0x4241);
    EXPECT_EQ(out.tell(), 12u);
    out.commit();
    EXPECT_EQ(read_file(folder_ / "a.bin"), "01ab456789AB");
}

TEST_F(OutputFile, TwoWritersOfOneTargetDoNotMix) {
    const auto path = folder_ / "a.bin";
    output_file first(path), second(path);
    first.write("first");
    second.write("second");
    first.commit();
    second.commit();
    EXPECT_EQ(read_file(path), "second");
    EXPECT_EQ(names().size(), 1u);
}

// Temporaries of killed runs are taken; those that are written now are not.
TEST_F(OutputFile, WhatAKilledRunLeftIsTaken) {
    const auto path = folder_ / "a.bin";
    output_file busy(path);
    busy.write("busy");
    for (const char* const left : {"a.bin.part1", "a.bin.part2", "a.bin.part4"})
        std::ofstream(folder_ / left) << "a long rest";
    {
        output_file out(path);
        out.write("new");
        out.commit();
    }
    EXPECT_EQ(read_file(path), "new");
    EXPECT_EQ(names(), (std::vector<std::string>{"a.bin", "a.bin.part0"}));
    busy.commit();
    EXPECT_EQ(read_file(path), "busy");
    EXPECT_EQ(names(), std::vector<std::string>{"a.bin"});
    // No temporary of ours: a link, and a file with another name.
    std::ofstream(folder_ / "mine") << "mine";
    std::filesystem::create_symlink(folder_ / "mine", folder_ / "a.bin.part0");
    std::filesystem::create_hard_link(folder_ / "mine", folder_ / "a.bin.part1");
    output_file out(path);
    out.commit();
    EXPECT_EQ(read_file(folder_ / "mine"), "mine");
    EXPECT_EQ(names(), (std::vector<std::string>{"a.bin", "a.bin.part0", "a.bin.part1", "mine"}));
}

// A process that is killed gives its temporary back, however much it has written.
TEST_F(OutputFile, AKilledProcessLeavesNoLock) {
    const auto path = folder_ / "a.bin";
    const pid_t child = fork();
    if (child == 0) {
        output_file out(path);
        out.write("half");
        kill(getpid(), SIGKILL);
    }
    int status = 0;
    waitpid(child, &status, 0);
    ASSERT_EQ(names(), std::vector<std::string>{"a.bin.part0"});
    output_file out(path);
    out.write("x");
    out.commit();
    EXPECT_EQ(read_file(path), "x");
    EXPECT_EQ(names(), std::vector<std::string>{"a.bin"});
}

TEST_F(OutputFile, ASymbolicLinkStaysOne) {
    const auto real = folder_ / "real.bin", link = folder_ / "link.bin";
    std::ofstream(real) << "old";
    std::filesystem::create_symlink(real, link);
    output_file out(link);
    out.write("new");
    out.commit();
    EXPECT_TRUE(std::filesystem::is_symlink(link));
    EXPECT_EQ(read_file(real), "new");
}

TEST_F(OutputFile, SaysWhyItCannotOpen) {
    const std::string missing = message_of([&] { output_file out(folder_ / "no" / "such" / "a.bin"); });
    EXPECT_NE(missing.find("a.bin"), std::string::npos) << missing;
    EXPECT_NE(missing.find("No such file or directory"), std::string::npos) << missing;
    EXPECT_EQ(missing.find('\n'), std::string::npos);
    const std::string directory = message_of([&] { output_file out(folder_); });
    EXPECT_NE(directory.find("Is a directory"), std::string::npos) << directory;
}

#ifdef __linux__
// /dev/full is a device on which every write fails as on a full disk.
TEST_F(OutputFile, EveryWriterReportsAFullDisk) {
    volume v = make_colored({40, 30, 20}), occupied = v;
    occupied.channels.resize(1); // all that slices hold
    for (const format& f : formats()) {
        if (f.extension == ".zarr") continue; // a folder: zarr_test.cpp
        const auto link = folder_ / ("full" + std::string(f.extension));
        std::vector<std::filesystem::path> links{link};
        if (f.extension == ".npy" || f.has_space) // one file for each channel
            links = {folder_ / ("full.occupancy" + std::string(f.extension)),
                     folder_ / ("full.color" + std::string(f.extension))};
        if (f.has_layers) links = {folder_ / "full0000.png"};
        for (const auto& each : links) std::filesystem::create_symlink("/dev/full", each);
        write_options options;
        options.preview.width = options.preview.height = 64;
        const std::string message = message_of([&] { write(f.has_layers ? occupied : v, link, options); });
        EXPECT_NE(message.find("No space left on device"), std::string::npos) << f.extension << ": " << message;
        EXPECT_EQ(message.find('\n'), std::string::npos);
        for (const auto& each : links) EXPECT_TRUE(std::filesystem::is_symlink(each)) << each;
    }
    for (const std::string& name : names()) EXPECT_EQ(name.find(".part"), std::string::npos) << name;
}
#endif

TEST_F(OutputFile, OneFailingChannelLeavesNone) {
    volume v = make_colored({8, 8, 8});
    std::filesystem::create_directory(folder_ / "out.color.npy"); // cannot be written over
    EXPECT_THROW(write(v, folder_ / "out.npy"), write_error);
    EXPECT_EQ(names(), std::vector<std::string>{"out.color.npy"});
}

TEST_F(OutputFile, RefusesWhatItCannotWrite) {
    volume v = make_volume({4, 4, 4});
    v.add("count", scalar::u32);
    const auto message = [&](const char* name) { return message_of([&] { write(v, folder_ / name); }); };
    EXPECT_NE(message("a.abc").find(".npy, .npz, .vox, .schem, .litematic, .binvox, .vti, .pvti, .nrrd, .nii, .nii.gz, "
                                    ".zarr, .glb, .obj, .ply, "
                                    ".stl, .3mf, .xyz, .vtu, .inp, .msh, .png"),
              std::string::npos);
    EXPECT_NE(message("noextension").find("extension"), std::string::npos);
    for (const char* name : {"a.vox", "a.schem", "a.binvox", "a.glb", "a.obj", "a.ply", "a.stl", "a.xyz", "a.png"})
        EXPECT_NE(message(name).find("needs the occupancy"), std::string::npos) << name;
    EXPECT_EQ(message("a.NPY"), "no error"); // either case will do
    v.channels.clear();
    EXPECT_NE(message("a.npy").find("no channel"), std::string::npos);
    v = make_occupancy({4, 4, 4});
    v.extent[0] = 5000;
    EXPECT_THROW(write(v, folder_ / "b.npy"), std::invalid_argument);
    EXPECT_EQ(names(), std::vector<std::string>{"a.NPY"});
}

TEST_F(OutputFile, ProgressRunsToOne) {
    const volume v = make_colored({64, 64, 64});
    volume occupied = v;
    occupied.channels.resize(1); // all that slices hold
    for (const format& f : formats()) {
        std::vector<double> seen;
        write_options options;
        options.preview.width = options.preview.height = 100;
        options.threads = 2;
        options.progress = [&](double p) { seen.push_back(p); };
        write(f.has_layers ? occupied : v, folder_ / ("out" + std::string(f.extension)), options);
        ASSERT_FALSE(seen.empty()) << f.extension;
        EXPECT_DOUBLE_EQ(seen.back(), 1.0) << f.extension;
        EXPECT_TRUE(std::is_sorted(seen.begin(), seen.end())) << f.extension;
        EXPECT_LE(seen.size(), 250u) << f.extension;
    }
}
