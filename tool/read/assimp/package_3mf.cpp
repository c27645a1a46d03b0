// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "package_3mf.hpp"

#include "linear_color.hpp"
#include "model/model_error.hpp"
#include "read/gltf/text.hpp"
#include "read/mesh/number.hpp"
#include "xml_tags.hpp"

#include <zlib.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <map>
#include <new>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace voxelize::assimp {
namespace {

// ---- The archive

std::uint64_t zip_number(std::span<const std::byte> bytes, std::size_t at, std::size_t count) {
    if (at > bytes.size() || count > bytes.size() - at) throw model_error("the archive is cut short");
    std::uint64_t number = 0;
    for (std::size_t i = count; i-- > 0;) number = number << 8 | std::to_integer<std::uint64_t>(bytes[at + i]);
    return number;
}

struct zip_entry {
    std::uint64_t method = 0, packed = 0, size = 0, at = 0; // bytes; the place of its own header
};

// The files of a ZIP archive by their paths, from its directory.
std::map<std::string, zip_entry, std::less<>> zip_entries(std::span<const std::byte> bytes) {
    constexpr std::size_t end_bytes = 22, most_comment = 65535, entry_bytes = 46;
    std::map<std::string, zip_entry, std::less<>> entries;
    if (bytes.size() < end_bytes) return entries;
    std::size_t end = bytes.size() - end_bytes;
    const std::size_t least = end > most_comment ? end - most_comment : 0;
    while (zip_number(bytes, end, 4) != 0x06054b50U) {
        if (end == least) return entries;
        --end;
    }
    auto at = static_cast<std::size_t>(zip_number(bytes, end + 16, 4));
    for (std::uint64_t i = zip_number(bytes, end + 10, 2); i > 0 && zip_number(bytes, at, 4) == 0x02014b50U; --i) {
        const auto name = static_cast<std::size_t>(zip_number(bytes, at + 28, 2));
        const auto more = static_cast<std::size_t>(zip_number(bytes, at + 30, 2) + zip_number(bytes, at + 32, 2));
        (void)zip_number(bytes, at + entry_bytes, 0);
        if (name > bytes.size() - at - entry_bytes) throw model_error("the archive is cut short");
        entries[std::string(reinterpret_cast<const char*>(bytes.data()) + at + entry_bytes, name)] = {
            zip_number(bytes, at + 10, 2), zip_number(bytes, at + 20, 4), zip_number(bytes, at + 24, 4),
            zip_number(bytes, at + 42, 4)};
        at += entry_bytes + name + more;
    }
    return entries;
}

std::string zip_text(std::span<const std::byte> bytes, const zip_entry& entry) {
    constexpr std::size_t header_bytes = 30;
    constexpr std::uint64_t stored = 0, deflated = 8;
    const auto head = static_cast<std::size_t>(entry.at);
    const std::uint64_t first = head + header_bytes + zip_number(bytes, head + 26, 2) + zip_number(bytes, head + 28, 2);
    if (first > bytes.size() || entry.packed > bytes.size() - first) throw model_error("the archive is cut short");
    const auto packed = bytes.subspan(static_cast<std::size_t>(first), static_cast<std::size_t>(entry.packed));
    if (entry.method == stored) return {reinterpret_cast<const char*>(packed.data()), packed.size()};
    if (entry.method != deflated) throw model_error("the archive is compressed in a way that is not supported");
    if (entry.size > 1032 * entry.packed + 1032) throw model_error("the archive is damaged");
    std::string text(static_cast<std::size_t>(entry.size), '\0');
    std::vector<Bytef> input(packed.size()); // which zlib takes as its own
    std::memcpy(input.data(), packed.data(), packed.size());
    z_stream stream{};
    if (inflateInit2(&stream, -MAX_WBITS) != Z_OK) throw std::bad_alloc();
    stream.next_in = input.data();
    stream.avail_in = static_cast<uInt>(input.size());
    stream.next_out = reinterpret_cast<Bytef*>(text.data());
    stream.avail_out = static_cast<uInt>(text.size());
    const int result = inflate(&stream, Z_FINISH);
    inflateEnd(&stream);
    if (result != Z_STREAM_END || stream.avail_out != 0) throw model_error("the archive is damaged");
    return text;
}

// ---- The model

using object_key = std::pair<std::string, std::string>; // path within the archive, number

struct component_3mf {
    object_key object;
    affine place;
};
struct object_3mf {
    std::vector<std::uint32_t> primitives; // of the model
    std::vector<component_3mf> components;
};

std::uint32_t index_3mf(std::string_view text) {
    std::uint32_t value = 0;
    const char* const end = text.data() + text.size();
    const auto [stop, error] = std::from_chars(text.data(), end, value);
    if (error != std::errc() || stop != end)
        throw model_error("a 3MF mesh has an invalid index: \"" + gltf::printable(text) + '"');
    return value;
}

// "m00 m01 m02 m10 ... m32", by which rows are multiplied from the left.
affine transform_3mf(std::string_view text) {
    affine result;
    if (text.empty()) return result;
    for (std::size_t row = 0; row < 4; ++row)
        for (std::size_t column = 0; column < 3; ++column) {
            text.remove_prefix(std::min(text.find_first_not_of(" \t\r\n"), text.size()));
            const std::string_view word = text.substr(0, text.find_first_of(" \t\r\n"));
            const std::optional<double> value = number_of(word);
            if (!value || !std::isfinite(*value)) throw model_error("a 3MF transform has fewer than 12 numbers");
            result.m[column][row] = *value;
            text.remove_prefix(word.size());
        }
    return result;
}

class package_reader {
public:
    explicit package_reader(std::span<const std::byte> bytes) : bytes_(bytes), entries_(zip_entries(bytes)) {
        made_.materials.emplace_back().name = "DefaultMaterial";
    }

    std::optional<model> read() {
        std::string root = "3D/3dmodel.model";
        if (const auto relations = entries_.find("_rels/.rels"); relations != entries_.end()) {
            const std::string text = zip_text(bytes_, relations->second);
            for (xml_tags tags(text); tags.next();)
                if (tags.begins && tags.value("Type").ends_with("/3dmodel")) root = xml_unescaped(tags.value("Target"));
        }
        while (root.starts_with('/')) root.erase(0, 1);
        const auto found = entries_.find(root);
        if (found == entries_.end() || !names_paths(zip_text(bytes_, found->second))) return std::nullopt;
        read_file(root);
        for (const component_3mf& item : items_) show(item.object, item.place, 0);
        made_.textures.resize(made_.materials.size());
        return std::move(made_);
    }

private:
    static bool names_paths(const std::string& text) {
        for (xml_tags tags(text); tags.next();)
            if (tags.begins && (tags.name == "component" || tags.name == "item") && !tags.value("path").empty())
                return true;
        return false;
    }

    void read_file(const std::string& path);
    void read_mesh(xml_tags& tags, object_3mf& object, const std::string& name, std::uint32_t material);
    void show(const object_key& key, const affine& place, int depth);
    // The material of a property group of the file that is read, or the default one.
    std::uint32_t material_of(std::string_view group, std::string_view index) const {
        const auto found = materials_.find(std::string(group));
        if (found == materials_.end() || index.empty()) return 0;
        const std::uint32_t number = index_3mf(index);
        return number < found->second.size() ? found->second[number] : 0;
    }

    std::span<const std::byte> bytes_;
    std::map<std::string, zip_entry, std::less<>> entries_;
    std::map<object_key, object_3mf> objects_;
    std::map<std::string, bool> read_;                            // files of the archive
    std::map<std::string, std::vector<std::uint32_t>> materials_; // of the file that is read, by group
    std::vector<component_3mf> items_;
    std::size_t num_shown_ = 0; // objects
    model made_;
};

glm::vec4 color_3mf(std::string_view text) {
    std::uint32_t value = 0;
    if (!text.starts_with('#') || (text.size() != 7 && text.size() != 9)) return glm::vec4(1);
    const auto [stop, error] = std::from_chars(text.data() + 1, text.data() + text.size(), value, 16);
    if (error != std::errc() || stop != text.data() + text.size()) return glm::vec4(1);
    if (text.size() == 7) value = value << 8U | 0xFFU;
    const auto byte = [&](unsigned shift) { return static_cast<float>(value >> shift & 0xFFU) / 255.0F; };
    return {linear_of(byte(24)), linear_of(byte(16)), linear_of(byte(8)), byte(0)};
}

void package_reader::read_file(const std::string& path) {
    if (!read_.try_emplace(path, true).second) return;
    const auto found = entries_.find(path);
    if (found == entries_.end())
        throw model_error("the 3MF names " + gltf::in_quotes(path) + ", which is not in its archive");
    const std::string text = zip_text(bytes_, found->second);
    const bool is_root = read_.size() == 1;
    std::vector<std::string> others;
    materials_.clear();
    const auto target = [&](const xml_tags& tags) {
        std::string other = xml_unescaped(tags.value("path"));
        while (other.starts_with('/')) other.erase(0, 1);
        if (!other.empty()) others.push_back(other);
        return component_3mf{{other.empty() ? path : other, std::string(tags.value("objectid"))},
                             transform_3mf(tags.value("transform"))};
    };
    std::string group;
    object_3mf* object = nullptr;
    std::string object_name;
    std::uint32_t object_material = 0;
    for (xml_tags tags(text); tags.next();) {
        if (tags.name == "basematerials" || tags.name == "colorgroup") {
            if (tags.begins) group = tags.value("id");
        } else if (tags.begins && (tags.name == "base" || tags.name == "color")) {
            material entry;
            entry.name = gltf::printable(xml_unescaped(tags.value("name")));
            entry.base_color = color_3mf(tags.value(tags.name == "base" ? "displaycolor" : "color"));
            if (entry.base_color.a < 1) entry.alpha = alpha_mode::blend;
            materials_[group].push_back(static_cast<std::uint32_t>(made_.materials.size()));
            made_.materials.push_back(std::move(entry));
        } else if (tags.begins && tags.name == "object") {
            object = &objects_[{path, std::string(tags.value("id"))}];
            object_name = gltf::printable(xml_unescaped(tags.value("name")));
            if (object_name.empty()) object_name = "object " + gltf::printable(tags.value("id"));
            object_material = material_of(tags.value("pid"), tags.value("pindex"));
        } else if (tags.begins && tags.name == "component" && object != nullptr) {
            object->components.push_back(target(tags));
        } else if (tags.begins && !tags.ends && tags.name == "mesh" && object != nullptr) {
            read_mesh(tags, *object, object_name, object_material);
        } else if (tags.begins && tags.name == "item" && is_root) {
            items_.push_back(target(tags));
        }
    }
    for (const std::string& other : others) read_file(other);
}

void package_reader::read_mesh(xml_tags& tags, object_3mf& object, const std::string& name, std::uint32_t material) {
    std::vector<glm::vec3> positions;
    std::map<std::uint32_t, std::vector<glm::uvec3>> triangles; // by material
    while (tags.next() && tags.name != "mesh") {
        if (tags.begins && tags.name == "vertex") {
            glm::vec3& p = positions.emplace_back();
            for (glm::length_t axis = 0; axis < 3; ++axis) {
                constexpr std::string_view axes = "xyz";
                const std::optional<double> value =
                    number_of(tags.value(axes.substr(static_cast<std::size_t>(axis), 1)));
                if (!value)
                    throw model_error("vertex " + std::to_string(positions.size()) + " of a 3MF mesh has no " +
                                      std::string(axes.substr(static_cast<std::size_t>(axis), 1)));
                p[axis] = static_cast<float>(*value);
            }
        } else if (tags.begins && tags.name == "triangle") {
            const glm::uvec3 t(index_3mf(tags.value("v1")), index_3mf(tags.value("v2")), index_3mf(tags.value("v3")));
            if (std::max({t.x, t.y, t.z}) >= positions.size())
                throw model_error("a 3MF mesh has an index " + std::to_string(std::max({t.x, t.y, t.z})) + ", and " +
                                  std::to_string(positions.size()) + " vertices");
            const std::string_view own = tags.value("pid");
            triangles[own.empty() ? material : material_of(own, tags.value("p1"))].push_back(t);
        }
    }
    for (auto& [shown, list] : triangles) {
        primitive part;
        part.name = name;
        part.positions = positions;
        part.triangles = std::move(list);
        part.material = shown;
        object.primitives.push_back(static_cast<std::uint32_t>(made_.primitives.size()));
        made_.primitives.push_back(std::move(part));
    }
}

void package_reader::show(const object_key& key, const affine& place, int depth) {
    constexpr int most_depth = 32;
    constexpr std::size_t most_instances = std::size_t{1} << 20;
    const auto found = objects_.find(key);
    if (found == objects_.end())
        throw model_error("the 3MF shows object " + gltf::in_quotes(key.second) + " of " + gltf::in_quotes(key.first) +
                          ", which is not there");
    if (depth == most_depth) throw model_error("the 3MF has components within components without end");
    if (!place.is_finite()) throw model_error("the 3MF has a transform that is not finite");
    for (const std::uint32_t number : found->second.primitives) made_.instances.push_back({number, place});
    if (++num_shown_ > most_instances) throw model_error("the 3MF shows more than a million objects");
    for (const component_3mf& part : found->second.components) show(part.object, place.after(part.place), depth + 1);
}

} // namespace

std::optional<model> read_package_3mf(std::span<const std::byte> bytes) { return package_reader(bytes).read(); }

} // namespace voxelize::assimp
