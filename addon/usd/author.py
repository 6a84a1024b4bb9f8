# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes networks and values into a USD material, and reads the values back. Needs pxr."""

from collections.abc import Mapping
from dataclasses import asdict

from pxr import Gf, Sdf, Usd, UsdMtlx, UsdShade, Vt

from ..material.surface import Attribute, GroupSurface, Image, Source
from .materialx import VERSION
from .network import Constant, Network

KEY = "trueDiffuse"  # of a material's custom data
VECTORS = {
    "color3f": Gf.Vec3f,
    "color4f": Gf.Vec4f,
    "float2": Gf.Vec2f,
    "float3": Gf.Vec3f,
    "float4": Gf.Vec4f,
    "asset": Sdf.AssetPath,
}


def write(material: UsdShade.Material, preview: Network, materialx: Network) -> None:
    """Make the two networks the surfaces of `material`, and remove shaders that no output uses any more."""
    surface, mtlx = material.CreateSurfaceOutput(), material.CreateSurfaceOutput("mtlx")
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
    """Define the shaders of `network`, whose order is from sources to the surface."""
    stage = material.GetPrim().GetStage()
    for name, shader in network.shaders.items():
        prim = UsdShade.Shader.Define(stage, _path(material, name))
        prim.CreateIdAttr(shader.identifier)
        prim.CreateOutput(shader.output.name, Sdf.ValueTypeNames.Find(shader.output.type))
        for socket, value in shader.inputs.items():
            target = prim.CreateInput(socket, Sdf.ValueTypeNames.Find(value.type))
            if isinstance(value, Constant):
                _set(target, value)
            else:
                source = UsdShade.Shader.Get(stage, _path(material, value.shader))
                target.ConnectToSource(source.GetOutput(value.name))


def _set(target: UsdShade.Input, constant: Constant) -> None:
    value, value_type = constant.value, VECTORS.get(constant.type)
    if value_type:
        value = value_type(*value) if isinstance(value, tuple) else value_type(value)
    target.Set(value)
    if constant.color_space:
        target.GetAttr().SetColorSpace(constant.color_space)


def _remove_unused(material: UsdShade.Material) -> None:
    """Remove the shaders and node graphs in `material` that none of its outputs uses."""
    stage, root = material.GetPrim().GetStage(), material.GetPath()
    used: set[Sdf.Path] = set()
    pending = list(material.GetOutputs())
    while pending:
        for source in pending.pop().GetConnectedSources()[0]:
            # the child of the material that contains the source, if any
            child = next((path for path in source.source.GetPath().GetPrefixes() if path.GetParentPath() == root), None)
            if child is not None and child not in used:
                used.add(child)
                for part in map(UsdShade.ConnectableAPI, Usd.PrimRange(stage.GetPrimAtPath(child))):
                    pending += [*part.GetInputs(), *part.GetOutputs()]
    for child in material.GetPrim().GetChildren():
        if child.GetPath() not in used and (child.IsA(UsdShade.Shader) or child.IsA(UsdShade.NodeGraph)):
            stage.RemovePrim(child.GetPath())


def write_custom_data(prim: Usd.Prim, surface: GroupSurface, unsupported: list[str]) -> None:
    """Write all of `surface` into the custom data of a material, with messages about what the networks do not hold."""
    data: dict[str, object] = {
        "group": surface.group,
        "version": surface.version,
        "inputs": {
            name: {3: Gf.Vec3d, 4: Gf.Vec4d}[len(value)](*value) if isinstance(value, tuple) else value
            for name, value in surface.inputs.items()
        },
        "fed": {name: _source_to_usd(source) for name, source in surface.linked.items()},  # the key of version 0.1.0
    }
    if unsupported:
        data["notCarried"] = Vt.StringArray(unsupported)
    prim.SetCustomDataByKey(KEY, data)


def _source_to_usd(source: Source) -> dict[str, object]:
    """Return a source as custom data, without the file of an image: USD packs files only where a shader refers to them."""
    values = asdict(source)
    values.pop("file", None)
    return values | {"kind": "image" if isinstance(source, Image) else "attribute"}


def read_custom_data(material: UsdShade.Material) -> GroupSurface | None:
    """Return the surface that `write_custom_data` wrote, None where there is none.

    Raises KeyError, TypeError or ValueError where the custom data have another form.
    """
    data = material.GetPrim().GetCustomDataByKey(KEY)
    if data is None:
        return None
    inputs = {name: value if isinstance(value, (str, int, float)) else tuple(value) for name, value in data["inputs"].items()}
    linked = {name: _source_from_usd(material, name, values) for name, values in data.get("fed", {}).items()}
    return GroupSurface(str(data["group"]), inputs, int(data["version"]), linked)


def _source_from_usd(material: UsdShade.Material, socket: str, values: Mapping[str, float | str]) -> Source:
    primvar, factor = str(values["primvar"]), float(values["factor"])
    if values["kind"] == "attribute":
        return Attribute(primvar, factor)
    name = f"MaterialX_{socket.replace(' ', '_')}_image"
    shader = UsdShade.Shader.Get(material.GetPrim().GetStage(), _path(material, name))
    file = shader.GetInput("file").Get() if shader else None
    path = (file.resolvedPath or file.path) if file else ""
    return Image(path, bool(values["is_color"]), primvar, str(values["wrap"]), factor)
