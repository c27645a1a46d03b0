// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// What the writers of meshes share: files of a bounded number of faces, coordinates and colours.

#include "mesh.hpp"
#include "progress.hpp"
#include "text.hpp"
#include "voxel_mesh.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace voxelize {

inline constexpr std::uint64_t max_faces = std::uint64_t{1} << 30;     // four corners each, numbered with 32 bits
inline constexpr std::uint64_t max_glb_faces = 40'000'000;             // of at most 104 bytes each in a file of 4 GiB
inline constexpr std::uint64_t max_3mf_faces = std::uint64_t{1} << 28; // some GB of text; vertex numbers have 31 bits

inline std::uint8_t red(std::uint32_t rgb) { return static_cast<std::uint8_t>(rgb); }
inline std::uint8_t green(std::uint32_t rgb) { return static_cast<std::uint8_t>(rgb >> 8); }
inline std::uint8_t blue(std::uint32_t rgb) { return static_cast<std::uint8_t>(rgb >> 16); }

// World coordinate of the lattice plane N along an axis; N is not whole for the middle of a voxel.
inline double world(const voxel_shape& v, std::size_t axis, double n) {
    return std::fma(n, v.voxel_size[axis], v.origin[axis]);
}

// A file of a mesh, and the faces that it holds.
struct file_part {
    std::filesystem::path path;
    std::span<const voxel_face> faces;
};

// The most faces of a file of a format that can number `of_format` of them.
inline std::uint64_t most_faces(std::uint64_t of_format, const write_options& options) {
    return options.faces_per_file != 0 ? std::min(of_format, options.faces_per_file) : of_format;
}

// Files of at most `most` faces each.
[[nodiscard]] std::vector<file_part> split(std::span<const voxel_face> faces, const std::filesystem::path& path,
                                           std::uint64_t most);

// Progress of finding the faces and of writing them, half of it each.
struct halves_of_progress {
    std::function<void(double)> first, second;

    explicit halves_of_progress(const write_options& options) {
        if (!options.progress) return;
        first = [&options](double done) { options.progress(0.5 * done); };
        second = [&options](double done) { options.progress(0.5 + 0.5 * done); };
    }
};

// Hands each part of the faces to WRITE(output_file&, std::span<const voxel_face>, progress_meter&); commits all at the
// end. `probe`: the file of `path`, opened before the faces were found, so that a path that cannot be written costs no
// work.
template <class Write>
std::vector<std::filesystem::path> write_parts(std::unique_ptr<output_file> probe, std::span<const voxel_face> faces,
                                               const std::filesystem::path& path, const write_options& options,
                                               std::uint64_t most, const std::function<void(double)>& progress,
                                               const Write& write) {
    const std::vector<file_part> parts = split(faces, path, most_faces(most, options));
    progress_meter meter(progress, 2 * static_cast<std::uint64_t>(faces.size())); // about one vertex a face
    std::vector<std::unique_ptr<output_file>> files;
    for (const file_part& part : parts) {
        if (parts.size() == 1)
            files.push_back(std::move(probe));
        else
            files.push_back(std::make_unique<output_file>(part.path));
        write(*files.back(), part.faces, meter);
    }
    return commit_all(files);
}

// The same with the faces of the shape.
template <class Write>
std::vector<std::filesystem::path> write_parts(const voxel_shape& v, const std::filesystem::path& path,
                                               const write_options& options, std::uint64_t most, const Write& write) {
    auto probe = std::make_unique<output_file>(path);
    const halves_of_progress halves(options);
    const std::vector<voxel_face> faces = voxel_faces(v, options.merge_faces, options.threads, halves.first);
    return write_parts(std::move(probe), faces, path, options, most, halves.second, write);
}

// Decimal text of every lattice coordinate, made once.
struct coordinate_texts {
    std::array<std::vector<std::string>, 3> of_axis;

    coordinate_texts(const voxel_shape& v, double shift, std::int64_t more) {
        for (std::size_t a = 0; a < 3; ++a)
            for (std::int64_t n = 0; n < v.extent[a] + more; ++n)
                of_axis[a].push_back(number(world(v, a, static_cast<double>(n) + shift)));
    }
    void append(std::string& out, std::size_t x, std::size_t y, std::size_t z) const {
        out.append(of_axis[0][x]).append(1, ' ').append(of_axis[1][y]).append(1, ' ').append(of_axis[2][z]);
    }
};

} // namespace voxelize
