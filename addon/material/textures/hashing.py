# SPDX-License-Identifier: GPL-3.0-or-later
"""The hashes of Blender's textures (Cycles' util/hash.h): random numbers that depend on a cell or a coordinate alone.

B. Jenkins, "lookup3.c" (2006): `hashword` and its `mix` and `final`, here on a state of three 32-bit integers in a list.
M. Jarzynski and M. Olano, "Hash functions for GPU rendering", JCGT 9(3) (2020): PCG; Cycles shifts signed integers.
"""

from .float32 import bits, f32

MASK = 0xFFFFFFFF


def lookup3(*keys: int) -> int:
    """Return Jenkins' hash, 0 to 2^32 - 1, of one to four integers, of which the low 32 bits count."""
    state = [(0xDEADBEEF + (len(keys) << 2) + 13 + key) & MASK for key in (*keys, 0, 0)[:3]]
    if len(keys) == 4:
        for step, turn in enumerate((4, 6, 8, 16, 19, 4)):
            at, source, third = step % 3, (step + 2) % 3, (step + 1) % 3
            state[at] = ((state[at] - state[source]) & MASK) ^ _rotated(state[source], turn)
            state[source] = (state[source] + state[third]) & MASK
        state[0] = (state[0] + keys[3]) & MASK
    for step, turn in enumerate((14, 11, 25, 16, 4, 14, 24)):
        at, source = (step + 2) % 3, (step + 1) % 3
        state[at] = ((state[at] ^ state[source]) - _rotated(state[source], turn)) & MASK
    return state[2]


def random(*keys: float) -> float:
    """Return a number from 0 to 1 that depends on the bits of one to four 32-bit floats."""
    return f32(lookup3(*(bits(key) for key in keys))) / 2.0**32


def random_in_cell(cell: tuple[int, ...]) -> tuple[float, ...]:
    """Return as many numbers from 0 to 1 as the `cell` has integer coordinates, two to four."""
    v = [(x * 1664525 + 1013904223) & MASK for x in cell]
    _pcg_round(v)
    v = [x ^ (((x - (x >> 31 << 32)) >> 16) & MASK) for x in v]
    _pcg_round(v)
    return tuple(f32(x & 0x7FFFFFFF) / 2.0**31 for x in v)


def _rotated(x: int, by: int) -> int:
    return (x << by | x >> (32 - by)) & MASK


def _pcg_round(v: list[int]) -> None:
    for at, (a, b) in enumerate({3: ((1, 2), (2, 0), (0, 1)), 4: ((1, 3), (2, 0), (0, 1), (1, 2))}.get(len(v), ((1, 1), (0, 0)))):
        v[at] = (v[at] + v[a] * (v[b] if len(v) > 2 else 1664525)) & MASK
