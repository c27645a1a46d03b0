// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Where a mesh crosses the edges that a surface crosses: of the crossings of the row between the edge's samples, sorted
// by exact position, then triangle, those at which the verdict of the fill rule changes; they are odd in number where
// the samples' verdicts differ, and the middle one of them is the edge's.

#include <voxelpipe/core/shared_counter.hpp>
#include <voxelpipe/solid/solid.hpp>
#include <voxelpipe/surfaces/core/edge_crossing.hpp>
#include <voxelpipe/surfaces/passes/cells.hpp>
#include <voxelpipe/surfaces/passes/mesh_rows.hpp>

#include <cstdint>

namespace voxelpipe::core::passes {

// Counts of all edges.
enum class edge_count : int { on_cones, made, count };

// The crossing of a crossed edge along Axis. For edges_of_cell.
template <int Axis>
struct cross_mesh {
    mesh_triangles mesh;
    row_keys<Axis> rows;
    const row_range* ranges; // of rows; null: rows are looked for among the keys
    const std::uint64_t* keys;
    std::uint64_t count; // of keys
    const std::uint32_t* triangles;
    fill_rule rule;
    bool each_draw; // inside of any draw
    int fraction;
    edge_crossing* crossings;
    std::uint64_t* counts;       // by edge_count
    counted_layers counted = {}; // of cells

    VOXELPIPE_HD void operator()(std::uint64_t number, int, const glm::ivec3& low, bool goes_out) const {
        const std::int64_t p[3] = {low.x, low.y, low.z};
        crossings[number] = find(p, goes_out, counted.has(low.z + 1));
    }

private:
    // A stretch of the list: the crossings of a row before the edge, then those of the edge.
    struct stretch {
        std::uint64_t row, begin, end;
    };
    // A crossing of the edge, in the order by position, then triangle.
    struct place {
        edge_position position;
        std::uint32_t triangle;
    };
    [[nodiscard]] VOXELPIPE_HD static bool is_before(const place& a, const place& b) {
        const int order = compare(a.position, b.position);
        return order != 0 ? order < 0 : b.triangle > a.triangle; // nvcc takes a.triangle < for a template
    }
    [[nodiscard]] VOXELPIPE_HD static std::int64_t winding_of(std::uint64_t key) { return (key & 1) != 0 ? -1 : 1; }

    [[nodiscard]] VOXELPIPE_HD row_range range_of(std::uint64_t row) const {
        if (ranges != nullptr) return ranges[row];
        return {count_below(keys, count, row << rows.bits), count_below(keys, count, (row + 1) << rows.bits)};
    }
    [[nodiscard]] VOXELPIPE_HD edge_crossing find(const std::int64_t (&p)[3], bool goes_out, bool is_counted) const {
        constexpr int u = row_keys<Axis>::u, v = row_keys<Axis>::v;
        const std::uint64_t row = rows.row(p[u], p[v]);
        const row_range range = range_of(row);
        const std::uint64_t low = range.begin, length = range.end - low;
        // The first sample beyond these crossings is the edge's upper one.
        const std::uint64_t from = rows.key(row, p[Axis] + 1, false), to = rows.key(row, p[Axis] + 2, false);
        const stretch s{low, low + count_below(keys + low, length, from), low + count_below(keys + low, length, to)};
        const std::int64_t half = std::int64_t{1} << (fraction - 1);
        const snapped_position sample{(p[0] << fraction) + half, (p[1] << fraction) + half, (p[2] << fraction) + half};

        place chosen{};
        exact_normal n{};
        const bool is_one = s.end - s.begin == 1;
        bool found = false;
        if (is_one) { // as most are
            const std::uint32_t triangle = triangles[s.begin];
            n = normal(triangle);
            chosen = {position_on_edge(n, mesh.positions[mesh.triangles[triangle].x], sample, Axis, fraction),
                      triangle};
            found = changes_verdict(s, sample, chosen);
        } else if (s.begin != s.end) {
            found = choose(s, sample, chosen);
            if (found) n = normal(chosen.triangle);
        }
        if (!found) {
            if (is_counted) add_shared(counts[static_cast<int>(edge_count::made)], 1);
            return {};
        }
        edge_crossing c;
        c.t = round_position(chosen.position);
        set_normal(c, n, Axis, goes_out);
        if (mesh.drawn > chosen.triangle)
            c.triangle = chosen.triangle;
        else if (is_counted)
            add_shared(counts[static_cast<int>(edge_count::on_cones)], 1);
        return c;
    }

    // Whether the verdict changes at the only crossing of an edge.
    [[nodiscard]] VOXELPIPE_HD bool changes_verdict(const stretch& s, const snapped_position& sample,
                                                    const place& only) const {
        if (each_draw) return verdict(s, sample, &only) != verdict(s, sample, nullptr);
        const std::int64_t before = winding(s, sample, nullptr, false, 0);
        return is_inside(rule, before) != is_inside(rule, before + winding_of(keys[s.begin]));
    }
    // The middle one of an odd number of changes of the verdict; false if their number is even.
    [[nodiscard]] VOXELPIPE_HD bool choose(const stretch& s, const snapped_position& sample, place& chosen) const {
        bool inside = verdict(s, sample, nullptr);
        const bool first_inside = inside;
        std::uint64_t changes = 0;
        place last{};
        for (bool any = false; next(s, sample, any, last); any = true) {
            const bool now = verdict(s, sample, &last);
            changes += now != inside ? 1 : 0;
            inside = now;
        }
        if (changes % 2 == 0) return false;
        std::uint64_t left = changes / 2 + 1;
        inside = first_inside;
        for (bool any = false; next(s, sample, any, chosen); any = true) {
            const bool now = verdict(s, sample, &chosen);
            if (now != inside && --left == 0) return true;
            inside = now;
        }
        return false;
    }

    [[nodiscard]] VOXELPIPE_HD exact_normal normal(std::uint32_t triangle) const {
        const glm::uvec3 t = mesh.triangles[triangle];
        return normal_of(mesh.positions[t.x], mesh.positions[t.y], mesh.positions[t.z]);
    }
    [[nodiscard]] VOXELPIPE_HD place at(std::uint64_t i, const snapped_position& sample) const {
        const std::uint32_t t = triangles[i];
        return {position_on_edge(normal(t), mesh.positions[mesh.triangles[t].x], sample, Axis, fraction), t};
    }
    // The first crossing of the edge, or the first one after `last`. A triangle crosses a row once at most.
    [[nodiscard]] VOXELPIPE_HD bool next(const stretch& s, const snapped_position& sample, bool has_last,
                                         place& last) const {
        bool found = false;
        place best{};
        for (std::uint64_t i = s.begin; i < s.end; ++i) {
            const place p = at(i, sample);
            if (has_last && !is_before(last, p)) continue;
            if (found && !is_before(p, best)) continue;
            best = p;
            found = true;
        }
        if (found) last = best;
        return found;
    }

    // Whether the row is inside just beyond a crossing of the edge; null: at the lower sample.
    [[nodiscard]] VOXELPIPE_HD bool verdict(const stretch& s, const snapped_position& sample, const place* upto) const {
        if (!each_draw) return is_inside(rule, winding(s, sample, upto, false, 0));
        const std::uint64_t end = upto == nullptr ? s.begin : s.end;
        for (std::uint64_t i = s.row; i < end; ++i) {
            // Each body once, at its first crossing of the list.
            const std::uint32_t body = mesh.body_of(triangles[i]);
            bool is_first = true;
            for (std::uint64_t k = s.row; k < i && is_first; ++k) is_first = mesh.body_of(triangles[k]) != body;
            if (is_first && is_inside(rule, winding(s, sample, upto, true, body))) return true;
        }
        return false;
    }
    // The winding number there, of all bodies or of one.
    [[nodiscard]] VOXELPIPE_HD std::int64_t winding(const stretch& s, const snapped_position& sample, const place* upto,
                                                    bool of_one, std::uint32_t body) const {
        std::int64_t sum = 0;
        const std::uint64_t end = upto == nullptr ? s.begin : s.end;
        for (std::uint64_t i = s.row; i < end; ++i) {
            if (of_one && mesh.body_of(triangles[i]) != body) continue;
            if (i >= s.begin && triangles[i] != upto->triangle && !is_before(at(i, sample), *upto)) continue;
            sum += winding_of(keys[i]);
        }
        return sum;
    }
};

} // namespace voxelpipe::core::passes
