// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "slab_output.hpp"

#include "write/formats/output_file.hpp"
#include "write/formats/vti.hpp"
#include "write/formats/zarr.hpp"

#include <algorithm>
#include <string>
#include <system_error>

namespace voxelize {
namespace {

namespace fs = std::filesystem;
using voxelpipe::slabs::layer_range;

// Removes the parts of files that a process left which ended while it wrote them.
void remove_parts(const fs::path& folder) {
    std::error_code error;
    std::vector<fs::path> parts;
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder, error))
        if (entry.path().extension().string().starts_with(".part")) parts.push_back(entry.path());
    for (const fs::path& part : parts) fs::remove(part, error);
}

// A slab is a layer of shards. Array files lie in data/, what slabs make of levels in levels/.
class zarr_slabs : public slab_output {
public:
    zarr_slabs(const fs::path& output, const volume& shape, const write_options& options)
        : target_(zarr_target(output)), shape_(shape), options_(options) {}

    [[nodiscard]] std::int64_t num_slabs() const override {
        return (shape_.extent[2] + zarr_slab_layers - 1) / zarr_slab_layers;
    }
    [[nodiscard]] layer_range layers(std::int64_t slab) const override {
        return {static_cast<int>(slab * zarr_slab_layers),
                static_cast<int>(std::min<std::int64_t>(shape_.extent[2], (slab + 1) * zarr_slab_layers))};
    }
    [[nodiscard]] const fs::path& target() const override { return target_; }
    void check_target() const override { check_zarr_target(target_); }
    void write(const fs::path& folder, std::int64_t slab, const volume& v) const override {
        write_zarr_slab(v, folder / "data", folder / "levels", slab, options_);
    }
    [[nodiscard]] std::vector<fs::path> finish(const fs::path& folder) const override {
        remove_parts(folder / "data");
        finish_zarr_slabs(shape_, folder / "data", folder / "levels", options_);
        replace_zarr(folder / "data", target_);
        return {target_};
    }

private:
    fs::path target_;
    volume shape_;
    write_options options_;
};

// A slab is a piece, which lies in data/ until all of them are there. The .pvti comes last.
class pvti_slabs : public slab_output {
public:
    pvti_slabs(const fs::path& output, const volume& shape, const write_options& options)
        : output_(output), shape_(shape), options_(options), pieces_(num_pvti_pieces(shape, options)) {
        // Other pieces are other work.
        target_ = output.parent_path() / (output.filename().string() + "." + std::to_string(pieces_));
    }

    [[nodiscard]] std::int64_t num_slabs() const override { return pieces_; }
    [[nodiscard]] layer_range layers(std::int64_t slab) const override {
        const auto [first, last] = pvti_piece_layers(shape_, slab, pieces_);
        return {static_cast<int>(first), static_cast<int>(last)};
    }
    [[nodiscard]] const fs::path& target() const override { return target_; }
    void write(const fs::path& folder, std::int64_t slab, const volume& v) const override {
        write_pvti_piece(v, in(folder, slab), slab, pieces_, options_);
    }
    [[nodiscard]] std::vector<fs::path> finish(const fs::path& folder) const override {
        std::vector<fs::path> files;
        std::error_code error;
        for (std::int64_t n = 0; n < pieces_; ++n) {
            files.push_back(pvti_piece_path(output_, n));
            // A process that ended in here has put some of them there before.
            if (fs::exists(in(folder, n), error)) fs::rename(in(folder, n), files.back(), error);
            if (error) throw write_error(files.back(), "rename: " + error.message());
            if (!fs::exists(files.back(), error))
                throw write_error(output_, "a piece of it is missing; remove " + folder.string());
        }
        files.push_back(output_);
        write_pvti_index(shape_, output_, pieces_);
        fs::remove_all(folder / "data", error);
        return files;
    }

private:
    [[nodiscard]] fs::path in(const fs::path& folder, std::int64_t piece) const {
        return folder / "data" / pvti_piece_path(output_, piece).filename();
    }

    fs::path output_, target_;
    volume shape_;
    write_options options_;
    std::int64_t pieces_;
};

bool is_pvti(const fs::path& output) { return lower_extension(output) == ".pvti"; }

} // namespace

bool has_slab_output(const fs::path& output) {
    return is_pvti(output) || lower_extension(zarr_target(output)) == ".zarr";
}

std::unique_ptr<slab_output> make_slab_output(const fs::path& output, const volume& shape,
                                              const write_options& options) {
    if (is_pvti(output)) return std::make_unique<pvti_slabs>(output, shape, options);
    return std::make_unique<zarr_slabs>(output, shape, options);
}

} // namespace voxelize
