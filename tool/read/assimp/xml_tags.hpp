// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// The tags of an XML document in UTF-8, one after the other, without its text: for formats that state everything in
// attributes. Names lose their namespace's prefix.

#include <cstddef>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace voxelize::assimp {

class xml_tags {
public:
    explicit xml_tags(std::string_view text) : rest_(text) {}

    std::string_view name;                                                 // of the tag, without a prefix
    bool begins = false, ends = false;                                     // both: <name/>
    std::vector<std::pair<std::string_view, std::string_view>> attributes; // as the file has them, with prefixes

    // False behind the last, and where the document is cut short.
    [[nodiscard]] bool next();
    // The value of the attribute of this name, whatever its prefix; empty for a tag without it.
    [[nodiscard]] std::string_view value(std::string_view of) const {
        for (const auto& [key, text] : attributes)
            if (local(key) == of) return text;
        return {};
    }

private:
    [[nodiscard]] static std::string_view local(std::string_view key) { return key.substr(key.find(':') + 1); }
    void read_attributes(std::string_view inside);

    std::string_view rest_;
};

// TEXT with the five entities that XML defines replaced.
[[nodiscard]] std::string xml_unescaped(std::string_view text);

} // namespace voxelize::assimp
