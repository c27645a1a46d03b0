// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0

#include "png.hpp"

#include "deflate.hpp"

#include <cstdlib>
#include <exception>
#include <libdeflate.h>
#include <new>

// stb_image_write filters and frames; libdeflate compresses, several times as fast as stb's own code.
namespace {
unsigned char* compress_png(unsigned char* data, int size, int* packed_size, int) try {
    *packed_size = 0;
    constexpr int level = 4;
    const voxelize::whole_compressor compressor(level);
    const std::size_t bound = libdeflate_zlib_compress_bound(compressor.get(), static_cast<std::size_t>(size));
    auto* packed = static_cast<unsigned char*>(std::malloc(bound)); // stb frees it
    if (packed != nullptr)
        *packed_size = static_cast<int>(
            libdeflate_zlib_compress(compressor.get(), data, static_cast<std::size_t>(size), packed, bound));
    return packed;
} catch (const std::bad_alloc&) { // stb's way to say so
    return nullptr;
}
} // namespace

#define STBIW_ZLIB_COMPRESS compress_png
#define STB_IMAGE_WRITE_IMPLEMENTATION
#define STB_IMAGE_WRITE_STATIC
#include <stb_image_write.h>

namespace voxelize {

std::vector<std::filesystem::path> write_picture(const std::filesystem::path& path, const write_options& options,
                                                 const std::function<image(const preview_options&)>& render) {
    preview_options preview = options.preview;
    preview.up = options.up;
    preview.threads = options.threads;
    output_file out(path); // first, so that a path that cannot be written costs no rendering
    const image picture = render(preview);

    struct sink {
        output_file& out;
        std::exception_ptr failure{};
    } to{out};
    const auto on_bytes = [](void* context, void* data, int size) {
        auto& target = *static_cast<sink*>(context);
        if (target.failure) return;
        try {
            target.out.write(std::span{static_cast<const std::byte*>(data), static_cast<std::size_t>(size)});
        } catch (...) {
            target.failure = std::current_exception(); // C code is between here and the caller
        }
    };
    const int ok = stbi_write_png_to_func(on_bytes, &to, picture.width, picture.height, picture.components,
                                          picture.pixels.data(), picture.width * picture.components);
    if (to.failure) std::rethrow_exception(to.failure);
    if (ok == 0) throw write_error(path, "out of memory");
    out.commit();
    return {path};
}

std::vector<std::filesystem::path> write_png(const volume& v, const std::filesystem::path& path,
                                             const write_options& options) {
    return write_picture(path, options,
                         [&](const preview_options& preview) { return render_preview(v, preview, options.progress); });
}

} // namespace voxelize
