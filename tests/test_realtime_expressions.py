# SPDX-License-Identifier: GPL-3.0-or-later
"""GLSL of expressions: what is in the text, what in the block of numbers, and what is refused."""

import pytest

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
    UvMap,
    apply,
)
from true_diffuse.addon.realtime.expressions import MAX_ATTRIBUTES, Code, NotDrawn, Writer, attribute_name

UV = UvMap("UVMap")


def texture(name: str = "Image", **settings: object) -> ImageTexture:
    return ImageTexture(Image(name, "sRGB", is_data=False), UV, **settings)


def written(**parameters: Expression) -> Code:
    writer = Writer(4)
    for name, expression in parameters.items():
        writer.add(name, expression)
    return writer.code()


def test_numbers_are_in_the_block_alone() -> None:
    first, second = (
        written(base_color=apply("multiply", texture(), (value, 0.2, 0.3)), roughness=Constant(value)) for value in (0.5, 0.7)
    )
    assert first.text == second.text
    assert first.values != second.values and 0.7 in second.values and 0.5 not in second.values
    assert len(first.values) % 4 == 0


def test_equal_numbers_of_two_inputs_have_places_of_their_own() -> None:
    """So that one of them may be dragged without another shader."""
    same, different = written(a=Constant(0.5), b=Constant(0.5)), written(a=Constant(0.5), b=Constant(0.25))
    assert same.text == different.text


def test_triple_never_lies_across_two_vectors() -> None:
    code = written(a=Constant(0.5), b=Constant((1.0, 2.0, 3.0)), c=Constant((4.0, 5.0, 6.0)), d=Constant(7.0))
    assert code.values == (0.5, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0)
    assert "material.values[0].yzw" in code.text and "material.values[1].xyz" in code.text


def test_what_two_inputs_share_is_computed_once() -> None:
    """Also where they are equal but not the same object, and for the color and alpha of one image."""
    code = written(
        a=apply("sine", apply("x", texture())),
        b=apply("cosine", apply("x", texture())),
        c=texture(output="alpha"),
    )
    assert code.text.count("image_linear(image_0") == 1 and code.text.count(".x;") == 1
    assert code.images == (Image("Image", "sRGB", is_data=False),)


def test_nodes_that_share_their_arguments_are_written_once_each() -> None:
    """A chain of 60 sums of a value with itself has 2^60 paths."""
    value: Expression = Attribute("Wear", "factor")
    for _ in range(60):
        value = Apply("add", (value, value))
    assert written(a=value).text.count(" + ") == 60 + written(a=Constant(0.0)).text.count(" + ") + 2  # 2 of the function beside


def test_number_among_triples_counts_for_each_component() -> None:
    code = written(a=apply("power", texture(), apply("x", UV)))
    assert "safe_power(x" in code.text and "vec3(x" in code.text
    assert code.stems.count("math") == 1


def test_height_of_a_bump_is_a_function_that_is_evaluated_thrice() -> None:
    code = written(normal=Bump(apply("x", texture())))
    assert code.text.count("float height_0(Point point)") == 1
    assert code.text.count("height_0(") == 1 + 3 and code.text.count("image_linear(") == 1


def test_attributes_of_any_name_have_names_in_glsl() -> None:
    names = [attribute_name(("attribute", name)) for name in ("Wear", "wear", "é ∂", "", "1 a")]
    assert len(set(names)) == len(names) and all(name.isidentifier() and name.isascii() for name in names)


REFUSED = {
    "tiles": ImageTexture(Image("Tiles", "sRGB", False, source="TILED"), UV),
    "box": texture(projection="BOX"),
    "property of the object": Attribute("wear", owner="OBJECT"),
    "coordinates of another object": Coordinate("object", "Empty"),
    "camera": Coordinate("camera"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_is_not_drawn_is_refused_and_leaves_nothing(name: str) -> None:
    writer = Writer(4)
    with pytest.raises(NotDrawn):
        writer.add("base_color", apply("multiply", texture("Other"), REFUSED[name]))
    writer.add("base_color", Constant((1.0, 1.0, 1.0)))
    assert writer.code() == written(base_color=Constant((1.0, 1.0, 1.0)))


def test_images_and_attributes_beyond_the_drivers_limit_are_refused() -> None:
    writer = Writer(2)
    for name in ("A", "B", "A"):
        writer.add(name, texture(name))
    with pytest.raises(NotDrawn, match="the image C"):
        writer.add("C", texture("C"))
    for index in range(MAX_ATTRIBUTES - 1):
        writer.add(f"attribute{index}", Attribute(str(index)))
    with pytest.raises(NotDrawn, match="the attribute last"):
        writer.add("last", Attribute("last"))


def test_points_of_a_curve_are_in_the_block() -> None:
    first, second = (written(a=Curve(((0.0, 0.0), (0.5, y), (1.0, 1.0)), apply("x", UV))) for y in (0.2, 0.4))
    assert first.text == second.text and "curve_value(0, 3, " in first.text
    assert second.values[:6] == (0.0, 0.0, 0.5, 0.4, 1.0, 1.0)
