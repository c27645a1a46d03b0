// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "zarr.hpp"

#include "dense_stream.hpp"
#include "part.hpp"
#include "progress.hpp"
#include "text.hpp"
#include "zarr_array.hpp"
#include "zarr_levels.hpp"

#include "model/parallel.hpp"
#include "model/system.hpp"

#include <algorithm>
#include <cstring>
#include <fstream>
#include <iterator>
#include <memory>
#include <system_error>
#include <utility>

namespace voxelize {
namespace {

namespace fs = std::filesystem;

// What the description of a group of this tool has, without blanks: so it knows that it may replace the group.
constexpr std::string_view own_attributes = "\"attributes\":{\"voxelpipe\":{";

// One channel on its way into its folder, chunk after chunk.
class channel_writer {
public:
    channel_writer(const volume& v, const channel& c, const fs::path& folder, const write_options& options)
        : v_(v), c_(c), file_(array_layout({v.extent[2], v.extent[1], v.extent[0]}), array_values(c, options.levels),
                              folder, options) {}

    [[nodiscard]] std::int64_t num_shards() const { return array_layout::product(file_.layout().shards); }
    // Shards of a layer.
    [[nodiscard]] std::int64_t shards_of_slab() const { return file_.layout().shards[1] * file_.layout().shards[2]; }
    // Number of chunks of `shards` shards.
    [[nodiscard]] std::int64_t chunks_of(std::int64_t shards) const {
        return shards * array_layout::product(file_.layout().per_shard);
    }
    // The shards [first, last). Calls advance() after each chunk.
    template <class Advance>
    void write(std::int64_t first, std::int64_t last, int threads, const Advance& advance) {
        const std::int64_t each = chunks_of(1);
        ordered_for(
            static_cast<std::size_t>(chunks_of(last - first)), threads,
            [&](std::size_t n) {
                const auto chunk = static_cast<std::int64_t>(n);
                return chunk_bytes(file_.layout().corner(first + chunk / each, chunk % each));
            },
            [&](std::size_t n, const std::vector<std::byte>& bytes) {
                const auto chunk = static_cast<std::int64_t>(n);
                file_.add(first + chunk / each, chunk % each, bytes);
                if ((chunk + 1) % each == 0) file_.end_shard();
                advance();
            });
    }
    // The description, once all shards are there.
    void describe() const { file_.finish(); }

private:
    // A chunk as its shard holds it. Beyond the array it is filled up.
    [[nodiscard]] std::vector<std::byte> chunk_bytes(const zyx& corner) const {
        if (!file_.layout().has(corner)) return {};
        const auto side = static_cast<std::size_t>(chunk_side), value_bytes = file_.values().voxel_bytes();
        std::vector<std::byte> raw(side * side * side * value_bytes), room;
        file_.values().clear(raw);
        const auto count = [&](std::size_t a) { return std::min(chunk_side, file_.layout().extent[a] - corner[a]); };
        const auto row_bytes = static_cast<std::size_t>(count(2)) * value_bytes;
        for (std::int64_t z = 0; z < count(0); ++z)
            for (std::int64_t y = 0; y < count(1); ++y) {
                const auto voxel = static_cast<std::uint64_t>(v_.index(corner[2], corner[1] + y, corner[0] + z));
                const auto row = streamed_piece(v_, c_, half_floats::keep, voxel * value_bytes, row_bytes, room);
                std::memcpy(raw.data() + static_cast<std::size_t>(z * chunk_side + y) * side * value_bytes, row.data(),
                            row_bytes);
            }
        return file_.pack(std::move(raw));
    }

    const volume& v_;
    const channel& c_;
    array_file file_;
};

[[noreturn]] void fail_rename(const fs::path& target, const std::error_code& error) {
    throw write_error(target, "rename: " + error.message());
}

fs::path beside(const fs::path& target, const char* what, int n) {
    return target.parent_path() / (target.filename().string() + what + std::to_string(n));
}

// A new folder beside the target, removed unless it takes the target's place.
class output_folder {
public:
    explicit output_folder(const fs::path& target) : target_(target) {
        check_zarr_target(target);
        try {
            part_ = make_part_folder(target);
        } catch (const std::system_error& error) {
            throw write_error(target, "make a folder: " + error.code().message());
        }
        path_ = part_.path().parent_path();
    }
    output_folder(const output_folder&) = delete;
    output_folder& operator=(const output_folder&) = delete;
    ~output_folder() {
        std::error_code ignored;
        if constexpr (os::open_files_keep_folders) part_.release();
        if (!path_.empty()) fs::remove_all(path_, ignored);
    }
    [[nodiscard]] const fs::path& path() const { return path_; }
    void commit() {
        std::error_code ignored;
        fs::remove(part_.path(), ignored);
        if constexpr (os::open_files_keep_folders) part_.release();
        replace_zarr(path_, target_);
        path_.clear();
    }

private:
    fs::path target_, path_;
    locked_part part_;
};

std::string group_description(const volume& v) {
    const auto list = [](const auto& values) {
        std::string text;
        for (const auto value : values) text += (text.empty() ? "" : ", ") + number(static_cast<double>(value));
        return '[' + text + ']';
    };
    return "{\n  \"zarr_format\": 3,\n  \"node_type\": \"group\",\n  \"attributes\": {\"voxelpipe\": {\"origin\": " +
           list(v.origin) + ", \"voxel_size\": " + list(v.voxel_size) + "}}\n}\n";
}

void write_description(const fs::path& group, const std::string& text) {
    output_file json(group / "zarr.json");
    json.write(text);
    json.commit();
}

// The folder of a channel's own array in its group.
fs::path array_of(const fs::path& folder, const channel& c, const write_options& options) {
    return options.levels ? folder / c.name / "0" : folder / c.name;
}

// A slab's part of the levels of a channel.
fs::path level_file(const fs::path& levels, const channel& c, std::int64_t slab) {
    return levels / (c.name + "." + std::to_string(slab));
}

} // namespace

bool has_zstd() {
#ifdef VOXELIZE_HAS_ZSTD
    return true;
#else
    return false;
#endif
}

fs::path zarr_target(const fs::path& path) {
    fs::path target = path;
    if (target.filename().empty()) target = target.parent_path(); // "out.zarr/"
    std::error_code ignored;
    if (fs::is_symlink(target, ignored)) target = fs::weakly_canonical(target, ignored); // kept, as by other writers
    return target;
}

void check_zarr_target(const fs::path& target) {
    std::error_code error;
    if (!fs::exists(fs::symlink_status(target, error))) return;
    const fs::path description = target / "zarr.json";
    if (!fs::is_regular_file(description, error)) throw write_error(target, "it exists and is no Zarr group");
    std::ifstream file(description, std::ios::binary);
    std::string text{std::istreambuf_iterator<char>(file), {}};
    std::erase_if(text, [](char c) { return c == ' ' || c == '\n' || c == '\r' || c == '\t'; });
    if (text.find(own_attributes) == std::string::npos)
        throw write_error(target, "it exists, and this program did not write it: its zarr.json lacks the attribute "
                                  "\"voxelpipe\"; remove it or name another output");
}

written_names zarr_names(const volume&, const fs::path& path, const write_options&, held_as) {
    return {{zarr_target(path)}, {}};
}

void replace_zarr(const fs::path& folder, const fs::path& target) {
    std::error_code error;
    check_zarr_target(target);
    fs::path old;
    if (fs::exists(target, error)) {
        for (int n = 0; old.empty() || fs::exists(old, error); ++n) old = beside(target, ".old", n);
        fs::rename(target, old, error);
        if (error) fail_rename(target, error);
    }
    fs::rename(folder, target, error);
    if (error) {
        std::error_code ignored;
        if (!old.empty()) fs::rename(old, target, ignored);
        fail_rename(target, error);
    }
    if (!old.empty()) fs::remove_all(old, error);
}

void write_zarr_slab(const volume& v, const fs::path& folder, const fs::path& levels, std::int64_t slab,
                     const write_options& options) {
    try {
        for (const channel& c : v.channels) {
            const fs::path array_folder = array_of(folder, c, options);
            fs::create_directories(array_folder);
            channel_writer array(v, c, array_folder, options);
            const std::int64_t each = array.shards_of_slab();
            progress_meter meter(options.progress, static_cast<std::uint64_t>(array.chunks_of(each)));
            array.write(slab * each, (slab + 1) * each, thread_count(options.threads), [&] { meter.advance(1); });
            if (!options.levels) continue;
            fs::create_directories(levels);
            write_slab_levels(v, c, level_file(levels, c, slab), slab * zarr_slab_layers,
                              std::min<std::int64_t>(v.extent[2], (slab + 1) * zarr_slab_layers), options);
        }
    } catch (const fs::filesystem_error& error) {
        throw write_error(folder, error.code().message());
    }
}

void finish_zarr_slabs(const volume& v, const fs::path& folder, const fs::path& levels, const write_options& options) {
    try {
        for (const channel& c : v.channels) {
            fs::create_directories(array_of(folder, c, options));
            channel_writer(v, c, array_of(folder, c, options), options).describe();
            if (!options.levels) continue;
            join_slab_levels(
                v, c, folder / c.name, zarr_slab_layers, [&](std::int64_t slab) { return level_file(levels, c, slab); },
                options);
            write_description(folder / c.name, multiscale_description(v, c));
        }
    } catch (const fs::filesystem_error& error) {
        throw write_error(folder, error.code().message());
    }
    write_description(folder, group_description(v));
}

std::vector<fs::path> write_zarr(const volume& v, const fs::path& path, const write_options& options) {
    const fs::path target = zarr_target(path);
    output_folder folder(target);
    try {
        std::vector<std::unique_ptr<channel_writer>> arrays;
        std::uint64_t steps = 0;
        v.for_each_channel([&](const volume& of, const channel& c) {
            const fs::path array_folder = array_of(folder.path(), c, options);
            fs::create_directories(array_folder);
            arrays.push_back(std::make_unique<channel_writer>(of, c, array_folder, options));
            steps += static_cast<std::uint64_t>(arrays.back()->chunks_of(arrays.back()->num_shards()));
            if (options.levels) steps += num_level_blocks(of);
        });
        progress_meter meter(options.progress, steps);
        const auto advance = [&] { meter.advance(1); };
        for (std::size_t n = 0; n < arrays.size(); ++n) {
            arrays[n]->write(0, arrays[n]->num_shards(), thread_count(options.threads), advance);
            arrays[n]->describe();
            if (!options.levels || n >= v.channels.size()) continue; // faces have none
            const channel& c = v.channels[n];
            write_zarr_levels(v, c, folder.path() / c.name, options, advance);
            write_description(folder.path() / c.name, multiscale_description(v, c));
        }
        write_description(folder.path(), group_description(v));
    } catch (const fs::filesystem_error& error) {
        throw write_error(target, error.code().message());
    }
    folder.commit();
    return {target};
}

} // namespace voxelize
