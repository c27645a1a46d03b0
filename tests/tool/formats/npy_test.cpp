// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "test_volumes.hpp"
#include "write/formats/dense_stream.hpp"
#include "write/formats/formats.hpp"
#include "write/formats/npy.hpp"

#include <minizip/unzip.h>

#include <cmath>

using namespace voxelize;
using namespace voxelize::testing;

namespace {

class Npy : public in_folder {};
class Npz : public in_folder {};

std::string stream_of(const volume& v, const channel& c, half_floats halves) {
    std::string all;
    stream_values(v, c, halves, [&](std::span<const std::byte> piece) {
        all.append(reinterpret_cast<const char*>(piece.data()), piece.size());
    });
    EXPECT_EQ(all.size(), streamed_bytes(v, c, halves));
    return all;
}

// The bytes of an occupancy, one voxel at a time.
std::string plain_bytes(const volume& v) {
    std::string all;
    for (std::int64_t k = 0; k < v.extent[2]; ++k)
        for (std::int64_t j = 0; j < v.extent[1]; ++j)
            for (std::int64_t i = 0; i < v.extent[0]; ++i) all.push_back(v.occupied(i, j, k) ? '\1' : '\0');
    return all;
}

} // namespace

TEST(DenseStream, ExpandsBitsOfEveryWidth) {
    for (std::int64_t nx = 1; nx <= 70; ++nx) {
        const volume v = make_occupancy({nx, 5, 3}, 2);
        ASSERT_EQ(stream_of(v, v.channels[0], half_floats::keep), plain_bytes(v)) << nx;
    }
}

TEST(DenseStream, ExpandsRowsLongerThanAPiece) {
    const volume v = make_occupancy({(1 << 20) + 77, 1, 3}, 3);
    EXPECT_EQ(stream_of(v, v.channels[0], half_floats::keep), plain_bytes(v));
}

TEST(DenseStream, WidensEveryHalfExactly) {
    volume v = make_volume({256, 16, 16});
    channel& c = v.add("h", scalar::f16);
    for (std::size_t h = 0; h < 65536; ++h) store(c.data.data() + 2 * h, static_cast<std::uint16_t>(h));
    const std::string floats = stream_of(v, c, half_floats::widen);
    for (std::size_t h = 0; h < 65536; ++h) {
        const auto got = read_value<float>(floats, 4 * h);
        const int exponent = static_cast<int>(h >> 10 & 31u), mantissa = static_cast<int>(h & 1023u);
        ASSERT_EQ(std::signbit(got), h >= 32768) << h;
        if (exponent == 31) {
            ASSERT_EQ(std::isnan(got), mantissa != 0) << h;
            ASSERT_EQ(std::isinf(got), mantissa == 0) << h;
            continue;
        }
        const double size = exponent == 0 ? std::ldexp(mantissa, -24) : std::ldexp(1024 + mantissa, exponent - 25);
        ASSERT_EQ(std::abs(static_cast<double>(got)), size) << h;
    }
    EXPECT_EQ(stream_of(v, c, half_floats::keep).size(), 2u * 65536);
}

TEST_F(Npy, HeaderIsVersionOneAndAligned) {
    volume v = make_volume({7, 5, 3});
    v.add("normal", scalar::f32, 3);
    const auto files = write(v, folder_ / "a.npy");
    ASSERT_EQ(files, std::vector{folder_ / "a.npy"});
    const std::string bytes = read_file(files[0]);
    EXPECT_EQ(bytes.substr(0, 8), std::string("\x93NUMPY\1\0", 8));
    const std::size_t length = read_value<std::uint16_t>(bytes, 8);
    EXPECT_EQ((10 + length) % 64, 0u);
    const std::string text = bytes.substr(10, length);
    EXPECT_EQ(text.substr(0, text.find('}') + 1), "{'descr': '<f4', 'fortran_order': False, 'shape': (3, 5, 7, 3), }");
    EXPECT_EQ(text.back(), '\n');
    EXPECT_EQ(text.find_first_not_of(' ', text.find('}') + 1), text.size() - 1);
    EXPECT_EQ(bytes.size(), 10 + length + v.channels[0].data.size());
}

TEST_F(Npy, BitsBecomeBytes) {
    const volume v = make_occupancy({45, 7, 3});
    write(v, folder_ / "a.npy");
    const std::string bytes = read_file(folder_ / "a.npy");
    const std::string header = npy_header(v, v.channels[0]);
    EXPECT_NE(header.find("'|u1'"), std::string::npos);
    EXPECT_NE(header.find("(3, 7, 45)"), std::string::npos);
    EXPECT_EQ(bytes, header + plain_bytes(v));
}

TEST_F(Npy, SeveralChannelsBecomeSeveralFiles) {
    const volume v = make_colored({6, 5, 4});
    const auto files = write(v, folder_ / "out.npy");
    EXPECT_EQ(files, (std::vector{folder_ / "out.occupancy.npy", folder_ / "out.color.npy"}));
    EXPECT_EQ(names(), (std::vector<std::string>{"out.color.npy", "out.occupancy.npy"}));
    EXPECT_EQ(read_file(files[1]).substr(npy_header(v, v.channels[1]).size()),
              std::string(reinterpret_cast<const char*>(v.channels[1].data.data()), v.channels[1].data.size()));
}

TEST_F(Npz, HoldsOneArrayForEachChannel) {
    volume v = make_colored({37, 20, 11});
    v.add("count", scalar::u32);
    fill(v, 2);
    for (const int compression : {0, 1, 9}) {
        write_options options;
        options.compression = compression;
        write(v, folder_ / "a.npz", options);
        const unzFile archive = unzOpen64((folder_ / "a.npz").c_str());
        ASSERT_NE(archive, nullptr);
        unz_global_info64 global{};
        ASSERT_EQ(unzGetGlobalInfo64(archive, &global), UNZ_OK);
        EXPECT_EQ(global.number_entry, v.channels.size());
        int code = unzGoToFirstFile(archive);
        for (const channel& c : v.channels) {
            ASSERT_EQ(code, UNZ_OK);
            unz_file_info64 info{};
            char name[64] = {};
            unzGetCurrentFileInfo64(archive, &info, name, sizeof name, nullptr, 0, nullptr, 0);
            EXPECT_EQ(std::string(name), c.name + ".npy");
            EXPECT_EQ(info.compression_method, compression == 0 ? 0u : 8u);
            const std::string expected = npy_header(v, c) + stream_of(v, c, half_floats::keep);
            ASSERT_EQ(info.uncompressed_size, expected.size());
            std::string got(expected.size(), '?');
            ASSERT_EQ(unzOpenCurrentFile(archive), UNZ_OK);
            EXPECT_EQ(unzReadCurrentFile(archive, got.data(), static_cast<unsigned>(got.size())),
                      static_cast<int>(got.size()));
            EXPECT_EQ(unzCloseCurrentFile(archive), UNZ_OK); // checks the CRC
            EXPECT_TRUE(got == expected) << c.name;
            code = unzGoToNextFile(archive);
        }
        EXPECT_EQ(code, UNZ_END_OF_LIST_OF_FILE);
        unzClose(archive);
    }
}

TEST_F(Npz, SameVolumeSameBytes) {
    const volume v = make_colored({33, 17, 9});
    write(v, folder_ / "a.npz");
    write(v, folder_ / "b.npz");
    EXPECT_TRUE(read_file(folder_ / "a.npz") == read_file(folder_ / "b.npz"));
}
