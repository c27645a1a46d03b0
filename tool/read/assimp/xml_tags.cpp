// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#include "xml_tags.hpp"

#include <algorithm>
#include <array>

namespace voxelize::assimp {
namespace {

constexpr std::string_view xml_blank = " \t\r\n";

} // namespace

bool xml_tags::next() {
    const auto skip_to = [this](std::string_view end) {
        const std::size_t at = rest_.find(end);
        rest_.remove_prefix(at == std::string_view::npos ? rest_.size() : at + end.size());
    };
    while (true) {
        rest_.remove_prefix(std::min(rest_.find('<'), rest_.size()));
        if (rest_.empty()) return false;
        if (rest_.starts_with("<!--")) {
            skip_to("-->");
        } else if (rest_.starts_with("<![CDATA[")) {
            skip_to("]]>");
        } else if (rest_.starts_with("<?") || rest_.starts_with("<!")) {
            skip_to(">");
        } else {
            break;
        }
    }
    // A '>' in quotes does not end the tag.
    std::size_t end = 1;
    for (char quote = 0; end < rest_.size() && (quote != 0 || rest_[end] != '>'); ++end) {
        const char c = rest_[end];
        if (quote != 0)
            quote = c == quote ? '\0' : quote;
        else if (c == '"' || c == '\'')
            quote = c;
    }
    if (end == rest_.size()) return false;
    std::string_view inside = rest_.substr(1, end - 1);
    rest_.remove_prefix(end + 1);
    begins = !inside.starts_with('/');
    ends = !begins || inside.ends_with('/');
    if (!begins) inside.remove_prefix(1);
    if (begins && ends) inside.remove_suffix(1);
    const std::size_t stop = std::min(inside.find_first_of(xml_blank), inside.size());
    name = local(inside.substr(0, stop));
    read_attributes(inside.substr(stop));
    return true;
}

void xml_tags::read_attributes(std::string_view inside) {
    attributes.clear();
    while (true) {
        inside.remove_prefix(std::min(inside.find_first_not_of(xml_blank), inside.size()));
        const std::size_t equals = inside.find('=');
        if (equals == std::string_view::npos) return;
        const std::string_view key = inside.substr(0, std::min(inside.find_first_of(" \t\r\n="), inside.size()));
        inside.remove_prefix(equals + 1);
        inside.remove_prefix(std::min(inside.find_first_not_of(xml_blank), inside.size()));
        if (inside.empty()) return;
        const std::size_t close = inside.find(inside.front(), 1);
        if (close == std::string_view::npos) return;
        attributes.emplace_back(key, inside.substr(1, close - 1));
        inside.remove_prefix(close + 1);
    }
}

std::string xml_unescaped(std::string_view text) {
    constexpr std::array<std::pair<std::string_view, char>, 5> entities{
        {{"&amp;", '&'}, {"&lt;", '<'}, {"&gt;", '>'}, {"&quot;", '"'}, {"&apos;", '\''}}};
    std::string result;
    while (!text.empty()) {
        const auto* const found = std::find_if(entities.begin(), entities.end(),
                                               [&](const auto& entity) { return text.starts_with(entity.first); });
        result += found != entities.end() ? found->second : text.front();
        text.remove_prefix(found != entities.end() ? found->first.size() : 1);
    }
    return result;
}

} // namespace voxelize::assimp
