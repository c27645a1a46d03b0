// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "zarr.hpp"

#include "dense_stream.hpp"
#include "progress.hpp"
#include "text.hpp"
#include "zarr_array.hpp"
#include "zarr_levels.hpp"

#include "../parallel.hpp"

#include <algorithm>
#include <cstring>
#include <memory>
#include <system_error>
#include <utility>

namespace voxelize {
namespace {

namespace fs = std::filesystem;

// One channel on its way into its folder, chunk after chunk.
class channel_writer {
public:
    channel_writer(const volume& v, const channel& c, const fs::path& folder, const write_options& options)
        : v_(v), c_(c), file_(array_layout({v.extent[2], v.extent[1], v.extent[0]}), array_values(c, options.levels),
                              folder, options) {}

    [[nodiscard]] std::int64_t num_chunks() const {
        return array_layout::product(file_.layout().shards) * array_layout::product(file_.layout().per_shard);
    }
    // Calls advance() after each chunk.
    template <class Advance>
    void write(int threads, const Advance& advance) {
        const std::int64_t each = array_layout::product(file_.layout().per_shard);
        ordered_for(
            static_cast<std::size_t>(num_chunks()), threads,
            [&](std::size_t n) {
                return chunk_bytes(
                    file_.layout().corner(static_cast<std::int64_t>(n) / each, static_cast<std::int64_t>(n) % each));
            },
            [&](std::size_t n, const std::vector<std::byte>& bytes) {
                const auto chunk = static_cast<std::int64_t>(n);
                file_.add(chunk / each, chunk % each, bytes);
                if ((chunk + 1) % each == 0) file_.end_shard();
                advance();
            });
        file_.finish();
    }

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

// A new folder beside the target, removed unless it takes the target's place.
class output_folder {
public:
    explicit output_folder(const fs::path& target) : target_(target) {
        std::error_code error;
        if (fs::exists(target, error) && !fs::exists(target / "zarr.json", error))
            throw write_error(target, "it exists and is no Zarr group");
        for (int n = 0; n < 1000; ++n) {
            part_ = beside(".part", n);
            if (fs::create_directory(part_, error)) return;
            if (error) throw write_error(target, "make a folder: " + error.message());
        }
        throw write_error(target, "make a folder: there are 1000 parts of it");
    }
    output_folder(const output_folder&) = delete;
    output_folder& operator=(const output_folder&) = delete;
    ~output_folder() {
        std::error_code ignored;
        if (!part_.empty()) fs::remove_all(part_, ignored);
    }
    [[nodiscard]] const fs::path& path() const { return part_; }
    void commit() {
        std::error_code error;
        fs::path old;
        if (fs::exists(target_, error)) {
            for (int n = 0; old.empty() || fs::exists(old, error); ++n) old = beside(".old", n);
            fs::rename(target_, old, error);
            if (error) throw write_error(target_, "rename: " + error.message());
        }
        fs::rename(part_, target_, error);
        if (error) throw write_error(target_, "rename: " + error.message());
        part_.clear();
        if (!old.empty()) fs::remove_all(old, error);
    }

private:
    [[nodiscard]] fs::path beside(const char* what, int n) const {
        return target_.parent_path() / (target_.filename().string() + what + std::to_string(n));
    }
    fs::path target_, part_;
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

} // namespace

bool has_zstd() {
#ifdef VOXELIZE_HAS_ZSTD
    return true;
#else
    return false;
#endif
}

std::vector<fs::path> write_zarr(const volume& v, const fs::path& path, const write_options& options) {
    fs::path target = path;
    if (target.filename().empty()) target = target.parent_path(); // "out.zarr/"
    std::error_code ignored;
    if (fs::is_symlink(target, ignored)) target = fs::weakly_canonical(target, ignored); // kept, as by other writers
    output_folder folder(target);
    try {
        std::vector<std::unique_ptr<channel_writer>> arrays;
        std::uint64_t steps = 0;
        for (const channel& c : v.channels) {
            const fs::path group = folder.path() / c.name;
            fs::create_directories(options.levels ? group / "0" : group);
            arrays.push_back(std::make_unique<channel_writer>(v, c, options.levels ? group / "0" : group, options));
            steps += static_cast<std::uint64_t>(arrays.back()->num_chunks());
            if (options.levels) steps += num_level_blocks(v);
        }
        progress_meter meter(options.progress, steps);
        const auto advance = [&] { meter.advance(1); };
        const auto describe = [](const fs::path& group, const std::string& text) {
            output_file json(group / "zarr.json");
            json.write(text);
            json.commit();
        };
        for (std::size_t n = 0; n < arrays.size(); ++n) {
            arrays[n]->write(thread_count(options.threads), advance);
            if (!options.levels) continue;
            const channel& c = v.channels[n];
            write_zarr_levels(v, c, folder.path() / c.name, options, advance);
            describe(folder.path() / c.name, multiscale_description(v, c));
        }
        describe(folder.path(), group_description(v));
    } catch (const fs::filesystem_error& error) {
        throw write_error(target, error.code().message());
    }
    folder.commit();
    return {target};
}

} // namespace voxelize
