# SPDX-License-Identifier: GPL-3.0-or-later
"""How near a target of the models comes to their formulas in 32-bit floats, and what it makes of the worst inputs.

Asked of every input: an error of at most RELATIVE of the value where that is above FLOOR of the model's largest, and at most
ABSOLUTE elsewhere; and never NaN, infinity or a negative radiance. The formula gets the same 32-bit numbers as the shader. An input
is conditioned if moving its numbers by their last bit moves the exact value by as much as the error: there the shader is as good as
its input. No bpy.
"""

import math
import random
import struct
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import islice
from typing import Protocol

from true_diffuse.addon.measure.record import Record
from true_diffuse.addon.models.vector import Vector, normalize
from true_diffuse.scripts.studies.study import Table, number_or_name

RELATIVE, FLOOR, ABSOLUTE = 2e-5, 1e-4, 1e-6
EXAMINED = 100  # of the random inputs, so many of the worst, and as many others, are worked out in all digits

type Arguments = tuple[Vector, Vector, Vector, float, tuple[float, ...]]  # N, L, V, the albedo and the shape parameters
type Reference = Callable[[str, Vector, Vector, Vector, float, Sequence[float]], float]


class Inputs(Protocol):
    """What one evaluation gets, all of it 32-bit floats."""

    def arguments(self) -> Arguments:
        """Return what the formula gets."""
        ...


@dataclass(frozen=True)
class Result:
    """The shader's value for `arguments` and the formula's; up to `floor` the absolute error counts, above it the relative one."""

    arguments: Arguments
    got: tuple[float, float, float]
    expected: float
    floor: float

    @property
    def is_relative(self) -> bool:
        """Whether the relative error counts."""
        return self.expected > self.floor

    @property
    def allowed(self) -> float:
        """The error that is asked for."""
        return RELATIVE * self.expected if self.is_relative else ABSOLUTE

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


@dataclass(frozen=True)
class AccuracyCheck:
    """Compares one target with the formulas: `exact` in all digits, `quick` in 64-bit floats."""

    target: str
    exact: Reference
    quick: Reference

    def records(
        self, model: str, names: Sequence[str], families: Mapping[str, Sequence[Inputs]], got: Iterator[tuple[float, float, float]]
    ) -> list[Record]:
        """Return a record for each family of inputs: its worst input, and how many inputs do as asked.

        `names` are those of the model's shape parameters; `got` gives the shader's values, one family after the other. Every input
        of the family "random" is held against `quick`, whose rounding is 1e9 times finer than the shader's; the worst of them and
        all other inputs against `exact`. `screen_error` is how far the two are apart at most, as a multiple of the error allowed.
        """
        cases = {case: [inputs.arguments() for inputs in family] for case, family in families.items()}
        screened = [float(self.quick(model, *arguments)) for arguments in cases.get("random", ())]
        floor = FLOOR * max(screened, default=1.0 / math.pi)

        def truth(arguments: Arguments) -> float:
            return float(self.exact(model, *arguments))

        records = []
        for case, family in cases.items():
            screen_error = 0.0
            values = islice(got, len(family))
            expected = screened if case == "random" else map(truth, family)
            results = [Result(*each, floor) for each in zip(family, values, expected, strict=True)]
            if case == "random":
                results.sort(key=lambda result: -result.excess)
                for k in [*range(min(EXAMINED, len(results))), *range(EXAMINED, len(results), len(results) // EXAMINED + 1)]:
                    corrected = replace(results[k], expected=truth(results[k].arguments))
                    screen_error = max(screen_error, abs(corrected.expected - results[k].expected) / corrected.allowed)
                    results[k] = corrected
            identity = {"target": self.target, "model": model, "case": case}
            records.append(identity | _findings(names, results, truth) | {"screen_error": screen_error})
        return records


def table(records: Sequence[Record]) -> Table:
    """Return a row for each record, with its largest errors."""
    columns = ("Model", "Case", "Target", "Inputs", "Relative", "Absolute", "As asked", "Due to input", "Sound")
    rows: list[tuple[str, ...]] = [
        (
            record["model"].replace("_", " "),  # so that a narrow terminal can break it
            record["case"],
            record["target"],
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


def single(*values: float) -> tuple[float, ...]:
    """Round to 32-bit floats, so that both sides start from the same numbers."""
    form = f"{len(values)}f"
    return struct.unpack(form, struct.pack(form, *values))


def single_vector(values: Sequence[float]) -> Vector:
    """Round a vector to 32-bit floats."""
    x, y, z = single(*values)
    return x, y, z


def anywhere(dice: random.Random) -> Vector:
    """Return a random unit vector, all directions alike."""
    return normalize((dice.gauss(0.0, 1.0), dice.gauss(0.0, 1.0), dice.gauss(0.0, 1.0)))


def _findings(names: Sequence[str], results: Sequence[Result], truth: Callable[[Arguments], float]) -> Record:
    worst = max(results, key=lambda result: result.excess)
    outside = sorted((result for result in results if not result.excess <= 1.0), key=lambda result: -result.excess)
    n, l, v, albedo, shape = worst.arguments
    vectors = {key: [number_or_name(x) for x in vector] for key, vector in (("n", n), ("l", l), ("v", v))}
    return {
        "inputs": vectors | dict(zip(("albedo", *names), map(number_or_name, (albedo, *shape)), strict=True)),
        "expected": worst.expected,
        "got": [number_or_name(value) for value in worst.got],
        "error": number_or_name(worst.error),
        "allowed": worst.allowed,
        "uncertainty": _uncertainty(worst, truth),
        "finite": all(result.sound for result in results),
        "count": len(results),
        "relative_error": number_or_name(max((r.error / r.expected for r in results if r.is_relative), default=0.0)),
        "absolute_error": number_or_name(max((r.error for r in results if not r.is_relative), default=0.0)),
        "share_within": 1.0 - len(outside) / len(results),
        "outside": len(outside),
        "conditioned": sum(result.error <= _uncertainty(result, truth) for result in outside[:EXAMINED]),
    }


def _uncertainty(result: Result, truth: Callable[[Arguments], float]) -> float:
    """Return how far the exact value moves when every one of the inputs' numbers moves by its last bit, each the worse way.

    To first order: the sum over the numbers of the larger of the moves to both neighboring 32-bit floats.
    """
    n, l, v, albedo, shape = result.arguments
    numbers, total = (*n, *l, *v, albedo, *shape), 0.0
    for k, x in enumerate(numbers):
        if math.isfinite(x):
            moves = []
            for neighbor in _neighbors(x):
                nx, ny, nz, lx, ly, lz, vx, vy, vz, albedo, *shape = (*numbers[:k], neighbor, *numbers[k + 1 :])
                moved = truth(((nx, ny, nz), (lx, ly, lz), (vx, vy, vz), albedo, tuple(shape)))
                moves.append(abs(moved - result.expected))
            total += max(moves)
    return total


def _neighbors(x: float) -> tuple[float, float]:
    """Return the 32-bit floats on both sides of the 32-bit float `x`; of 0, the rounding of a unit vector's component, 2^-24."""
    fraction, exponent = math.frexp(x)
    step = math.ldexp(1.0, max(exponent - 24, -149))
    inward = 0.5 * step if abs(fraction) == 0.5 and exponent > -125 else step  # below a power of 2 they lie twice as close
    return x - math.copysign(inward, x), x + math.copysign(step, x)
