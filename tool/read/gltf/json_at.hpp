// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once
// A value of a JSON document that knows how it was reached, so that whatever is wrong there is said with its path:
// "meshes[2].primitives[0].indices: 9 is not in accessors, which has 4". Getters give nothing for an absent member and
// throw gltf_error for one of the wrong type or range.

#include "read/gltf_scene.hpp"
#include "text.hpp"

#include <nlohmann/json.hpp>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace voxelize::gltf {

using nlohmann::json;

// Refers to its value and to its parent: both must outlive it.
class json_at {
public:
    explicit json_at(json& value) : value_{&value} {}

    [[nodiscard]] json& value() const { return *value_; }

    // Index of an array's element.
    [[nodiscard]] std::size_t index_in_list() const { return index_; }

    [[nodiscard]] std::string path() const {
        if (parent_ == nullptr) return "";
        if (key_.empty()) return parent_->path() + '[' + std::to_string(index_) + ']';
        const std::string above = parent_->path();
        return above.empty() ? printable(key_) : above + '.' + printable(key_);
    }

    [[noreturn]] void fail(const std::string& why) const {
        const std::string where = path();
        throw gltf_error(where.empty() ? why : where + ": " + why);
    }

    [[nodiscard]] std::optional<json_at> member(std::string_view key) const {
        const auto found = value_->find(key);
        if (found == value_->end()) return std::nullopt;
        return json_at{*found, *this, key, 0};
    }

    [[nodiscard]] std::optional<json_at> object(std::string_view key) const {
        const auto found = member(key);
        if (found && !found->value_->is_object()) found->fail("must be an object");
        return found;
    }

    // Number of elements of the array KEY, 0 where it is absent.
    [[nodiscard]] std::size_t array_size(std::string_view key) const {
        const auto found = member(key);
        if (!found) return 0;
        if (!found->value_->is_array()) found->fail("must be an array");
        return found->value_->size();
    }

    // VISIT(json_at element) for every element of the array KEY.
    template <class Visit>
    void each(std::string_view key, Visit&& visit) const {
        if (array_size(key) == 0) return;
        const json_at list = *member(key);
        std::size_t index = 0;
        for (json& element : *list.value_) visit(json_at{element, list, {}, index++});
    }

    // The same, and every element must be an object.
    template <class Visit>
    void each_object(std::string_view key, Visit&& visit) const {
        each(key, [&](const json_at& element) {
            if (!element.value_->is_object()) element.fail("must be an object");
            visit(element);
        });
    }

    // JSON does not tell 3 from 3.0: an integral float is accepted, and replaced by the integer.
    [[nodiscard]] std::uint64_t as_integer(std::uint64_t low, std::uint64_t high) const {
        if (value_->is_number_float()) {
            const double number = value_->get<double>();
            if (number >= 0 && number <= 9007199254740992.0 && number == std::floor(number))
                *value_ = static_cast<std::uint64_t>(number);
        }
        if (!value_->is_number_unsigned()) fail("must be a non-negative integer, it is " + shown());
        const auto number = value_->get<std::uint64_t>();
        if (number < low || number > high)
            fail(shown() + " is not in the range " + std::to_string(low) + " to " + std::to_string(high));
        return number;
    }

    [[nodiscard]] std::optional<std::uint64_t> integer(std::string_view key, std::uint64_t low,
                                                       std::uint64_t high) const {
        const auto found = member(key);
        return found ? std::optional{found->as_integer(low, high)} : std::nullopt;
    }

    // A reference to one of the SIZE elements of the file's list LIST.
    [[nodiscard]] std::uint32_t as_index(std::string_view list, std::size_t size) const {
        const std::uint64_t number = as_integer(0, UINT32_MAX);
        if (number >= size) fail(shown() + " is not in " + std::string(list) + ", which has " + std::to_string(size));
        return static_cast<std::uint32_t>(number);
    }

    [[nodiscard]] std::optional<std::uint32_t> index(std::string_view key, std::string_view list,
                                                     std::size_t size) const {
        const auto found = member(key);
        return found ? std::optional{found->as_index(list, size)} : std::nullopt;
    }

    [[nodiscard]] std::optional<double> number(std::string_view key) const {
        const auto found = member(key);
        if (!found) return std::nullopt;
        if (!found->value_->is_number()) found->fail("must be a number, it is " + found->shown());
        *found->value_ = found->value_->get<double>(); // see check_numbers
        return found->value_->get<double>();
    }

    // True if KEY is there; it must then be an array of COUNT numbers. They are made floats, since tinygltf cuts
    // integers to 32 bits.
    bool check_numbers(std::string_view key, std::size_t count) const {
        const auto found = member(key);
        if (!found) return false;
        if (array_size(key) != count) found->fail("must have " + std::to_string(count) + " numbers");
        for (json& element : *found->value_) {
            if (!element.is_number()) found->fail("must have numbers only");
            element = element.get<double>();
        }
        return true;
    }

    [[nodiscard]] std::optional<bool> boolean(std::string_view key) const {
        const auto found = member(key);
        if (!found) return std::nullopt;
        if (!found->value_->is_boolean()) found->fail("must be true or false, it is " + found->shown());
        return found->value_->get<bool>();
    }

    // Valid as long as the document.
    [[nodiscard]] std::optional<std::string_view> string(std::string_view key) const {
        const auto found = member(key);
        if (!found) return std::nullopt;
        if (!found->value_->is_string()) found->fail("must be a string, it is " + found->shown());
        return std::string_view{found->value_->get_ref<const std::string&>()};
    }

    template <class Value>
    [[nodiscard]] Value required(std::string_view key, std::optional<Value> value) const {
        if (!value) fail("has no " + std::string(key));
        return std::move(*value);
    }

    // Removes every member that is not listed: what stays has been checked.
    void keep_only(std::initializer_list<std::string_view> keys) const {
        std::vector<std::string> others;
        for (const auto& entry : value_->items()) {
            bool listed = false;
            for (const std::string_view key : keys) listed = listed || entry.key() == key;
            if (!listed) others.push_back(entry.key());
        }
        for (const std::string& key : others) value_->erase(key);
    }

    // The value as it stands in the file, for messages.
    [[nodiscard]] std::string shown() const {
        if (value_->is_object()) return "an object";
        if (value_->is_array()) return "an array";
        if (value_->is_string()) return in_quotes(value_->get_ref<const std::string&>());
        return printable(value_->dump());
    }

private:
    json_at(json& value, const json_at& parent, std::string_view key, std::size_t index)
        : value_{&value}, parent_{&parent}, key_{key}, index_{index} {}

    json* value_;
    const json_at* parent_ = nullptr;
    std::string_view key_;  // empty for an array's element
    std::size_t index_ = 0; // of an array's element
};

} // namespace voxelize::gltf
