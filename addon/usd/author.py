# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes networks and values into a USD material, and reads the values back. Needs pxr."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict

from pxr import Gf, Sdf, Usd, UsdMtlx, UsdShade, Vt

from ..material.surface import KEY, Attribute, Image, Setting, Source, Surface
from .materialx import VERSION
from .network import Constant, Network

RENDER_CONTEXT = "mtlx"
VECTORS = {
    "color3f": Gf.Vec3f,
    "color4f": Gf.Vec4f,
    "float2": Gf.Vec2f,
    "float3": Gf.Vec3f,
    "float4": Gf.Vec4f,
    "asset": Sdf.AssetPath,
}


def write(material: UsdShade.Material, preview: Network, materialx: Network) -> None:
    """Make the two networks the surfaces of `material`; what was there before is removed as far as nothing else uses it."""
    surface, mtlx = material.CreateSurfaceOutput(), material.CreateSurfaceOutput(RENDER_CONTEXT)
    for output in (surface, mtlx):
        output.ClearSources()
    _remove_unused(material)
    for network, output in ((preview, surface), (materialx, mtlx)):
        _shaders(material, network)
        shader = UsdShade.Shader.Get(material.GetPrim().GetStage(), _path(material, network.surface.shader))
        output.ConnectToSource(shader.GetOutput(network.surface.name))
    config = UsdMtlx.MaterialXConfigAPI.Apply(material.GetPrim())
    config.CreateConfigMtlxVersionAttr(VERSION)


def _path(material: UsdShade.Material, shader: str) -> Sdf.Path:
    return material.GetPath().AppendChild(shader)


def _shaders(material: UsdShade.Material, network: Network) -> None:
    """Define the shaders of `network`; each is made before what it feeds."""
    stage = material.GetPrim().GetStage()
    for name, shader in network.shaders.items():
        made = UsdShade.Shader.Define(stage, _path(material, name))
        made.CreateIdAttr(shader.identifier)
        made.CreateOutput(shader.output.name, _type(shader.output.type))
        for socket, value in shader.inputs.items():
            target = made.CreateInput(socket, _type(value.type))
            if isinstance(value, Constant):
                _set(target, value)
            else:
                source = UsdShade.Shader.Get(stage, _path(material, value.shader))
                target.ConnectToSource(source.GetOutput(value.name))


def _type(name: str) -> Sdf.ValueTypeName:
    return Sdf.ValueTypeNames.Find(name)


def _set(target: UsdShade.Input, constant: Constant) -> None:
    make = VECTORS.get(constant.type)
    if make is None:
        target.Set(constant.value)
    elif isinstance(constant.value, tuple):
        target.Set(make(*constant.value))
    else:
        target.Set(make(constant.value))
    if constant.color_space:
        target.GetAttr().SetColorSpace(constant.color_space)


def _remove_unused(material: UsdShade.Material) -> None:
    """Remove the shaders and node graphs in `material` that none of its outputs needs."""
    stage, home = material.GetPrim().GetStage(), material.GetPath()
    used: set[Sdf.Path] = set()
    ends = list(material.GetOutputs())
    while ends:
        for source in ends.pop().GetConnectedSources()[0]:
            # the child of the material that holds the source, if one does
            child = next((path for path in source.source.GetPath().GetPrefixes() if path.GetParentPath() == home), None)
            if child is not None and child not in used:
                used.add(child)
                for part in map(UsdShade.ConnectableAPI, Usd.PrimRange(stage.GetPrimAtPath(child))):
                    ends += [*part.GetInputs(), *part.GetOutputs()]
    for child in material.GetPrim().GetChildren():
        if child.GetPath() not in used and (child.IsA(UsdShade.Shader) or child.IsA(UsdShade.NodeGraph)):
            stage.RemovePrim(child.GetPath())


def remember(prim: Usd.Prim, surface: Surface, lost: list[str]) -> None:
    """Keep all of `surface` as custom data of the material, with what the networks leave out."""
    data: dict[str, object] = {
        "group": surface.group,
        "version": surface.version,
        "inputs": {name: _packed(value) for name, value in surface.inputs.items()},
        "fed": {name: _packed_source(source) for name, source in surface.fed.items()},
    }
    if lost:
        data["notCarried"] = Vt.StringArray(lost)
    prim.SetCustomDataByKey(KEY, data)


def _packed(value: Setting) -> object:
    if isinstance(value, tuple):
        return {3: Gf.Vec3d, 4: Gf.Vec4d}[len(value)](*value)
    return value


def _packed_source(source: Source) -> dict[str, object]:
    """Return a source as custom data; the file of an image is its shader's alone, where USD finds and packs it."""
    values = asdict(source)
    values.pop("file", None)
    return values | {"kind": "image" if isinstance(source, Image) else "attribute"}


def recall(material: UsdShade.Material) -> Surface | None:
    """Return the surface of `remember`, None where there is none.

    Raises KeyError, TypeError or ValueError where the custom data are not what `remember` writes.
    """
    data = material.GetPrim().GetCustomDataByKey(KEY)
    if data is None:
        return None
    inputs = {name: _unpacked(value) for name, value in data["inputs"].items()}
    fed = {name: _unpacked_source(material, name, values) for name, values in data.get("fed", {}).items()}
    return Surface(str(data["group"]), int(data["version"]), inputs, fed)


def _unpacked(value: str | float | Sequence[float]) -> Setting:
    return value if isinstance(value, (str, int, float)) else tuple(value)


def _unpacked_source(material: UsdShade.Material, socket: str, values: Mapping[str, float | str]) -> Source:
    primvar, factor = str(values["primvar"]), float(values["factor"])
    if values["kind"] == "attribute":
        return Attribute(primvar, factor)
    name = f"MaterialX_{socket.replace(' ', '_')}_image"
    shader = UsdShade.Shader.Get(material.GetPrim().GetStage(), _path(material, name))
    file = shader.GetInput("file").Get() if shader else None
    path = (file.resolvedPath or file.path) if file else ""
    return Image(path, bool(values["is_color"]), primvar, str(values["wrap"]), factor)
