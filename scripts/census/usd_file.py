# SPDX-License-Identifier: GPL-3.0-or-later
"""What each material of a USD file holds, as UsdPreviewSurface and as MaterialX network. Needs pxr.

A MaterialX network may be a surface of all layers (OpenPBR, Standard Surface) or closures put together; of the latter, each channel
has several candidates.
"""

import math
import re
from collections.abc import Iterator, Mapping
from pathlib import Path, PurePosixPath
from typing import Any

from true_diffuse.scripts.census.values import DEFAULT_UV_MAP, PLACES, ImageUse, Place, Value, constant, product, union

PREVIEW, MATERIALX = "", "mtlx"
# Channel: inputs of the surface whose product it is
PREVIEW_INPUTS = {
    "base color": ("diffuseColor",),
    "roughness": ("roughness",),
    "metallic": ("metallic",),
    "normal": ("normal",),
    "alpha": ("opacity",),
    "emission": ("emissiveColor",),
    "occlusion": ("occlusion",),
    "coat": ("clearcoat",),
    "specular": ("specularColor",),
}
OPEN_PBR_INPUTS = {
    "base color": ("base_color", "base_weight"),
    "roughness": ("specular_roughness",),
    "metallic": ("base_metalness",),
    "normal": ("geometry_normal",),
    "alpha": ("geometry_opacity",),
    "emission": ("emission_color", "emission_luminance"),
    "coat": ("coat_weight",),
    "sheen": ("fuzz_weight",),
    "transmission": ("transmission_weight",),
    "specular": ("specular_weight", "specular_color"),
    "anisotropy": ("specular_roughness_anisotropy",),
    "thin film": ("thin_film_weight",),
    "subsurface": ("subsurface_weight",),
}
STANDARD_SURFACE_INPUTS = {
    "base color": ("base_color", "base"),
    "roughness": ("specular_roughness",),
    "metallic": ("metalness",),
    "normal": ("normal",),
    "alpha": ("opacity",),
    "emission": ("emission_color", "emission"),
    "coat": ("coat",),
    "sheen": ("sheen",),
    "transmission": ("transmission",),
    "specular": ("specular", "specular_color"),
    "anisotropy": ("specular_anisotropy",),
    "thin film": ("thin_film_thickness",),
    "subsurface": ("subsurface",),
}
SURFACES = {
    "UsdPreviewSurface": PREVIEW_INPUTS,
    "ND_open_pbr_surface_surfaceshader": OPEN_PBR_INPUTS,
    "ND_standard_surface_surfaceshader": STANDARD_SURFACE_INPUTS,
}
# Channel: pairs of a node's identifier and an input's name, as patterns, where a network of closures may have it
CLOSURES = {
    "base color": ((r"oren_nayar|burley|subsurface_bsdf", r"color"), (r"conductor|generalized_schlick", r"color0|reflectivity")),
    "roughness": ((r"dielectric|conductor|generalized_schlick", r"roughness"),),
    "metallic": ((r"mix_bsdf", r"mix"),),
    "normal": ((r"_bsdf", r"normal"),),
    "alpha": ((r"^ND_surface$", r"opacity"),),
    "emission": ((r"_edf", r"color|intensity"), (r"multiply_edf", r"in2")),
    "coat": ((r"dielectric|generalized_schlick", r"weight"),),
    "sheen": ((r"sheen", r"weight|color"),),
    "transmission": ((r"mix_bsdf", r"mix"), (r"dielectric", r"weight")),
    "specular": ((r"dielectric|generalized_schlick", r"weight|tint|color0|ior"),),
    "anisotropy": ((r"roughness_anisotropy|open_pbr_anisotropy", r"anisotropy"),),
    "thin film": ((r"dielectric|conductor|generalized_schlick", r"thinfilm_thickness"),),
    "subsurface": ((r"mix_bsdf", r"mix"),),
}
PASSED = re.compile(r"^ND_((convert|dot|normalize|clamp)_|roughness_anisotropy$)")
MOST_NODES = 5000

type Candidates = dict[str, list[Value]]


def read(path: Path) -> dict[str, dict[str, Candidates]]:
    """Return what the materials of a file have on each channel, by Blender's name of the material and by kind of network."""
    from pxr import Usd, UsdGeom, UsdShade

    stage = Usd.Stage.Open(str(path))
    primvars: dict[str, set[str]] = {}
    for prim in stage.Traverse():
        if prim.IsA(UsdGeom.Mesh):
            bound = [UsdShade.MaterialBindingAPI(item).GetDirectBinding().GetMaterialPath() for item in (prim, *prim.GetChildren())]
            names = {primvar.GetPrimvarName() for primvar in UsdGeom.PrimvarsAPI(prim).GetPrimvars() if primvar.HasAuthoredValue()}
            for target in bound:
                primvars.setdefault(str(target), set()).update(names)
    found: dict[str, dict[str, Candidates]] = {}
    for prim in stage.Traverse():
        if prim.IsA(UsdShade.Material):
            material = UsdShade.Material(prim)
            name = prim.GetAttribute("userProperties:blender:data_name").Get() or prim.GetName()
            reader = _Reader(primvars.get(str(prim.GetPath()), set()))
            found[name] = {}
            for kind in (PREVIEW, MATERIALX):
                output = material.GetSurfaceOutput(kind)
                source = _source(output) if output else None
                if source:
                    found[name][kind] = reader.channels(source[0])
    return found


def _source(socket: Any) -> tuple[Any, str] | None:  # noqa: ANN401 - pxr has no types
    """Return the shader that feeds an input or output, and the name of its output; through node graphs."""
    from pxr import UsdShade

    attributes = UsdShade.Utils.GetValueProducingAttributes(socket)
    if not attributes:
        return None
    prim = attributes[0].GetPrim()
    base, kind = UsdShade.Utils.GetBaseNameAndType(attributes[0].GetName())
    if kind != UsdShade.AttributeType.Output or not prim.IsA(UsdShade.Shader):
        return None
    return UsdShade.Shader(prim), base


class _Reader:
    """Reads the networks of one material, whose meshes have certain primvars."""

    def __init__(self, primvars: set[str]) -> None:
        self.primvars = primvars
        self.values: dict[tuple[str, str], Value] = {}

    def channels(self, surface: Any) -> Candidates:  # noqa: ANN401
        """Return the candidates of each channel."""
        inputs = SURFACES.get(surface.GetShaderId())
        if inputs is not None:
            found = {
                channel: [product(self.input(surface, name, constant(1.0)) for name in names)]
                for channel, names in inputs.items()
                if surface.GetInput(names[0])
            }
            threshold = surface.GetInput("opacityThreshold")
            if threshold and (threshold.Get() or 0.0) > 0.0 and "alpha" in found:
                found["alpha"] = [found["alpha"][0].but("CUTOFF")]
            return found
        found = {}
        found_ids: set[str] = set()
        for shader in self.upstream(surface):
            found_ids.add(shader.GetShaderId() or "")
            for channel, pairs in CLOSURES.items():
                for identifier, name in pairs:
                    if re.search(identifier, shader.GetShaderId() or ""):
                        found.setdefault(channel, []).extend(
                            self.input(shader, item.GetBaseName(), constant(1.0))
                            for item in shader.GetInputs()
                            if re.fullmatch(name, item.GetBaseName())
                        )
        for channel, number in _weights(str(found_ids)):
            found.setdefault(channel, []).append(constant(number))
        return found

    def upstream(self, shader: Any) -> Iterator[Any]:  # noqa: ANN401
        """Yield a shader and all that feed it, each once."""
        seen, waiting = set(), [shader]
        while waiting and len(seen) < MOST_NODES:
            item = waiting.pop()
            path = str(item.GetPath())
            if path in seen:
                continue
            seen.add(path)
            yield item
            waiting += [source[0] for source in map(_source, item.GetInputs()) if source]

    def input(self, shader: Any, name: str, default: Value) -> Value:  # noqa: ANN401
        """Return what feeds an input, `default` where it has neither source nor value."""
        socket = shader.GetInput(name)
        if not socket:
            return default
        source = _source(socket)
        if source is None:
            value = socket.Get()
            return default if value is None or isinstance(value, str) else constant(value)
        key = str(source[0].GetPath()), source[1]
        if key not in self.values:
            self.values[key] = Value(operations=frozenset({"loop"}))
            self.values[key] = self.output(*source)
        return self.values[key]

    def output(self, shader: Any, name: str) -> Value:  # noqa: ANN401
        identifier = shader.GetShaderId() or ""

        def get(socket: str, default: float = 1.0) -> Value:
            return self.input(shader, socket, constant(default))

        if identifier == "UsdUVTexture":
            uv_map, places = self.placement(shader, "st")
            use = ImageUse(self.file(shader), name if name in ("r", "g", "b", "a") else "rgb", uv_map, places)
            scale = get("scale") if use.channel == "rgb" else _component(shader, "scale", "rgba".index(use.channel))
            bias = get("bias", 0.0)
            is_scaled = bias == constant(0.0)
            return Value(
                scale.factor if is_scaled else (1.0, 1.0, 1.0),
                frozenset({use}),
                operations=frozenset() if is_scaled else frozenset({"NORMAL_MAP" if bias == constant(-1.0) else "bias"}),
            )
        if identifier.startswith("UsdPrimvarReader"):
            return self.attribute(shader, "varname")
        if re.match(r"ND_(image|tiledimage|gltf_image|UsdUVTexture)", identifier):
            uv_map, places = self.placement(shader, "texcoord")
            return Value(images=frozenset({ImageUse(self.file(shader), "rgb", uv_map, places)}))
        if re.match(r"ND_geompropvalue", identifier):
            return self.attribute(shader, "geomprop")
        if identifier.startswith("ND_geomcolor"):
            return Value(attributes=frozenset({"displayColor"}))
        if re.match(r"ND_multiply_(color|float|vector)", identifier):
            return product((get("in1"), get("in2")))
        if re.match(r"ND_mix_(color|float|vector)", identifier):
            amount = get("mix", 0.0)
            if amount.is_constant and amount.factor[0] in (0.0, 1.0):
                return get("fg" if amount.factor[0] else "bg", 0.0)
        if identifier.startswith("ND_constant_"):
            return get("value", 0.0)
        if re.match(r"ND_extract_", identifier):
            index = shader.GetInput("index")
            return get("in").channel("rgba"[int((index.Get() if index else 0) or 0)])
        if re.match(r"ND_separate", identifier) and name[-1] in "rgbaxyzw":
            return get("in").channel("rgba"["rgbaxyzw".index(name[-1]) % 4])
        if re.match(r"ND_normalmap", identifier):
            return union((get("in"), get("scale")), "NORMAL_MAP")
        if PASSED.match(identifier):
            return get("roughness" if "roughness_anisotropy" in identifier else "in")
        inputs = [self.input(shader, item.GetBaseName(), Value()) for item in shader.GetInputs()]
        return union(inputs, identifier)

    def attribute(self, shader: Any, name: str) -> Value:  # noqa: ANN401
        """Return what a primvar gives; black where no mesh of the material has it."""
        given = str(shader.GetInput(name).Get())
        return Value(attributes=frozenset({given})) if given in self.primvars else constant(0.0)

    def file(self, shader: Any) -> str:  # noqa: ANN401
        value = shader.GetInput("file").Get() if shader.GetInput("file") else None
        return PurePosixPath(getattr(value, "path", "") or "").stem

    def placement(self, shader: Any, name: str) -> tuple[str, tuple[Place, ...] | None]:  # noqa: ANN401
        """Return the UV map that an image reads, and where; None in place of the latter where that is not understood."""
        source = _source(shader.GetInput(name)) if shader.GetInput(name) else None
        if source is None:
            return DEFAULT_UV_MAP, PLACES
        uv_maps: set[str] = set()
        points = [self.point(source[0], place, uv_maps) for place in PLACES]
        missing = {name for name in uv_maps if name not in (DEFAULT_UV_MAP, *self.primvars)}
        if missing or len(uv_maps) != 1 or any(point is None for point in points):
            return next(iter(uv_maps), DEFAULT_UV_MAP), None
        return uv_maps.pop(), tuple((point[0], point[1]) for point in points if point is not None)

    def point(self, shader: Any, place: Place, uv_maps: set[str]) -> list[float] | None:  # noqa: ANN401
        """Return the coordinates that a shader gives at a UV coordinate; None for a shader that is not known here."""
        identifier = shader.GetShaderId() or ""
        if identifier == "UsdPrimvarReader_float2":
            uv_maps.add(_uv_map(str(shader.GetInput("varname").Get())))
            return [*place, 0.0]
        if identifier.startswith("ND_geompropvalue_vector2"):
            uv_maps.add(_uv_map(str(shader.GetInput("geomprop").Get())))
            return [*place, 0.0]
        if identifier.startswith("ND_texcoord"):
            uv_maps.add(DEFAULT_UV_MAP)
            return [*place, 0.0]

        def get(name: str, default: float = 0.0) -> list[float] | None:
            socket = shader.GetInput(name)
            if not socket:
                return [default] * 3
            source = _source(socket)
            if source is not None:
                return self.point(source[0], place, uv_maps)
            value = socket.Get()
            if value is None:
                return [default] * 3
            return [float(value)] * 3 if isinstance(value, (int, float)) else [*map(float, value), 0.0, 0.0][:3]

        operation = TRANSFORMS.get(re.sub(r"_(vector[23]|float|vector[23]FA)$", "", identifier))
        return operation(get) if operation else None


def _weights(identifiers: str) -> Iterator[tuple[str, float]]:
    """Yield weights of layers that are 0 or 1 because of the closures that a network has, by the identifiers of its nodes."""
    has_diffuse, has_subsurface = (re.search(kind, identifiers) for kind in ("oren_nayar|burley", "subsurface_bsdf"))
    has_metal, is_mixed = (re.search(kind, identifiers) for kind in ("conductor|generalized_schlick", "mix_bsdf"))
    if has_metal and not (has_diffuse or has_subsurface or "ND_dielectric" in identifiers):
        yield "metallic", 1.0
    if (has_diffuse or has_subsurface) and not (has_metal and is_mixed):
        yield "metallic", 0.0
    if has_subsurface and not has_diffuse:
        yield "subsurface", 1.0
    if "ND_dielectric" in identifiers and not (has_diffuse or has_subsurface or has_metal):
        yield "transmission", 1.0


def _component(shader: Any, name: str, index: int) -> Value:  # noqa: ANN401
    """Return a component of a vector, which is 1 where it has no value."""
    value = shader.GetInput(name).Get() if shader.GetInput(name) else None
    return constant(1.0 if value is None else float(value[index]))


def _uv_map(primvar: str) -> str:
    return DEFAULT_UV_MAP if primvar == "st" else primvar


def _rotated(x: float, y: float, degrees: float) -> tuple[float, float]:
    sine, cosine = math.sin(math.radians(degrees)), math.cos(math.radians(degrees))
    return cosine * x - sine * y, sine * x + cosine * y


def _transform2d(get: Any) -> list[float] | None:  # noqa: ANN401
    """UsdTransform2d: scale, then rotate counter-clockwise, then translate."""
    given, scale, rotation, translation = get("in"), get("scale", 1.0), get("rotation"), get("translation")
    x, y = _rotated(given[0] * scale[0], given[1] * scale[1], rotation[0])
    return [x + translation[0], y + translation[1], 0.0]


def _place2d(get: Any) -> list[float] | None:  # noqa: ANN401
    """MaterialX's place2d (stdlib_ng.mtlx): about a pivot, divide by scale, rotate clockwise, subtract offset; SRT by default."""
    given, pivot, scale, rotation, offset = get("texcoord"), get("pivot"), get("scale", 1.0), get("rotate"), get("offset")
    if given is None:
        return None
    x, y = given[0] - pivot[0], given[1] - pivot[1]
    if get("operationorder")[0] > 0.5:
        x, y = _rotated(x - offset[0], y - offset[1], -rotation[0])
        x, y = x / scale[0], y / scale[1]
    else:
        x, y = _rotated(x / scale[0], y / scale[1], -rotation[0])
        x, y = x - offset[0], y - offset[1]
    return [x + pivot[0], y + pivot[1], 0.0]


def _componentwise(function: Any) -> Any:  # noqa: ANN401
    def apply(get: Any) -> list[float] | None:  # noqa: ANN401
        one, other = get("in1"), get("in2")
        return None if one is None or other is None else [function(a, b) for a, b in zip(one, other, strict=True)]

    return apply


def _rotate2d(get: Any) -> list[float] | None:  # noqa: ANN401
    given, amount = get("in"), get("amount")
    return None if given is None else [*_rotated(given[0], given[1], -amount[0]), 0.0]


def _rotate3d(get: Any) -> list[float] | None:  # noqa: ANN401
    """About the axis z, clockwise as rotate2d (mx_rotate_vector3.glsl); no other axis keeps UV coordinates in their plane."""
    given, amount, axis = get("in"), get("amount"), get("axis")
    if given is None or abs(amount[0]) < 1e-9:
        return given
    if axis[:2] != [0.0, 0.0]:
        return None
    x, y = _rotated(given[0], given[1], -amount[0] * axis[2])
    return [x, y, given[2]]


TRANSFORMS: Mapping[str, Any] = {
    "UsdTransform2d": _transform2d,
    "ND_place2d": _place2d,
    "ND_multiply": _componentwise(lambda a, b: a * b),
    "ND_divide": _componentwise(lambda a, b: a / b if b else 0.0),
    "ND_add": _componentwise(lambda a, b: a + b),
    "ND_subtract": _componentwise(lambda a, b: a - b),
    "ND_rotate2d": _rotate2d,
    "ND_rotate3d": _rotate3d,
    "ND_convert_vector2": lambda get: get("in"),
    "ND_convert_vector3": lambda get: get("in"),
    "ND_dot": lambda get: get("in"),
}
