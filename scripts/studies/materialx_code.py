# SPDX-License-Identifier: GPL-3.0-or-later
"""Shader code that MaterialX's own library generates from the networks in USD files, and the radiance that its GLSL gives.

Runs in a process without Blender, whose bundled MaterialX lacks the generators of OSL and MDL.
"""

from array import array
from collections.abc import Sequence
from typing import Any

import MaterialX as mx
import MaterialX.PyMaterialXGenGlsl as mx_glsl
import MaterialX.PyMaterialXGenMdl as mx_mdl
import MaterialX.PyMaterialXGenOsl as mx_osl
import MaterialX.PyMaterialXGenShader as mx_gen  # before the generators, which need it loaded
import moderngl
from pxr import Sdf, UsdShade

type Vector = tuple[float, float, float]

MATERIAL = "True_Diffuse"
GENERATORS = {
    "GLSL": mx_glsl.GlslShaderGenerator,
    "OSL": mx_osl.OslShaderGenerator,
    "MDL": mx_mdl.MdlShaderGenerator,
}
DRIVER: Any = {"backend": "egl", "libgl": "libGL.so.1", "libegl": "libEGL.so.1"}
WIDTH = 64  # pixels in a row of the target
# Replaces the generated vertex shader: a point for each pixel, the viewer at the origin.
VERTEX = """#version 400
in vec2 pixel;
in vec3 normal;
in vec3 viewer;
out VertexData {block} vd;
void main()
{{
    gl_Position = vec4(pixel, 0.0, 1.0);
    {fields}
}}
"""
# What it sets, where the block has it
FIELDS = {
    "normalWorld": "vd.normalWorld = normal;",
    "positionWorld": "vd.positionWorld = -viewer;",
    "tangentWorld": "vd.tangentWorld = normalize(cross(normal, normal.yzx + vec3(0.0, 0.0, 2.0)));",
}


def library() -> mx.Document:
    """Return MaterialX's standard libraries."""
    standard = mx.createDocument()
    mx.loadLibraries(mx.getDefaultDataLibraryFolders(), mx.getDefaultDataSearchPath(), standard)
    return standard


def document(material: UsdShade.Material, standard: mx.Document) -> mx.Document:
    """Return the MaterialX network of `material` as a document that includes the `standard` libraries.

    Raises KeyError for a shader or an input that they lack.
    """
    network = mx.createDocument()
    network.importLibrary(standard)
    surface = material.GetSurfaceOutput("mtlx").GetConnectedSources()[0][0].source.GetPrim()
    for prim in surface.GetParent().GetChildren():
        shader = UsdShade.Shader(prim)
        if shader and shader.GetShaderId().startswith("ND_"):
            _node(network, shader)
    network.addMaterialNode(MATERIAL, network.getNode(surface.GetName()))
    return network


def _node(network: mx.Document, shader: UsdShade.Shader) -> None:
    definition = network.getNodeDef(shader.GetShaderId())
    if definition is None:
        raise KeyError(shader.GetShaderId())
    node = network.addNode(definition.getNodeString(), shader.GetPrim().GetName(), definition.getType())
    node.setNodeDefString(definition.getName())
    for usd_input in shader.GetInputs():
        declared = definition.getInput(usd_input.GetBaseName())
        if declared is None:
            raise KeyError(f"{shader.GetShaderId()}.{usd_input.GetBaseName()}")
        socket = node.addInput(usd_input.GetBaseName(), declared.getType())
        connections = usd_input.GetConnectedSources()[0]
        if connections:
            socket.setNodeName(connections[0].source.GetPrim().GetName())
        else:
            socket.setValueString(text_of(usd_input.Get()))
        if usd_input.GetAttr().HasColorSpace():
            socket.setColorSpace(usd_input.GetAttr().GetColorSpace())


def text_of(value: object) -> str:
    """Return a USD value in MaterialX's text form."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, (str, int, float)):
        return str(value)
    if isinstance(value, Sdf.AssetPath):
        return value.path
    return ", ".join(map(str, value))


def generate(network: mx.Document, target: str) -> mx_gen.Shader:
    """Return the shader that MaterialX generates for a `target` of GENERATORS; GLSL is for one directional light."""
    generator = GENERATORS[target].create()
    context = mx_gen.GenContext(generator)
    context.registerSourceCodeSearchPath(mx.getDefaultDataSearchPath())
    generator.registerTypeDefs(network)
    color = mx_gen.DefaultColorManagementSystem.create(generator.getTarget())
    color.loadLibrary(network)
    generator.setColorManagementSystem(color)
    options = context.getOptions()
    options.targetColorSpaceOverride = "lin_rec709"
    options.hwMaxActiveLightSources = 1
    if target == "GLSL":
        mx_gen.HwShaderGenerator.bindLightShader(network.getNodeDef("ND_directional_light"), 1, context)
    return generator.generate(MATERIAL, network.getNode(MATERIAL), context)


def evaluate(pixel_shader: str, light: Vector, rows: Sequence[tuple[Vector, Vector]]) -> list[Vector]:
    """Return the radiance [W/(m^2 sr)] that generated GLSL gives for each (N, V) of `rows` under a light of 1 W/m^2 from `light`.

    The viewer is at the origin, the shaded point at -V. The number of rows is a multiple of WIDTH. Raises moderngl.Error where
    there is no driver or the shader does not compile.
    """
    context = moderngl.create_context(standalone=True, **DRIVER)
    block = pixel_shader.split("in VertexData", 1)[1].split("vd;", 1)[0]
    fields = "\n    ".join(line for field, line in FIELDS.items() if field in block)
    program = context.program(vertex_shader=VERTEX.format(block=block, fields=fields), fragment_shader=pixel_shader)
    values = {
        "u_numActiveLightSources": 1,
        "u_lightData[0].type": 1,
        "u_lightData[0].direction": tuple(-x for x in light),
        "u_lightData[0].color": (1.0, 1.0, 1.0),
        "u_lightData[0].intensity": 1.0,
        "u_envLightIntensity": 0.0,
    }
    for name, value in values.items():
        if name in program:
            program[name] = value
    height = len(rows) // WIDTH
    points = array("f")
    for index, (normal, viewer) in enumerate(rows):
        x, y = 2.0 * (index % WIDTH + 0.5) / WIDTH - 1.0, 2.0 * (index // WIDTH + 0.5) / height - 1.0
        points.extend((x, y, *normal, *viewer))
    target = context.framebuffer(color_attachments=[context.renderbuffer((WIDTH, height), 4, dtype="f4")])
    target.use()
    target.clear()
    names = [name for name in ("pixel", "normal", "viewer") if name in program]
    layout = "2f " + " ".join("3f" if name in names else "3x4" for name in ("normal", "viewer"))
    vertices = context.vertex_array(program, [(context.buffer(points), layout, *names)])
    vertices.render(moderngl.POINTS)
    colors = array("f")
    colors.frombytes(target.read(components=3, dtype="f4"))
    context.release()
    return [(colors[i], colors[i + 1], colors[i + 2]) for i in range(0, len(colors), 3)]
