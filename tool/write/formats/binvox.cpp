// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "binvox.hpp"

#include "progress.hpp"
#include "text.hpp"

#include <algorithm>

namespace voxelize {
namespace {

// Collects runs of equal voxels and writes them as (value, length) byte pairs, each at most 255 long.
class run_writer {
public:
    explicit run_writer(output_file& out) : out_(out) { pairs_.reserve(flush_bytes + 2); }

    void add(bool value, std::uint64_t length) {
        if (length == 0) return; // must not end a run of the other value
        if (value != value_) {
            put();
            value_ = value;
        }
        length_ += length;
    }

    void finish() {
        put();
        out_.write(pairs_);
    }

private:
    static constexpr std::size_t flush_bytes = std::size_t{1} << 16;

    void put() {
        for (; length_ > 0; length_ -= std::min<std::uint64_t>(length_, 255)) {
            pairs_.push_back(static_cast<std::byte>(value_));
            pairs_.push_back(static_cast<std::byte>(std::min<std::uint64_t>(length_, 255)));
            if (pairs_.size() >= flush_bytes) {
                out_.write(pairs_);
                pairs_.clear();
            }
        }
    }

    output_file& out_;
    std::vector<std::byte> pairs_;
    bool value_ = false;
    std::uint64_t length_ = 0;
};

} // namespace

std::vector<std::filesystem::path> write_binvox(const voxel_shape& v, const std::filesystem::path& path,
                                                const write_options& options) {
    const auto side = static_cast<std::uint64_t>(*std::max_element(v.extent.begin(), v.extent.end()));

    output_file out(path);
    const std::string n = std::to_string(side);
    out.write("#binvox 1\ndim " + n + " " + n + " " + n + "\n");
    out.write("translate " + number(v.origin[0]) + " " + number(v.origin[1]) + " " + number(v.origin[2]) + "\n");
    out.write("scale " + number(v.voxel_size[0] * static_cast<double>(side)) + "\ndata\n");

    // x is slowest in the file and y fastest.
    const brick_order order(v, 0);
    progress_meter meter(options.progress, order.num_layers());
    run_writer runs(out);
    std::uint64_t written = 0; // voxels of the cube
    for (std::size_t layer = 0; layer < order.num_layers(); ++layer) {
        for (unsigned x = 0; x < 8; ++x)
            order.for_each_voxel(order.layer(layer), x, [&](std::size_t, const glm::ivec3& voxel) {
                const std::uint64_t at =
                    (static_cast<std::uint64_t>(voxel.x) * side + static_cast<std::uint64_t>(voxel.z)) * side +
                    static_cast<std::uint64_t>(voxel.y);
                runs.add(false, at - written);
                runs.add(true, 1);
                written = at + 1;
            });
        meter.advance(1);
    }
    runs.add(false, side * side * side - written);
    runs.finish();
    out.commit();
    return {path};
}

} // namespace voxelize
