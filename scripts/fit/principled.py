# SPDX-License-Identifier: GPL-3.0-or-later
"""Fits the numbers of addon/closures/principled_layers.py to what Cycles' and EEVEE's Principled BSDF leaves for its diffuse layer.

uv run scripts/fit/principled.py      half a minute

A quarter of a cylinder shows N.V across and the roughness along: the Diffuse Color pass of a white Principled BSDF is what its
layers leave, that of a black one under a white sheen what the sheen reflects.
"""

import math
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import checkout  # noqa: F401 - makes this checkout the package true_diffuse
from true_diffuse.addon.closures.principled_layers import CYCLES, EEVEE, Interface, Layers, level_f0, sheen_albedo, specular_albedo
from true_diffuse.addon.models.fresnel import boundary
from true_diffuse.addon.models.quadrature import integrate
from true_diffuse.scripts.cli.console import Parser, Terminal, end, script_arguments
from true_diffuse.scripts.cli.startup import start_blender
from true_diffuse.scripts.fit.albedo import mirrored
from true_diffuse.scripts.fit.least_squares import dot, least_squares

if TYPE_CHECKING:
    from true_diffuse.addon.blender.engines import Engine

SIZE = 256  # pixels each way
SEGMENTS = 2048  # of the quarter of a cylinder
EVERY = 8  # of the rows and columns are fitted
IORS = (1.2, 1.3, 1.4, 1.5, 1.6, 1.8, 2.0)
E_IOR = 1.5  # for which what microfacets lose is fitted
MUS, ORDER = 12, 24
ROUNDS = 12  # of Gauss-Newton
LEAST = 1e-6
RIDGE = 1e-6  # damps the steps


class Point(NamedTuple):
    """A pixel's cosine N.V and roughness, and what the layers leave there."""

    mu: float
    roughness: float
    left: float


class Cylinder:
    """The scene; `node` is the Principled BSDF, whose input `along` is the roughness."""

    def __init__(self, engine: "Engine", along: str) -> None:
        import bpy

        self.engine = engine
        self.scene = scene = bpy.data.scenes.new("Cylinder")
        scene.render.resolution_x = scene.render.resolution_y = SIZE
        scene.render.filter_size = 0.0
        scene.render.film_transparent = True
        scene.cycles.pixel_filter_type, scene.cycles.filter_width = "BLACKMAN_HARRIS", 0.01
        mesh = bpy.data.meshes.new("Cylinder")
        angles = [0.5 * math.pi * i / SEGMENTS for i in range(SEGMENTS + 1)]
        mesh.from_pydata(
            [(math.sin(angle), y, math.cos(angle)) for angle in angles for y in (0.0, 1.0)],
            [],
            [(2 * i, 2 * i + 2, 2 * i + 3, 2 * i + 1) for i in range(SEGMENTS)],
        )
        mesh.shade_smooth()
        mesh.normals_split_custom_set_from_vertices([(math.sin(angle), 0.0, math.cos(angle)) for angle in angles for _ in range(2)])
        material = bpy.data.materials.new("Principled")
        mesh.materials.append(material)
        scene.collection.objects.link(bpy.data.objects.new("Cylinder", mesh))
        camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
        camera.data.type, camera.data.ortho_scale, camera.location = "ORTHO", 1.0, (0.5, 0.5, 5.0)
        scene.collection.objects.link(camera)
        scene.camera = camera
        tree = material.node_tree
        tree.nodes.clear()
        self.node = tree.nodes.new("ShaderNodeBsdfPrincipled")
        self.node.inputs["Base Color"].default_value = (1.0, 1.0, 1.0, 1.0)
        tree.links.new(self.node.outputs[0], tree.nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
        separate = tree.nodes.new("ShaderNodeSeparateXYZ")
        tree.links.new(tree.nodes.new("ShaderNodeNewGeometry").outputs["Position"], separate.inputs[0])
        tree.links.new(separate.outputs["Y"], self.node.inputs[along])

    def points(self, **inputs: float | tuple[float, ...]) -> list[Point]:
        """Return a point for each pixel, for the node's `inputs` by name with _ for a space."""
        from true_diffuse.addon.measure import render

        for name, value in inputs.items():
            self.node.inputs[name.replace("_", " ")].default_value = value
        left = render.mean_albedo(self.scene, self.engine, 1)
        centers = [(i + 0.5) / SIZE for i in range(SIZE)]
        return [
            Point(math.sqrt(1.0 - x * x), y, left[row * SIZE + column])
            for row, y in enumerate(reversed(centers))
            for column, x in enumerate(centers)
        ]


def thinned(points: Sequence[Point]) -> Iterator[Point]:
    """Yield the points of every few rows and columns, those of the most grazing views among them."""
    for row in range(0, SIZE, EVERY):
        yield from points[row * SIZE + EVERY - 1 : (row + 1) * SIZE : EVERY]


def terms(mu: float, roughness: float, powers: Sequence[int], highest: int = 2) -> list[float]:
    """Return mu^i roughness^j, i up to `highest`, j of `powers`."""
    return [mu**i * roughness**j for i in range(highest + 1) for j in powers]


def cosine_of(reflectance: float, ior: float) -> float:
    """Return the cosine at which a smooth surface has that reflectance, in (0, 1)."""
    low, high = LEAST, 1.0
    for _ in range(40):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if 1.0 - boundary(ior).transmittance(middle) > reflectance else (low, middle)
    return 0.5 * (low + high)


def fit_lost() -> tuple[list[float], list[float]]:
    """Return Q of 1 - E = r^2 Q, and of E's average over all views the powers of r^2; weighted by the reflectance at E_IOR."""
    rows, wanted, weights, averages = [], [], [], []
    steps = [(i + 0.5) / MUS for i in range(MUS)]
    for roughness in steps:
        for x in steps:
            mu = math.sqrt(1.0 - x * x)
            rows.append(terms(mu, roughness, (2, 3, 4)))
            wanted.append(1.0 - mirrored(mu, roughness**2))
            weights.append((1.0 - boundary(E_IOR).transmittance(mu)) ** 2)
        averages.append(integrate(lambda mu, alpha=roughness**2: 2.0 * mu * mirrored(mu, alpha), (1e-3, 1.0), ORDER))
    average = least_squares([[1.0, r**2, r**4] for r in steps], averages)
    return least_squares(rows, wanted, weights), average


def fit_smoother(by_ior: dict[float, list[Point]], powers: Sequence[int]) -> list[float]:
    """Return P of c^2 = mu^2 + P: linear least squares with the slope of the reflectance in c^2 as weight."""
    rows, wanted, weights = [], [], []
    for ior, points in by_ior.items():
        interface = Interface(level_f0(ior))
        for mu, roughness, left in thinned(points):
            kept = 1.0 - interface.lost(mu, roughness)
            cosine = cosine_of((1.0 - left) / kept, ior)
            step = 1e-3 * cosine
            slope = (boundary(ior).transmittance(cosine) - boundary(ior).transmittance(cosine - step)) / (2.0 * cosine * step)
            rows.append(terms(mu, roughness, powers))
            wanted.append(cosine**2 - mu**2)
            weights.append((slope * kept) ** 2)
    return least_squares(rows, wanted, weights)


def fit_sheen(points: Sequence[Point]) -> tuple[list[float], list[float]]:
    """Return numerator and denominator, whose factor of mu is 1, of the sheen's albedo: linear least squares, then Gauss-Newton."""
    above = [(i, j) for i in range(3) for j in range(3 - i)]
    below = [(i, j) for i in range(4) for j in range(4 - i) if (i, j) not in ((0, 0), (1, 0))]
    chosen = [
        (mu, reflected, [mu**i * r**j for i, j in above], [mu**i * r**j for i, j in below]) for mu, r, reflected in thinned(points)
    ]
    rows = [up + [-reflected * x for x in down] for _, reflected, up, down in chosen]
    numbers = least_squares(rows, [reflected * mu for mu, reflected, *_ in chosen])
    for _ in range(ROUNDS):
        rows, wanted = [], []
        for mu, reflected, up, down in chosen:
            denominator = mu + dot(numbers[len(above) :], down)
            value = dot(numbers[: len(above)], up) / denominator
            rows.append([x / denominator for x in up] + [-value * x / denominator for x in down])
            wanted.append(reflected - value)
        numbers = [number + step for number, step in zip(numbers, least_squares(rows, wanted, ridge=RIDGE), strict=True)]
    return numbers[: len(above)], numbers[len(above) :]


def rms(values: Sequence[float]) -> float:
    return math.sqrt(sum(value * value for value in values) / len(values))


def errors(engine: "Engine", layers: Layers, by_ior: dict[float, list[Point]], sheen: Sequence[Point]) -> Iterator[str]:
    """Yield a line for each index of refraction and one for the sheen: how far off the numbers of the package are."""
    for ior, points in by_ior.items():
        off = [1.0 - specular_albedo(layers, mu, r, Interface(level_f0(ior))) - left for mu, r, left in thinned(points)]
        yield f"{engine.label}, IOR {ior:g}: RMS {rms(off):.4f}, largest {max(map(abs, off)):.3f}"
    off = [sheen_albedo(layers, mu, r) - left for mu, r, left in thinned(sheen)]
    yield f"{engine.label}, sheen: RMS {rms(off):.4f}, largest {max(map(abs, off)):.3f}"


def main() -> int:
    """Run the script; returns the exit status."""
    Parser(prog="fit/principled.py", description=(__doc__ or "").splitlines()[0]).parse_args(script_arguments())
    with Terminal() as terminal:
        found = {engine.key: engine for engine in start_blender(("cycles", "eevee"), terminal)}
        lost, average = fit_lost()
        terminal.say(f"LOST {shown(lost)}\nAVERAGE {shown(average)}")
        for key, layers, powers in (("cycles", CYCLES, (2, 3, 4)), ("eevee", EEVEE, (0, 2, 3, 4))):
            if key not in found:
                continue
            cylinder = Cylinder(found[key], "Roughness")
            by_ior = {ior: cylinder.points(IOR=ior) for ior in IORS}
            fuzz = Cylinder(found[key], "Sheen Roughness")
            sheen = fuzz.points(Base_Color=(0.0, 0.0, 0.0, 1.0), Specular_IOR_Level=0.0, Sheen_Weight=1.0)
            terminal.say(f"{key}: smoother, powers {powers} of the roughness: {shown(fit_smoother(by_ior, powers))}")
            if key == "cycles":
                above, below = fit_sheen(sheen)
                terminal.say(f"{key}: sheen {shown(above)} over {shown(below)}")
            terminal.say("\n".join(errors(found[key], layers, by_ior, sheen)))
    return 0


def shown(numbers: Sequence[float]) -> str:
    return ", ".join(f"{number:.5g}" for number in numbers)


if __name__ == "__main__":
    end(main())
