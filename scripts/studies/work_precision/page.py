# SPDX-License-Identifier: GPL-3.0-or-later
"""The study as one page that needs nothing else: recommendation, curves, tables. No bpy."""

from collections.abc import Iterable, Sequence
from html import escape

from true_diffuse.addon.measure.record import LABELS, Record
from true_diffuse.addon.probe.fit import FLAT
from true_diffuse.scripts.studies.work_precision import plot
from true_diffuse.scripts.studies.work_precision.curves import TOLERANCES, seconds

TITLES = {
    "sphere": ("Sphere", "Under a sun 60 degrees beside the viewer, without bounces: nothing but the material."),
    "furnace": ("Furnace", "The same sphere in a white world: what the material reflects of light from everywhere."),
    "five": (
        "Five characters",
        "As an artist renders them: sun, sky, shadows, bounces, the pixel filter. All five in one material.",
    ),
    "face": (
        "Face",
        "One head of skin, key and back light with shadows, without bounces; all skin but where an edge runs through.",
    ),
}
STYLE = """
:root{--paper:#fff;--ink:#1c1c1c;--soft:#666;--line:#ddd;--mark:#f2f4f7;
--c0:#0072b2;--c1:#d55e00;--c2:#009e73;--c3:#b0518f;--c4:#8a6d00;--c5:#3a9bd0;--c6:#444;--c7:#c78500}
@media(prefers-color-scheme:dark){:root{--paper:#16181c;--ink:#e6e6e6;--soft:#a0a0a0;--line:#3a3d44;--mark:#22252b;
--c0:#5ab4ea;--c1:#ff8a3c;--c2:#2fcf9f;--c3:#e58cc4;--c4:#d3b84a;--c5:#9ad4f5;--c6:#c4c4c4;--c7:#f5c04a}}
*{box-sizing:border-box}
body{margin:0 auto;padding:1rem;max-width:72rem;background:var(--paper);color:var(--ink);font:16px/1.5 system-ui,sans-serif}
h1{font-size:1.6rem;line-height:1.2}h2{margin-top:2.5rem;border-bottom:1px solid var(--line)}h3{margin:1.5rem 0 .3rem}
p,li{max-width:46rem}.soft,figcaption{color:var(--soft);font-size:.9rem}
.pair{display:grid;grid-template-columns:repeat(auto-fit,minmax(min(100%,22rem),1fr));gap:1rem}
figure{margin:0;min-width:0}svg.plot{width:100%;height:auto;max-width:34rem;display:block}
svg.key{vertical-align:middle}svg text{fill:var(--ink);font-size:12px}
.grid{stroke:var(--line);stroke-width:.7;fill:none}.frame{fill:none;stroke:var(--soft)}.unknown{fill:var(--line);opacity:.6}
.tolerance{stroke:var(--soft);stroke-dasharray:2 4;fill:none}.spread{stroke-width:1;opacity:.7;fill:none}
.pareto{fill:none;stroke:var(--ink);stroke-width:1.2}
.scroll{overflow-x:auto;margin:.5rem 0 1rem}table{border-collapse:collapse;font-size:.9rem}
th,td{padding:.25rem .6rem;border-bottom:1px solid var(--line);text-align:left;vertical-align:top}
td.n,th.n{text-align:right;white-space:nowrap;font-variant-numeric:tabular-nums}thead th{background:var(--mark)}
.best{font-weight:700}summary{cursor:pointer}
"""
HOW = (
    "Error is RMS over the pixels of the subject, relative to the RMS of what they are held against.",
    "A point is the median of its repeats, each with random numbers of its own; bars show the least and the greatest. Variants "
    "take turns, so that what slows the machine down slows all of them alike.",
    "A ring marks a point that no other of the same target beats in both time and error: the Pareto front.",
    "Floor is the error that is left with any number of samples, by fits of error² = floor² + (noise · samples^-slope)², one "
    "for each repeat; ± is the standard error of their mean. Monte Carlo has a slope of 1/2. Where the errors of all sample "
    "counts agree there is no noise, hence no slope. Where the longest counts have fewer repeats, the first stands in each fit. "
    "Errors below 0.01 % are drawn at it. A dotted line at the right shows the floor.",
    "Time to an error is the fixed part of a frame and as many samples as the fit asks for, one at least. Never: the floor lies "
    "above. An asterisk: it takes more samples than were measured, or lies below the reference's noise.",
    "Gray at the bottom of a diagram is the reference's own noise: nothing below it can be measured.",
    "Shaders are compiled once, in the first render of each material, which is in no curve. The driver's disk cache is off.",
    "EEVEE's Principled BSDF is its Diffuse BSDF where a surface is matt, so it is in the sphere alone, and its Diffuse BSDF "
    "ignores Roughness. In the characters and the face EEVEE ends at 64 samples, as 256 take minutes.",
    "Realtime draws the models themselves, at one quality; it has no bounces, and its world lights through everything. On the "
    "sphere all its samples are at the pixel's center, so that one is enough.",
    "Times hold for this machine alone. Compare choices, not machines.",
)


def html(document: Record) -> str:
    """Return the page that shows what report.json holds."""
    curves = document["curves"]
    machine, devices = document["environment"]["machine"], document["environment"]["devices"]
    where = f"Blender {document['environment']['blender']}, True Diffuse {document['environment']['true_diffuse']}; "
    where += f"{machine['processor']}, {machine['cores']} cores, {machine['system']}; "
    where += ", ".join(f"{LABELS[key]} on {device}" for key, device in devices.items())
    if others := document.get("environments"):
        where += f"; times are of {len(others)} different machines"
    parts = [
        "<h1>What an error costs</h1>",
        "<p>Rough Diffuse and Subsurface in each engine and quality, beside what Blender has: error against render time.</p>",
        f'<p class="soft">{escape(where)}{". A quick run: few samples and repeats." if document["options"]["quick"] else ""}</p>',
        "<h2>Which to take</h2>",
        *_advice(document),
    ]
    built = {one["scene"]: one for one in document["scenes"]}
    for name in document["options"]["scenes"]:
        parts += _scene(name, built[name], [curve for curve in curves if curve["scene"] == name])
    parts += ["<h2>Startup, first and later renders</h2>", *_startup(document)]
    parts += ["<h2>Hard inputs</h2>", *_stability(document["stability"], document["hard_inputs"])]
    parts += ["<h2>What the paper claims</h2>", *_claims(document["claims"])]
    parts += ["<h2>How it is measured</h2>", "<ul>", *(f"<li>{escape(text)}</li>" for text in HOW), "</ul>"]
    head = '<meta charset="utf-8"><meta name="viewport" content="width=device-width,initial-scale=1">'
    head += '<meta name="color-scheme" content="light dark"><title>True Diffuse: what an error costs</title>'
    body = "\n".join(parts)
    return f'<!DOCTYPE html>\n<html lang="en"><head>{head}<style>{STYLE}</style></head>\n<body>\n{body}\n</body></html>\n'


def _table(columns: Sequence[str], rows: Iterable[Sequence[str]], words: int) -> str:
    """Return a table in a box of its own that scrolls; cells are HTML, the first `words` columns words, the rest figures."""

    def cells(tag: str, row: Sequence[str]) -> str:
        return "".join(f"<{tag}{'' if k < words else ' class="n"'}>{cell}</{tag}>" for k, cell in enumerate(row))

    body = "\n".join(f"<tr>{cells('td', row)}</tr>" for row in rows)
    return f'<div class="scroll"><table><thead><tr>{cells("th", columns)}</tr></thead><tbody>\n{body}\n</tbody></table></div>'


def _percent(share: float | None) -> str:
    return "–" if share is None else f"{100.0 * share:.2g} %" if share < 0.995 else f"{100.0 * share:.0f} %"


def _advice(document: Record) -> list[str]:
    lines = []
    for scene in document["options"]["scenes"]:
        title = TITLES[scene][0]
        for engine in document["options"]["engines"]:
            own = [one for one in document["recommendations"] if (one["scene"], one["engine"]) == (scene, engine)]
            if own:
                lines.append(f"<p><b>{escape(title)}, {LABELS[engine]}.</b> {escape(_said(own))}</p>")
    return lines


def _said(advice: Sequence[Record]) -> str:
    """Return the sentences of one scene and engine, from wide tolerances to narrow ones, each choice once."""
    said: dict[tuple[object, ...], list[Record]] = {}
    for one in advice:
        said.setdefault((one["label"], one["samples"]) if one["label"] else (None,), []).append(one)
    sentences = []
    for group in said.values():
        text, last = group[0]["text"], group[-1]["tolerance"]
        if group[0]["label"] and len(group) > 1:  # what is near enough for the narrowest is so for all
            text = text.replace(" take ", f" down to {100.0 * last:g} % take ", 1)
        sentences.append(text)
    return " ".join(sentences)


def _scene(name: str, built: Record, curves: Sequence[Record]) -> list[str]:
    title, what = TITLES[name]
    lines = [f'<h2 id="{name}">{escape(title)}</h2>', f"<p>{escape(what)} Held against: {escape(built['reference'])}"]
    noise = max((curve["reference_error"] for curve in curves), default=0.0)
    lines.append(f" That reference's own noise: {_percent(noise)}.</p>" if noise > 0.0 else "</p>")
    lines.append('<div class="pair">')
    tables = []
    for engine in LABELS:
        own = [curve for curve in curves if curve["engine"] == engine]
        if own and engine != "glsl":
            caption = f"{title}, {LABELS[engine]}: error over time"
            lines.append(f"<figure>{plot.svg(own, caption)}<figcaption>{escape(caption)}</figcaption></figure>")
        if own:
            tables += [f"<h3>{LABELS[engine]}</h3>", _curve_table(own)]
    return [*lines, "</div>", *tables]


def _curve_table(curves: Sequence[Record]) -> str:
    columns = ("", "Material", "Held against", "Floor", "Slope", "One sample", *(f"To {100.0 * t:g} %" for t in TOLERANCES))
    best = {f"{tolerance:g}": _soonest(curves, f"{tolerance:g}") for tolerance in TOLERANCES}
    rows = []
    for index, curve in enumerate(curves):
        cells = []
        for tolerance in TOLERANCES:
            key = f"{tolerance:g}"
            spent = curve["seconds_to"][key]
            text = "never" if spent is None else seconds(spent) + ("*" if key in curve["beyond"] else "")
            cells.append(f'<span class="best">{text}</span>' if curve is best[key] else text)
        first, errors = curve["points"][0], [point["error"] for point in curve["points"]]
        slope = "–" if curve["slope"] is None else _plus_minus(curve["slope"], curve["slope_uncertainty"])
        if curve["slope"] is None and min(errors) * (1.0 + FLAT) >= max(errors):
            slope = "no noise"
        one = f"{_percent(first['error'])}, {seconds(first['seconds'])}"
        mark = plot.key(index, curve["kind"])
        rows.append((mark, escape(curve["label"]), escape(curve["target"]), _floor(curve), slope, one, *cells))
    return _table(columns, rows, 3)


def _soonest(curves: Sequence[Record], key: str) -> Record | None:
    """Return the curve of the first one's target that has the error `key` soonest, with no more samples than were measured."""
    rivals = [curve for curve in curves if curve["target"] == curves[0]["target"] and key not in curve["beyond"]]
    able = [curve for curve in rivals if curve["seconds_to"][key] is not None]
    return min(able, key=lambda curve: curve["seconds_to"][key], default=None)


def _floor(curve: Record) -> str:
    if curve["floor"] < curve["reference_error"]:
        return f"below {_percent(curve['reference_error'])}"
    uncertainty = curve["floor_uncertainty"]
    if uncertainty is None or uncertainty < 0.01 * curve["floor"]:
        return _percent(curve["floor"])
    return f"{_plus_minus(100.0 * curve['floor'], 100.0 * uncertainty)} %"


def _plus_minus(value: float, uncertainty: float | None) -> str:
    """Return a figure with its uncertainty, to two digits."""
    return f"{value:.2g}" if uncertainty is None else f"{value:.2g} ± {uncertainty:.1g}"


def _startup(document: Record) -> list[str]:
    once = [("Start-up", LABELS[one["engine"]], seconds(one["seconds"])) for one in document["startup"]]
    once += [("Scene build", escape(TITLES[one["scene"]][0]), seconds(one["seconds"])) for one in document["scenes"]]
    lines = [
        "<p>Once, before the first picture:</p>",
        _table(("What", "Where", "Time"), once, 2),
        "<p>For each material: building it, what its first render takes beyond a later one (compiling its shaders, in the order of "
        "this study: what an earlier scene has compiled is not compiled again), and what every frame takes.</p>",
    ]
    names = ("build_seconds", "first_seconds", "seconds_fixed", "seconds_per_sample")
    rows = []
    for curve in document["curves"]:
        if curve["engine"] != "glsl":
            times = ("–" if curve[name] is None else seconds(curve[name]) for name in names)
            rows.append((escape(TITLES[curve["scene"]][0]), LABELS[curve["engine"]], escape(curve["label"]), *times))
    columns = ("Scene", "Engine", "Material", "Build", "First render, beyond", "Frame, fixed", "Each sample")
    return [*lines, "<details><summary>All materials</summary>", _table(columns, rows, 3), "</details>"]


def _stability(found: Sequence[Record], shaders: Sequence[Record]) -> list[str]:
    def shown(value: float | str | None) -> str:
        return "–" if value is None else escape(value) if isinstance(value, str) else f"{value:.6g}"

    rows = [(escape(one["what"]), escape(one["case"]), *(shown(one[k]) for k in ("plain", "ours", "expected"))) for one in found]
    paper = [row for row, one in zip(rows, found, strict=True) if one["expected"] is None]
    others = [row for row, one in zip(rows, found, strict=True) if one["expected"] is not None]
    columns = ("Formula", "Case", "As published", "Ours", "Exact")
    lines = ["<p>The rough model as the paper prints it, and ours:</p>", _table(columns[:4], (row[:4] for row in paper), 2)]
    lines += ["<details><summary>Subsurface formulas</summary>", _table(columns, others, 2), "</details>"]
    if shaders:
        body = (
            (
                *(escape(str(one[k])) for k in ("target", "model", "case")),
                str(one["count"]),
                *(f"{float(one[k]):.1e}" for k in ("relative_error", "absolute_error")),
                f"{100.0 * one['share_within']:.3f} %",
                "yes" if one["finite"] else "NO",
            )
            for one in shaders
        )
        names = ("Target", "Model", "Inputs", "Count", "Relative error", "Absolute error", "As asked", "Finite, not negative")
        lines += ["<details><summary>GLSL and OSL in 32-bit floats</summary>", _table(names, body, 3), "</details>"]
    return lines


def _claims(claims: Sequence[Record]) -> list[str]:
    lines = []
    for one in claims:
        lines.append(f"<h3>“{escape(one['claim'])}”</h3><p><b>{escape(one['verdict'] or 'Not measured in this run.')}</b></p>")
        lines += ["<ul>", *(f"<li>{escape(text)}</li>" for text in one["measured"]), "</ul>"]
    return lines
