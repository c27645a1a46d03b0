// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "resources.hpp"

#include "model/system.hpp"
#include "picture_file.hpp"
#include "text.hpp"

#include <tiny_gltf.h>

#include <cerrno>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <system_error>

namespace voxelize::gltf {

namespace {

std::vector<std::byte> decode_data_uri(std::string uri) {
    // tinygltf knows PNG, JPEG and a few more; what a picture really is, its bytes say.
    constexpr std::string_view image = "data:image/";
    constexpr std::string_view base64 = ";base64,";
    if (const std::size_t end = uri.find(base64); uri.starts_with(image) && end < 64)
        uri.replace(0, end + base64.size(), "data:image/png;base64,");
    if (!tinygltf::IsDataURI(uri)) throw gltf_error("a data URI that is not base64 of a known media type");
    std::vector<unsigned char> decoded;
    std::string media_type;
    if (!tinygltf::DecodeDataURI(&decoded, media_type, uri, 0, false))
        throw gltf_error("a data URI without valid base64 data");
    std::vector<std::byte> bytes(decoded.size());
    std::memcpy(bytes.data(), decoded.data(), decoded.size());
    return bytes;
}

int hex_digit(char c) {
    if (c >= '0' && c <= '9') return c - '0';
    if (c >= 'a' && c <= 'f') return c - 'a' + 10;
    if (c >= 'A' && c <= 'F') return c - 'A' + 10;
    return -1;
}

std::string percent_decoded(std::string_view uri) {
    std::string text;
    for (std::size_t i = 0; i < uri.size(); ++i) {
        if (uri[i] == '%' && i + 2 < uri.size() && hex_digit(uri[i + 1]) >= 0 && hex_digit(uri[i + 2]) >= 0) {
            text += static_cast<char>(hex_digit(uri[i + 1]) * 16 + hex_digit(uri[i + 2]));
            i += 2;
        } else {
            text += uri[i];
        }
    }
    return text;
}

} // namespace

std::filesystem::path local_path(const std::string& uri) {
    const std::string text = percent_decoded(uri);
    if (text.empty()) throw gltf_error("an empty file name");
    if (text.find('\0') != std::string::npos) throw gltf_error("a file name with a zero byte");
    if (const std::size_t colon = text.find(':'); colon != std::string::npos && text.find('/') > colon)
        throw gltf_error("not a relative path");
    std::filesystem::path path = std::filesystem::path(text).lexically_normal();
    if (path.has_root_path() || text.front() == '\\') throw gltf_error("not a relative path");
    if (path.begin()->string() == "..") throw gltf_error("a path that leaves the folder of the file");
    return path;
}

resources::resources(const checked_document& document, std::span<const std::byte> binary, bool has_binary,
                     const gltf_file_reader& read_file, budget& memory, leniency& tolerance,
                     const file_mapper& map_file)
    : document_{document}, read_file_{read_file}, memory_{memory} {
    owned_.reserve(document.buffers.size());
    for (std::size_t index = 0; index < document.buffers.size(); ++index) {
        const buffer_source& source = document.buffers[index];
        std::span<const std::byte> bytes;
        if (source.uri) {
            try {
                if (map_file && !source.uri->starts_with("data:")) {
                    bytes = map_file(local_path(*source.uri));
                    memory_.grant_input(bytes.size());
                } else {
                    owned_.push_back(fetch(*source.uri));
                    bytes = owned_.back();
                }
            } catch (const gltf_error& error) {
                throw gltf_error("buffers[" + std::to_string(index) + "].uri " + in_quotes(*source.uri) + ": " +
                                 error.what());
            }
        } else if (index == 0 && has_binary) {
            bytes = binary;
        } else {
            buffers_.emplace_back();
            continue;
        }
        if (bytes.size() < source.byte_length) {
            const std::string what = "buffers[" + std::to_string(index) + "]: byteLength says " +
                                     std::to_string(source.byte_length) + ", the data has " +
                                     std::to_string(bytes.size());
            // Padding that was counted and not written.
            if (source.byte_length - bytes.size() >= 4) throw gltf_error(what);
            tolerance.accept(what, "the rest is taken as zero");
            memory_.charge(source.byte_length, 1, "buffers");
            owned_.emplace_back(bytes.begin(), bytes.end()).resize(source.byte_length);
            bytes = owned_.back();
        }
        buffers_.push_back(bytes.first(source.byte_length));
    }
}

std::span<const std::byte> resources::buffer(std::size_t index) const {
    if (buffers_[index].empty()) throw gltf_error("buffers[" + std::to_string(index) + "] has no data");
    return buffers_[index];
}

std::vector<std::byte> resources::fetch(const std::string& uri) const {
    if (uri.starts_with("data:")) return decode_data_uri(uri);
    const std::filesystem::path path = local_path(uri);
    if (!read_file_) throw gltf_error("other files are not read");
    std::vector<std::byte> bytes = read_file_(path, memory_.limits().max_file_bytes);
    memory_.grant_input(bytes.size());
    return bytes;
}

std::string resources::image_title(std::size_t index) const {
    const image_source& source = document_.images[index];
    if (!source.name.empty()) return ' ' + in_quotes(source.name);
    if (source.uri && !source.uri->starts_with("data:")) return ' ' + in_quotes(*source.uri);
    return "";
}

picture resources::decode_image(std::size_t index, std::span<const std::byte> view_bytes) const {
    const image_source& source = document_.images[index];
    std::vector<std::byte> fetched;
    std::span<const std::byte> bytes = view_bytes;
    if (source.uri) {
        try {
            fetched = fetch(*source.uri);
        } catch (const gltf_error& error) {
            throw gltf_error(in_quotes(*source.uri) + ": " + error.what());
        }
        bytes = fetched;
    } else if (!source.buffer_view) {
        throw gltf_error("it has neither a uri nor a bufferView");
    }
    picture result = decode_picture(bytes, memory_.limits());
    result.name = source.name;
    return result;
}

void name_files(const checked_document& document, const gltf_options& options) {
    if (!options.names_file) return;
    const auto name = [&](const std::optional<std::string>& uri) {
        if (!uri || uri->starts_with("data:")) return;
        try {
            options.names_file(local_path(*uri));
        } catch (const gltf_error&) { // no file of this model's; its reader says so
        }
    };
    for (const buffer_source& source : document.buffers) name(source.uri);
    for (const image_source& source : document.images) name(source.uri);
}

gltf_file_reader folder_reader(std::filesystem::path folder) {
    return [folder = std::move(folder)](const std::filesystem::path& relative, std::uint64_t max_bytes) {
        return read_whole_file(folder / relative, max_bytes);
    };
}

std::size_t checked_file_size(const std::filesystem::path& file, std::uint64_t max_bytes) {
    std::error_code error;
    const std::filesystem::file_status status = std::filesystem::status(file, error);
    if (status.type() == std::filesystem::file_type::not_found) throw gltf_error("no such file");
    if (!std::filesystem::exists(status)) throw gltf_error("cannot be read: " + error.message());
    if (!std::filesystem::is_regular_file(status)) throw gltf_error("not a regular file");
    const std::uintmax_t size = std::filesystem::file_size(file, error);
    if (error) throw gltf_error("cannot be read: " + error.message());
    if (size > max_bytes)
        throw gltf_error("has " + std::to_string(size) + " bytes, more than the " + std::to_string(max_bytes) +
                         " allowed");
    return static_cast<std::size_t>(size);
}

std::vector<std::byte> read_whole_file(const std::filesystem::path& file, std::uint64_t max_bytes) {
    const std::size_t size = checked_file_size(file, max_bytes);
    std::ifstream stream(file, std::ios::binary);
    std::vector<std::byte> bytes(size);
    const int why_closed = stream.is_open() ? 0 : errno;
    if (!stream.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(size)) && size != 0)
        throw gltf_error("cannot be read: " + (why_closed != 0 ? std::generic_category().message(why_closed)
                                                               : "it ends after " + std::to_string(stream.gcount()) +
                                                                     " of its " + std::to_string(size) + " bytes"));
    return bytes;
}

mapped_file::mapped_file(const std::filesystem::path& file, std::uint64_t max_bytes) {
    size_ = checked_file_size(file, max_bytes);
    if (size_ == 0) return;
    data_ = os::map_file(file, size_);
    if (data_ == nullptr) throw gltf_error("cannot be read: " + std::generic_category().message(errno));
}

mapped_file::~mapped_file() {
    if (data_ != nullptr) os::unmap_file(data_, size_);
}

} // namespace voxelize::gltf
