// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "../../test_scale.hpp"
#include "test_volumes.hpp"
#include "write/formats/formats.hpp"
#include "write/formats/palette.hpp"

#include <map>
#include <set>
#include <sstream>

using namespace voxelize;
using namespace voxelize::testing;

namespace {

class Vox : public in_folder {};

using point = std::array<std::int64_t, 3>;

// A .vox file as its published description reads it: chunks of id, content size, children size.
struct vox_file {
    int version = 0;
    struct model {
        point size{};
        std::vector<std::array<std::uint8_t, 4>> voxels;
    };
    std::vector<model> models;
    std::vector<rgb8> palette;                       // palette[n] belongs to index n + 1
    std::map<int, std::pair<int, point>> transforms; // node -> child, translation
    std::map<int, std::vector<int>> groups;
    std::map<int, int> shapes; // node -> model

    // Voxel -> colour index, with every model where the scene graph puts it.
    [[nodiscard]] std::map<point, int> voxels() const {
        std::map<point, int> all;
        const auto add = [&](const model& m, const point& low) {
            for (const auto& v : m.voxels) {
                const point at{low[0] + v[0], low[1] + v[1], low[2] + v[2]};
                for (std::size_t a = 0; a < 3; ++a) EXPECT_LT(v[a], m.size[a]);
                EXPECT_TRUE(all.emplace(at, v[3]).second) << "two models hold one voxel";
            }
        };
        if (transforms.empty()) {
            EXPECT_EQ(models.size(), 1u);
            add(models.at(0), {0, 0, 0});
            return all;
        }
        std::set<int> used;
        for (const int child : groups.at(transforms.at(0).first)) {
            const auto& [shape, at] = transforms.at(child);
            const int id = shapes.at(shape);
            EXPECT_TRUE(used.insert(id).second);
            const model& m = models.at(static_cast<std::size_t>(id));
            add(m, {at[0] - m.size[0] / 2, at[1] - m.size[1] / 2, at[2] - m.size[2] / 2});
        }
        EXPECT_EQ(used.size(), models.size());
        return all;
    }
};

class vox_parser {
public:
    explicit vox_parser(const std::string& bytes) : bytes_(bytes) {}

    vox_file parse() {
        EXPECT_EQ(bytes_.substr(0, 4), "VOX ");
        file_.version = read_value<std::int32_t>(bytes_, 4);
        EXPECT_EQ(bytes_.substr(8, 4), "MAIN");
        EXPECT_EQ(read_value<std::int32_t>(bytes_, 12), 0);
        EXPECT_EQ(static_cast<std::size_t>(read_value<std::int32_t>(bytes_, 16)), bytes_.size() - 20);
        for (std::size_t at = 20; at < bytes_.size();) {
            const std::string id = bytes_.substr(at, 4);
            const auto size = static_cast<std::size_t>(read_value<std::int32_t>(bytes_, at + 4));
            EXPECT_EQ(read_value<std::int32_t>(bytes_, at + 8), 0);
            at_ = at + 12;
            chunk(id);
            EXPECT_EQ(at_, at + 12 + size) << id;
            at += 12 + size;
        }
        return file_;
    }

private:
    int integer() {
        at_ += 4;
        return read_value<std::int32_t>(bytes_, at_ - 4);
    }
    std::string text() {
        const auto size = static_cast<std::size_t>(integer());
        at_ += size;
        return bytes_.substr(at_ - size, size);
    }
    std::map<std::string, std::string> dictionary() {
        std::map<std::string, std::string> out;
        for (int n = integer(); n > 0; --n) {
            const std::string key = text();
            out[key] = text();
        }
        return out;
    }
    void chunk(const std::string& id) {
        if (id == "SIZE") {
            file_.models.push_back({{integer(), integer(), integer()}, {}});
            for (const std::int64_t s : file_.models.back().size) EXPECT_TRUE(s >= 1 && s <= 256);
        } else if (id == "XYZI") {
            const int count = integer();
            for (int n = 0; n < count; ++n, at_ += 4)
                file_.models.back().voxels.push_back(read_value<std::array<std::uint8_t, 4>>(bytes_, at_));
        } else if (id == "RGBA") {
            for (int n = 0; n < 256; ++n, at_ += 4) {
                const auto c = read_value<std::array<std::uint8_t, 4>>(bytes_, at_);
                file_.palette.push_back({c[0], c[1], c[2]});
            }
        } else if (id == "nTRN") {
            const int node = integer();
            dictionary();
            const int child = integer();
            EXPECT_EQ(integer(), -1);
            integer();
            EXPECT_EQ(integer(), 1);
            auto frame = dictionary();
            std::istringstream in(frame.contains("_t") ? frame["_t"] : "0 0 0");
            point at{};
            in >> at[0] >> at[1] >> at[2];
            EXPECT_FALSE(frame.contains("_r"));
            file_.transforms[node] = {child, at};
        } else if (id == "nGRP") {
            const int node = integer();
            dictionary();
            for (int n = integer(); n > 0; --n) file_.groups[node].push_back(integer());
        } else if (id == "nSHP") {
            const int node = integer();
            dictionary();
            EXPECT_EQ(integer(), 1);
            file_.shapes[node] = integer();
            dictionary();
        } else {
            ADD_FAILURE() << "unexpected chunk " << id;
        }
    }

    const std::string& bytes_;
    std::size_t at_ = 0;
    vox_file file_;
};

vox_file load(const std::filesystem::path& path) {
    const std::string bytes = read_file(path);
    return vox_parser(bytes).parse();
}

// The position in the file of a voxel of the volume.
point expected_place(const volume& v, up_axis up, const point& p) {
    return up == up_axis::y ? point{p[0], v.extent[2] - 1 - p[2], p[1]} : p;
}

rgb8 color_of(const volume& v, const point& p) {
    const std::byte* at = v.find("color")->data.data() + 4 * v.index(p[0], p[1], p[2]);
    return {std::to_integer<std::uint8_t>(at[0]), std::to_integer<std::uint8_t>(at[1]),
            std::to_integer<std::uint8_t>(at[2])};
}

// Compares every voxel of file and volume, up to one shift for all.
void expect_same_voxels(const volume& v, const vox_file& file, up_axis up, const point& shift,
                        const std::function<void(const point&, int)>& each) {
    std::map<point, int> got = file.voxels();
    EXPECT_EQ(static_cast<std::int64_t>(got.size()), v.popcount());
    for (std::int64_t k = 0; k < v.extent[2]; ++k)
        for (std::int64_t j = 0; j < v.extent[1]; ++j)
            for (std::int64_t i = 0; i < v.extent[0]; ++i) {
                if (!v.occupied(i, j, k)) continue;
                const point p = expected_place(v, up, {i, j, k});
                const auto found = got.find({p[0] + shift[0], p[1] + shift[1], p[2] + shift[2]});
                ASSERT_NE(found, got.end()) << i << " " << j << " " << k;
                each({i, j, k}, found->second);
            }
}

// Few enough colours that the palette is exact.
void reduce_colors(volume& v) {
    channel& c = *v.find("color");
    for (std::size_t n = 0; n < c.data.size(); ++n)
        c.data[n] = static_cast<std::byte>(std::to_integer<unsigned>(c.data[n]) % 6 * 51);
}

} // namespace

TEST_F(Vox, OneModelHoldsEveryVoxelAndItsColor) {
    for (const up_axis up : {up_axis::y, up_axis::z})
        for (const auto& extent : {point{37, 20, 11}, point{1, 1, 1}, point{256, 3, 256}, point{5, 256, 33}}) {
            volume v = make_colored(extent, extent[0] == 1 ? 1 : 5);
            reduce_colors(v);
            write_options options;
            options.up = up;
            write(v, folder_ / "a.vox", options);
            const vox_file file = load(folder_ / "a.vox");
            EXPECT_EQ(file.version, 150);
            EXPECT_TRUE(file.transforms.empty());
            const point size = up == up_axis::y ? point{extent[0], extent[2], extent[1]} : extent;
            EXPECT_EQ(file.models.at(0).size, size);
            expect_same_voxels(v, file, up, {0, 0, 0}, [&](const point& p, int index) {
                ASSERT_GE(index, 1);
                ASSERT_EQ(file.palette.at(static_cast<std::size_t>(index) - 1), color_of(v, p));
            });
        }
}

TEST_F(Vox, LargeGridsAreSplitAndPutTogether) {
    // 17 million voxels are split along all axes at once, but in a slow build.
    const point large = tests::is_slow_build() ? point{257, 5, 259} : point{257, 258, 259};
    for (const up_axis up : {up_axis::y, up_axis::z})
        for (const auto& extent : {point{300, 20, 7}, large, point{20, 600, 3}, point{3, 4, 513}}) {
            volume v = make_colored(extent, 97);
            reduce_colors(v);
            write_options options;
            options.up = up;
            write(v, folder_ / "a.vox", options);
            const vox_file file = load(folder_ / "a.vox");
            EXPECT_EQ(file.version, 200);
            // The middle of the ground plan stands on the origin, the lowest layer on the ground.
            const point size = up == up_axis::y ? point{extent[0], extent[2], extent[1]} : extent;
            expect_same_voxels(v, file, up, {-(size[0] / 2), -(size[1] / 2), 0}, [&](const point& p, int index) {
                ASSERT_EQ(file.palette.at(static_cast<std::size_t>(index) - 1), color_of(v, p));
            });
        }
}

TEST_F(Vox, EmptyBlocksAreLeftOut) {
    volume v = make_volume({700, 700, 20});
    channel& bits = v.add("occupancy", scalar::bit);
    v.set_bit(bits, 0, 0, 0);
    v.set_bit(bits, 699, 699, 19);
    write(v, folder_ / "a.vox");
    const vox_file file = load(folder_ / "a.vox");
    EXPECT_EQ(file.models.size(), 2u);
    expect_same_voxels(v, file, up_axis::y, {-350, -10, 0}, [](const point&, int index) { EXPECT_EQ(index, 1); });
}

TEST_F(Vox, NoVoxelsGiveOneEmptyModel) {
    for (const std::int64_t n : {5, 400}) {
        volume v = make_volume({n, 4, 3});
        v.add("occupancy", scalar::bit);
        write(v, folder_ / "a.vox");
        const vox_file file = load(folder_ / "a.vox");
        EXPECT_EQ(file.models.size(), 1u);
        EXPECT_TRUE(file.voxels().empty());
    }
}

TEST_F(Vox, WithoutColorsEverythingIsClay) {
    const volume v = make_occupancy({12, 13, 14});
    write(v, folder_ / "a.vox");
    const vox_file file = load(folder_ / "a.vox");
    expect_same_voxels(v, file, up_axis::y, {0, 0, 0}, [](const point&, int index) { EXPECT_EQ(index, 1); });
    EXPECT_EQ(file.palette[0], clay);
}

TEST_F(Vox, ManyColorsBecome255NearOnes) {
    const volume v = make_colored({64, 64, 64}, 2); // random colours: the worst case
    write(v, folder_ / "a.vox");
    const vox_file file = load(folder_ / "a.vox");
    double squares = 0;
    std::int64_t count = 0;
    expect_same_voxels(v, file, up_axis::y, {0, 0, 0}, [&](const point& p, int index) {
        ASSERT_TRUE(index >= 1 && index <= 255);
        const rgb8 want = color_of(v, p), got = file.palette[static_cast<std::size_t>(index) - 1];
        for (std::size_t a = 0; a < 3; ++a) squares += (want[a] - got[a]) * (want[a] - got[a]);
        ++count;
    });
    // 255 equal cubes would leave 3 * 40.3^2 / 12 = 406 of squared distance; median cut comes close to that.
    EXPECT_LT(squares / static_cast<double>(count), 520);
}

TEST_F(Vox, RefusesWhatPassesTwoGigabytes) {
    volume v = make_volume({1024, 1024, 1024});
    channel& bits = v.add("occupancy", scalar::bit);
    std::fill(bits.data.begin(), bits.data.end(), std::byte{255});
    try {
        write(v, folder_ / "a.vox");
        FAIL();
    } catch (const write_error& e) {
        EXPECT_NE(std::string(e.what()).find("too large for .vox"), std::string::npos) << e.what();
    }
    EXPECT_TRUE(names().empty());
}

TEST(Palette, KeepsColorsThatFit) {
    std::vector<counted_color> colors;
    for (unsigned n = 0; n < 255; ++n)
        colors.push_back({{static_cast<std::uint8_t>(n * 7), static_cast<std::uint8_t>(n), 9}, n + 1});
    const palette p = make_palette(colors, 255);
    ASSERT_EQ(p.entries.size(), 255u);
    for (std::size_t n = 0; n < colors.size(); ++n) EXPECT_EQ(p.entries[p.entry_of[n]], colors[n].color);
}

TEST(Palette, EveryColorGetsItsNearestEntry) {
    std::vector<counted_color> colors;
    for (std::uint32_t n = 0; n < 3000; ++n) {
        const std::uint32_t h = pattern(n, 1, 2, 3, 0);
        colors.push_back(
            {{static_cast<std::uint8_t>(h), static_cast<std::uint8_t>(h >> 8), static_cast<std::uint8_t>(h >> 16)},
             1 + (h >> 28)});
    }
    const palette p = make_palette(colors, 64);
    EXPECT_LE(p.entries.size(), 64u);
    EXPECT_GT(p.entries.size(), 60u);
    for (std::size_t n = 0; n < colors.size(); ++n) {
        const auto distance = [&](const rgb8& e) {
            int sum = 0;
            for (std::size_t a = 0; a < 3; ++a) sum += (e[a] - colors[n].color[a]) * (e[a] - colors[n].color[a]);
            return sum;
        };
        int best = 1 << 30;
        for (const rgb8& e : p.entries) best = std::min(best, distance(e));
        ASSERT_EQ(distance(p.entries[p.entry_of[n]]), best) << n;
    }
}

TEST(Palette, FindsTheClusters) {
    std::vector<counted_color> colors;
    for (std::uint8_t n = 0; n < 10; ++n) {
        colors.push_back({{static_cast<std::uint8_t>(n), 0, 0}, 1});
        colors.push_back({{static_cast<std::uint8_t>(200 + n), 100, 0}, 1});
    }
    const palette p = make_palette(colors, 2);
    EXPECT_EQ(p.entries, (std::vector<rgb8>{{5, 0, 0}, {205, 100, 0}}));
    for (std::size_t n = 0; n < colors.size(); ++n) EXPECT_EQ(p.entry_of[n], n % 2);
    EXPECT_EQ(make_palette(colors, 1).entries.size(), 1u);
}

TEST(Palette, OfNothingIsEmpty) {
    const palette p = make_palette({}, 255);
    EXPECT_TRUE(p.entries.empty());
    EXPECT_TRUE(p.entry_of.empty());
}

// MagicaVoxel shows the coordinates -1000 to 999. The middle of x and y, and the lowest z, stand at 0.
TEST_F(Vox, ModelsBeyondTheSceneAreAWarning) {
    const auto warnings = [&](const point& extent) {
        volume v = make_volume(extent);
        channel& bits = v.add("occupancy", scalar::bit);
        v.set_bit(bits, 0, 0, 0);
        v.set_bit(bits, extent[0] - 1, extent[1] - 1, extent[2] - 1);
        std::vector<std::string> lines;
        write_options options;
        options.up = up_axis::z;
        options.warn = [&](const std::string& line) { lines.push_back(line); };
        write(v, folder_ / "a.vox", options);
        return lines;
    };
    EXPECT_TRUE(warnings({2000, 1, 1}).empty());
    EXPECT_TRUE(warnings({1, 2000, 1}).empty());
    EXPECT_TRUE(warnings({1, 1, 1000}).empty());
    EXPECT_EQ(1U, warnings({1, 2001, 1}).size());
    EXPECT_EQ(1U, warnings({1, 1, 1001}).size());
    EXPECT_EQ(std::vector<std::string>{"'" + (folder_ / "a.vox").string() +
                                       "': 1 of 2 models lie in part or whole beyond MagicaVoxel's scene, which has "
                                       "the coordinates -1000 to 999: they reach from (-1000, 0, 0) to (1000, 0, 0); "
                                       "take fewer voxels"},
              warnings({2001, 1, 1}));
}
