# SPDX-License-Identifier: GPL-3.0-or-later
"""Textures as arithmetic, against their reference, and MaterialX' fractal noise against it."""

import math
import random
from pathlib import Path

import MaterialX as mx
import pytest

from true_diffuse.addon.material.expression import Apply, Constant, Coordinate, Expression, Point, evaluate, triple, walk
from true_diffuse.addon.material.operations import OPERATIONS, Value, broadcast
from true_diffuse.addon.material.texture_formulas import as_arithmetic, is_fractal
from true_diffuse.addon.material.textures import FUNCTIONS
from true_diffuse.addon.usd.expressions import Writer
from true_diffuse.addon.usd.network import Network, Output
from true_diffuse.addon.usd.terms import COMPARISONS, NODES
from true_diffuse.scripts.studies.glsl_values import evaluate_functions

OCTAVES = (2.6, 0.55, 2.1, 0.8, 1.3)  # detail, roughness, lacunarity, offset, gain
MUSGRAVE = ("MULTIFRACTAL", "RIDGED_MULTIFRACTAL", "HYBRID_MULTIFRACTAL", "HETERO_TERRAIN")
TYPES = ("FBM, True", "FBM, False", *(f"{kind}, True" for kind in MUSGRAVE))
RED, BLUE = (0.8, 0.2, 0.1), (0.05, 0.3, 0.9)
# Arguments after the vector
CASES: dict[str, tuple] = {
    "checker_fac()": (RED, BLUE, 3.0),
    "checker_color()": (RED, BLUE, 3.0),
    **{
        f"gradient_fac({kind})": ()
        for kind in ("LINEAR", "QUADRATIC", "EASING", "DIAGONAL", "SPHERICAL", "QUADRATIC_SPHERE", "RADIAL")
    },
    "gradient_color(EASING)": (),
    **{f"magic_color({depth})": (0.9, 1.2) for depth in range(11)},
    "magic_fac(2)": (0.9, 0.0),
    **{f"wave_fac(BANDS, {axis}, X, SIN)": (1.1, 0.0, 2.0, 1.0, 0.5, 0.7) for axis in ("X", "Y", "Z", "DIAGONAL")},
    **{f"wave_fac(RINGS, X, {axis}, TRI)": (1.1, 0.0, 2.0, 1.0, 0.5, 0.7) for axis in ("X", "Y", "Z", "SPHERICAL")},
    "wave_color(BANDS, X, X, SAW)": (0.8, 1.3, 1.5, 1.7, 0.6, 0.7),
    **{f"noise_value({n}D, {kind})": (0.0, 1.7, *OCTAVES, 0.0) for n in (2, 3) for kind in TYPES},
    **{f"noise_color({n}D, FBM, True)": (0.0, 1.7, *OCTAVES, 0.4) for n in (2, 3)},
}


class Place(Point):
    """A point that has the generated coordinates alone."""

    def __init__(self, vector: tuple[float, float, float]) -> None:
        self.vector = vector

    def coordinate(self, coordinate: Coordinate) -> tuple[float, float, float]:
        return self.vector


def texture(name: str, arguments: tuple) -> Apply:
    """Return an operation of the generated coordinates and constants."""
    return Apply(name, (Coordinate("generated"), *map(Constant, arguments)), "Texture")


@pytest.mark.parametrize("name", CASES)
def test_arithmetic_is_the_texture(name: str) -> None:
    whole = texture(name, CASES[name])
    formula = as_arithmetic(whole)
    assert formula is not None
    assert all(is_basic(one) for one in walk(formula))
    dice = random.Random(3)
    for _ in range(50):
        place = Place(tuple(dice.uniform(-2.0, 2.0) for _ in range(3)))
        # the texture rounds coordinates to 32 bits, of which those of Color lie 200 from the origin and lose 1e-5
        assert triple(evaluate(formula, place)) == pytest.approx(triple(evaluate(whole, place)), abs=1e-4)


def is_basic(expression: Expression) -> bool:
    """Return whether this is no texture but what fractal2d and fractal3d are."""
    return not isinstance(expression, Apply) or expression.operation.partition("(")[0] not in FUNCTIONS or is_fractal(expression)


@pytest.mark.parametrize("name", [name for name in CASES if "_fac" not in name or "(RINGS" in name])
def test_usd_network_is_the_texture(name: str, library: mx.Document) -> None:
    network = Network("MaterialX_")
    whole = texture(name, CASES[name])
    color = Writer(network, {}).color(Apply(whole.operation, (Coordinate("position"), *whole.arguments[1:])))
    assert all(library.getNodeDef(shader.identifier) for shader in network.shaders.values())
    dice = random.Random(4)
    for _ in range(20):
        place = Place(tuple(dice.uniform(-2.0, 2.0) for _ in range(3)))
        assert value_of(network, color.value, place.vector) == pytest.approx(triple(evaluate(whole, place)), abs=1e-4)


@pytest.fixture(scope="module")
def library() -> mx.Document:
    document = mx.createDocument()
    mx.loadLibraries(mx.getDefaultDataLibraryFolders(), mx.getDefaultDataSearchPath(), document)
    return document


def value_of(network: Network, output: Output, position: tuple[float, float, float]) -> Value:
    """Return what an output of a network is at a `position`; fractal noise is the reference's."""
    found: dict[str, Value] = {}
    for name, shader in network.shaders.items():
        given = {key: found[value.shader] if isinstance(value, Output) else value.value for key, value in shader.inputs.items()}
        node, kind = shader.identifier.split("_")[1], shader.identifier.rpartition("_")[2]
        if node in NODES:
            inputs, function = NODES[node]
            found[name] = broadcast(function, *(given[key] for key in inputs))
        elif node in COMPARISONS:
            found[name] = given["in1" if COMPARISONS[node](given["value1"], given["value2"]) else "in2"]
        else:
            found[name] = OTHER_NODES[node](given | {"kind": kind, "here": position})
    return found[output.shader]


def converted(value: Value, kind: str) -> Value:
    return triple(value) if kind != "vector2" else (*triple(value)[:2], 0.0)


def fractal(given: dict, position: tuple[float, float, float], dimensions: str) -> float:
    operation = OPERATIONS[f"noise_value({dimensions}, FBM, False)"]
    return operation.python(position, 0.0, 1.0, given["octaves"] - 1, given["diminish"], given["lacunarity"], 0.0, 0.0, 0.0)


OTHER_NODES = {
    "position": lambda given: given["here"],
    "convert": lambda given: converted(given["in"], given["kind"]),
    "extract": lambda given: given["in"][given["index"]],
    "combine3": lambda given: (given["in1"], given["in2"], given["in3"]),
    "dotproduct": lambda given: math.sumprod(given["in1"], given["in2"]),
    "magnitude": lambda given: math.hypot(*given["in"]),
    "mix": lambda given: broadcast(lambda a, b, t: a + (b - a) * t, given["bg"], given["fg"], given["mix"]),
    "fractal2d": lambda given: fractal(given, given["texcoord"], "2D"),
    "fractal3d": lambda given: fractal(given, given["position"], "3D"),
}


@pytest.mark.parametrize(
    ("name", "arguments"),
    [
        ("voronoi_distance(3D, F1, EUCLIDEAN, True)", (0.0, 5.0, 0.0, 0.5, 2.0, 1.0, 0.5, 1.0)),
        ("white_noise_value(3D)", (0.0,)),
        ("noise_value(4D, FBM, True)", (0.0, 5.0, *OCTAVES, 0.0)),
        ("noise_value(3D, FBM, False)", (0.0, 1.0, 2.0, *OCTAVES[1:], 0.0)),
    ],
)
def test_others_have_no_arithmetic(name: str, arguments: tuple) -> None:
    assert as_arithmetic(texture(name, arguments)) is None


def test_noise_of_varying_detail_has_no_arithmetic() -> None:
    whole = texture("noise_value(3D, FBM, True)", (0.0, 1.0, 2.0, *OCTAVES[1:], 0.0))
    vector, w, scale, _, *rest = whole.arguments
    varying = Apply("x", (Coordinate("generated"),))
    assert as_arithmetic(Apply(whole.operation, (vector, w, scale, varying, *rest))) is None


@pytest.mark.render
@pytest.mark.usefixtures("driver")
@pytest.mark.parametrize(("dimensions", "of"), [(2, "xy"), (3, "xyz")])
def test_materialx_fractal_is_fbm(dimensions: int, of: str) -> None:
    library = Path(mx.__file__).parent / "libraries" / "stdlib" / "genglsl" / "lib" / "mx_noise.glsl"
    dice = random.Random(5)
    rows = [(tuple(dice.randrange(-5000, 5000) / 1024.0 for _ in range(3)),) for _ in range(200)]  # exact in 32 bits
    got = evaluate_functions(library.read_text(), f"vec3(mx_fractal{dimensions}d_noise_float(a.{of}, 4, 2.0, 0.5))", rows)
    operation = OPERATIONS[f"noise_value({dimensions}D, FBM, False)"]
    for (vector,), (value, _, _) in zip(rows, got, strict=True):
        assert value == pytest.approx(operation.python(vector, 0.0, 1.0, 3.0, 0.5, 2.0, 0.0, 0.0, 0.0), abs=2e-6)
