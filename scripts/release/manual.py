# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes the manual: a page for each node group from its own sockets, with pictures at three values or of every menu entry.

uv run scripts/release/manual.py [OPTIONS]
uv run --group site scripts/release/manual.py --site DIR    makes a site of all pages as they are; seconds
blender -b --python scripts/release/manual.py -- [OPTIONS]
"""

import sys
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import checkout  # noqa: F401 - makes this checkout the package true_diffuse
from true_diffuse.scripts.cli.console import Parser, Terminal, end, script_arguments
from true_diffuse.scripts.cli.inputs import sample_count
from true_diffuse.scripts.cli.outputs import OutputFolder
from true_diffuse.scripts.cli.startup import load_bpy, run_script, start_blender
from true_diffuse.scripts.release.previews import build

if TYPE_CHECKING:
    import bpy

    from true_diffuse.addon.blender.engines import Engine
    from true_diffuse.addon.material.materials import Setting
    from true_diffuse.addon.nodes import Group
    from true_diffuse.addon.nodes.graph import Socket

PAGES = Path(__file__).resolve().parents[2] / "scripts" / "manual"
SAMPLES = 128
SIZE = 176  # pixels each way, of one value
WARM, COOL, DARK = (0.8, 0.45, 0.25, 1.0), (0.3, 0.5, 0.7, 1.0), (0.1, 0.1, 0.1, 1.0)
# The values to show, by group and socket. A menu shows all of its entries.
VALUES: dict[str, dict[str, Sequence["Setting"]]] = {
    "rough_diffuse": {"Color": (DARK, WARM, COOL), "Roughness": (0.0, 0.33, 1.0), "IOR": (1.0, 1.5, 3.0)},
    "subsurface": {
        "Color": (DARK, WARM, COOL),
        "Roughness": (0.0, 0.33, 1.0),
        "Subsurface": (0.0, 0.5, 1.0),
        "Subsurface Radius": ((0.1, 0.1, 0.1), (1.3, 0.95, 0.67), (5.0, 1.0, 0.2)),
        "Scale": (0.2, 1.0, 5.0),
        "Specular": (0.0, 0.5, 1.0),
        "Specular Roughness": (0.1, 0.4, 0.8),
        "IOR": (1.1, 1.4, 2.0),
    },
    "specular": {"Color": (DARK, WARM, COOL), "Specular": (0.0, 0.1, 0.4), "Exponent": (5.0, 20.0, 100.0)},
    "principled": {"Diffuse Roughness": (0.0, 0.33, 1.0)},
}
WITHOUT_PICTURE = {("principled", "Distribution"), ("principled", "Subsurface Method")}  # Blender's own, as others of that group
BASE: dict[str, dict[str, "Setting"]] = {  # the group's other inputs
    "rough_diffuse": {"Color": (0.6, 0.6, 0.6, 1.0)},
    "subsurface": {"Color": (0.65, 0.4, 0.3, 1.0), "Specular": 0.5},
    "specular": {"Color": (0.15, 0.15, 0.18, 1.0), "Specular": 0.2},
    "principled": {"Base Color": (0.6, 0.6, 0.6, 1.0), "Roughness": 0.4},
}
OVERRIDES: dict[tuple[str, str], dict[str, "Setting"]] = {  # where those would hide what a socket does
    ("rough_diffuse", "Model"): {"Roughness": 0.7},
    ("rough_diffuse", "Quality"): {"Roughness": 1.0},
    ("rough_diffuse", "IOR"): {"Model": "Wolff"},
    ("principled", "Model"): {"Diffuse Roughness": 0.7},
    ("principled", "Quality"): {"Diffuse Roughness": 1.0},
    ("subsurface", "Model"): {"Subsurface": 0.0, "Specular": 0.0, "Roughness": 0.7},
    ("subsurface", "Roughness"): {"Subsurface": 0.0, "Specular": 0.0},
    ("subsurface", "Method"): {"Scale": 2.0},
    ("subsurface", "Specular"): {"Color": DARK},
    ("subsurface", "Specular Roughness"): {"Color": DARK, "Specular": 1.0},
    ("subsurface", "IOR"): {"Color": DARK, "Specular": 1.0},
}
IN_EEVEE = {("rough_diffuse", "Quality"), ("principled", "Quality")}  # makes no difference in Cycles
SOCKET_TYPES = {
    "NodeSocketFloat": "number",
    "NodeSocketColor": "color",
    "NodeSocketVector": "vector",
    "NodeSocketMenu": "menu",
    "NodeSocketBool": "checkbox",
}


def main() -> int:
    """Run the script; returns the exit status."""
    parser = Parser(prog="manual.py", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--samples", type=sample_count, metavar="N", help=f"per pixel (default: {SAMPLES})")
    parser.add_argument("--out", type=Path, metavar="DIR", help="folder to write (default: scripts/manual)")
    parser.add_argument("--site", type=Path, metavar="DIR", help="make static pages of manual, figures and gallery, with search")
    options = parser.parse_args(script_arguments())
    if options.site:
        if options.samples or options.out:
            parser.error("--site renders nothing and writes to its own folder: leave out --samples and --out")
        return run_script("manual.py", options.site, site)
    return run_script("manual.py", options.out or PAGES, partial(manual, options.samples or SAMPLES))


def site(output: OutputFolder, terminal: Terminal) -> None:
    """Make the site in `output`, then publish it."""
    from true_diffuse.scripts.release import website

    website.sphinx()
    terminal.say("Loading Blender")
    load_bpy()
    website.build(output.folder.parent, output.folder)
    size = sum(path.stat().st_size for path in output.folder.rglob("*") if path.is_file())
    count = len(output.publish())
    terminal.say(f"Wrote {output.target / 'index.html'} and {count - 1} other files, {size / 1e6:.1f} MB")


def manual(samples: int, output: OutputFolder, terminal: Terminal) -> None:
    """Render the pictures and write the pages into `output`, then publish them."""
    engines = {engine.key: engine for engine in start_blender(("cycles", "eevee"), terminal)}
    import bpy

    from true_diffuse.addon.nodes import GROUPS, chosen_lights

    scene = bpy.context.scene
    subject = build(scene)
    subject.data.name = "Subject"
    scene.render.film_transparent = False
    scene.render.image_settings.file_format = "PNG"
    scene.render.resolution_x = scene.render.resolution_y = SIZE
    scene.cycles.use_denoising = True
    pictures = [(group, socket) for group in GROUPS for socket in group.inputs if has_picture(group, socket)]
    chosen_lights.choose([item for item in scene.objects if item.type == "LIGHT"])
    with terminal.progress(len(pictures)) as progress:
        for group, socket in pictures:
            key = "eevee" if (group.key, socket.name) in IN_EEVEE else "cycles"
            with progress.step(f"{group.label}  {socket.name}", 1.0):
                if key in engines:
                    strip(subject, group, socket, engines[key], samples, output.folder)
    for group in GROUPS:
        output.write_text(f"{group.key}.md", page(group))
    terminal.say(f"Wrote {', '.join(output.publish())}")


def has_picture(group: "Group", socket: "Socket") -> bool:
    """Return whether the page of `group` shows what `socket` does."""
    is_menu = socket.kind == "NodeSocketMenu" and (group.key, socket.name) not in WITHOUT_PICTURE
    return is_menu or socket.name in VALUES[group.key]


def strip(subject: "bpy.types.Object", group: "Group", socket: "Socket", engine: "Engine", samples: int, folder: Path) -> None:
    """Render `group` at each value of `socket` to be shown and write the pictures side by side, with captions, into `folder`."""
    import bpy

    from true_diffuse.addon.blender import engines
    from true_diffuse.addon.material import materials
    from true_diffuse.scripts.studies import pictures

    values = list(entries(group, socket)) if socket.kind == "NodeSocketMenu" else VALUES[group.key][socket.name]
    scene = bpy.context.scene
    engines.use(scene, engine, samples)
    scene.cycles.use_denoising = True
    parts = []
    for index, value in enumerate(values):
        subject.active_material = materials.create("Subject", group, **{**other_inputs(group, socket), socket.name: value})
        parts.append(folder / f"{index}.png")
        scene.render.filepath = str(parts[-1])
        bpy.ops.render.render(write_still=True)
    pictures.strip(parts, folder / picture_name(group, socket), [text(value) for value in values])
    for part in parts:
        part.unlink()


def picture_name(group: "Group", socket: "Socket") -> str:
    """Return the name of the picture of one socket."""
    return f"{group.key}_{socket.name.lower().replace(' ', '_')}.webp"


def other_inputs(group: "Group", socket: "Socket") -> dict[str, "Setting"]:
    """Return the values of the inputs other than `socket` in its picture."""
    inputs = {**BASE[group.key], **OVERRIDES.get((group.key, socket.name), {})}
    return {name: value for name, value in inputs.items() if name != socket.name}


def text(value: "Setting") -> str:
    """Return the text of a value in captions and pages."""
    if isinstance(value, tuple):
        return ", ".join(f"{component:g}" for component in value[:3])
    return value if isinstance(value, str) else f"{value:g}"


def entries(group: "Group", socket: "Socket") -> dict[str, str]:
    """Return the entries of the menu `socket` with their descriptions, from the menu switch in the built group."""
    for tree in _trees(group.ensure()):
        for node in tree.nodes:
            if node.bl_idname == "GeometryNodeMenuSwitch" and node.inputs[0].is_linked:
                source = node.inputs[0].links[0]
                if source.from_node.type == "GROUP_INPUT" and source.from_socket.name == socket.name:
                    return {item.name: item.description for item in node.enum_items}
    raise LookupError(f"{group.name} has no menu {socket.name}")


def _trees(tree: "bpy.types.ShaderNodeTree") -> list["bpy.types.ShaderNodeTree"]:
    """Return `tree` and the trees of the groups in it."""
    return [tree, *(node.node_tree for node in tree.nodes if node.type == "GROUP")]


def page(group: "Group") -> str:
    """Return the page of `group` in Markdown."""
    lines = ["<!-- Written by `uv run scripts/release/manual.py`, from the group itself -->", ""]
    lines += [f"# {group.label}", "", group.description + ".", ""]
    for socket in group.inputs:
        lines += [f"## {socket.name}", "", f"{socket.description}.", "", _facts(socket), ""]
        if socket.kind == "NodeSocketMenu":
            lines += [f"- **{name}**: {description}" for name, description in entries(group, socket).items()] + [""]
        if has_picture(group, socket):
            engine = "EEVEE" if (group.key, socket.name) in IN_EEVEE else "Cycles"
            others = ", ".join(f"{name} {text(value)}" for name, value in other_inputs(group, socket).items())
            others = f", with {others}" if others else ""
            lines += [
                f"![{socket.name}, {engine}]({picture_name(group, socket)})",
                "",
                f"In {engine}{others}; the head is 3 cm high.",
                "",
            ]
    return "\n".join(lines)


def _facts(socket: "Socket") -> str:
    """Return a socket's type, default and range as a line."""
    facts = [f"A {SOCKET_TYPES[socket.kind]}"]
    if socket.hide_value:
        facts.append("used where something is connected")
    elif socket.default is not None:
        facts.append(f"{_default(socket.default)} by default")
    if socket.minimum is not None:
        facts.append(f"{socket.minimum:g} to {socket.maximum:.4g}" if socket.maximum is not None else f"{socket.minimum:g} or more")
    return "; ".join(facts) + "."


def _default(value: "Setting | bool") -> str:
    if isinstance(value, bool):
        return "on" if value else "off"
    return text(value if isinstance(value, (str, tuple)) else round(value, 4))


if __name__ == "__main__":
    end(main())
