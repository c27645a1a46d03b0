// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "output_check.hpp"

#include "model/system.hpp"
#include "read/assimp/file_name.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <string_view>
#include <system_error>
#include <utility>

namespace voxelize {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t most_looked_at = 1000; // numbered names that are there and may be links

fs::path folder_around(const fs::path& file) { return file.has_parent_path() ? file.parent_path() : fs::path("."); }

std::string quoted(const std::string& text) { return '\'' + text + '\''; }

const char* kind_of(const fs::path& file, const fs::path& model) {
    constexpr std::array<std::string_view, 14> pictures{".png", ".jpg", ".jpeg", ".webp", ".bmp", ".gif",  ".tga",
                                                        ".tif", ".dds", ".ktx",  ".ktx2", ".hdr", ".tiff", ".exr"};
    const std::string extension = assimp::lower_extension(file), of_model = assimp::lower_extension(model);
    if (extension == ".mtl") return "a material library of ";
    if (std::find(pictures.begin(), pictures.end(), extension) != pictures.end()) return "a texture of ";
    return of_model == ".gltf" || of_model == ".glb" ? "a buffer of " : "a file of ";
}

// "part.12.obj" as "part.", 12 and ".obj".
struct numbered_name {
    std::string prefix, suffix;
    std::uint64_t number = 0;
};
std::optional<numbered_name> split_number(const std::string& name) {
    const std::size_t last = name.rfind('.');
    if (last == std::string::npos || last == 0) return std::nullopt;
    const std::size_t dot = name.rfind('.', last - 1);
    if (dot == std::string::npos) return std::nullopt;
    numbered_name split{name.substr(0, dot + 1), name.substr(last), 0};
    const char* const begin = name.data() + dot + 1;
    const char* const end = name.data() + last;
    const auto [at, error] = std::from_chars(begin, end, split.number);
    if (error != std::errc{} || at != end || *begin == '0') return std::nullopt;
    return split;
}

} // namespace

output_check::output_check(std::span<const fs::path> outputs)
    : replaces_folders_(std::any_of(outputs.begin(), outputs.end(), [](fs::path output) {
          if (output.filename().empty()) output = output.parent_path();
          return assimp::lower_extension(output) == ".zarr";
      })) {}

std::optional<output_check::identity> output_check::identify(const fs::path& path) {
    const auto numbers = [](const os::file_facts& found, const fs::path& rest) {
        return identity{found.id.device, found.id.file, os::compared_name(rest)};
    };
    if (const auto found = os::facts_of(path)) {
        if (found->kind == os::file_kind::other) return std::nullopt;
        return numbers(*found, {});
    }
    std::error_code error;
    fs::path missing = path;
    if (const auto found = os::facts_of(folder_around(missing))) return numbers(*found, missing.filename());
    missing = fs::absolute(missing, error).lexically_normal();
    fs::path rest = missing.filename();
    for (fs::path folder = missing.parent_path();; folder = folder.parent_path()) {
        const auto found = os::facts_of(folder);
        if (found || folder == folder.parent_path()) return numbers(found.value_or(os::file_facts{}), rest);
        rest = folder.filename() / rest;
    }
}

const std::optional<output_check::identity>& output_check::identify_folder(const fs::path& folder) {
    const auto [known, is_new] = folders_.try_emplace(folder.string());
    if (is_new) known->second = identify(folder);
    return known->second;
}

const std::vector<output_check::identity>& output_check::folders_around(const fs::path& file) {
    const auto [known, is_new] = folders_around_.try_emplace(folder_around(file).string());
    if (!is_new) return known->second;
    std::error_code error;
    fs::path folder = fs::weakly_canonical(fs::absolute(folder_around(file), error), error);
    for (;; folder = folder.parent_path()) {
        if (const auto& id = identify_folder(folder)) known->second.push_back(*id);
        if (folder == folder.parent_path()) return known->second;
    }
}

void output_check::add_input(const fs::path& file, const std::string& what) {
    users_.push_back({what, file.string(), what});
    add(file, users_.size() - 1, true);
}

void output_check::add_named(const fs::path& file, const fs::path& model) {
    add_input(file, kind_of(file, model) + quoted(model.string()));
}

void output_check::add_output(const fs::path& output, const written_names& names, bool is_known) {
    const std::size_t by = users_.size();
    users_.push_back({"", output.string(), "output " + quoted(output.string())});
    for (const fs::path& file : names.files) add(file, by, is_known);
    for (const numbered_names& each : names.numbered) add_numbered(each, by, is_known);
}

void output_check::add(const fs::path& file, std::size_t by, bool is_known) {
    const std::optional<identity> id = identify(file);
    if (!id) return;
    const auto [known, is_new] = files_.try_emplace(*id, by);
    if (!is_new) check_pair(known->second, by, file, is_known);
    if (replaces_folders_) add_to_folders(file, *id, by);
    const std::optional<numbered_name> name = split_number(os::compared_name(file.filename()));
    if (!name) return;
    const std::optional<identity>& folder = identify_folder(folder_around(file));
    if (!folder) return;
    const pattern with{*folder, name->prefix, name->suffix};
    with_number_[with].push_back({name->number, by});
    if (const auto found = with_numbers_.find(with); found != with_numbers_.end())
        for (const numbered_user& other : found->second)
            if (name->number <= other.number) check_pair(other.by, by, file, is_known);
}

void output_check::add_to_folders(const fs::path& file, const identity& id, std::size_t by) {
    for (const identity& folder : folders_around(file)) {
        folders_in_use_.try_emplace(folder, by);
        if (const auto found = replaced_folders_.find(folder); found != replaced_folders_.end())
            refuse_folder(found->second, by);
    }
    if (!users_[by].what.empty() || assimp::lower_extension(file) != ".zarr") return;
    replaced_folders_.try_emplace(id, by);
    if (const auto found = folders_in_use_.find(id); found != folders_in_use_.end()) refuse_folder(by, found->second);
}

void output_check::add_numbered(const numbered_names& names, std::size_t by, bool is_known) {
    const fs::path where = names.folder.empty() ? fs::path(".") : names.folder;
    if (const std::optional<identity>& folder = identify_folder(where)) {
        const pattern with{*folder, os::compared_name(names.prefix), os::compared_name(names.suffix)};
        with_numbers_[with].push_back({names.count, by});
        if (const auto found = with_number_.find(with); found != with_number_.end())
            for (const numbered_user& other : found->second)
                if (other.number <= names.count) check_pair(other.by, by, names.name(other.number), is_known);
    }
    for (std::uint64_t n = 1; n <= std::min(names.count, most_looked_at); ++n) {
        if (!os::facts_of(names.name(n), os::links::keep)) break;
        const std::optional<identity> id = identify(names.name(n));
        if (const auto known = id ? files_.find(*id) : files_.end(); known != files_.end())
            check_pair(known->second, by, names.name(n), is_known);
    }
}

void output_check::check_pair(std::size_t before, std::size_t now, const fs::path& file, bool is_known) const {
    if (before == now) return;
    const user &a = users_[before], &b = users_[now];
    if (!a.what.empty() && !b.what.empty()) return; // one file may be read as many
    if (a.what.empty() && b.what.empty()) {
        if (is_known && a.path == b.path) return;
        if (identify(a.path) == identify(b.path))
            throw output_conflict(b.called + " is the same file as " + a.called + "; name another output");
        throw output_conflict(b.called + " and " + a.called + " may both become " + quoted(file.string()) +
                              "; name another output");
    }
    const user &read = a.what.empty() ? b : a, &written = a.what.empty() ? a : b;
    if (written.path == file) throw output_conflict(written.called + " is " + read.what + "; name another output");
    throw output_conflict(written.called + " may become " + quoted(file.string()) + ", which is " + read.what +
                          "; name another output");
}

void output_check::refuse_folder(std::size_t folder, std::size_t inside) const {
    throw output_conflict(users_[folder].called + " is a folder that holds " +
                          (users_[inside].what.empty() ? users_[inside].called : users_[inside].what) +
                          "; name another output");
}

} // namespace voxelize
