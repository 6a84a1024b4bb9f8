# SPDX-License-Identifier: GPL-3.0-or-later
"""What the paper claims of the rough model, and what was measured of it. No bpy."""

from collections.abc import Sequence

from true_diffuse.addon.measure.record import LABELS, Record
from true_diffuse.addon.models import OrenNayar, directional_albedo

SIGMAS = (0.2, 0.33)
MUS = (1.0, 0.5, 0.2, 0.05)
CHEAP = 1.25  # times Lambert's render time
PRINTED, SIMPLE, AHEAD = 1, 2, 3  # of `cost.FORMS`, after Lambert


def records(curves: Sequence[Record], forms: Sequence[Record], luminance: Sequence[Record]) -> list[Record]:
    """Return claim, what was measured in sentences, and a verdict.

    `forms` are those of `studies.cost.forms`, `luminance` what the roughest character has over Lambert's in each engine. What was
    not measured is left out; a verdict is None where nothing was.
    """
    return [_darker(luminance), _expensive(curves, forms), _ahead(forms)]


def _darker(luminance: Sequence[Record]) -> Record:
    measured = [
        f"The character with sigma 0.33 has {one['ratio']:.3f} of Lambert's luminance in {LABELS[one['engine']]}."
        for one in luminance
    ]
    albedos = {sigma: [directional_albedo(OrenNayar(sigma), mu) for mu in MUS] for sigma in SIGMAS}
    for sigma, values in albedos.items():
        shares = ", ".join(f"{value:.3f} at N.V {mu:g}" for value, mu in zip(values, MUS, strict=True))
        measured.append(f"Of Lambert's 1, sigma {sigma:g} reflects {shares}.")
    facing = max(values[0] for values in albedos.values())
    grazing = max(values[-1] for values in albedos.values())
    verdict = "True where a surface faces the viewer" if facing < 1.0 else "False"
    verdict += ", false at grazing view, where a small sigma reflects more than it receives." if grazing > 1.0 else "."
    return {"claim": "Oren-Nayar is slightly darker than Lambert", "measured": measured, "verdict": verdict}


def _expensive(curves: Sequence[Record], forms: Sequence[Record]) -> Record:
    measured = []
    if forms:
        lambert, printed = forms[0], forms[PRINTED]
        measured.append(
            f"In GLSL one evaluation takes {printed['operations']} operations and {printed['nanoseconds']:.2f} ns as printed, "
            f"Lambert's {lambert['operations']} and {lambert['nanoseconds']:.2f} ns."
        )
    ratios: dict[str, list[float]] = {}
    for curve in curves:
        if curve["group"] != "rough_diffuse" or curve["model"] != "Oren-Nayar" or curve["engine"] == "glsl":
            continue
        own = [
            one
            for one in curves
            if (one["scene"], one["engine"]) == (curve["scene"], curve["engine"]) and one["label"].startswith("Diffuse BSDF")
        ]
        if own:
            ratio = _ratio(curve, own[0])
            ratios.setdefault(curve["engine"], []).append(ratio)
            variant = curve["label"].removeprefix("Rough Diffuse, ")
            measured.append(
                f"{curve['scene']}, {LABELS[curve['engine']]}, {variant}: {ratio:.2f} times the time of Blender's Diffuse BSDF."
            )
    if not ratios:
        return {"claim": "Oren-Nayar is too expensive for games", "measured": measured, "verdict": None}
    least = max(min(values) for values in ratios.values())
    verdict = "False" if least <= CHEAP else "True"
    verdict += (
        f": in every engine measured there is a quality that takes at most {least:.2f} times as long as Blender's own Diffuse BSDF."
    )
    return {"claim": "Oren-Nayar is too expensive for games", "measured": measured, "verdict": verdict}


def _ratio(curve: Record, own: Record) -> float:
    """Return the quotient of the times at the greatest sample count that both have."""
    times = {point["samples"]: point["seconds"] for point in own["points"]}
    last = max((point for point in curve["points"] if point["samples"] in times), key=lambda point: point["samples"])
    return last["seconds"] / times[last["samples"]]


def _ahead(forms: Sequence[Record]) -> Record:
    claim = "Precomputing A and B helps"
    if not forms:
        return {"claim": claim, "measured": [], "verdict": None}
    named = (("As printed", PRINTED), ("With the roots cancelled", SIMPLE), ("With A and B worked out ahead", AHEAD))
    measured = [
        f"{words[0].upper()}{words[1:]}: {forms[k]['operations']} operations, {forms[k]['nanoseconds']:.2f} ns."
        for words, k in named
    ]
    simple, ahead = forms[SIMPLE]["nanoseconds"], forms[AHEAD]["nanoseconds"]
    saved = 1.0 - ahead / simple
    verdict = f"True: it saves {100.0 * saved:.0f} % of an evaluation" if saved > 0.0 else "Not on this driver"
    share = 1.0 - simple / forms[PRINTED]["nanoseconds"]
    verdict += f"; cancelling the square roots saves {100.0 * share:.0f} % of the printed form before." if share > 0.0 else "."
    return {"claim": claim, "measured": measured, "verdict": verdict}
