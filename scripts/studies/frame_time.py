# SPDX-License-Identifier: GPL-3.0-or-later
"""Frame times of the realtime shaders: every law and form of equation (1) in turns with Lambert's, and how the cost grows.

What draws is a `Stage`: Blender's gpu module in realtime_frames.py, moderngl in scripts/bench_glsl.py. No bpy.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from statistics import linear_regression, median, quantiles
from typing import Protocol

from true_diffuse.addon.measure.record import Progress, Record
from true_diffuse.addon.models import Specular
from true_diffuse.addon.realtime.laws import LAWS, SPECULAR, Law
from true_diffuse.scripts.studies.formulations import FORMS, law

SIGMA = 0.33
INPUTS = {"Roughness": SIGMA, "IOR": 1.5, "Specular": Specular().specular, "Exponent": Specular().exponent}
LAMPS, ROUNDS = (1, 2, 4, 8), 5
PIXELS = (0.25, 0.5, 1.0, 2.0)  # times the picture's
GROWTH_LAMPS = 4  # while pixels and triangles change
SUNS = tuple((0.2 * k - 0.7, -0.75, 0.5 - 0.05 * k) for k in range(8))  # towards each of the lamps, before the characters
SOFTWARE = ("llvmpipe", "softpipe", "swiftshader", "software")  # in the names of drivers that draw on the processor

PLAIN_LAMBERT, LAMBERT, OREN_NAYAR = "plain Lambert", "lambert.glsl", "oren_nayar.glsl"
PLAIN = (PLAIN_LAMBERT, "plain (1), as printed", "plain (1), simplified", "plain (1), folded")
CONTESTANTS: Mapping[str, Law] = {name: law(form) for name, form in zip(PLAIN, FORMS, strict=True)} | {
    f"{shipped.stem}.glsl": shipped for shipped in (*LAWS.values(), SPECULAR)
}
GROWING = {name: CONTESTANTS[name] for name in (LAMBERT, OREN_NAYAR)}

type Table = tuple[tuple[str, ...], list[tuple[str, ...]]]
type Times = Mapping[str, float]
"""Seconds of a frame by the clocks that told them: readback, timer, processor."""


@dataclass(frozen=True)
class Setting:
    """What is drawn: suns, which are the lamps that cost least; pixels and triangles as multiples of those that the stage has."""

    lamps: int = 1
    pixels: float = 1.0
    triangles: float = 1.0


class Terminal(Protocol):
    """What shows text and tables."""

    def say(self, text: str) -> None: ...

    def table(self, title: str, columns: Sequence[str], rows: Sequence[Sequence[str]]) -> None: ...


class Stage(Protocol):
    """What draws frames."""

    @property
    def details(self) -> Sequence[float]:
        """The multiples of its triangles that it can draw."""
        ...

    def prepare(self, setting: Setting) -> Record:
        """Have `setting` ready to draw; return its width, height and triangles."""
        ...

    def frame(self, law: Law) -> Times:
        """Draw all with `law` at INPUTS and wait until it is done; return how long that took."""
        ...


def is_software(renderer: str) -> bool:
    """Return whether the driver of this name draws on the processor, so that its times are good for ratios alone."""
    return any(name in renderer.lower() for name in SOFTWARE)


def work(stage: Stage, lamps: Sequence[int], rounds: int, grows: bool) -> float:
    """Return how many units of work `records` has: a frame's, and a fifth of that for each lamp."""
    frames = sum(_work(CONTESTANTS, count, rounds) for count in lamps)
    settings = len(PIXELS) + len(stage.details)
    return frames + (_work(GROWING, GROWTH_LAMPS, rounds) * settings if grows else 0.0)


def records(stage: Stage, lamps: Sequence[int], rounds: int, grows: bool, progress: Progress) -> Iterator[Record]:
    """Yield a record for each contestant, number of lamps and clock; then, if it `grows`, for how the cost does."""
    by_lamps = []
    for count in lamps:
        by_lamps += compare(stage, Setting(count), CONTESTANTS, rounds, progress)
    yield from by_lamps
    if not grows:
        return
    yield from growth("lamps", [record for record in by_lamps if record["law"] in GROWING])
    for what, settings in (
        ("pixels", [Setting(GROWTH_LAMPS, pixels=share) for share in PIXELS]),
        ("triangles", [Setting(GROWTH_LAMPS, triangles=detail) for detail in stage.details]),
    ):
        yield from growth(what, [one for setting in settings for one in compare(stage, setting, GROWING, rounds, progress)])


def compare(stage: Stage, setting: Setting, laws: Mapping[str, Law], rounds: int, progress: Progress) -> list[Record]:
    """Return a record for each of `laws` and each clock, after `rounds` in which all take turns, every other one backwards."""
    about = {"lit_by": f"{setting.lamps} sun{'s' * (setting.lamps > 1)}", "lamps": setting.lamps, **stage.prepare(setting)}
    text = f"{about['lit_by']}  {about['width']} x {about['height']}  {about['triangles']} triangles"
    with progress.step(text, _work(laws, setting.lamps, rounds)):
        return in_turns(stage, about, laws, rounds, lambda done: progress.within(done * _frame_work(setting.lamps)))


def in_turns(
    stage: Stage, about: Record, laws: Mapping[str, Law], rounds: int, told: Callable[[int], None] = lambda _: None
) -> list[Record]:
    """Return a record for each of `laws` and each clock: `about`, the median time and its quartiles, and so of each round's ratio.

    The stage draws what it is prepared for. `told` hears how many frames are done.
    """
    for one in laws.values():
        stage.frame(one)  # counts for nothing, as shaders are compiled in it
    names = list(laws)
    rows: list[dict[str, Times]] = []
    for turn in range(rounds):
        row = {}
        for name in names[::-1] if turn % 2 else names:
            row[name] = stage.frame(laws[name])
            told(turn * len(laws) + len(row))
        rows.append(row)
    made = []
    for name in names:
        for clock in (clock for clock in rows[0][name] if all(clock in row[name] for row in rows)):
            record = {"home": "realtime", "law": name, "clock": clock, **about, "rounds": rounds}
            record |= _spread("seconds", [row[name][clock] for row in rows])
            for key, other in (("over_lambert", LAMBERT), ("over_plain_lambert", PLAIN_LAMBERT)):
                if other in laws:
                    record |= _spread(key, [row[name][clock] / row[other][clock] for row in rows])
            made.append(record)
    return made


def growth(what: str, found: Sequence[Record]) -> Iterator[Record]:
    """Yield for each law and clock of `found` the line that a frame's seconds follow: where it starts, and its slope by `what`.

    Pixels and triangles are counted in millions. `off` is how far the farthest point is from the line, as a share of its own.
    """
    for name, clock in dict.fromkeys((record["law"], record["clock"]) for record in found):
        mine = [record for record in found if (record["law"], record["clock"]) == (name, clock)]
        points = [(_amount(what, record), record["seconds"]) for record in mine]
        if len(points) > 1:
            slope, start = linear_regression(*zip(*points, strict=True))
            off = max(abs(start + slope * x - y) / y for x, y in points)
            about = {"home": "realtime", "law": name, "clock": clock, "grows_with": what}
            yield {**about, "points": points, "start": start, "slope": slope, "off": off}


def tell(found: Sequence[Record], renderer: str, terminal: Terminal) -> None:
    """Show the records in tables and name what drew; times are shown where that is no software."""
    absolute = not is_software(renderer)
    terminal.say(f"Drawn by {renderer}" + ("" if absolute else ": software rendering, so ratios alone"))
    for clock in dict.fromkeys(record["clock"] for record in found):
        title = f"A frame's time by {clock} over that of lambert.glsl / of plain Lambert, medians"
        terminal.table(title, *table(found, clock, absolute))
    if grown := growth_table(found, absolute):
        terminal.table("What of a frame's time is fixed and what grows, on the line through all", *grown)


def table(found: Sequence[Record], clock: str, absolute: bool) -> Table:
    """Return columns and rows: under each light a frame's time by `clock` over that of lambert.glsl and of plain Lambert.

    Milliseconds are there if they are `absolute`.
    """
    timed = [record for record in found if "over_plain_lambert" in record and record["clock"] == clock]
    lights = tuple(dict.fromkeys(record["lit_by"] for record in timed))
    cells = {(record["law"], record["lit_by"]): _cell(record, absolute) for record in timed}
    names = dict.fromkeys(record["law"] for record in timed)
    rows: list[tuple[str, ...]] = [(name, *(cells.get((name, light), "") for light in lights)) for name in names]
    return ("Law", *lights), rows


def growth_table(found: Sequence[Record], absolute: bool) -> Table | None:
    """Return columns and rows for people: shares of the dearest frame timed, and in milliseconds if they are `absolute`.

    None where nothing grew.
    """
    rows: list[tuple[str, ...]] = []
    for record in found:
        if "grows_with" in record:
            start, slope = record["start"], record["slope"]
            most, seconds = max(record["points"])
            shares = (
                f"{100.0 * start / seconds:.0f} %",
                f"{100.0 * slope * most / seconds:.0f} %",
                f"{100.0 * record['off']:.0f} %",
            )
            line = (f"{1e3 * start:.3g} + {1e3 * slope:.3g} x ms",) if absolute else ()
            unit = "" if record["grows_with"] == "lamps" else " million"
            rows.append((f"{record['law']}, {record['clock']}", f"{most:.3g}{unit} {record['grows_with']}", *shares, *line))
    return (("Law", "At", "Fixed", "Grows", "Off the line", *("Line",) * absolute), rows) if rows else None


def _frame_work(lamps: int) -> float:
    return 1.0 + lamps / 5.0


def _work(laws: Mapping[str, Law], lamps: int, rounds: int) -> float:
    return len(laws) * rounds * _frame_work(lamps)


def _spread(key: str, values: Sequence[float]) -> Record:
    """Return the median of `values`, and under `key`_low and `key`_high their quartiles."""
    low, _, high = quantiles(values, n=4, method="inclusive") if len(values) > 1 else (*values, *values, *values)
    return {key: median(values), f"{key}_low": low, f"{key}_high": high}


def _amount(what: str, record: Record) -> float:
    """Return how many lamps, or how many millions of pixels or triangles, a record has."""
    match what:
        case "lamps":
            return record["lamps"]
        case "pixels":
            return record["width"] * record["height"] * 1e-6
    return record["triangles"] * 1e-6


def _cell(record: Record, absolute: bool) -> str:
    time = f"{1e3 * record['seconds']:.3g} ms  " if absolute else ""
    return f"{time}{record['over_lambert']:.2f} / {record['over_plain_lambert']:.2f}"
