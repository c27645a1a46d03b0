// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "test_volumes.hpp"
#include "write/formats/dense_stream.hpp"
#include "write/formats/formats.hpp"
#include "write/sparse_formats.hpp"

#include <zlib.h>

#include <fstream>

using namespace voxelize;
using namespace voxelize::testing;

namespace {

class Vti : public in_folder {};
class Nrrd : public in_folder {};
class Nifti : public in_folder {};

std::string stream_of(const volume& v, const channel& c) {
    std::string all;
    stream_values(v, c, half_floats::widen, [&](std::span<const std::byte> piece) {
        all.append(reinterpret_cast<const char*>(piece.data()), piece.size());
    });
    return all;
}

// A volume with a channel of every type, and voxels that are no cubes.
volume make_all_types() {
    volume v = make_volume({37, 11, 6});
    v.voxel_size = {0.1, 0.25, 3};
    v.add("occupancy", scalar::bit);
    for (int type = 1; type < 10; ++type) {
        const auto t = static_cast<scalar>(type);
        v.add(std::string(name_of(t)), t, 1 + type % 4);
    }
    for (std::size_t n = 0; n < v.channels.size(); ++n) fill(v, n);
    return v;
}

std::string inflate_all(const std::string& packed, int window) {
    z_stream z{};
    EXPECT_EQ(inflateInit2(&z, window), Z_OK);
    std::string out, buffer(1 << 16, '\0');
    z.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(packed.data()));
    z.avail_in = static_cast<uInt>(packed.size());
    int code = Z_OK;
    while (code == Z_OK) {
        z.next_out = reinterpret_cast<Bytef*>(buffer.data());
        z.avail_out = static_cast<uInt>(buffer.size());
        code = inflate(&z, Z_NO_FLUSH);
        out.append(buffer, 0, buffer.size() - z.avail_out);
    }
    EXPECT_EQ(code, Z_STREAM_END);
    EXPECT_EQ(z.avail_in, 0u) << "bytes after the stream";
    inflateEnd(&z);
    return out;
}

// Value of an XML attribute after a position.
std::string attribute(const std::string& xml, std::size_t from, const std::string& name) {
    std::string opening = " ";
    opening.append(name).append("=\"");
    const std::size_t begin = xml.find(opening, from);
    if (begin == std::string::npos) return "(none)";
    const std::size_t value = begin + opening.size();
    return xml.substr(value, xml.find('"', value) - value);
}

// The bytes of the array whose DataArray element starts at a position of the file.
std::string array_bytes(const std::string& file, std::size_t element) {
    const std::size_t data = file.find("<AppendedData encoding=\"raw\">");
    const std::size_t base = file.find('_', data) + 1;
    std::size_t at = base + std::stoull(attribute(file, element, "offset"));
    if (attribute(file, 0, "compressor") == "(none)") {
        const auto length = read_value<std::uint64_t>(file, at);
        return file.substr(at + 8, length);
    }
    EXPECT_EQ(attribute(file, 0, "compressor"), "vtkZLibDataCompressor");
    const auto blocks = read_value<std::uint64_t>(file, at);
    const auto block = read_value<std::uint64_t>(file, at + 8);
    const auto last = read_value<std::uint64_t>(file, at + 16);
    std::size_t from = at + 24 + 8 * blocks;
    std::string all;
    for (std::uint64_t b = 0; b < blocks; ++b) {
        const auto packed = read_value<std::uint64_t>(file, at + 24 + 8 * b);
        const std::string part = inflate_all(file.substr(from, packed), 15);
        EXPECT_EQ(part.size(), b + 1 == blocks && last != 0 ? last : block);
        all += part;
        from += packed;
    }
    return all;
}

// The numbers of a header by their places in it, as nifti1.h has them.
TEST_F(Nifti, HeaderSaysWhereTheVoxelsAre) {
    volume v = make_volume({8, 4, 2});
    v.voxel_size = {0.5, 0.25, 2};
    v.add("fraction", scalar::f32);
    fill(v, 0);
    for (const patient_axes axes : {patient_axes::lps, patient_axes::ras}) {
        write_options options;
        options.space = axes;
        write(v, folder_ / "a.nii", options);
        const std::string file = read_file(folder_ / "a.nii");
        const auto floats = [&](std::size_t at, std::size_t count) {
            std::vector<float> values;
            for (std::size_t n = 0; n < count; ++n) values.push_back(read_value<float>(file, at + 4 * n));
            return values;
        };
        EXPECT_EQ(read_value<std::int32_t>(file, 0), 348);
        const std::array<std::int16_t, 8> dim{3, 8, 4, 2, 1, 1, 1, 1};
        for (std::size_t n = 0; n < dim.size(); ++n) EXPECT_EQ(read_value<std::int16_t>(file, 40 + 2 * n), dim[n]);
        EXPECT_EQ(read_value<std::int16_t>(file, 70), 16); // of single precision
        EXPECT_EQ(read_value<std::int16_t>(file, 72), 32);
        EXPECT_EQ(floats(76, 4), (std::vector<float>{1, 0.5F, 0.25F, 2}));
        EXPECT_EQ(floats(108, 3), (std::vector<float>{352, 1, 0}));
        const float sign = axes == patient_axes::lps ? -1.0F : 1.0F;
        const float x = sign * -1.25F, y = sign * 0.375F;
        EXPECT_EQ(floats(256, 6), (std::vector<float>{0, 0, sign < 0 ? 1.0F : 0.0F, x, y, 11}));
        EXPECT_EQ(floats(280, 12), (std::vector<float>{sign * 0.5F, 0, 0, x, 0, sign * 0.25F, 0, y, 0, 0, 2, 11}));
        EXPECT_EQ(file.substr(328, 9), std::string("fraction\0", 9));
        EXPECT_EQ(file.substr(344, 8), std::string("n+1\0\0\0\0\0", 8));
        EXPECT_TRUE(file.substr(352) == stream_of(v, v.channels[0]));
    }
}

// Components that are no colours are volumes one behind the other.
TEST_F(Nifti, HoldsEveryTypeOneFileEach) {
    const volume v = make_all_types();
    const std::array<std::int16_t, 10> types{2, 2, 512, 768, 1280, 8, 1024, 16, 16, 64};
    for (const std::string extension : {".nii", ".nii.gz"})
        for (const int compression : {0, 6}) {
            write_options options;
            options.compression = compression;
            const auto files = write(v, folder_ / ("A" + extension), options);
            ASSERT_EQ(files.size(), v.channels.size());
            for (std::size_t n = 0; n < files.size(); ++n) {
                const channel& c = v.channels[n];
                EXPECT_EQ(files[n], folder_ / ("A." + c.name + extension));
                std::string file = read_file(files[n]);
                if (extension == ".nii.gz") file = inflate_all(file, 15 + 16);
                EXPECT_EQ(read_value<std::int16_t>(file, 70), types[static_cast<std::size_t>(c.type)]) << c.name;
                EXPECT_EQ(read_value<std::int16_t>(file, 40), c.components == 1 ? 3 : 5);
                EXPECT_EQ(read_value<std::int16_t>(file, 50), c.components);
                const std::string together = stream_of(v, c);
                const std::size_t each = together.size() / static_cast<std::size_t>(v.num_voxels() * c.components);
                std::string apart;
                for (int m = 0; m < c.components; ++m)
                    for (std::size_t at = static_cast<std::size_t>(m) * each; at < together.size();
                         at += each * static_cast<std::size_t>(c.components))
                        apart += together.substr(at, each);
                EXPECT_TRUE(file.substr(352) == apart) << c.name;
            }
        }
}

TEST_F(Nifti, ColoursAreRgbaOfEachVoxel) {
    volume v = make_volume({5, 4, 3});
    for (int components = 3; components <= 4; ++components) {
        v.channels.clear();
        v.add("color", scalar::u8, components);
        fill(v, 0);
        write(v, folder_ / "a.nii");
        const std::string file = read_file(folder_ / "a.nii");
        EXPECT_EQ(read_value<std::int16_t>(file, 40), 3);
        EXPECT_EQ(read_value<std::int16_t>(file, 70), components == 3 ? 128 : 2304);
        EXPECT_EQ(read_value<std::int16_t>(file, 72), 8 * components);
        EXPECT_TRUE(file.substr(352) == stream_of(v, v.channels[0]));
    }
}

TEST_F(Nifti, TellsWhereItsNumbersEnd) {
    volume v = make_volume({32768, 1, 1});
    v.add("occupancy", scalar::bit);
    EXPECT_THROW(write(v, folder_ / "a.nii.gz"), write_error);
    EXPECT_EQ(names(), std::vector<std::string>{});
    std::vector<std::string> warnings;
    write_options options;
    options.warn = [&](const std::string& warning) { warnings.push_back(warning); };
    v = make_occupancy({32767, 1, 1});
    write(v, folder_ / "a.nii", options);
    EXPECT_EQ(warnings, std::vector<std::string>{});
    v.origin[0] = 4'700'000.125; // whose first centre is 1.5 voxels from the nearest float
    write(v, folder_ / "a.nii", options);
    ASSERT_EQ(warnings.size(), 1u);
    EXPECT_NE(warnings[0].find("which move voxels by up to 1.5"), std::string::npos) << warnings[0];
}

} // namespace

TEST_F(Vti, HoldsEveryChannelAsCellData) {
    const volume v = make_all_types();
    for (const int compression : {0, 1}) {
        write_options options;
        options.compression = compression;
        EXPECT_EQ(write(v, folder_ / "a.vti", options), std::vector{folder_ / "a.vti"});
        const std::string file = read_file(folder_ / "a.vti");
        EXPECT_EQ(attribute(file, 0, "type"), "ImageData");
        EXPECT_EQ(attribute(file, 0, "byte_order"), "LittleEndian");
        EXPECT_EQ(attribute(file, 0, "header_type"), "UInt64");
        EXPECT_EQ(attribute(file, 0, "WholeExtent"), "0 37 0 11 0 6");
        EXPECT_EQ(attribute(file, 0, "Origin"), "-1.5 0.25 10");
        EXPECT_EQ(attribute(file, 0, "Spacing"), "0.1 0.25 3");
        EXPECT_LT(file.find("<CellData"), file.find("<DataArray"));
        const std::array<std::string, 10> types{"UInt8", "UInt8", "UInt16",  "UInt32",  "UInt64",
                                                "Int32", "Int64", "Float32", "Float32", "Float64"};
        for (const channel& c : v.channels) {
            const std::size_t name = file.find(std::string("Name=\"").append(c.name).append("\""));
            ASSERT_NE(name, std::string::npos) << c.name;
            const std::size_t element = file.rfind("<DataArray", name);
            EXPECT_EQ(attribute(file, element, "type"), types[static_cast<std::size_t>(c.type)]);
            EXPECT_EQ(attribute(file, element, "NumberOfComponents"), std::to_string(c.components));
            EXPECT_EQ(attribute(file, element, "format"), "appended");
            EXPECT_TRUE(array_bytes(file, element) == stream_of(v, c)) << c.name << ", compression " << compression;
        }
        EXPECT_EQ(file.substr(file.size() - 11), "</VTKFile>\n");
    }
}

TEST_F(Vti, BlocksEndWhereTheArrayEnds) {
    // One block exactly, one byte more, and several with a short last one.
    for (const std::int64_t nx : {std::int64_t{1} << 20, (std::int64_t{1} << 20) + 1, 5 * (std::int64_t{1} << 19)}) {
        volume v = make_volume({nx, 1, 1});
        v.add("a", scalar::u8);
        fill(v, 0);
        write(v, folder_ / "a.vti");
        const std::string file = read_file(folder_ / "a.vti");
        EXPECT_TRUE(array_bytes(file, file.find("<DataArray")) == stream_of(v, v.channels[0])) << nx;
    }
}

TEST_F(Vti, APieceHoldsTheLayersOfItsSlab) {
    const volume v = make_all_types();
    write_options options;
    options.pieces = 4;
    const auto written = write(v, folder_ / "a.pvti", options);
    EXPECT_EQ(written,
              (std::vector<std::filesystem::path>{folder_ / "a.1.vti", folder_ / "a.2.vti", folder_ / "a.3.vti",
                                                  folder_ / "a.4.vti", folder_ / "a.pvti"}));
    EXPECT_NE(read_file(folder_ / "a.pvti").find("<Piece Extent=\"0 37 0 11 1 3\" Source=\"a.2.vti\"/>"),
              std::string::npos);
    EXPECT_NE(read_file(folder_ / "a.2.vti").find("WholeExtent=\"0 37 0 11 1 3\""), std::string::npos);
    // From bricks, of which a piece has at most so many bytes.
    const volume colored = make_colored({40, 30, 20});
    options.pieces = 0;
    options.piece_bytes = 40 * 30 * 5 * 7;
    const auto pieces = write_sparse(make_sparse(colored, 1), folder_ / "b.pvti", options);
    EXPECT_EQ(pieces.size(), 4u); // of three pieces, and of one file that names them
}

// A new file takes away the pieces of the old one that it does not name, and no other files.
TEST_F(Vti, PiecesOfTheFileBeforeDoNotStay) {
    const volume v = make_all_types();
    std::ofstream(folder_ / "a.4.vti") << "not named by any .pvti";
    write_options options;
    options.pieces = 3;
    write(v, folder_ / "a.pvti", options);
    options.pieces = 1;
    write(v, folder_ / "a.pvti", options);
    EXPECT_EQ(names(), (std::vector<std::string>{"a.1.vti", "a.4.vti", "a.pvti"}));
}

TEST_F(Vti, AFullDiskLeavesNoPiece) {
    const volume v = make_colored({64, 64, 64});
    write_options options;
    options.compression = 0;
    options.pieces = 3; // 21, 21 and 22 layers of 20,480 bytes
    expect_full_disk(435'000, [&] { write(v, folder_ / "a.pvti", options); });
    EXPECT_EQ(names(), std::vector<std::string>{});
}

TEST_F(Nrrd, HeaderSaysWhereTheVoxelsAre) {
    volume v = make_volume({8, 4, 2});
    v.voxel_size = {0.5, 0.25, 2};
    v.add("color", scalar::u8, 4);
    fill(v, 0);
    write_options options;
    options.compression = 0;
    write(v, folder_ / "a.nrrd", options);
    const std::string file = read_file(folder_ / "a.nrrd");
    const std::size_t end = file.find("\n\n");
    ASSERT_NE(end, std::string::npos);
    const std::string header = std::string("\n").append(file, 0, end + 1);
    EXPECT_EQ(header.substr(0, 10), "\nNRRD0004\n");
    for (const char* line :
         {"type: uint8", "dimension: 4", "space: left-posterior-superior", "sizes: 4 8 4 2",
          "space directions: none (0.5,0,0) (0,0.25,0) (0,0,2)", "centerings: none cell cell cell",
          "kinds: RGBA-color domain domain domain", "encoding: raw", "space origin: (-1.25,0.375,11)"})
        EXPECT_NE(header.find(std::string("\n").append(line).append("\n")), std::string::npos) << line << "\n"
                                                                                               << header;
    EXPECT_EQ(header.find("endian"), std::string::npos);          // bytes have no order
    EXPECT_EQ(header.find("space dimension"), std::string::npos); // the name of a space has it
    EXPECT_TRUE(file.substr(end + 2) == stream_of(v, v.channels[0]));
    options.space = patient_axes::ras; // the same numbers in another space
    write(v, folder_ / "a.nrrd", options);
    const std::string name = "left-posterior", named = read_file(folder_ / "a.nrrd");
    EXPECT_EQ(named, std::string(file).replace(file.find(name), name.size(), "right-anterior"));
}

TEST_F(Nrrd, HoldsEveryTypeOneFileEach) {
    const volume v = make_all_types();
    const std::array<std::string, 10> types{"uint8", "uint8", "uint16", "uint32", "uint64",
                                            "int32", "int64", "float",  "float",  "double"};
    for (const int compression : {0, 6}) {
        write_options options;
        options.compression = compression;
        const auto files = write(v, folder_ / "a.nrrd", options);
        ASSERT_EQ(files.size(), v.channels.size());
        for (std::size_t n = 0; n < files.size(); ++n) {
            const channel& c = v.channels[n];
            EXPECT_EQ(files[n], folder_ / ("a." + c.name + ".nrrd"));
            const std::string file = read_file(files[n]);
            const std::size_t end = file.find("\n\n");
            const std::string header = file.substr(0, end + 1);
            EXPECT_NE(header.find(std::string("\ntype: ").append(types[static_cast<std::size_t>(c.type)]).append("\n")),
                      std::string::npos);
            EXPECT_NE(header.find(compression == 0 ? "encoding: raw" : "encoding: gzip"), std::string::npos);
            EXPECT_EQ(header.find("endian: little") != std::string::npos,
                      c.type != scalar::bit && c.type != scalar::u8);
            std::string values = file.substr(end + 2);
            if (compression != 0) values = inflate_all(values, 15 + 16);
            EXPECT_TRUE(values == stream_of(v, c)) << c.name;
        }
    }
}
