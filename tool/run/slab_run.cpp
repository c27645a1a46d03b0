// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "slab_run.hpp"

#include "batch.hpp"
#include "draw/pass_files.hpp"
#include "draw/sparse/loaded_slabs.hpp"
#include "model/memory.hpp"
#include "model/system.hpp"
#include "slab_output.hpp"
#include "write/formats/output_file.hpp"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cerrno>
#include <fstream>
#include <functional>
#include <memory>
#include <new>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

namespace voxelize {
namespace {

namespace fs = std::filesystem;
namespace slabs = voxelpipe::slabs;
using json = nlohmann::ordered_json;

// Counts that a mark keeps.
constexpr std::pair<const char*, std::uint64_t voxelize_stats::*> kept_counts[] = {
    {"voxels", &voxelize_stats::voxels},
    {"fragments", &voxelize_stats::fragments},
    {"fragments_discarded", &voxelize_stats::fragments_discarded},
    {"triangles_drawn", &voxelize_stats::triangles_drawn},
    {"normals_cancelled", &voxelize_stats::normals_cancelled}};

// A lock of a folder by the name of its file, which the system takes back from a process that ends in whatever way. On
// NFS it is the server's, so it holds between hosts. Throws write_error where the file system has no locks.
class folder_lock {
public:
    // say: is called before the lock is waited for, where another process has it. May be empty.
    explicit folder_lock(const fs::path& folder, const std::string& name = "lock",
                         const std::function<void()>& say = {}) {
        const fs::path path = folder / name;
        file_ = os::open_file(path, os::opening::share);
        int error = file_ < 0 ? errno : 0;
        bool is_locked = error == 0 && say && os::lock_file(file_, false);
        if (error == 0 && !is_locked && say && errno == EWOULDBLOCK) say();
        if (error == 0 && !is_locked && !os::lock_file(file_, true)) error = errno;
        // Who had the lock before may have removed the folder.
        if (error == 0) {
            const auto mine = os::facts_of(file_), there = os::facts_of(path);
            has_ = mine && there && mine->id == there->id;
        }
        if (error == 0 || error == ENOENT || error == stale_file) return;
        if (file_ >= 0) os::close_file(file_);
        throw write_error(path, "lock: " + std::generic_category().message(error));
    }
    folder_lock(const folder_lock&) = delete;
    folder_lock& operator=(const folder_lock&) = delete;
    ~folder_lock() {
        if (file_ >= 0) os::close_file(file_);
    }
    // False if the folder is gone.
    explicit operator bool() const { return has_; }

private:
#if defined(ESTALE)
    static constexpr int stale_file = ESTALE; // as NFS has it
#else
    static constexpr int stale_file = ENOENT;
#endif
    int file_;
    bool has_ = false;
};

// The folder of the slabs of one output. All that several processes may do at once is done under its lock.
class slab_folder {
public:
    slab_folder(const slab_output& output, const std::string& work)
        : output_(output), path_(output.target().string() + "." + work + ".slabs") {
        output_.check_target();
    }
    [[nodiscard]] const fs::path& path() const { return path_; }
    // The lock of a process's share, which processes of the same rank hold one after the other: from begin() until the
    // output is made, or until no slab of the share is missing. False if another process has made the output meanwhile.
    [[nodiscard]] std::unique_ptr<folder_lock> lock_share(const batch_request& share,
                                                          const std::function<void()>& say) const {
        make(path_);
        const std::string name = share_lock + std::to_string(share.rank) + "." + std::to_string(share.world_size);
        return std::make_unique<folder_lock>(path_, name, say);
    }
    [[nodiscard]] bool is_there() const {
        std::error_code error;
        return fs::exists(path_, error);
    }
    // Returns the slabs of `share` that have to be drawn; the folder stays until they are. The list is empty if another
    // process makes the output meanwhile.
    [[nodiscard]] std::vector<std::int64_t> begin(const std::vector<std::int64_t>& share) const {
        std::error_code error;
        const folder_lock lock(path_);
        if (!lock) return {};
        // Without data its slabs became the output, and the process ended before it could remove the rest.
        if (!has_data())
            for (const fs::directory_entry& entry : fs::directory_iterator(path_, error))
                if (!is_lock(entry.path())) fs::remove_all(entry.path(), error);
        make(path_ / "data");
        std::vector<std::int64_t> missing;
        for (const std::int64_t slab : share)
            if (!has(slab)) missing.push_back(slab);
        return missing;
    }
    void mark(std::int64_t slab, const voxelize_stats& counts) const {
        json line;
        for (const auto& [name, count] : kept_counts) line[name] = counts.*count;
        output_file file(mark_of(slab));
        file.write(line.dump() + "\n");
        file.commit();
    }
    // If all slabs are there: makes the output of them, adds their counts to `all`, and returns its files. None if some
    // are `left`, or another process does.
    [[nodiscard]] std::vector<fs::path> finish(voxelize_stats& all, std::int64_t& left) const {
        std::vector<fs::path> files;
        std::error_code error;
        {
            const folder_lock lock(path_);
            if (!lock || !has_data()) return {};
            for (std::int64_t s = 0; s < output_.num_slabs(); ++s) left += has(s) ? 0 : 1;
            if (left != 0) return {};
            for (std::int64_t s = 0; s < output_.num_slabs(); ++s) {
                std::ifstream file(mark_of(s));
                const json line = json::parse(file, nullptr, false);
                if (!line.is_object()) throw write_error(mark_of(s), "it holds no counts; remove it");
                for (const auto& [name, count] : kept_counts) all.*count += line.value(name, std::uint64_t{0});
            }
            files = output_.finish(path_);
            fs::remove_all(path_, error);
        }
        fs::remove(path_, error); // NFS keeps a file that is removed, and so its folder, until it is closed
        return files;
    }

private:
    static constexpr const char* share_lock = "process.";
    [[nodiscard]] static bool is_lock(const fs::path& path) {
        const std::string name = path.filename().string();
        return name == "lock" || name.starts_with(share_lock);
    }
    void make(const fs::path& folder) const {
        std::error_code error;
        fs::create_directories(folder, error);
        if (error) throw write_error(path_, "make a folder: " + error.message());
    }
    [[nodiscard]] bool has(std::int64_t slab) const {
        std::error_code error;
        return fs::exists(mark_of(slab), error);
    }
    [[nodiscard]] fs::path mark_of(std::int64_t slab) const { return path_ / ("done." + std::to_string(slab)); }
    [[nodiscard]] bool has_data() const {
        std::error_code error;
        return fs::exists(path_ / "data", error);
    }

    const slab_output& output_;
    fs::path path_;
};

// Shape and channels of the output, without values.
volume shape_of(const voxelize_request& request, std::size_t num_targets) {
    volume v = volume_of(request.grid);
    for (std::size_t t = 0; t < num_targets; ++t) {
        const target_info& info = info_of(request.targets[t]);
        v.channels.push_back({std::string(info.name), info.type, info.components, {}});
    }
    return v;
}

} // namespace

std::string why_not_by_slabs(const command_line& options) {
    const voxelize_request& request = options.voxelize;
    if (options.outputs.size() != 1 || !has_slab_output(options.outputs[0])) return "one output, a .zarr or .pvti";
    if (options.storage == storage_choice::dense || request.backend == backend_choice::cuda || request.devices != 1 ||
        request.strategy != voxelpipe::strategy::automatic)
        return "the CPU and bricks: no --dense, --backend cuda, --devices or --strategy";
    return "";
}

slab_outcome run_by_slabs(const command_line& options, slab_source&& source, run_report& report) {
    const voxelize_request& request = report.request;
    const std::size_t num_targets = request.targets.size() - options.implied.size();
    const std::unique_ptr<slab_output> output =
        make_slab_output(options.outputs[0], shape_of(request, num_targets), options.write);
    const slab_folder folder(*output, work_of(options, options.input));
    slab_outcome outcome;
    outcome.slabs = output->num_slabs();

    std::vector<std::int64_t> share;
    std::vector<slabs::layer_range> ranges;
    for (std::int64_t s = 0; s < outcome.slabs; ++s) ranges.push_back(output->layers(s));
    for (std::int64_t s = options.batch.rank; s < outcome.slabs; s += options.batch.world_size) share.push_back(s);
    voxelize_stats& stats = report.stats;
    const auto count_triangles = [&] {
        stats.triangles = source.stream != nullptr ? source.stream->num_triangles() : source.model.triangle_count();
    };
    std::unique_ptr<folder_lock> lock;
    if (!share.empty())
        lock = folder.lock_share(options.batch, [&source] {
            if (source.place.say) source.place.say("another process draws the same slabs: waiting for its end");
        });
    if (lock ? !*lock : !folder.is_there()) { // the output is made, or others make it
        count_triangles();
        return outcome;
    }
    const std::vector<std::int64_t> missing = folder.begin(share);
    const std::vector<std::size_t> mine(missing.begin(), missing.end());
    const pass_files passes(folder.path(),
                            static_cast<std::size_t>(outcome.slabs * options.batch.rank / options.batch.world_size));
    voxelize_stats before;
    const auto write = [&](std::size_t i, sparse_volume&& bricks, const voxelize_stats& until) {
        bricks.channels.resize(num_targets);
        output->write(folder.path(), missing[i], as_dense(bricks, bricks.channels));
        voxelize_stats counts;
        for (const auto& [name, count] : kept_counts) counts.*count = until.*count - before.*count;
        before = until;
        folder.mark(missing[i], counts);
        ++outcome.drawn;
    };
    if (source.stream != nullptr && !mine.empty()) {
        draw_streamed(*source.stream, source.place, request, {ranges, mine, &passes}, stats,
                      [&](std::size_t i, sparse_volume&& bricks) { write(i, std::move(bricks), stats); });
    } else if (!mine.empty()) {
        const std::filesystem::path& place = source.place.folder;
        try {
            loaded_slabs model(std::move(source.model), request, ranges, mine, place, &passes, stats);
            for (std::size_t i = 0; i < mine.size(); ++i) write(i, model.draw(ranges[mine[i]], stats), stats);
            warn_of_parts(stats, request);
        } catch (const std::system_error& error) {
            throw write_error(place, "temporary files for a flood: " + error.code().message());
        } catch (const std::bad_alloc&) {
            throw memory_error(memory::shortage(memory::fewer_voxels_hint));
        }
    } else {
        count_triangles();
    }
    voxelize_stats all;
    std::vector<fs::path> files = folder.finish(all, outcome.left);
    lock.reset();
    std::error_code ignored;
    fs::remove(folder.path(), ignored); // if it is empty: NFS, as above
    if (outcome.left != 0 && options.batch.world_size == 1)
        throw write_error(folder.path(), "slabs that this run has written are gone");
    if (files.empty()) return outcome;
    outcome.finished = true;
    for (const auto& [name, count] : kept_counts) stats.*count = all.*count;
    report.files.insert(report.files.end(), files.begin(), files.end());
    return outcome;
}

} // namespace voxelize
