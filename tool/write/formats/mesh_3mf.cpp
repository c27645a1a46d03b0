// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "mesh_3mf.hpp"

#include "deflate.hpp"
#include "mesh_parts.hpp"
#include "model/parallel.hpp"
#include "zip.hpp"

#include <algorithm>
#include <string_view>

namespace voxelize {
namespace {

constexpr std::string_view content_types =
    R"(<?xml version="1.0" encoding="UTF-8"?>
<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">
<Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/>
<Default Extension="model" ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/>
</Types>
)";
constexpr std::string_view relationships =
    R"(<?xml version="1.0" encoding="UTF-8"?>
<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">
<Relationship Target="/3D/3dmodel.model" Id="rel0" Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/>
</Relationships>
)";
constexpr std::string_view model_head =
    R"(<?xml version="1.0" encoding="UTF-8"?>
<model unit="millimeter" xml:lang="en-US" xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02" xmlns:m="http://schemas.microsoft.com/3dmanufacturing/material/2015/02">
<metadata name="Application">voxelize</metadata>
<resources>
)";

// The text of the model, which is handed over piece by piece and in order.
class model_text {
public:
    model_text(std::span<const voxel_face> faces, const voxel_shape& v, int threads)
        : faces_(faces), mesh_(weld(faces, v.extent, threads, false)), threads_(threads), coordinates_(v, 0, 1) {
        if (!v.colored()) return;
        for (const voxel_face& face : faces)
            if (colors_.empty() || colors_.back() != face.rgb) colors_.push_back(face.rgb);
        std::sort(colors_.begin(), colors_.end());
        colors_.erase(std::unique(colors_.begin(), colors_.end()), colors_.end());
    }

    // True if the text may have 4 GiB or more.
    [[nodiscard]] bool is_large() const {
        constexpr std::uint64_t most_of_line = 128; // of a vertex or a triangle
        return (mesh_.vertices.size() + 2 * faces_.size() + colors_.size() + 16) * most_of_line > 0xffff'ffffU;
    }

    // Calls USE(n, MAKE(std::string text)) for all pieces: MAKE on all threads.
    template <class Make, class Use>
    void for_each_piece(const Make& make, const Use& use) const {
        const std::size_t colors = pieces_of(colors_.size()), vertices = pieces_of(mesh_.vertices.size()),
                          triangles = pieces_of(faces_.size());
        ordered_for(
            colors + vertices + triangles + 1, thread_count(threads_),
            [&](std::size_t n) {
                std::string text;
                if (n == 0) text += model_head;
                if (n == 0 && !colors_.empty()) text += "<m:colorgroup id=\"2\">\n";
                if (n < colors) {
                    for_items(n, colors_.size(), [&](std::size_t i) { add_3mf_color(text, colors_[i]); });
                    return make(std::move(text));
                }
                if (n == colors && !faces_.empty()) text += begin_of_object();
                if (n < colors + vertices) {
                    for_items(n - colors, mesh_.vertices.size(), [&](std::size_t i) { add_vertex(text, i); });
                    return make(std::move(text));
                }
                if (n == colors + vertices && !faces_.empty()) text += "</vertices>\n<triangles>\n";
                if (n < colors + vertices + triangles) {
                    for_items(n - colors - vertices, faces_.size(), [&](std::size_t i) { add_triangles(text, i); });
                    return make(std::move(text));
                }
                text += faces_.empty() ? "</resources>\n<build/>\n</model>\n"
                                       : "</triangles>\n</mesh>\n</object>\n</resources>\n"
                                         "<build>\n<item objectid=\"1\"/>\n</build>\n</model>\n";
                return make(std::move(text));
            },
            use);
    }

private:
    static constexpr std::size_t piece_items = std::size_t{1} << 12; // some 200 KB of text

    static std::size_t pieces_of(std::size_t items) { return (items + piece_items - 1) / piece_items; }
    template <class Visit>
    static void for_items(std::size_t piece, std::size_t count, const Visit& visit) {
        for (std::size_t i = piece * piece_items; i < std::min(count, (piece + 1) * piece_items); ++i) visit(i);
    }
    [[nodiscard]] std::string begin_of_object() const {
        const std::string with_color = colors_.empty() ? "" : " pid=\"2\" pindex=\"0\"";
        return std::string(colors_.empty() ? "" : "</m:colorgroup>\n") +
               "<object id=\"1\" type=\"model\" name=\"voxels\"" + with_color + ">\n<mesh>\n<vertices>\n";
    }
    void add_vertex(std::string& text, std::size_t n) const {
        const std::array<std::uint32_t, 3>& corner = mesh_.vertices[n].corner;
        text.append("<vertex x=\"").append(coordinates_.of_axis[0][corner[0]]);
        text.append("\" y=\"").append(coordinates_.of_axis[1][corner[1]]);
        text.append("\" z=\"").append(coordinates_.of_axis[2][corner[2]]).append("\"/>\n");
    }
    void add_triangles(std::string& text, std::size_t n) const {
        const std::array<std::uint32_t, 4>& quad = mesh_.quads[n];
        std::string color;
        if (!colors_.empty()) {
            const auto at = std::lower_bound(colors_.begin(), colors_.end(), faces_[n].rgb) - colors_.begin();
            color = " pid=\"2\" p1=\"" + std::to_string(at) + '"';
        }
        for (std::size_t t = 0; t < 2; ++t) {
            text.append("<triangle v1=\"").append(std::to_string(quad[0]));
            text.append("\" v2=\"").append(std::to_string(quad[t + 1]));
            text.append("\" v3=\"").append(std::to_string(quad[t + 2])).append(1, '"').append(color).append("/>\n");
        }
    }

    std::span<const voxel_face> faces_;
    welded_mesh mesh_;
    int threads_;
    coordinate_texts coordinates_;
    std::vector<std::uint32_t> colors_; // ascending, no two alike; empty: the model has no colours
};

void add_small(zip_archive& archive, const std::string& name, std::string_view text) {
    archive.add(
        name, [&](const entry_sink& add) { add(std::as_bytes(std::span{text})); }, false);
}

void write_package(output_file& out, const model_text& model, const write_options& options,
                   const std::function<void()>& piece_done) {
    zip_archive archive(out, options.compression);
    add_small(archive, "[Content_Types].xml", content_types);
    add_small(archive, "_rels/.rels", relationships);
    const std::string name = "3D/3dmodel.model";
    if (options.compression == 0) {
        archive.add(
            name,
            [&](const entry_sink& add) {
                model.for_each_piece([](std::string text) { return text; },
                                     [&](std::size_t, const std::string& text) {
                                         add(std::as_bytes(std::span{text}));
                                         piece_done();
                                     });
            },
            model.is_large());
    } else {
        archive.add_compressed(
            name,
            [&](const entry_sink& add) {
                piece_compressor compressor(piece_compressor::form::stream_part, options.compression);
                running_crc whole;
                model.for_each_piece(
                    [&](const std::string& text) {
                        return compressor.compress(std::as_bytes(std::span{text}), text.size());
                    },
                    [&](std::size_t, const std::shared_ptr<const compressed_piece>& piece) {
                        add(piece->bytes);
                        whole.add(*piece);
                        piece_done();
                    });
                add(deflate_end);
                return zip_archive::source{whole.size, whole.crc};
            },
            model.is_large());
    }
    archive.finish();
}

} // namespace

void add_3mf_color(std::string& text, std::uint32_t rgb) {
    constexpr std::string_view digits = "0123456789ABCDEF";
    text += "<m:color color=\"#";
    for (const std::uint8_t c : {red(rgb), green(rgb), blue(rgb)}) {
        text += digits[c >> 4U];
        text += digits[c & 15U];
    }
    text += "\"/>\n";
}

void write_3mf_package(output_file& out, int compression, bool is_large, bool is_empty,
                       const std::function<void(const entry_sink&)>& objects) {
    zip_archive archive(out, compression);
    add_small(archive, "[Content_Types].xml", content_types);
    add_small(archive, "_rels/.rels", relationships);
    archive.add(
        "3D/3dmodel.model",
        [&](const entry_sink& add) {
            add(std::as_bytes(std::span{model_head}));
            if (!is_empty) objects(add);
            const std::string_view end = is_empty
                                             ? "</resources>\n<build/>\n</model>\n"
                                             : "</resources>\n<build>\n<item objectid=\"1\"/>\n</build>\n</model>\n";
            add(std::as_bytes(std::span{end}));
        },
        is_large);
    archive.finish();
}

std::vector<std::filesystem::path> write_3mf(const voxel_shape& v, const std::filesystem::path& path,
                                             const write_options& options) {
    return write_parts(v, path, options, max_3mf_faces,
                       [&](output_file& out, std::span<const voxel_face> faces, progress_meter& meter) {
                           const model_text model(faces, v, options.threads);
                           constexpr std::uint64_t of_piece = 1 << 12;
                           write_package(out, model, options, [&] { meter.advance(of_piece); });
                       });
}

} // namespace voxelize
