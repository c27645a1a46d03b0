// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "files.hpp"

#include "../digest.hpp"
#include "inflate.hpp"
#include "meshes.hpp"

#include <algorithm>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <string_view>
#include <utility>
#include <vector>

namespace golden {

namespace {

namespace fs = std::filesystem;

// ---- models ---------------------------------------------------------------------------------------------------------

void put_u32(std::string& to, std::uint32_t value) {
    for (int i = 0; i < 4; ++i) to += static_cast<char>(value >> (8 * i) & 0xffu);
}
void put_float(std::string& to, float value) { put_u32(to, voxelpipe::core::bit_cast<std::uint32_t>(value)); }

// A coordinate, which is a number of steps of 1/1024, in decimals and exactly.
std::string decimal(float value) {
    const auto steps = static_cast<std::int64_t>(value * 1024.0f);
    const std::int64_t size = steps < 0 ? -steps : steps;
    std::string part = std::to_string(size % 1024 * 9765625);
    part.insert(0, 10 - part.size(), '0');
    return (steps < 0 ? "-" : "") + std::to_string(size / 1024) + '.' + part;
}
std::string decimals(const glm::vec3& p) { return decimal(p.x) + ' ' + decimal(p.y) + ' ' + decimal(p.z); }

// What the model consists of: a torus of one material, and spheres of another: one that overlaps the torus, with a
// cavity, and one beside it that is inside out. Each rule of solids fills other voxels.
struct model_parts {
    mesh_data ring = torus(6, 3, 5200, 2100), ball = sphere(5, 3900, false);

    model_parts() {
        append(ball, sphere(3, 1900, true));
        mesh_data drop = sphere(3, 1300, true);
        for (glm::vec3& p : drop.positions) p += glm::vec3(5.5f, 5.0f, 4.5f);
        append(ball, drop);
    }
};

std::string obj_of(const model_parts& m) {
    std::string text = "mtllib model.mtl\n";
    std::size_t first = 1;
    for (const auto& [name, part] : {std::pair{"ring", &m.ring}, std::pair{"ball", &m.ball}}) {
        text += std::string("o ") + name + "\nusemtl " + name + '\n';
        for (const glm::vec3& p : part->positions) text += "v " + decimals(p) + '\n';
        for (const glm::uvec3& t : part->triangles)
            text += "f " + std::to_string(first + t.x) + ' ' + std::to_string(first + t.y) + ' ' +
                    std::to_string(first + t.z) + '\n';
        first += part->positions.size();
    }
    return text;
}
std::string stl_of(const mesh_data& m) {
    std::string bytes(80, ' ');
    put_u32(bytes, static_cast<std::uint32_t>(m.triangles.size()));
    for (const glm::uvec3& t : m.triangles) {
        for (int i = 0; i < 3; ++i) put_float(bytes, 0.0f); // a normal that nobody reads
        for (const std::uint32_t v : {t.x, t.y, t.z})
            for (int a = 0; a < 3; ++a) put_float(bytes, m.positions[v][a]);
        bytes += std::string(2, '\0');
    }
    return bytes;
}
// With colours at the vertices, in text.
std::string ply_of(const mesh_data& m) {
    std::string text = "ply\nformat ascii 1.0\nelement vertex " + std::to_string(m.positions.size()) +
                       "\nproperty float x\nproperty float y\nproperty float z\nproperty uchar red\nproperty uchar "
                       "green\nproperty uchar blue\nelement face " +
                       std::to_string(m.triangles.size()) + "\nproperty list uchar int vertex_indices\nend_header\n";
    for (std::size_t i = 0; i < m.positions.size(); ++i) {
        text += decimals(m.positions[i]);
        for (int a = 0; a < 3; ++a) text += ' ' + std::to_string(static_cast<int>(m.colors[i][a] * 255.0f));
        text += '\n';
    }
    for (const glm::uvec3& t : m.triangles)
        text += "3 " + std::to_string(t.x) + ' ' + std::to_string(t.y) + ' ' + std::to_string(t.z) + '\n';
    return text;
}

// A glTF file of two nodes. The ring has colours at its vertices and is turned by a matrix; the ball's material shows
// a double-sided blend.
std::string glb_of(const model_parts& m) {
    std::string binary, accessors, views;
    int count = 0;
    const auto view = [&](std::size_t begin, int target) {
        views += (count == 0 ? "" : ",") + std::string(R"({"buffer":0,"byteOffset":)") + std::to_string(begin) +
                 R"(,"byteLength":)" + std::to_string(binary.size() - begin) + R"(,"target":)" +
                 std::to_string(target) + '}';
    };
    const auto accessor = [&](std::size_t n, const std::string& rest) {
        accessors += (count == 0 ? "" : ",") + std::string(R"({"bufferView":)") + std::to_string(count) +
                     R"(,"count":)" + std::to_string(n) + rest + '}';
        return count++;
    };
    const auto add_positions = [&](const mesh_data& part) {
        const std::size_t begin = binary.size();
        glm::vec3 low = part.positions[0], high = low;
        for (const glm::vec3& p : part.positions)
            for (int a = 0; a < 3; ++a) {
                put_float(binary, p[a]);
                low[a] = std::min(low[a], p[a]);
                high[a] = std::max(high[a], p[a]);
            }
        const auto array = [](const glm::vec3& p) {
            return '[' + decimal(p.x) + ',' + decimal(p.y) + ',' + decimal(p.z) + ']';
        };
        view(begin, 34962);
        return accessor(part.positions.size(),
                        R"(,"componentType":5126,"type":"VEC3","min":)" + array(low) + R"(,"max":)" + array(high));
    };
    const auto add_indices = [&](const mesh_data& part) {
        const std::size_t begin = binary.size();
        for (const glm::uvec3& t : part.triangles)
            for (const std::uint32_t v : {t.x, t.y, t.z}) put_u32(binary, v);
        view(begin, 34963);
        return accessor(3 * part.triangles.size(), R"(,"componentType":5125,"type":"SCALAR")");
    };
    const int ring_positions = add_positions(m.ring), ring_indices = add_indices(m.ring);
    const std::size_t begin = binary.size();
    for (const glm::vec4& c : m.ring.colors)
        for (int a = 0; a < 3; ++a) put_float(binary, c[a]);
    view(begin, 34962);
    const int ring_colors = accessor(m.ring.colors.size(), R"(,"componentType":5126,"type":"VEC3")");
    const int ball_positions = add_positions(m.ball), ball_indices = add_indices(m.ball);

    const auto number = [](int n) { return std::to_string(n); };
    std::string json =
        R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0,1]}],"nodes":[{"name":"ring","mesh":0,"matrix":)"
        R"([0,1,0,0,-1,0,0,0,0,0,1,0,0.25,0.5,0,1]},{"name":"ball","mesh":1}],"meshes":[{"primitives":[{"attributes":)"
        R"({"POSITION":)" +
        number(ring_positions) + R"(,"COLOR_0":)" + number(ring_colors) + R"(},"indices":)" + number(ring_indices) +
        R"(,"material":0}]},{"primitives":[{"attributes":{"POSITION":)" + number(ball_positions) + R"(},"indices":)" +
        number(ball_indices) +
        R"(,"material":1}]}],"materials":[{"name":"ring","pbrMetallicRoughness":{"baseColorFactor":[0.875,0.5,0.25,1]}},)"
        R"({"name":"ball","doubleSided":true,"alphaMode":"BLEND","pbrMetallicRoughness":{"baseColorFactor":)"
        R"([0.125,0.375,0.75,0.375]}}],"buffers":[{"byteLength":)" +
        std::to_string(binary.size()) + R"(}],"bufferViews":[)" + views + R"(],"accessors":[)" + accessors + "]}";
    json.append((4 - json.size() % 4) % 4, ' ');
    std::string file = "glTF";
    put_u32(file, 2);
    put_u32(file, static_cast<std::uint32_t>(12 + 8 + json.size() + 8 + binary.size()));
    put_u32(file, static_cast<std::uint32_t>(json.size()));
    file += "JSON" + json;
    put_u32(file, static_cast<std::uint32_t>(binary.size()));
    file += "BIN" + std::string(1, '\0') + binary;
    return file;
}

void write(const fs::path& path, const std::string& content) {
    std::ofstream out(path, std::ios::binary);
    out.write(content.data(), static_cast<std::streamsize>(content.size()));
    if (!out.flush()) throw std::runtime_error(path.string() + " cannot be written");
}

// ---- files of the tool ----------------------------------------------------------------------------------------------

std::string read(const fs::path& path) {
    std::ifstream in(path, std::ios::binary);
    if (!in) throw std::runtime_error(path.string() + " cannot be read");
    return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

std::uint32_t big_endian(std::string_view bytes) {
    std::uint32_t value = 0;
    for (int i = 0; i < 4; ++i) value = value << 8 | static_cast<unsigned char>(bytes[static_cast<std::size_t>(i)]);
    return value;
}

// The chunks of a picture but their checksums, its pixels inflated.
std::string decoded_png(std::string_view file) {
    std::string content, packed;
    for (std::size_t at = 8; at + 12 <= file.size();) {
        const std::size_t length = big_endian(file.substr(at));
        if (at + 12 + length > file.size()) throw std::runtime_error("a chunk of the picture ends early");
        const std::string_view chunk = file.substr(at + 4, 4 + length);
        if (chunk.starts_with("IDAT"))
            packed += chunk.substr(4);
        else
            content += chunk;
        at += 12 + length;
    }
    return content + inflater::inflate(std::string_view(packed).substr(2)); // behind the two bytes of zlib
}
// Behind a header without optional fields.
std::string decoded_gzip(std::string_view file) {
    if (file.size() < 18 || file[3] != 0) throw std::runtime_error("a gzip header with optional fields");
    return inflater::inflate(file.substr(10));
}
std::string decoded_base64(std::string_view text) {
    constexpr std::string_view letters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string bytes;
    std::uint32_t held = 0;
    int count = 0;
    for (const char c : text) {
        const std::size_t digit = letters.find(c);
        if (digit == std::string_view::npos) break; // padding
        held = held << 6 | static_cast<std::uint32_t>(digit);
        count += 6;
        if (count < 8) continue;
        count -= 8;
        bytes += static_cast<char>(held >> count & 0xffu);
    }
    return bytes;
}
// What a page shows: the description of the volume, and its data. The page around them may change.
std::string decoded_page(std::string_view file) {
    const auto script = [&](std::string_view id) {
        const std::size_t tag = file.find("<script id=\"" + std::string(id) + '"');
        if (tag == std::string_view::npos) throw std::runtime_error("the page has no " + std::string(id));
        const std::size_t begin = file.find('>', tag) + 1;
        return file.substr(begin, file.find("</script>", begin) - begin);
    };
    return std::string(script("shape")) + inflater::inflate(decoded_base64(script("data")));
}

std::string decoded(const fs::path& path) {
    std::string file = read(path);
    const std::string_view view = file;
    if (view.starts_with("\x89PNG")) return decoded_png(view);
    if (view.starts_with("\x1f\x8b")) return decoded_gzip(view);
    if (path.extension() == ".html") return decoded_page(view);
    return file;
}

void add_text(digest& d, std::string_view text) { d.add(std::span<const char>(text.data(), text.size())); }

template <class F>
int guarded(F&& f) {
    try {
        f();
        return 0;
    } catch (const std::exception& error) {
        std::fprintf(stderr, "%s\n", error.what());
        return 1;
    }
}

} // namespace

int write_models(const std::string& folder) {
    return guarded([&] {
        const fs::path to = folder;
        const model_parts parts;
        mesh_data both = parts.ring;
        append(both, parts.ball);
        write(to / "model.obj", obj_of(parts));
        write(to / "model.mtl", "newmtl ring\nKd 0.875 0.5 0.25\nnewmtl ball\nKd 0.125 0.375 0.75\nd 0.375\n");
        write(to / "model.stl", stl_of(both));
        write(to / "model.ply", ply_of(both));
        write(to / "open.stl", stl_of(sphere(6, 7700, false, 7)));
        write(to / "model.glb", glb_of(parts));
    });
}

int print_file(const std::string& name, const std::string& path) {
    return guarded([&] {
        digest d;
        if (fs::is_directory(path)) {
            std::vector<std::pair<std::string, fs::path>> files;
            for (const fs::directory_entry& entry : fs::recursive_directory_iterator(path))
                if (entry.is_regular_file())
                    files.emplace_back(fs::relative(entry.path(), path).generic_string(), entry.path());
            std::sort(files.begin(), files.end());
            if (files.empty()) throw std::runtime_error(path + " holds no file");
            for (const auto& [below, file] : files) {
                add_text(d, below);
                add_text(d, decoded(file));
            }
        } else {
            add_text(d, decoded(path));
        }
        std::printf("%s %s\n", name.c_str(), d.hex().c_str());
    });
}

} // namespace golden
