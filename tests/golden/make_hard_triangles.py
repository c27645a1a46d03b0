#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""Finds triangles whose normal or barycentrics show the order of the roundings, and prints tests/golden/hard_triangles.hpp.

The library computes both in double and rounds the result to float, so another order of the fused steps changes a float
only if the double lies next to the middle between two floats: one random triangle in about 10^9. This script builds such
triangles instead. Expected values come from exact rational numbers and the one rounding of each written step; nothing here
comes from the library.

  make_hard_triangles.py >tests/golden/hard_triangles.hpp
"""
import math
import random
import struct
from fractions import Fraction
from itertools import permutations

UNITS = 1 << 16  # sub-voxel units of a voxel, in a grid of at most 128 voxels an axis
EXTENT = 16  # voxels of the tests' grid, an axis
CENTRE = EXTENT // 2 * UNITS
random.seed(35)


def double(x):
    """Nearest double of a rational number, ties to even."""
    return float(Fraction(x))


def to_float(x):
    """Nearest float of a double, ties to even."""
    return struct.unpack("f", struct.pack("f", x))[0]


def bits(x):
    return struct.unpack("I", struct.pack("f", x))[0]


def fma(a, b, c):
    return double(Fraction(a) * Fraction(b) + Fraction(c))


def mul(a, b):
    return double(Fraction(a) * Fraction(b))


def div(a, b):
    return double(Fraction(a) / Fraction(b))


# ---- normals --------------------------------------------------------------------------------------------------------


def length(x, y, z):
    """x * x, then two fused steps; math.sqrt is the square root of IEEE 754."""
    return math.sqrt(fma(z, z, fma(y, y, mul(x, x))))


def unit(n, size):
    return tuple(to_float(div(a, size)) for a in n)


def other_normals(n):
    """Results of other roundings: the five other orders, sums that are not fused, one reciprocal for three quotients."""
    x, y, z = n
    results = {}
    for order in permutations("xyz"):
        if order != ("x", "y", "z"):
            a, b, c = (n["xyz".index(k)] for k in order)
            results["order_" + "".join(order)] = unit(n, length(a, b, c))
    total = double(Fraction(double(Fraction(mul(x, x)) + Fraction(mul(y, y)))) + Fraction(mul(z, z)))
    results["not_fused"] = unit(n, math.sqrt(total))
    inverse = div(1.0, length(x, y, z))
    results["reciprocal"] = tuple(to_float(mul(a, inverse)) for a in n)
    return results


def near_middle(size):
    """A normal of components up to about `size`, one of them close to the middle between two floats once it is divided by
    the length; as doubles."""
    b, c = (random.randrange(size // 2, size) * random.choice((-1, 1)) for _ in range(2))
    middle = 2 * random.randrange(1 << 23, 1 << 24) + 1  # over 2^25
    square = (b * b + c * c) * middle * middle // ((1 << 50) - middle * middle)
    a = math.isqrt(square)
    if square - a * a > a:
        a += 1
    n = [a, b, c]
    random.shuffle(n)
    return n


def is_near_middle(n):
    size = math.sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2])
    for a in n:
        q = abs(a) / size
        scale = 25 - math.frexp(q)[1]
        rest = math.ldexp(q, scale) % 2.0
        if abs(rest - 1.0) < 2.0**-26:
            return True
    return False


def sides(n):
    """Two short integer vectors whose cross product is n."""
    a, b, c = n
    g, x, y = extended_gcd(a, b)
    e, f = [b // g, -a // g, 0], [x * c, y * c, -g]
    while True:  # Gauss's reduction of the lattice of vectors at right angles to n
        if dot(e, e) > dot(f, f):
            e, f = f, e
        k = round(Fraction(dot(e, f), dot(e, e)))
        if k == 0:
            break
        f = [p - k * q for p, q in zip(f, e)]
    return (e, f) if cross(e, f) == list(n) else (f, e)


def extended_gcd(a, b):
    x0, y0, x1, y1 = 1, 0, 0, 1
    while b:
        q = a // b
        a, b, x0, y0, x1, y1 = b, a - q * b, x1, y1, x0 - q * x1, y0 - q * y1
    return (a, x0, y0) if a > 0 else (-a, -x0, -y0)


def dot(a, b):
    return sum(p * q for p, q in zip(a, b))


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def normal_rows(name, size, limit, wanted):
    """Rows until `wanted` of them refute each of the other ways to round. `limit`: units that a side may be long."""
    refuted, rows = {}, []
    while True:
        n = near_middle(size)
        if not is_near_middle(n) or math.gcd(*n) != 1:
            continue
        n = [float(a) for a in n]
        result = unit(n, length(*n))
        wrong = [k for k, v in other_normals(n).items() if v != result]
        if all(refuted.get(k, 0) >= wanted for k in wrong):
            if len(refuted) == 7 and min(refuted.values()) >= wanted:
                return rows
            continue
        e, f = sides([int(a) for a in n])
        first = [CENTRE + random.randrange(UNITS) - (p + q) // 3 for p, q in zip(e, f)]
        triangle = [first, [p + q for p, q in zip(first, e)], [p + q for p, q in zip(first, f)]]
        if max(abs(a) for a in e + f) > limit or max(abs(a) for v in triangle for a in v) > 1 << 24:
            continue
        for k in wrong:
            refuted[k] = refuted.get(k, 0) + 1
        rows.append((name, triangle, result, None, None))


# ---- barycentrics ---------------------------------------------------------------------------------------------------


def weight_rows(name, bits_of_side, count):
    """Triangles in a plane of voxels whose first weight, at the centre of a column, is so close to the middle between two
    floats that the double is that middle: rounding once gives the other float for some, and so does a product with the
    area's reciprocal."""
    rows = []
    direct = inverse = 0
    while len(rows) < count:
        side = [random.randrange(1 << (bits_of_side - 1), 1 << bits_of_side) * random.choice((-1, 1)) for _ in range(2)]
        if math.gcd(*side) != 1:
            continue
        area = random.randrange(1 << (2 * bits_of_side - 2), 1 << (2 * bits_of_side - 1)) | 1
        sign = random.choice((-1, 1))
        middle = pow(area, -1, 1 << 25)
        middle = middle if sign > 0 else (1 << 25) - middle
        if middle < 1 << 24:
            continue
        weight = (middle * area - sign) >> 25
        assert weight * (1 << 25) == middle * area - sign
        # side x to_centre = weight, side x to_apex = area
        _, x, y = extended_gcd(side[0], -side[1])
        particular = [y, x]
        assert side[0] * particular[1] - side[1] * particular[0] == 1

        def vector(value, along):
            p = [value * k for k in particular]
            t = round(Fraction(p[0] * side[0] + p[1] * side[1], side[0] ** 2 + side[1] ** 2) - along)
            return [a - t * b for a, b in zip(p, side)]

        to_apex = vector(area, Fraction(random.randrange(1000), 1000))
        to_centre = vector(weight, Fraction(1, 2))
        voxel = [EXTENT // 2 + random.randrange(-2, 3) for _ in range(3)]
        centre = [v * UNITS + UNITS // 2 for v in voxel]
        one = [c - g for c, g in zip(centre, to_centre)]
        two = [p + d for p, d in zip(one, side)]
        zero = [p + h for p, h in zip(one, to_apex)]
        flat = [zero, one, two]
        cross2 = lambda p, q, r: (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0])
        exact = [cross2(one, two, centre), cross2(two, zero, centre), cross2(zero, one, centre)]
        assert exact[0] == weight and cross2(zero, one, two) == area
        if min(exact) <= 0 or max(abs(a) for v in flat for a in v) > 1 << 24:
            continue
        if bits_of_side < 20 and max(abs(v[k] - centre[k]) for v in flat for k in (0, 1)) > 3 * UNITS:
            continue
        result = tuple(to_float(div(n, area)) for n in exact)
        once = rounded_once(Fraction(weight, area))
        by_product = to_float(mul(float(weight), div(1.0, float(area))))
        if once == result[0] and by_product == result[0]:
            continue
        if (direct > inverse and by_product == result[0]) or (inverse > direct and once == result[0]):
            continue
        direct += once != result[0]
        inverse += by_product != result[0]
        axis = random.randrange(3)
        place = lambda u, v, w: [(u, v, w)[(k - axis - 1) % 3] for k in range(3)]
        w = voxel[2] * UNITS + UNITS // 2
        triangle = [place(v[0], v[1], w) for v in flat]
        normal = tuple(1.0 if k == axis else 0.0 for k in range(3))
        rows.append((name, triangle, normal, place(*voxel), result))
    return rows


def rounded_once(x):
    """Nearest float of a rational number from 1/2 to 1, ties to even."""
    return float(round(x * (1 << 24))) / (1 << 24)


# ---- output ---------------------------------------------------------------------------------------------------------

HEAD = """// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Triangles whose normal or barycentrics change in the last bit if a rounding is left out, added or moved. Written by
// make_hard_triangles.py, which says how they are found; the values come from exact rational numbers.

#include <array>
#include <cstdint>

namespace golden {

struct hard_triangle {
    const char* name;
    std::int32_t vertices[3][3]; // 2^-16 voxel, in a grid of 16 voxels an axis; each a float exactly
    std::uint32_t normal[3];     // bits of the unit normal's floats
    std::int32_t voxel[3];       // where the barycentrics are known; -1 if nowhere
    std::uint32_t barycentric[3];
};

// clang-format off
"""


def main():
    rows = normal_rows("normal", 1 << 46, 1 << 24, 3)
    rows += normal_rows("normal of a small triangle", 1 << 35, 4 * UNITS, 1)
    rows += weight_rows("barycentric", 22, 12)
    rows += weight_rows("barycentric of a small triangle", 17, 12)
    print(HEAD, end="")
    print(f"inline constexpr std::array<hard_triangle, {len(rows)}> hard_triangles{{{{")
    for name, triangle, normal, voxel, weights in rows:
        vertices = ", ".join("{%d, %d, %d}" % tuple(v) for v in triangle)
        print('    {"%s", {%s},' % (name, vertices))
        print("     {%s}, {%s}, {%s}}," % (
            ", ".join("0x%08x" % bits(a) for a in normal), ", ".join(map(str, voxel or [-1] * 3)),
            ", ".join("0x%08x" % bits(a) for a in weights or [0.0] * 3)))
    print("}};\n// clang-format on\n\n} // namespace golden")


main()
