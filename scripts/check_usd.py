# SPDX-License-Identifier: GPL-3.0-or-later
"""Checks the True Diffuse materials of USD files with programs that are not Blender: OpenUSD's validators, MaterialX's generators.

uv run scripts/check_usd.py FILE [FILE ...]

The GLSL that MaterialX generates runs on the graphics driver, and is held against the formula of the model that the file names.
"""

import json
import math
import random
import sys
from argparse import Namespace
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))

import moderngl
from pxr import Tf, Usd, UsdShade, UsdValidation

import checkout  # noqa: F401 - makes this checkout the package true_diffuse
from true_diffuse.addon import models
from true_diffuse.addon.models import Model
from true_diffuse.addon.models.vector import Vector, dot
from true_diffuse.scripts.characters import reading
from true_diffuse.scripts.cli import process
from true_diffuse.scripts.cli.console import BadInput, Parser, Terminal, end, say_error, script_arguments
from true_diffuse.scripts.studies import materialx_code
from true_diffuse.scripts.studies.float32_accuracy import anywhere, single_vector
from true_diffuse.scripts.studies.study import Table, text

KEY = "trueDiffuse"  # of the custom data, see addon/usd/author.py
# Parameters of addon/material/surface.py that one of our formulas has
PLAIN = {"base_color", "diffuse_roughness", "diffuse_ior", "highlight_weight", "highlight_exponent"}
WHITE_PAPER = (0.8, 0.8, 0.8)  # the default of base_color
LIGHT: Vector = (0.0, 0.0, 1.0)
COUNT = 64 * materialx_code.WIDTH


def main() -> int:
    """Run the script; returns the exit status."""
    parser = Parser(prog="check_usd.py", description=__doc__.splitlines()[0])
    parser.add_argument("files", nargs="+", type=Path, metavar="FILE", help="USD files")
    parser.add_argument("--json", action="store_true", help="print the records, and nothing else")
    options = parser.parse_args(script_arguments())
    return process.alone("check_usd.py", partial(run, options), "nothing written")


def run(options: Namespace) -> int:
    """Check the files and print what is found; returns the exit status."""
    records = []
    try:
        with Terminal() as terminal:  # which keeps OpenUSD's warnings to itself
            for file in options.files:
                try:
                    with reading.limited(file):
                        records += list(check(file, Usd.Stage.Open(str(file))))
                except (Tf.ErrorException, OSError, UnicodeDecodeError) as error:
                    raise BadInput(f"cannot read {file}: it is damaged, or not there") from error
            if options.json:
                terminal.say(json.dumps(records))
            else:
                terminal.table("Materials, as OpenUSD and MaterialX have them", *table(records))
    except BadInput as error:
        return say_error("check_usd.py", str(error))
    return 1 if any(record["problems"] for record in records) else 0


def problems(stage: Usd.Stage) -> list[str]:
    """Return what OpenUSD's validators find, but that this copy of it, as it comes without MaterialX, does not know its shaders."""
    registry = UsdValidation.ValidationRegistry()
    found = UsdValidation.ValidationContext(registry.GetOrLoadAllValidators()).Validate(stage)
    return [
        f"{error.GetName()}: {error.GetMessage()}"
        for error in found
        if not (error.GetName() == "MissingShaderIdInRegistry" and "'ND_" in error.GetMessage())
    ]


def materials(stage: Usd.Stage) -> list[UsdShade.Material]:
    """Return the True Diffuse materials."""
    return [UsdShade.Material(prim) for prim in stage.Traverse() if prim.IsA(UsdShade.Material) and prim.HasCustomDataKey(KEY)]


def check(file: Path, stage: Usd.Stage) -> Iterator[dict[str, object]]:
    """Yield a record for the file, with what its validators find, and one for each True Diffuse material."""
    yield {"file": file.name, "material": "", "problems": problems(stage)}
    standard = materialx_code.library()
    for material in materials(stage):
        made = materialx_code.document(material, standard)
        valid, message = made.validate()
        code = {target: materialx_code.generate(made, target).getSourceCode("pixel") for target in materialx_code.GENERATORS}
        data = material.GetPrim().GetCustomDataByKey(KEY)
        yield {
            "file": file.name,
            "material": material.GetPrim().GetName(),
            "model": models.MODELS[data["model"]].label if "model" in data else "",
            "problems": ([] if valid else [message]) + [f"no {target}" for target, text in code.items() if not text],
            "lines": {target: len(text.splitlines()) for target, text in code.items()},
            **glsl_error(code["GLSL"], data),
        }


def formula(data: dict) -> tuple[Model, Sequence[float]] | None:
    """Return the model that the custom `data` name, with the albedo by channel; None where it varies or is no BRDF alone."""
    surface = data.get("surface", {})
    if data.get("varying") or set(surface) - PLAIN or "model" not in data:
        return None
    albedo = tuple(surface.get("base_color", WHITE_PAPER))
    if "highlight_weight" in surface:
        return models.Specular(surface["highlight_weight"], surface.get("highlight_exponent", 30.0)), albedo
    inputs = {"Roughness": surface.get("diffuse_roughness", 0.0), "IOR": surface.get("diffuse_ior", 1.5)}
    return models.MODELS[data["model"]].reference(inputs), albedo


def glsl_error(code: str, data: dict) -> dict[str, float]:
    """Return how far generated GLSL is from the formula, over lights and views above the surface at random.

    `rms` is relative to the RMS of the formula, `worst` to a white Lambert surface that faces the light; `worst_beside` is the
    worst where light and viewer are less than a right angle apart. Nothing where there is no formula or no driver.
    """
    found = formula(data)
    if found is None:
        return {}
    model, albedo = found
    rows = list(directions(COUNT))
    try:
        colors = materialx_code.evaluate(code, LIGHT, rows)
    except moderngl.Error:
        return {}
    squares = total = worst = beside = 0.0
    for (normal, viewer), color in zip(rows, colors, strict=True):
        for rho, value in zip(albedo, color, strict=True):
            exact = model.radiance(normal, LIGHT, viewer, rho)
            squares += (value - exact) ** 2
            total += exact**2
            off = math.pi * abs(value - exact)
            worst = max(worst, off)
            if dot(LIGHT, viewer) > 0.0:
                beside = max(beside, off)
    return {"rms": math.sqrt(squares / total), "worst": worst, "worst_beside": beside}


def directions(count: int) -> Iterator[tuple[Vector, Vector]]:
    """Yield N and V as 32-bit floats, evenly over all directions with N.L and N.V > 0."""
    dice = random.Random(1)
    while count:
        normal, viewer = single_vector(anywhere(dice)), single_vector(anywhere(dice))
        if dot(normal, LIGHT) > 0.0 and dot(normal, viewer) > 0.0:
            count -= 1
            yield normal, viewer


def table(records: Sequence[dict]) -> Table:
    """Return a row for each material."""
    rows: list[tuple[str, ...]] = [
        (
            record["file"],
            record["material"],
            record.get("model", ""),
            "; ".join(record["problems"]) or "none",
            *(text(record.get(key), ".2g") for key in ("rms", "worst", "worst_beside")),
        )
        for record in records
    ]
    return ("File", "Material", "Model", "Problems", "GLSL RMS", "Worst", "Worst, L.V > 0"), rows


if __name__ == "__main__":
    end(main())
