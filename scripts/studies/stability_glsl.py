# SPDX-License-Identifier: GPL-3.0-or-later
"""How near the GLSL functions, in 32-bit floats on this machine's driver, come to their formulas, and what the worst inputs do.

What is asked of them is in float32_accuracy.py.
"""

import math
import random
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

from true_diffuse.addon.measure.record import Record
from true_diffuse.addon.models import MODELS, ReflectanceModel
from true_diffuse.addon.models.vector import Vector, add, dot, from_polar, normalize, scale
from true_diffuse.scripts.studies.float32_accuracy import AccuracyCheck, Arguments, Reference, anywhere, single, single_vector
from true_diffuse.scripts.studies.glsl_values import evaluate
from true_diffuse.scripts.studies.study import Step

COUNT = 100_000

type Evaluate = Callable[[str, str, Sequence[tuple[Sequence[float], ...]]], Sequence[tuple[float, float, float]]]


@dataclass(frozen=True)
class Parameter:
    """One shape parameter: the range of random values, by its logarithm if `decades`, and what the other cases use."""

    name: str
    low: float
    high: float
    typical: float
    decades: bool = False

    def draw(self, dice: random.Random) -> float:
        """Return a random value."""
        if self.decades:
            return self.low * (self.high / self.low) ** dice.random()
        return dice.uniform(self.low, self.high)


@dataclass(frozen=True)
class Shader:
    """A file of shaders/, and what its surface gets of the parameters p0, p1."""

    model: str
    arguments: str = ""
    parameters: tuple[Parameter, ...] = ()

    def call(self) -> str:
        """Return the GLSL expression for inputs laid out by `Inputs.row`."""
        arguments = self.arguments.replace("p0", "b.w").replace("p1", "c.w")
        return f"{self.model}_radiance({self.model}_surface(a.xyz, c.xyz, vec3(a.w){arguments}), b.xyz)"


def shader_of(model: ReflectanceModel) -> Shader:
    """Return the shader of a registered model."""
    if model.parameter is None:
        return Shader(model.id)
    parameter = Parameter(model.parameter.name, model.parameter.low, model.parameter.highest_usual, model.parameter.usual)
    return Shader(model.id, f", {model.id}_coefficients(p0)", (parameter,))


DRAWN = (
    *map(shader_of, MODELS.values()),
    Shader("blinn_phong", ", p0, p1", (Parameter("specular", 0.0, 1.0, 0.5), Parameter("exponent", 1.0, 1e4, 30.0, decades=True))),
)


@dataclass(frozen=True)
class Inputs:
    """What one evaluation gets, all of it 32-bit floats."""

    n: Vector
    l: Vector
    v: Vector
    albedo: float
    parameters: tuple[float, ...]

    def arguments(self) -> Arguments:
        """Return what the formula gets."""
        return self.n, self.l, self.v, self.albedo, self.parameters

    def row(self) -> tuple[Sequence[float], ...]:
        """Return the vec4s a, b and c."""
        return ((*self.n, self.albedo), (*self.l, *self.parameters[:1]), (*self.v, *self.parameters[1:]))


def stability(exact: Reference, quick: Reference, count: int, target: str = "glsl", evaluate: Evaluate = evaluate) -> list[Step]:
    """Return a step for each model, with a record for each family of cases: its worst input, and how many inputs do as asked.

    `exact` gives a formula's value in all digits, `quick` in 64-bit floats. There are `count` random inputs of each model.
    `evaluate` is that of glsl_values.py, or does the same for another `target`.
    """
    check, dice = AccuracyCheck(target, exact, quick), random.Random(1)
    directions = [_lit(dice) for _ in range(count)]

    def measure(shader: Shader) -> list[Record]:
        families = {"random": _random(shader, directions), **_adversarial(shader)}
        rows = [inputs.row() for family in families.values() for inputs in family]
        got = iter(evaluate(shader.model, shader.call(), rows))
        return check.records(shader.model, [parameter.name for parameter in shader.parameters], families, got)

    return [Step(f"GLSL  {shader.model}", partial(measure, shader)) for shader in DRAWN]


def _lit(dice: random.Random) -> tuple[Vector, Vector, Vector]:
    """Return N anywhere, L and V anywhere above its surface."""
    n, l, v = anywhere(dice), anywhere(dice), anywhere(dice)
    l, v = (x if dot(n, x) > 0.0 else scale(x, -1.0) for x in (l, v))
    return single_vector(n), single_vector(l), single_vector(v)


def _random(shader: Shader, directions: Sequence[tuple[Vector, Vector, Vector]]) -> list[Inputs]:
    dice = random.Random(shader.model)
    return [
        Inputs(n, l, v, *single(dice.random()), single(*(parameter.draw(dice) for parameter in shader.parameters)))
        for n, l, v in directions
    ]


def _adversarial(shader: Shader) -> dict[str, list[Inputs]]:
    """Return the inputs that are hard or wrong, by what is hard or wrong with them."""
    dice = random.Random(2)
    typical = single(*(parameter.typical for parameter in shader.parameters))
    full = single(*(parameter.high for parameter in shader.parameters))
    (rho,) = single(0.7)
    frames = [((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)), *(_frame(dice) for _ in range(3))]
    cosines = (-0.5, -1e-8, 0.0, 1e-8, 1e-4, 0.5, 1.0 - 1e-8, 1.0)

    def at(frame: tuple[Vector, Vector, Vector], mu: float, azimuth: float) -> Vector:
        return single_vector([dot(from_polar(mu, azimuth), column) for column in zip(*frame, strict=True)])

    grazing = [
        Inputs(single_vector(frame[2]), at(frame, mu_i, azimuth), at(frame, mu_o, 0.0), rho, shape)
        for frame in frames
        for shape in {typical, full}
        for mu_i in cosines
        for mu_o in cosines
        for azimuth in (0.0, 1.0, math.pi)
    ]

    # N = L = V, light at the viewer, light opposite the viewer, light or viewer at N; all in the direction itself and a bit aside
    aligned = []
    for _ in range(100):
        n, l, v = _lit(dice)
        opposite = single_vector(add(scale(n, 2.0 * dot(n, v)), scale(v, -1.0)))
        aside = [single_vector(normalize(add(v, scale(anywhere(dice), distance)))) for distance in (1e-6, 1e-3)]
        for light, viewer in ((n, n), (v, v), (opposite, v), (n, v), (l, n), (aside[0], v), (aside[1], v)):
            aligned.append(Inputs(n, light, viewer, rho, typical if len(aligned) % 2 else full))

    usual = [_lit(dice) for _ in range(8)]
    strange = (0.0, 1e-40, 1e-8, 1e-3, math.pi / 2, 1e3, 1e38, math.inf, -0.5, -math.inf, math.nan)
    families = {"grazing": grazing, "aligned": aligned}
    for k, parameter in enumerate(shader.parameters):
        values = single(parameter.low, parameter.high, *strange)
        families[parameter.name] = [
            Inputs(n, l, v, rho, (*typical[:k], value, *typical[k + 1 :])) for n, l, v in usual for value in values
        ]
    albedos = single(0.0, 1e-40, 0.5, 1.0, 1.5, 1e38, math.inf, -0.5, -math.inf, math.nan)
    families["albedo"] = [Inputs(n, l, v, albedo, typical) for n, l, v in usual for albedo in albedos]

    vectors = []
    for n, l, v in usual:
        good = Inputs(n, l, v, rho, typical)
        for key in "nlv":
            vector = getattr(good, key)
            x, y, z = vector
            wrong: list[Sequence[float]] = [scale(vector, factor) for factor in (0.0, 1e-30, 1e-3, 0.5, 2.0, 1e6, 1e12, 1e30, -1.0)]
            wrong += [(1e-40,) * 3, (math.nan,) * 3, (math.inf,) * 3, (3e38, -3e38, 3e38)]
            wrong += [(math.nan, y, z), (x, -math.inf, z), (x, y, 1e-40)]
            vectors += [replace(good, **{key: single_vector(numbers)}) for numbers in wrong]
        for size in (1e-3, 0.5, 2.0, 1e6):
            vectors.append(Inputs(*(single_vector(scale(vector, size)) for vector in (n, l, v)), rho, typical))
    families["vectors"] = vectors
    return families


def _frame(dice: random.Random) -> tuple[Vector, Vector, Vector]:
    """Return three orthogonal unit vectors in a random direction."""
    z, other = anywhere(dice), anywhere(dice)
    x = normalize(add(other, scale(z, -dot(other, z))))
    return x, (z[1] * x[2] - z[2] * x[1], z[2] * x[0] - z[0] * x[2], z[0] * x[1] - z[1] * x[0]), z
