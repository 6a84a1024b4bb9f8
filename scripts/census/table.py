# SPDX-License-Identifier: GPL-3.0-or-later
"""The figures over all assets: what becomes of each feature in each target, and how many assets it serves whole. No bpy."""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from true_diffuse.scripts.census.verdict import Verdict

TARGETS = {
    "cycles": "Converted, in Cycles",
    "realtime": "Realtime",
    "materialx": "USD MaterialX",
    "preview": "USD Preview",
    "gltf": "glTF",
}
WHOLE = {Verdict.KEPT, Verdict.BAKED, Verdict.NONE}
COLUMNS = ("Feature", "Target", "Assets", "Materials", "Converted", "Kept", "Baked", "Said", "Lost unsaid")
PICTURE_COLUMNS = ("Picture", "", "Materials", "Median", "90 of 100 below", "Worst")
PICTURES = {"cycles": "Cycles, after conversion from before", "realtime": "Realtime from Cycles"}
SHARE_COLUMNS = ("Target", "", "Whole", "Whole or said", "Lost unsaid", "Poorer than Blender's own")

type Record = Mapping[str, Any]
type Table = tuple[str, Sequence[str], Sequence[Sequence[str]]]  # title, columns and rows


def features(records: Sequence[Record]) -> list[dict[str, Any]]:
    """Return, for each feature and target, how many materials were kept, baked, said and lost, and in how many assets."""
    assets: dict[str, set[str]] = {}
    counts: dict[str, Counter[str]] = {}
    verdicts: dict[tuple[str, str], Counter[str]] = {}
    for record in records:
        for material in record["materials"]:
            rows = {feature["row"]: feature["channel"] for feature in material["features"]}
            for row, channel in rows.items():
                assets.setdefault(row, set()).add(record["file"])
                counts.setdefault(row, Counter()).update(materials=1, converted=int(material["converted"]))
                for target, given in material["verdicts"].items():
                    verdicts.setdefault((row, target), Counter())[given.get(channel, Verdict.NONE)] += 1
    order = sorted(assets, key=lambda row: (_group(row), -len(assets[row]), row))
    return [
        {
            "feature": row,
            "target": target,
            "assets": len(assets[row]),
            "materials": counts[row]["materials"],
            "converted": counts[row]["converted"],
            **{verdict.value: verdicts[row, target][verdict] for verdict in Verdict if verdict is not Verdict.NONE},
        }
        for row in order
        for target in TARGETS
        if (row, target) in verdicts and set(verdicts[row, target]) != {Verdict.NONE}
    ]


def _group(row: str) -> int:
    """Base colors come first, what concerns the whole surface last."""
    return (
        0 if row.startswith("Base color") else 2 if row in ("Mix or Add Shader", "Group around a closure", "Several outputs") else 1
    )


def shares(records: Sequence[Record]) -> list[dict[str, Any]]:
    """Return, for each target and for all together, how many assets are served whole, whole or said, and not."""
    found = []
    for target in (*TARGETS, ""):
        counts: Counter[str] = Counter()
        for record in records:
            given = [
                verdict
                for material in record["materials"]
                for name, verdicts in material["verdicts"].items()
                for verdict in verdicts.values()
                if target in ("", name)
            ]
            poorer = any(
                lost for material in record["materials"] for name, lost in material["poorer"].items() if target in ("", name)
            )
            counts.update(
                assets=1,
                whole=int(set(given) <= WHOLE),
                said=int(Verdict.LOST not in given),
                lost=int(Verdict.LOST in given),
                poorer=int(poorer),
            )
        found.append({"target": target, **{key: counts[key] for key in ("assets", "whole", "said", "lost", "poorer")}})
    return found


def pictures(records: Sequence[Record]) -> list[dict[str, Any]]:
    """Return, for both kinds of picture, how far they are from what they should be over all materials: fractions."""
    found = []
    for kind in PICTURES:
        given = sorted(
            material["pictures"][kind]["rms"]
            for record in records
            for material in record["materials"]
            if kind in material["pictures"] and (material["converted"] or kind != "cycles")
        )
        if given:
            last = len(given) - 1
            middle, most = given[last // 2], given[round(0.9 * last)]
            found.append({"picture": kind, "materials": len(given), "median": middle, "most": most, "worst": given[-1]})
    return found


def tables(records: Sequence[Record]) -> Iterator[Table]:
    """Yield the tables for the terminal."""
    rows, last = [], ""
    for line in features(records):
        first = line["feature"] != last
        last = line["feature"]
        numbers = [str(line[key]) if first else "" for key in ("assets", "materials", "converted")]
        numbers += [str(line[verdict]) if line[verdict] else "" for verdict in ("kept", "baked", "said", "lost")]
        rows.append([line["feature"] if first else "", TARGETS[line["target"]], *numbers])
    yield "What becomes of each feature, in materials", COLUMNS, rows
    rows = []
    for line in shares(records):
        of = max(1, line["assets"])
        rows.append([TARGETS.get(line["target"], "All targets"), ""])
        rows[-1] += [
            f"{line[key]} of {line['assets']} ({100.0 * line[key] / of:.0f} %)" for key in ("whole", "said", "lost", "poorer")
        ]
    yield "Assets", SHARE_COLUMNS, rows
    shown = []
    for line in pictures(records):
        figures = [f"{100.0 * line[key]:.2f} %" for key in ("median", "most", "worst")]
        shown.append([PICTURES[line["picture"]], "", str(line["materials"]), *figures])
    if shown:
        yield "RMS difference of pictures, one sun, interior of each material", PICTURE_COLUMNS, shown


def faults(records: Sequence[Record]) -> Iterator[tuple[str, str, str, str, str, str]]:
    """Yield file, material, target, channel, what it should be and what is held, of all that is lost unsaid or poorer."""
    for record in records:
        for material in record["materials"]:
            for target, verdicts in material["verdicts"].items():
                for channel, verdict in verdicts.items():
                    is_poorer = channel in material["poorer"].get(target, ())
                    if channel == "surface" or not (verdict == Verdict.LOST or is_poorer):
                        continue
                    kind = " and ".join(["lost unsaid"] * (verdict == Verdict.LOST) + ["poorer than Blender's own"] * is_poorer)
                    held = material["held"].get(target, {}).get(channel, [])
                    if target in material["pictures"]:
                        held = [f"a picture {100.0 * material['pictures'][target]['rms']:.1f} % off"]
                    yield (
                        record["file"],
                        material["name"],
                        TARGETS[target],
                        f"{channel} {kind}",
                        material["channels"][channel],
                        " or ".join(held) or "nothing",
                    )
