# SPDX-License-Identifier: GPL-3.0-or-later
"""How near the GLSL functions, in 32-bit floats on this machine's driver, come to their formulas, and what the worst inputs do.

Asked of every input: an error of at most 2e-5 of the value where that is above 1e-4 of the model's largest, and at most 1e-6
elsewhere; and never NaN, infinity or a negative radiance. The formula gets the same 32-bit numbers as the shader. An input is
conditioned if moving its numbers by their last bit moves the exact value by as much as the error: there the shader is as good as
its input.
"""

import math
import random
import struct
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

from .comparison import Progress, Record
from .measure.glsl import evaluate
from .models.vector import Vector, add, dot, from_polar, normalize, scale

RELATIVE, FLOOR, ABSOLUTE = 2e-5, 1e-4, 1e-6
EXAMINED = 100  # of the random inputs, so many of the worst, and as many others, are worked out in all digits
COUNT = 100_000

type Referee = Callable[[str, Vector, Vector, Vector, float, Sequence[float]], float]


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
    """A file of shaders/ and how its function is called with the parameters p0, p1."""

    model: str
    arguments: str = ""
    parameters: tuple[Parameter, ...] = ()

    def call(self) -> str:
        """Return the GLSL expression for inputs laid out by `Inputs.row`."""
        arguments = self.arguments.replace("p0", "b.w").replace("p1", "c.w")
        return f"{self.model}_radiance(a.xyz, b.xyz, c.xyz, vec3(a.w){arguments})"


SIGMA = Parameter("sigma", 0.0, math.pi / 2, 0.33)
ROUGHNESS = Parameter("roughness", 0.0, 1.0, 0.5)
DRAWN = (
    Shader("lambert"),
    Shader("oren_nayar", ", oren_nayar_coefficients(p0)", (SIGMA,)),
    Shader("oren_nayar_1994", ", oren_nayar_1994_coefficients(p0)", (SIGMA,)),
    Shader("fujii", ", fujii_coefficients(p0)", (ROUGHNESS,)),
    Shader("eon", ", eon_coefficients(p0)", (ROUGHNESS,)),
    Shader("cycles_diffuse", ", cycles_diffuse_coefficients(p0)", (ROUGHNESS,)),
    Shader("wolff", ", wolff_coefficients(p0)", (Parameter("ior", 1.0, 3.0, 1.5),)),
    Shader("pits"),
    Shader("specular", ", p0, p1", (Parameter("specular", 0.0, 1.0, 0.5), Parameter("exponent", 1.0, 1e4, 30.0, decades=True))),
)


@dataclass(frozen=True)
class Inputs:
    """What one evaluation gets, all of it 32-bit floats."""

    n: Vector
    l: Vector
    v: Vector
    albedo: float
    parameters: tuple[float, ...]

    @classmethod
    def of(cls, numbers: Sequence[float]) -> "Inputs":
        """Return the inputs that have these `numbers()`, in 32 bits."""
        n, l, v = (_vector(numbers[k : k + 3]) for k in (0, 3, 6))
        return cls(n, l, v, *_single(numbers[9]), _single(*numbers[10:]))

    def row(self) -> tuple[Sequence[float], ...]:
        """Return the vec4s a, b and c."""
        return ((*self.n, self.albedo), (*self.l, *self.parameters[:1]), (*self.v, *self.parameters[1:]))

    def numbers(self) -> tuple[float, ...]:
        """Return all of them, one after the other."""
        return (*self.n, *self.l, *self.v, self.albedo, *self.parameters)


@dataclass(frozen=True)
class Result:
    """The shader's value for `inputs` and the formula's; `allowed` is the error that is asked for."""

    inputs: Inputs
    got: tuple[float, float, float]
    expected: float
    allowed: float

    @property
    def sound(self) -> bool:
        """Whether all channels are finite and none is negative."""
        return all(0.0 <= value < math.inf for value in self.got)

    @property
    def error(self) -> float:
        """The largest deviation of a channel; infinite if one is not finite."""
        return max(abs(value - self.expected) if math.isfinite(value) else math.inf for value in self.got)

    @property
    def excess(self) -> float:
        """The error as a multiple of what is asked for."""
        return self.error / self.allowed


def stability(exact: Referee, quick: Referee, count: int, progress: Progress) -> Iterator[Record]:
    """Yield a record for each model and family of cases: its worst input, and how many inputs do as asked.

    `exact` gives a formula's value in all digits, `quick` in 64-bit floats. Every random input is held against `quick`, whose
    rounding is 1e9 times finer than the shader's; the worst of them and all other inputs against `exact`. `screen_error` is how
    far the two are apart at most, as a multiple of the error allowed. Each model is one unit of work to `progress`.
    """
    dice = random.Random(1)
    directions = [_lit(dice) for _ in range(count)]
    for shader in DRAWN:
        with progress.step(f"GLSL  {shader.model}", 1.0):
            records = _records(shader, directions, exact, quick)
        yield from records


def work() -> int:
    """Return how many units of work `stability` has."""
    return len(DRAWN)


def table(records: Sequence[Record]) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Return columns and rows for people: one for each record, with its largest errors."""
    columns = ("Model", "Case", "Home", "Inputs", "Relative", "Absolute", "As asked", "Due to input", "Sound")
    rows: list[tuple[str, ...]] = [
        (
            record["model"].replace("_", " "),  # so that a narrow terminal can break it
            record["case"],
            record["home"],
            str(record["count"]),
            f"{float(record['relative_error']):.1e}",
            f"{float(record['absolute_error']):.1e}",
            f"{100.0 * record['share_within']:.3f} %",
            f"{record['conditioned']} of {record['outside']}",
            "yes" if record["finite"] else "NO",
        )
        for record in records
    ]
    return columns, rows


def _records(shader: Shader, directions: Sequence[tuple[Vector, Vector, Vector]], exact: Referee, quick: Referee) -> list[Record]:
    families = {"random": _random(shader, directions), **_adversarial(shader)}
    every = [inputs for family in families.values() for inputs in family]
    got = iter(evaluate(shader.model, shader.call(), [inputs.row() for inputs in every]))
    screened = [float(quick(shader.model, *_arguments(inputs))) for inputs in families["random"]]
    largest = max(screened)

    def judge(inputs: Inputs, value: tuple[float, float, float], expected: float) -> Result:
        return Result(inputs, value, expected, RELATIVE * expected if expected > FLOOR * largest else ABSOLUTE)

    def truth(inputs: Inputs) -> float:
        return float(exact(shader.model, *_arguments(inputs)))

    records = []
    for case, family in families.items():
        screen_error = 0.0
        if case == "random":
            results = sorted(map(judge, family, got, screened), key=lambda result: -result.excess)
            for k in [*range(min(EXAMINED, len(results))), *range(EXAMINED, len(results), len(results) // EXAMINED + 1)]:
                corrected = judge(results[k].inputs, results[k].got, truth(results[k].inputs))
                screen_error = max(screen_error, abs(corrected.expected - results[k].expected) / corrected.allowed)
                results[k] = corrected
        else:
            results = [judge(inputs, next(got), truth(inputs)) for inputs in family]
        records.append(_record(shader, case, results, largest, screen_error, truth))
    return records


def _record(
    shader: Shader, case: str, results: Sequence[Result], largest: float, screen_error: float, truth: Callable[[Inputs], float]
) -> Record:
    worst = max(results, key=lambda result: result.excess)
    outside = sorted((result for result in results if not result.excess <= 1.0), key=lambda result: -result.excess)
    conditioned = sum(result.error <= _uncertainty(result, truth) for result in outside[:EXAMINED])
    names = ("albedo", *(parameter.name for parameter in shader.parameters))
    shape = dict(zip(names, map(_plain, (worst.inputs.albedo, *worst.inputs.parameters)), strict=True))
    return {
        "home": "glsl",
        "model": shader.model,
        "case": case,
        "inputs": {key: [_plain(x) for x in getattr(worst.inputs, key)] for key in "nlv"} | shape,
        "expected": worst.expected,
        "got": [_plain(value) for value in worst.got],
        "error": _plain(worst.error),
        "allowed": worst.allowed,
        "uncertainty": _uncertainty(worst, truth),
        "finite": all(result.sound for result in results),
        "count": len(results),
        "relative_error": _plain(max((r.error / r.expected for r in results if r.expected > FLOOR * largest), default=0.0)),
        "absolute_error": _plain(max((r.error for r in results if not r.expected > FLOOR * largest), default=0.0)),
        "share_within": 1.0 - len(outside) / len(results),
        "outside": len(outside),
        "conditioned": conditioned,
        "screen_error": screen_error,
    }


def _arguments(inputs: Inputs) -> tuple[Vector, Vector, Vector, float, tuple[float, ...]]:
    return inputs.n, inputs.l, inputs.v, inputs.albedo, inputs.parameters


def _uncertainty(result: Result, truth: Callable[[Inputs], float]) -> float:
    """Return how far the exact value moves when every one of the inputs' numbers moves by its last bit, each the worse way.

    To first order: the sum over the numbers of the larger of the moves to both neighboring 32-bit floats.
    """
    numbers, total = result.inputs.numbers(), 0.0
    for k, x in enumerate(numbers):
        if math.isfinite(x):
            moves = []
            for neighbor in _neighbors(x):
                moved = (*numbers[:k], neighbor, *numbers[k + 1 :])
                moves.append(abs(truth(Inputs.of(moved)) - result.expected))
            total += max(moves)
    return total


def _neighbors(x: float) -> tuple[float, float]:
    """Return the 32-bit floats on both sides of the 32-bit float `x`."""
    fraction, exponent = math.frexp(x)
    step = math.ldexp(1.0, max(exponent - 24, -149))
    inward = 0.5 * step if abs(fraction) == 0.5 and exponent > -125 else step  # below a power of 2 they lie twice as close
    return x - math.copysign(inward, x), x + math.copysign(step, x)


def _plain(x: float) -> float | str:
    """Return `x`, or its name where JSON has no number for it."""
    return x if math.isfinite(x) else str(x)


def _single(*values: float) -> tuple[float, ...]:
    """Round to 32-bit floats, so that both sides start from the same numbers."""
    form = f"{len(values)}f"
    return struct.unpack(form, struct.pack(form, *values))


def _vector(values: Sequence[float]) -> Vector:
    x, y, z = _single(*values)
    return x, y, z


def _anywhere(dice: random.Random) -> Vector:
    return normalize((dice.gauss(0.0, 1.0), dice.gauss(0.0, 1.0), dice.gauss(0.0, 1.0)))


def _lit(dice: random.Random) -> tuple[Vector, Vector, Vector]:
    """Return N anywhere, L and V anywhere above its surface."""
    n, l, v = _anywhere(dice), _anywhere(dice), _anywhere(dice)
    l, v = (x if dot(n, x) > 0.0 else scale(x, -1.0) for x in (l, v))
    return _vector(n), _vector(l), _vector(v)


def _random(shader: Shader, directions: Sequence[tuple[Vector, Vector, Vector]]) -> list[Inputs]:
    dice = random.Random(shader.model)
    return [
        Inputs(n, l, v, *_single(dice.random()), _single(*(parameter.draw(dice) for parameter in shader.parameters)))
        for n, l, v in directions
    ]


def _adversarial(shader: Shader) -> dict[str, list[Inputs]]:
    """Return the inputs that are hard or wrong, by what is hard or wrong with them."""
    dice = random.Random(2)
    typical = _single(*(parameter.typical for parameter in shader.parameters))
    full = _single(*(parameter.high for parameter in shader.parameters))
    (rho,) = _single(0.7)
    frames = [((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)), *(_frame(dice) for _ in range(3))]
    cosines = (-0.5, -1e-8, 0.0, 1e-8, 1e-4, 0.5, 1.0 - 1e-8, 1.0)

    def at(frame: tuple[Vector, Vector, Vector], mu: float, azimuth: float) -> Vector:
        return _vector([dot(from_polar(mu, azimuth), column) for column in zip(*frame, strict=True)])

    grazing = [
        Inputs(_vector(frame[2]), at(frame, mu_i, azimuth), at(frame, mu_o, 0.0), rho, shape)
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
        opposite = _vector(add(scale(n, 2.0 * dot(n, v)), scale(v, -1.0)))
        aside = [_vector(normalize(add(v, scale(_anywhere(dice), distance)))) for distance in (1e-6, 1e-3)]
        for light, viewer in ((n, n), (v, v), (opposite, v), (n, v), (l, n), (aside[0], v), (aside[1], v)):
            aligned.append(Inputs(n, light, viewer, rho, typical if len(aligned) % 2 else full))

    usual = [_lit(dice) for _ in range(8)]
    strange = (0.0, 1e-40, 1e-8, 1e-3, math.pi / 2, 1e3, 1e38, math.inf, -0.5, -math.inf, math.nan)
    families = {"grazing": grazing, "aligned": aligned}
    for k, parameter in enumerate(shader.parameters):
        values = _single(parameter.low, parameter.high, *strange)
        families[parameter.name] = [
            Inputs(n, l, v, rho, (*typical[:k], value, *typical[k + 1 :])) for n, l, v in usual for value in values
        ]
    albedos = _single(0.0, 1e-40, 0.5, 1.0, 1.5, 1e38, math.inf, -0.5, -math.inf, math.nan)
    families["albedo"] = [Inputs(n, l, v, albedo, typical) for n, l, v in usual for albedo in albedos]

    vectors = []
    for n, l, v in usual:
        good = Inputs(n, l, v, rho, typical)
        for key in "nlv":
            vector = getattr(good, key)
            x, y, z = vector
            wrong: list[Sequence[float]] = [scale(vector, factor) for factor in (0.0, 1e-30, 1e-3, 0.5, 2.0, 1e6, 1e30, -1.0)]
            wrong += [(1e-40,) * 3, (math.nan,) * 3, (math.inf,) * 3, (3e38, -3e38, 3e38)]
            wrong += [(math.nan, y, z), (x, -math.inf, z), (x, y, 1e-40)]
            vectors += [replace(good, **{key: _vector(numbers)}) for numbers in wrong]
        for size in (1e-3, 0.5, 2.0, 1e6):
            vectors.append(Inputs.of([*(size * x for x in (*n, *l, *v)), rho, *typical]))
    families["vectors"] = vectors
    return families


def _frame(dice: random.Random) -> tuple[Vector, Vector, Vector]:
    """Return three orthogonal unit vectors in a random direction."""
    z, other = _anywhere(dice), _anywhere(dice)
    x = normalize(add(other, scale(z, -dot(other, z))))
    return x, (z[1] * x[2] - z[2] * x[1], z[2] * x[0] - z[0] * x[2], z[0] * x[1] - z[1] * x[0]), z
