// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

// Zarr groups as folders: which files there are, and what a failed run leaves. Values are read back by other people's
// readers (read_back.py).

#include "test_volumes.hpp"
#include "write/formats/formats.hpp"
#include "write/sparse_formats.hpp"

using namespace voxelize;
using namespace voxelize::testing;

namespace {

namespace fs = std::filesystem;

class Zarr : public in_folder {
protected:
    // Files below the folder, by their names relative to it.
    [[nodiscard]] std::vector<std::string> files(const fs::path& in) const {
        std::vector<std::string> all;
        for (const auto& entry : fs::recursive_directory_iterator(in))
            if (entry.is_regular_file()) all.push_back(entry.path().lexically_relative(in).generic_string());
        std::sort(all.begin(), all.end());
        return all;
    }
};

} // namespace

TEST_F(Zarr, EmptyChunksHaveNoFileAndNoBytes) {
    volume v = make_volume({300, 70, 270}); // 2 x 1 x 2 shards
    v.add("count", scalar::u32);
    v.add("material", scalar::i32);
    channel& empty = *v.find("material");
    for (std::size_t at = 0; at < empty.data.size(); ++at) empty.data[at] = std::byte{0xff}; // -1: an empty voxel
    // One voxel in the first shard, one in the last.
    const std::uint32_t one = 1;
    channel& count = *v.find("count");
    for (const auto& [i, j, k] : {std::array{3, 65, 2}, std::array{299, 0, 269}})
        std::memcpy(count.data.data() + 4 * v.index(i, j, k), &one, 4);
    write_options options;
    options.compression = 0;
    const auto written = write(v, folder_ / "a.zarr", options);
    EXPECT_EQ(written, std::vector<fs::path>{folder_ / "a.zarr"});
    EXPECT_EQ(files(folder_ / "a.zarr"), (std::vector<std::string>{"count/c/0/0/0", "count/c/1/0/1", "count/zarr.json",
                                                                   "material/zarr.json", "zarr.json"}));
    // One chunk of 64^3, and the index of all chunks of the shard: 4 x 2 x 4 of 16 bytes, and a checksum.
    EXPECT_EQ(fs::file_size(folder_ / "a.zarr/count/c/0/0/0"), 64u * 64 * 64 * 4 + 32 * 16 + 4);
    EXPECT_NE(read_file(folder_ / "a.zarr/material/zarr.json").find("\"fill_value\": -1"), std::string::npos);
    options.compression = 9;
    write(v, folder_ / "a.zarr", options); // in place of the other
    EXPECT_LT(fs::file_size(folder_ / "a.zarr/count/c/0/0/0"), 3000u);
    EXPECT_EQ(names(), std::vector<std::string>{"a.zarr"});
    EXPECT_NE(read_file(folder_ / "a.zarr/count/zarr.json").find("\"gzip\""), std::string::npos);
    if (!has_zstd()) return;
    options.zstd = true;
    write(v, folder_ / "a.zarr", options);
    EXPECT_LT(fs::file_size(folder_ / "a.zarr/count/c/0/0/0"), 3000u);
    EXPECT_NE(read_file(folder_ / "a.zarr/count/zarr.json").find("\"zstd\""), std::string::npos);
}

TEST_F(Zarr, FilesDoNotDependOnThreads) {
    const volume v = make_colored({130, 70, 90});
    write_options options;
    options.threads = 1;
    write(v, folder_ / "one.zarr", options);
    options.threads = 3;
    write(v, folder_ / "three.zarr", options);
    const auto all = files(folder_ / "one.zarr");
    EXPECT_EQ(all, files(folder_ / "three.zarr"));
    for (const std::string& file : all)
        EXPECT_EQ(read_file(folder_ / "one.zarr" / file), read_file(folder_ / "three.zarr" / file)) << file;
}

TEST_F(Zarr, LevelsOfBricksAreThoseOfADenseGrid) {
    volume v = make_colored({200, 9, 70});
    channel& color = *v.find("color"); // a voxel that is not occupied has none
    for (std::int64_t at = 0; at < v.num_voxels(); ++at)
        if (!v.occupied(at % 200, at / 200 % 9, at / 1800)) std::memset(color.data.data() + 4 * at, 0, 4);
    write_options options;
    options.levels = true;
    options.threads = 1;
    write(v, folder_ / "dense.zarr", options);
    options.threads = 2;
    write_sparse(make_sparse(v, 1), folder_ / "bricks.zarr", options);
    const auto all = files(folder_ / "dense.zarr");
    EXPECT_EQ(all, (std::vector<std::string>{"color/0/c/0/0/0/0", "color/0/zarr.json", "color/1/c/0/0/0/0",
                                             "color/1/zarr.json", "color/2/c/0/0/0/0", "color/2/zarr.json",
                                             "color/zarr.json", "occupancy/0/c/0/0/0", "occupancy/0/zarr.json",
                                             "occupancy/1/c/0/0/0", "occupancy/1/zarr.json", "occupancy/2/c/0/0/0",
                                             "occupancy/2/zarr.json", "occupancy/zarr.json", "zarr.json"}));
    EXPECT_EQ(all, files(folder_ / "bricks.zarr"));
    for (const std::string& file : all)
        EXPECT_EQ(read_file(folder_ / "dense.zarr" / file), read_file(folder_ / "bricks.zarr" / file)) << file;
    v.add("temperature", scalar::f32);
    EXPECT_THROW(write(v, folder_ / "dense.zarr", options), write_error);
}

TEST_F(Zarr, ReplacesOnlyAGroup) {
    const volume v = make_occupancy({9, 8, 7});
    const auto message = [&](const fs::path& path) {
        try {
            write(v, path);
        } catch (const write_error& e) {
            return std::string(e.what());
        }
        return std::string("no error");
    };
    std::ofstream(folder_ / "file.zarr") << "mine";
    fs::create_directory(folder_ / "folder.zarr");
    std::ofstream(folder_ / "folder.zarr/mine.txt") << "mine";
    EXPECT_NE(message(folder_ / "file.zarr").find("no Zarr group"), std::string::npos);
    EXPECT_NE(message(folder_ / "folder.zarr").find("no Zarr group"), std::string::npos);
    // A group of another program, and one of ours that a reader wrote anew in its own style.
    fs::create_directory(folder_ / "other.zarr");
    std::ofstream(folder_ / "other.zarr/zarr.json") << R"({"zarr_format": 3, "node_type": "group", "attributes": {}})";
    EXPECT_NE(message(folder_ / "other.zarr").find("this program did not write it"), std::string::npos);
    EXPECT_EQ(files(folder_ / "other.zarr"), std::vector<std::string>{"zarr.json"});
    std::ofstream(folder_ / "other.zarr/zarr.json")
        << "{\n\"attributes\": {\n    \"voxelpipe\": {\"origin\": [0, 0, 0]}}, \"zarr_format\": 3}";
    EXPECT_EQ(message(folder_ / "other.zarr"), "no error");
    fs::remove_all(folder_ / "other.zarr");
    EXPECT_NE(message(folder_ / "nowhere/a.zarr").find("No such file"), std::string::npos);
    EXPECT_EQ(read_file(folder_ / "folder.zarr/mine.txt"), "mine");
    EXPECT_EQ(names(), (std::vector<std::string>{"file.zarr", "folder.zarr"}));
    // A link is followed and kept.
    fs::create_directory(folder_ / "elsewhere");
    EXPECT_EQ(message(folder_ / "elsewhere/b.zarr"), "no error");
    fs::create_directory_symlink(folder_ / "elsewhere/b.zarr", folder_ / "link.zarr");
    EXPECT_EQ(message(folder_ / "link.zarr"), "no error");
    EXPECT_TRUE(fs::is_symlink(folder_ / "link.zarr"));
}

TEST_F(Zarr, AFullDiskLeavesTheOldGroupAndNothingElse) {
    const volume small = make_occupancy({9, 8, 7}), large = make_colored({200, 200, 100});
    write(small, folder_ / "a.zarr");
    const auto before = files(folder_ / "a.zarr");
    expect_full_disk(100000, [&] { write(large, folder_ / "a.zarr"); });
    EXPECT_EQ(names(), std::vector<std::string>{"a.zarr"});
    EXPECT_EQ(files(folder_ / "a.zarr"), before);
}
