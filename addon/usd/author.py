# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes networks and a material's nodes into a USD material, and reads the nodes back. Needs pxr."""

import json
from collections.abc import Mapping, Sequence
from typing import Any

from pxr import Gf, Sdf, Usd, UsdMtlx, UsdShade, Vt

from ..material.expression import Constant as Value
from ..material.surface import Surface
from .materialx import VERSION
from .network import Constant, Network, Output, Primvar

KEY = "trueDiffuse"  # of a material's custom data
IMAGES = "trueDiffuse:images"  # the attribute with the files of a material's images: USD packs the files of attributes
FORMAT = 2  # of the custom data; version 0.1.0 wrote none
VECTORS = {
    "color3f": Gf.Vec3f,
    "color4f": Gf.Vec4f,
    "float2": Gf.Vec2f,
    "float3": Gf.Vec3f,
    "float4": Gf.Vec4f,
    "asset": Sdf.AssetPath,
}


def write(material: UsdShade.Material, preview: Network | None, materialx: Network) -> dict[Sdf.Path, Primvar]:
    """Make the networks the surfaces of `material`, and remove shaders that no output uses any more.

    Without a `preview` the surface for programs without MaterialX stays as it is. Return the inputs that name UV maps and
    attributes, by Blender's names.
    """
    outputs = {material.CreateSurfaceOutput("mtlx"): materialx}
    if preview:
        outputs[material.CreateSurfaceOutput()] = preview
    for output in outputs:
        output.ClearSources()
    _remove_unused(material)
    primvars: dict[Sdf.Path, Primvar] = {}
    for output, network in reversed(outputs.items()):
        primvars |= _shaders(material, network)
        shader = UsdShade.Shader.Get(material.GetPrim().GetStage(), _path(material, network.surface.shader))
        output.ConnectToSource(shader.GetOutput(network.surface.name))
    config = UsdMtlx.MaterialXConfigAPI.Apply(material.GetPrim())
    config.CreateConfigMtlxVersionAttr(VERSION)
    return primvars


def _path(material: UsdShade.Material, shader: str) -> Sdf.Path:
    return material.GetPath().AppendChild(shader)


def _shaders(material: UsdShade.Material, network: Network) -> dict[Sdf.Path, Primvar]:
    """Define the shaders of `network`, whose order is from sources to the surface; return the inputs that name primvars."""
    stage = material.GetPrim().GetStage()
    primvars: dict[Sdf.Path, Primvar] = {}
    for name, shader in network.shaders.items():
        prim = UsdShade.Shader.Define(stage, _path(material, name))
        prim.CreateIdAttr(shader.identifier)
        for output, kind in shader.outputs.items():
            prim.CreateOutput(output, Sdf.ValueTypeNames.Find(kind))
        for socket, value in shader.inputs.items():
            if isinstance(value, Constant) and value.interop_id:
                Usd.ColorSpaceAPI.Apply(prim.GetPrim()).CreateColorSpaceNameAttr(value.interop_id)
            target = prim.CreateInput(socket, Sdf.ValueTypeNames.Find(value.type))
            if isinstance(value, Output):
                source = UsdShade.Shader.Get(stage, _path(material, value.shader))
                target.ConnectToSource(source.GetOutput(value.name))
            elif isinstance(value, Primvar):
                target.Set(value.name)
                primvars[target.GetAttr().GetPath()] = value
            else:
                _set(target, value)
    return primvars


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


def write_nodes(material: UsdShade.Material, surface: Surface, nodes: Mapping[str, Any], images: Mapping[str, str]) -> None:
    """Write a material's nodes, a record of node_record.py, with the files of its `images` by their full names in Blender.

    The surface's reflectance model, its constants, and the names of what varies are for other readers.
    """
    prim = material.GetPrim()
    constants = {name: one.value for name, one in surface.inputs.items() if isinstance(one, Value)}
    varying = [name for name in surface.inputs if name not in constants]
    data: dict[str, object] = {
        "format": FORMAT,
        "model": surface.model,
        "surface": {name: Gf.Vec3d(*value) if isinstance(value, tuple) else float(value) for name, value in constants.items()},
        "nodes": json.dumps(nodes, separators=(",", ":")),
    }
    if varying:
        data["varying"] = Vt.StringArray(varying)
    if images:
        data["images"] = Vt.StringArray(list(images))
        files = [Sdf.AssetPath(path) for path in images.values()]
        prim.CreateAttribute(IMAGES, Sdf.ValueTypeNames.AssetArray, custom=True, variability=Sdf.VariabilityUniform).Set(files)
    prim.SetCustomDataByKey(KEY, data)


def write_names(prim: Usd.Prim, names: Mapping[Primvar, str], messages: Sequence[str]) -> None:
    """Write what UV maps and attributes are called in the stage, and messages about what the networks do not hold."""
    for kind in dict.fromkeys(primvar.kind for primvar in names):
        own = {primvar.name: name for primvar, name in names.items() if primvar.kind == kind}
        if own:
            prim.SetCustomDataByKey(f"{KEY}:{kind}Names", Vt.StringArray([part for pair in own.items() for part in pair]))
    if messages:
        prim.SetCustomDataByKey(f"{KEY}:notCarried", Vt.StringArray(list(messages)))


def read_nodes(material: UsdShade.Material) -> tuple[dict[str, Any], dict[str, str], dict[str, dict[str, str]]] | None:
    """Return what `write_nodes` wrote: the nodes, the files by image, and the names in USD of UV maps and colors by Blender's.

    None where there is nothing of that. Raises KeyError, TypeError or ValueError where the custom data have another form.
    """
    prim = material.GetPrim()
    data = prim.GetCustomDataByKey(KEY)
    if data is None or "nodes" not in data:
        return None
    if data["format"] > FORMAT:
        raise ValueError("a newer True Diffuse has written it")
    attribute = prim.GetAttribute(IMAGES)
    files = [file.resolvedPath or file.path for file in (attribute.Get() or ())] if attribute else []
    images = dict(zip(data.get("images", ()), files, strict=False))
    names = {}
    for kind in ("uv", "color"):
        parts = list(data.get(f"{kind}Names", ()))
        names[kind] = dict(zip(parts[::2], parts[1::2], strict=True))
    return json.loads(data["nodes"]), images, names
