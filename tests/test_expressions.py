# SPDX-License-Identifier: GPL-3.0-or-later
"""Expressions: simplification, GLSL and edges of operations against the reference in Python, which test_read_nodes.py tests."""

import math
import random
from collections.abc import Sequence

import pytest
from hypothesis import given
from hypothesis import strategies as st

from true_diffuse.addon.blender.glsl import source
from true_diffuse.addon.material.expression import (
    Apply,
    Attribute,
    Bump,
    Constant,
    Coordinate,
    Curve,
    Expression,
    Image,
    ImageTexture,
    NormalMap,
    UvMap,
    apply,
    compute,
    curve,
    evaluate,
    rewritten,
    triple,
    walk,
)
from true_diffuse.addon.material.node_formulas import TABLE_TOLERANCE, table
from true_diffuse.addon.material.operations import OPERATIONS, Kind, Value
from true_diffuse.addon.material.textures import FUNCTIONS
from true_diffuse.scripts.studies.glsl_values import evaluate_functions

# Of the larger of 1 and the value: 32-bit floats through a few operations, of which drivers' logarithms and powers lose most.
TOLERANCE = 1e-4
NAMES = [name for name in OPERATIONS if name.partition("(")[0] not in FUNCTIONS]  # those of textures are tested on their own
# Which arguments are numbers, of operations whose kind does not follow from their arguments; the others take triples
NUMBERS = {"combine": (0, 1, 2), "refract": (2,), "rotate_about": (2,), "fresnel": (0, 1)}
NUMBERS |= dict.fromkeys(("mix_hue", "mix_saturation", "mix_value", "mix_color"), (2,))


def kinds(name: str, wanted: Kind = "triple") -> list[Kind]:
    """Return the kinds of an operation's arguments; those of one that works by components are `wanted`."""
    entry = OPERATIONS[name]
    count = 1 + max(index for index in range(4) if f"{{{index}}}" in entry.glsl)
    if not entry.kind:
        return [wanted] * count
    return ["number" if index in NUMBERS.get(name, ()) else "triple" for index in range(count)]


@pytest.mark.render
@pytest.mark.usefixtures("driver")
@pytest.mark.parametrize("wanted", ["number", "triple"])
def test_glsl_of_every_operation_is_its_reference(wanted: Kind) -> None:
    dice = random.Random(11)

    def number() -> float:
        # multiples of 1/64, so that 32-bit floats place steps where Python does; small numbers meet limits more often
        return dice.choice((0.0, 1.0, -1.0, 0.5, *(round(dice.uniform(-2.0, 2.0) * 64.0) / 64.0 for _ in range(8))))

    rows, expected, branches = [], [], ""
    for index, name in enumerate(NAMES):
        entry, given_kinds = OPERATIONS[name], kinds(name, wanted)
        swizzles = {"number": "x", "triple": "xyz"}
        call = entry.glsl.format(*(f"{letter}.{swizzles[kind]}" for letter, kind in zip("abc", given_kinds, strict=False)))
        branches += f"    if (d.x == {index}.0) {{ return vec3({call}); }}\n"
        for _ in range(150):
            values = [(number(), number(), number()) for _ in "abc"]
            rows.append((*values, (float(index),)))
            arguments = [value if kind == "triple" else value[0] for value, kind in zip(values, given_kinds, strict=False)]
            expected.append((name, arguments, triple(compute(name, *arguments))))
    functions = source(*dict.fromkeys(entry.stem for name in NAMES if (entry := OPERATIONS[name]).stem))
    chosen = f"vec3 chosen(vec4 a, vec4 b, vec4 c, vec4 d)\n{{\n{branches}    return vec3(0.0);\n}}\n"
    got = evaluate_functions(functions + chosen, "chosen(a, b, c, d)", rows)
    wrong = [
        (name, arguments, value, reference)
        for (name, arguments, reference), value in zip(expected, got, strict=True)
        if not near(value, reference, TOLERANCE)
    ]
    assert not wrong


def near(value: Sequence[float], reference: Sequence[float], tolerance: float) -> bool:
    return all(abs(x - y) <= tolerance * max(1.0, abs(y)) for x, y in zip(value, reference, strict=True))


floats = st.floats(width=32, allow_nan=False, allow_infinity=False)


@given(st.sampled_from(NAMES), st.lists(st.tuples(floats, floats, floats), min_size=3, max_size=3))
def test_operations_are_finite_for_numbers_of_any_size(name: str, values: list[tuple[float, float, float]]) -> None:
    arguments = [value if kind == "triple" else value[0] for value, kind in zip(values, kinds(name), strict=False)]
    assert all(math.isfinite(component) for component in triple(compute(name, *arguments)))


class Here:
    """A point with a few attributes."""

    values = {"a": (0.25, -1.5, 2.0), "b": (1.0, 0.5, 0.0), "p": 0.75, "q": -2.0}

    def attribute(self, attribute: Attribute) -> Value:
        return self.values[attribute.name]


LEAVES = [
    *(Constant(value) for value in (0.0, 1.0, 2.0, -0.5, (0.0, 0.0, 0.0), (1.0, 1.0, 1.0), (0.5, 2.0, -1.0), (0.0, 1.0, 2.0))),
    *(Attribute(name, "vector") for name in "ab"),
    *(Attribute(name, "factor") for name in "pq"),
]
BUILT = ["add", "subtract", "multiply", "divide", "mix", "clamp", "combine", "x", "y", "z", "luminance", "average", "rotate"]
type Pair = tuple[Expression, Expression]


def _applied(name: str, pairs: list[Pair]) -> Pair:
    """Return an operation as it is and as `apply` simplifies it."""
    wanted = kinds(name)
    if OPERATIONS[name].kind:
        pairs = [pair for pair, kind in zip(pairs, wanted, strict=False) if pair[0].kind == kind]
    if len(pairs) < len(wanted):
        return LEAVES[0], LEAVES[0]
    plain, simple = zip(*pairs[: len(wanted)], strict=True)
    return Apply(name, plain), apply(name, *simple)


trees = st.recursive(
    st.sampled_from(LEAVES).map(lambda leaf: (leaf, leaf)),
    lambda inner: st.builds(_applied, st.sampled_from(BUILT), st.lists(inner, min_size=3, max_size=3)),
    max_leaves=12,
)


@given(trees)
def test_simplified_expression_has_the_same_value_and_kind(pair: Pair) -> None:
    plain, simple = pair
    assert simple.kind == plain.kind
    assert near(triple(evaluate(simple, Here())), triple(evaluate(plain, Here())), 1e-9)  # the order of a few 64-bit products


A, P = Attribute("a", "vector"), Attribute("p", "factor")


@pytest.mark.parametrize(
    ("simple", "expected"),
    [
        (apply("multiply", (1.0, 1.0, 1.0), A), A),
        (apply("add", A, 0.0), A),
        (apply("multiply", apply("multiply", A, 2.0), (1.0, 2.0, 3.0)), Apply("multiply", (A, Constant((2.0, 4.0, 6.0))))),
        (apply("divide", A, 4.0), Apply("multiply", (A, Constant(0.25)))),
        (apply("mix", A, (0.5, 0.5, 0.5), 0.0), A),
        (apply("mix", A, A, P), A),
        (apply("combine", apply("x", A), apply("y", A), apply("z", A)), A),
        (apply("y", apply("combine", 0.0, P, 0.0)), P),
        (apply("luminance", apply("combine", P, P, P)), P),
        (apply("rotate", A, (0.0, 0.0, 0.0)), A),
        (apply("multiply", A, 0.0), Constant((0.0, 0.0, 0.0))),
        (apply("multiply", P, (1.0, 1.0, 1.0)), Apply("combine", (P, P, P))),
    ],
)
def test_what_changes_nothing_vanishes(simple: Expression, expected: Expression) -> None:
    assert simple == expected


def test_clamp_of_an_image_of_bytes_vanishes() -> None:
    texture = ImageTexture(Image("a", "sRGB", False), UvMap())
    assert apply("clamp", texture, 0.0, 1.0) == texture
    deep = ImageTexture(Image("a", "Linear Rec.709", False, is_float=True), UvMap())
    assert apply("clamp", deep, 0.0, 1.0) != deep


def test_shared_expressions_are_visited_once() -> None:
    shared: Expression = P
    for _ in range(200):  # 2^200 paths to P
        shared = apply("mix", shared, apply("multiply", shared, shared), 0.5)
    assert len(list(walk(shared))) == 402  # P, the factor, and two operations a step
    assert shared.kind == "number"
    assert 0.0 <= float(evaluate(shared, Here())) < 0.75


def test_rewriting_reaches_below_everything() -> None:
    def whole(place: Expression) -> Expression:
        height = curve(((0.0, 0.0), (1.0, 2.0)), apply("x", apply("multiply", place, 2.0)))
        return apply("add", Bump(height), NormalMap(ImageTexture(Image("Image", "sRGB", is_data=False), place)))

    first, second = Coordinate("generated"), Coordinate("object")
    assert rewritten(whole(first), lambda one: second if one == first else None) == whole(second)
    assert rewritten(whole(first), lambda _: None) == whole(first)


def test_curve_between_and_outside_of_its_points() -> None:
    points = ((0.0, 1.0), (0.5, 3.0), (1.0, 2.0))
    for options, expected in (({}, (1.0, 2.0, 2.5, 2.0)), ({"is_extended": True}, (-3.0, 2.0, 2.5, 0.0))):
        assert [evaluate(Curve(points, Constant(x), **options), Here()) for x in (-1.0, 0.25, 0.75, 2.0)] == list(expected)
    stepped = [evaluate(Curve(points, Constant(x), is_stepped=True), Here()) for x in (-1.0, 0.25, 0.5, 0.75, 2.0)]
    assert stepped == [1.0, 1.0, 3.0, 3.0, 2.0]


def test_curve_that_changes_nothing_vanishes() -> None:
    assert curve(((0.0, 0.0), (1.0, 1.0)), P, is_extended=True) == P
    assert curve(((0.0, 0.5), (1.0, 0.5)), P) == Constant(0.5)
    assert curve(((0.0, 0.0), (1.0, 2.0)), Constant(0.25)) == Constant(0.5)


@given(st.lists(st.floats(0.0, 1.0, width=32), min_size=3, max_size=60), st.booleans(), st.booleans())
def test_table_keeps_all_its_values(values: list[float], is_stepped: bool, is_extended: bool) -> None:
    made = table(values, P, 1.0, 3.0, is_stepped, is_extended)
    for i, value in enumerate(values):
        x = 1.0 + 2.0 * i / (len(values) - 1)
        kept = (
            made.value if isinstance(made, Constant) else evaluate(Curve(made.points, Constant(x), is_stepped, is_extended), Here())
        )
        assert kept == pytest.approx(value, abs=TABLE_TOLERANCE * 1.001)


def test_table_of_straight_lines_has_a_point_for_each_bend() -> None:
    values = [min(i / 85.0, 1.0) if i < 170 else 1.0 - (i - 170) / 85.0 for i in range(256)]
    made = table(values, P)
    assert isinstance(made, Curve)
    assert [round(x * 255) for x, _ in made.points] == [0, 85, 170, 255]
