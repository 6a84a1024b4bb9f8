# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads closures, our groups' and Blender's, and their mixes and sums, into one `Surface`.

A mix of two closures becomes one surface whose opacity, emission and parameters are mixed. That is exact for transparency, for
emission, and where only the base color differs; where more differs a `Loss` says so. So it does for closures that a surface lacks.
"""

from collections.abc import Callable, Mapping
from dataclasses import replace

import bpy

from ..models import by_label
from ..nodes import GROUPS, ROUGH_DIFFUSE, SPECULAR_GROUP, SUBSURFACE
from ..nodes.graph import key_and_version
from .expression import Constant, Coordinate, Expression, apply
from .links import Place, source
from .read_nodes import NodeReader, UnsupportedInput
from .surface import PARAMETERS, Loss, Surface
from .upgrade import current_name, current_value

MILLIMETERS = 1000.0  # in a meter
LAMBERT, CYCLES_DIFFUSE = "lambert", "cycles_diffuse"
BLACK, WHITE = Constant((0.0, 0.0, 0.0)), Constant((1.0, 1.0, 1.0))
NOTHING, FULL = Constant(0.0), Constant(1.0)
OWN_VALUE = "the socket's own value takes its place"
PRINCIPLED = "principled"  # key of Principled Rough Diffuse

# Parameters that count only with a weight above 0
WEIGHTS: Mapping[str, tuple[str, ...]] = {
    "subsurface_weight": ("subsurface_radius", "subsurface_anisotropy"),
    "highlight_weight": ("highlight_exponent",),
    "coat_weight": ("coat_color", "coat_roughness", "coat_ior", "coat_normal"),
    "fuzz_weight": ("fuzz_color", "fuzz_roughness"),
    "thin_film_thickness": ("thin_film_ior",),
    "emission_strength": ("emission_color",),
    "specular_anisotropy": ("specular_rotation", "tangent"),
}
SPECULAR = ("specular_roughness", "specular_anisotropy", "specular_color", "thin_film_thickness")  # of all that reflects sharply
HIGHLIGHT = ("highlight_weight", "highlight_exponent")
# A mix is exact where only these differ
LINEAR = {"base_color", "opacity", "emission_color", "emission_strength"}

# Principled BSDF's inputs, and those of the group with the same names
PRINCIPLED_INPUTS = {
    "base_color": "Base Color",
    "metallic": "Metallic",
    "transmission_weight": "Transmission Weight",
    "subsurface_weight": "Subsurface Weight",
    "subsurface_anisotropy": "Subsurface Anisotropy",
    "specular_color": "Specular Tint",
    "specular_roughness": "Roughness",
    "specular_ior": "IOR",
    "specular_anisotropy": "Anisotropic",
    "specular_rotation": "Anisotropic Rotation",
    "tangent": "Tangent",
    "coat_weight": "Coat Weight",
    "coat_color": "Coat Tint",
    "coat_roughness": "Coat Roughness",
    "coat_ior": "Coat IOR",
    "coat_normal": "Coat Normal",
    "fuzz_weight": "Sheen Weight",
    "fuzz_color": "Sheen Tint",
    "fuzz_roughness": "Sheen Roughness",
    "thin_film_thickness": "Thin Film Thickness",
    "thin_film_ior": "Thin Film IOR",
    "emission_color": "Emission Color",
    "emission_strength": "Emission Strength",
    "opacity": "Alpha",
    "normal": "Normal",
}
ENGINES = ("EEVEE", "CYCLES")
TARGETS = (*ENGINES, "ALL")
"""Of a Material Output, in the order in which one is looked for; one for all engines serves each that has none."""
METHODS = {
    "Christensen-Burley": "BURLEY",
    "Random Walk": "RANDOM_WALK",
    "Random Walk (Skin)": "RANDOM_WALK_SKIN",
    "Random Walk (Legacy)": "RANDOM_WALK_LEGACY",
}


class ClosureReader:
    """Reads closures; collects what they lose, the images and the input of each parameter.

    `unit` is the scene's unit in meters, in which Blender's own closures have their lengths.
    """

    def __init__(self, unit: float) -> None:
        self.nodes = NodeReader()
        self.unit = unit
        self.losses: list[Loss] = []
        self.places: dict[str, Place] = {}
        self.emits = False  # even where black takes the place of what feeds the color

    def surface(self, place: Place) -> Surface:
        """Return the surface of a closure's input; black where nothing is linked to it."""
        output = source(place)
        if not output.socket.is_output:
            return nothing()
        node = output.node
        key = key_and_version(node)[0]
        if key in {group.key for group in GROUPS} and not node.mute:
            return self._group(key, output)
        read = CLOSURES.get(node.bl_idname)
        if read is None or node.mute:
            if not node.mute:
                self.losses.append(Loss("", output.label, f"the closure {node.bl_label}", "black takes its place"))
            return nothing()
        return read(self, output)

    def value(self, output: Place, parameter: str, name: str | int) -> Expression:
        """Return the expression of the input `name` of a closure, for a `parameter`; its own value where it has no expression."""
        place = output.input(name)
        self.places.setdefault(parameter, place)
        try:
            found = self.nodes.expression(place)
        except UnsupportedInput as problem:
            self.losses.append(Loss(parameter, problem.node, problem.what, OWN_VALUE))
            found = self.nodes.own(place)
        self.emits |= parameter == "emission_strength" and found != NOTHING
        return found

    def values(self, output: Place, inputs: Mapping[str, str]) -> dict[str, Expression]:
        """Return `value` for each parameter by the name of its input."""
        return {parameter: self.value(output, parameter, name) for parameter, name in inputs.items()}

    def _group(self, key: str, output: Place) -> Surface:
        names = {current_name(socket.name): socket.name for socket in output.node.inputs}
        defaults = {socket.name: socket.default for group in GROUPS if group.key == key for socket in group.inputs}

        def choice(name: str) -> str:
            if name not in names:  # an older version lacks it
                return str(defaults[name])
            return str(current_value(name, source(output.input(names[name])).socket.default_value))

        def named(**inputs: str) -> dict[str, Expression]:
            known = {parameter: names[name] for parameter, name in inputs.items() if name in names}
            return self.values(output, known)

        if key == SPECULAR_GROUP.key:
            given = named(base_color="Color", highlight_weight="Specular", highlight_exponent="Exponent", normal="Normal")
            return surface(LAMBERT, given)
        model = by_label(choice("Model"))
        if key == ROUGH_DIFFUSE.key:
            given = named(base_color="Color", diffuse_roughness="Roughness", diffuse_ior="IOR", normal="Normal")
            return surface(model.id, given)
        if key == SUBSURFACE.key:
            given = named(
                base_color="Color",
                diffuse_roughness="Roughness",
                diffuse_ior="IOR",
                subsurface_weight="Subsurface",
                subsurface_radius="Subsurface Radius",
                coat_weight="Specular",
                coat_roughness="Specular Roughness",
                coat_ior="IOR",
                normal="Normal",
            )
            scale = self.value(output, "subsurface_scale", names["Scale"])
            given["subsurface_radius"] = apply("multiply", given["subsurface_radius"], scale)
            given["coat_normal"] = given["normal"]
            return surface(model.id, given, is_coat_averaged=True, subsurface_method=METHODS[choice("Method")])
        if key == PRINCIPLED:
            return self._principled(
                output,
                model.id,
                radius_in_mm=1.0,
                method=METHODS[choice("Subsurface Method")],
                is_multi_scattering=choice("Distribution") != "GGX",
            )
        raise ValueError(f"unknown group {key}")

    def _principled(self, output: Place, model: str, radius_in_mm: float, method: str, is_multi_scattering: bool) -> Surface:
        given = self.values(output, PRINCIPLED_INPUTS)
        given["diffuse_roughness"] = self.value(output, "diffuse_roughness", "Diffuse Roughness")
        given["diffuse_ior"] = given["specular_ior"]
        given["specular_weight"] = apply("multiply", self.value(output, "specular_weight", "Specular IOR Level"), 2.0)
        scale = apply("multiply", self.value(output, "subsurface_scale", "Subsurface Scale"), radius_in_mm)
        given["subsurface_radius"] = apply("multiply", self.value(output, "subsurface_radius", "Subsurface Radius"), scale)
        thin = self.value(output, "thin_wall", "Thin Wall")
        if not isinstance(thin, Constant):
            self.losses.append(Loss("", output.label, "Thin Wall, which is linked,", "a solid takes its place"))
        return surface(
            model,
            given,
            is_thin_wall=thin in (Constant(1.0), Constant(True)),
            subsurface_method=method,
            is_multi_scattering=is_multi_scattering,
        )

    def principled(self, output: Place) -> Surface:
        """Return the surface of a Principled BSDF."""
        node = output.node
        return self._principled(
            output,
            self._diffuse_model(output, "Diffuse Roughness"),
            radius_in_mm=self.unit * MILLIMETERS,
            method=node.subsurface_method,
            is_multi_scattering=node.distribution == "MULTI_GGX",
        )

    def _diffuse_model(self, output: Place, name: str) -> str:
        """Return the model of Blender's own diffuse closures by the input of their roughness."""
        return LAMBERT if self.value(output, "diffuse_roughness", name) == NOTHING else CYCLES_DIFFUSE

    def diffuse(self, output: Place) -> Surface:
        """Return the surface of a Diffuse BSDF."""
        given = self.values(output, {"base_color": "Color", "diffuse_roughness": "Roughness", "normal": "Normal"})
        return surface(self._diffuse_model(output, "Roughness"), given)

    def glossy(self, output: Place) -> Surface:
        """Return a metal for a Glossy BSDF, whose reflectance however does not grow towards the horizon."""
        if self.value(output, "base_color", "Color") != WHITE:
            self._say(output, "the constant reflectance of a Glossy BSDF", "a metal of its color takes its place")
        return self._metal(output, "Color")

    def metallic(self, output: Place) -> Surface:
        """Return the surface of a Metallic BSDF, of its base color and edge tint."""
        if output.node.fresnel_type != "F82":
            self._say(output, "a metal by its index of refraction", "its base color and edge tint take its place")
        found = self._metal(output, "Base Color")
        film = {"thin_film_thickness": "Thin Film Thickness", "thin_film_ior": "Thin Film IOR"}
        tint = self.value(output, "specular_color", "Edge Tint")
        return surface(found.model, {**found.inputs, **self.values(output, film), "specular_color": tint})

    def _metal(self, output: Place, color: str) -> Surface:
        names = {"specular_roughness": "Roughness", "specular_anisotropy": "Anisotropy", "specular_rotation": "Rotation"}
        given = self.values(output, {"base_color": color, **names, "normal": "Normal", "tangent": "Tangent"})
        return surface(LAMBERT, {**given, "metallic": FULL}, is_multi_scattering=output.node.distribution == "MULTI_GGX")

    def glass(self, output: Place) -> Surface:
        """Return the surface of a Glass or a Refraction BSDF."""
        given = self.values(
            output, {"base_color": "Color", "specular_roughness": "Roughness", "specular_ior": "IOR", "normal": "Normal"}
        )
        if output.node.type == "BSDF_REFRACTION":
            self._say(output, "a refraction without reflection", "glass takes its place")
        return surface(LAMBERT, {**given, "transmission_weight": FULL, "specular_weight": FULL})

    def subsurface(self, output: Place) -> Surface:
        """Return the surface of a Subsurface Scattering BSDF."""
        given = self.values(output, {"base_color": "Color", "subsurface_anisotropy": "Anisotropy", "normal": "Normal"})
        scale = apply("multiply", self.value(output, "subsurface_scale", "Scale"), self.unit * MILLIMETERS)
        given["subsurface_radius"] = apply("multiply", self.value(output, "subsurface_radius", "Radius"), scale)
        given["subsurface_weight"] = FULL
        return surface(LAMBERT, given, subsurface_method=output.node.falloff)

    def sheen(self, output: Place) -> Surface:
        """Return a black surface with the sheen of a Sheen BSDF."""
        given = self.values(output, {"fuzz_color": "Color", "fuzz_roughness": "Roughness", "normal": "Normal"})
        return surface(LAMBERT, {**given, "base_color": BLACK, "fuzz_weight": FULL})

    def emission(self, output: Place) -> Surface:
        """Return a black surface that emits."""
        given = self.values(output, {"emission_color": "Color", "emission_strength": "Strength"})
        return surface(LAMBERT, {**given, "base_color": BLACK})

    def transparent(self, output: Place) -> Surface:
        """Return a surface without opacity."""
        if self.value(output, "opacity", "Color") != WHITE:
            self._say(output, "the color of what shines through", "white takes its place")
        return surface(LAMBERT, {"base_color": BLACK, "opacity": NOTHING})

    def as_diffuse(self, output: Place) -> Surface:
        """Return a Lambert surface in the color of a closure that a surface lacks."""
        self._say(output, f"the closure {output.node.bl_label}", "a Diffuse BSDF of its color takes its place")
        return surface(LAMBERT, {"base_color": self.value(output, "base_color", 0)})

    def mix_shader(self, output: Place) -> Surface:
        """Return the surface of a Mix Shader."""
        factor = apply("clamp", self.value(output, "mix", "Factor"), 0.0, 1.0)
        if factor in (NOTHING, FULL):
            return self.surface(output.input(1 if factor == NOTHING else 2))
        first, second = self.surface(output.input(1)), self.surface(output.input(2))
        return self._mixed(output, first, second, factor)

    def add_shader(self, output: Place) -> Surface:
        """Return the surface of an Add Shader: exact for emission, and for diffuse reflection of one model."""
        first, second = self.surface(output.input(0)), self.surface(output.input(1))
        radiance = apply("add", radiance_of(first), radiance_of(second))
        first, second = (dark(one) for one in (first, second))
        if is_black(first):
            result = second
        elif is_black(second):
            result = first
        elif is_highlight(second) and not first.uses("highlight_weight"):
            result = self._highlighted(output, first, second)
        elif is_highlight(first) and not second.uses("highlight_weight"):
            result = self._highlighted(output, second, first)
        elif _differing(first, second) <= {"base_color"} and not {"metallic", "specular_weight", "opacity"} & set(first.inputs):
            result = surface(first.model, {**first.inputs, "base_color": apply("add", first["base_color"], second["base_color"])})
        else:
            self._say(output, "a sum of closures", "one surface of their mean values takes its place")
            result = self._mixed(output, first, second, Constant(0.5))
        return surface(result.model, {**result.inputs, "emission_color": radiance, "emission_strength": FULL}, like=result)

    def _highlighted(self, output: Place, one: Surface, highlight: Surface) -> Surface:
        """Return a surface with a `highlight` added, whose weight in a surface is that of what is opaque, no metal and no glass."""
        if one["normal"] != highlight["normal"]:
            self._say(output, "a highlight with a normal of its own", "the surface's normal takes its place")
        weight = highlight["highlight_weight"]
        for part in (one["opacity"], *(apply("subtract", 1.0, one[name]) for name in ("metallic", "transmission_weight"))):
            if part != FULL:
                weight = apply("divide", weight, part)
        return surface(
            one.model,
            {**one.inputs, "highlight_weight": weight, "highlight_exponent": highlight["highlight_exponent"]},
            like=one,
        )

    def _mixed(self, output: Place, first: Surface, second: Surface, factor: Expression) -> Surface:
        """Return the surface of `first` at `factor` 0, `second` at 1."""
        opacity = apply("mix", first["opacity"], second["opacity"], factor)
        # the part of what is opaque that is the second's
        if (first["opacity"], second["opacity"]) == (FULL, NOTHING):
            factor = NOTHING
        elif (first["opacity"], second["opacity"]) == (NOTHING, FULL):
            factor = FULL
        elif opacity != FULL and first["opacity"] != second["opacity"]:
            factor = apply("divide", apply("multiply", factor, second["opacity"]), opacity)
        if factor in (NOTHING, FULL):
            chosen = second if factor == FULL else first
            return surface(chosen.model, {**chosen.inputs, "opacity": opacity}, like=chosen)
        inputs = {"opacity": opacity}
        radiance = apply("mix", radiance_of(first), radiance_of(second), factor)
        if radiance != BLACK:
            inputs |= {"emission_color": radiance, "emission_strength": FULL}
        # what a black closure, such as emission, says of roughness or normal does not count
        main = second if is_black(first) else first
        other = dark(first if main is second else second)
        weights = {name for name in WEIGHTS if name != "emission_strength"}
        for name in {*first.inputs, *second.inputs} - set(inputs) - {"emission_color", "emission_strength"}:
            if is_black(other) and name != "base_color" and name not in weights:
                inputs[name] = main[name]
            else:
                inputs[name] = apply("mix", first[name], second[name], factor)
        differing = _differing(first, second) if not is_black(other) else set(main.inputs) & {"metallic", "specular_weight"}
        if differing - LINEAR or (first.model != second.model and not is_black(other)):
            listed = ", ".join(sorted(name.replace("_", " ") for name in differing - LINEAR)) or "reflectance model"
            self._say(output, f"a mix of closures that differ in {listed}", "one surface of mixed values takes its place")
        return surface(main.model, inputs, like=main)

    def _say(self, output: Place, what: str, instead: str) -> None:
        self.losses.append(Loss("", output.label, what, instead))


def surface(model: str, inputs: Mapping[str, Expression], like: Surface | None = None, **settings: str | bool) -> Surface:
    """Return a surface without the inputs that are at their defaults or count for nothing, and the settings of `like`."""
    given = {name: value for name, value in inputs.items() if value != Constant(PARAMETERS[name])}
    given = {name: value for name, value in given.items() if not _is_surface_normal(name, value)}
    for weight, names in WEIGHTS.items():
        if weight not in given:
            given = {name: value for name, value in given.items() if name not in names}
    if given.get("emission_color") == BLACK:
        del given["emission_color"], given["emission_strength"]
    if not {"metallic", "transmission_weight", "specular_weight"} & set(given):
        given = {name: value for name, value in given.items() if name not in (*SPECULAR, "specular_ior")}
    result = replace(like or Surface(LAMBERT), model=model, inputs=given, **settings)
    unused = {"diffuse_roughness", "diffuse_ior"} - {result.model_parameter}
    return replace(result, inputs={name: value for name, value in given.items() if name not in unused})


def nothing() -> Surface:
    """Return a black surface."""
    return surface(LAMBERT, {"base_color": BLACK})


def radiance_of(one: Surface) -> Expression:
    """Return what a surface emits, in W/(m^2 sr)."""
    return apply("multiply", one["emission_color"], one["emission_strength"]) if one.uses("emission_strength") else BLACK


def dark(one: Surface) -> Surface:
    """Return a surface without its emission."""
    kept = {name: value for name, value in one.inputs.items() if not name.startswith("emission")}
    return replace(one, inputs=kept)


def is_black(one: Surface) -> bool:
    """Return whether a surface scatters no light at all."""
    layers = {"specular_weight", "coat_weight", "fuzz_weight", "highlight_weight"}
    return one["base_color"] == BLACK and not layers & set(one.inputs) and one["opacity"] == FULL


def is_highlight(one: Surface) -> bool:
    """Return whether a surface is Blinn-Phong's highlight alone."""
    return one.uses("highlight_weight") and set(one.inputs) <= {"base_color", *HIGHLIGHT, "normal"} and one["base_color"] == BLACK


def _differing(first: Surface, second: Surface) -> set[str]:
    return {name for name in {*first.inputs, *second.inputs} if first[name] != second[name]}


def _is_surface_normal(name: str, value: Expression) -> bool:
    """Return whether a normal is the surface's own, from the node that gives it."""
    return name in ("normal", "coat_normal") and value == Coordinate("normal")


type Closure = Callable[[ClosureReader, Place], Surface]
CLOSURES: Mapping[str, Closure] = {
    "ShaderNodeBsdfPrincipled": ClosureReader.principled,
    "ShaderNodeBsdfDiffuse": ClosureReader.diffuse,
    "ShaderNodeBsdfAnisotropic": ClosureReader.glossy,
    "ShaderNodeBsdfMetallic": ClosureReader.metallic,
    "ShaderNodeBsdfGlass": ClosureReader.glass,
    "ShaderNodeBsdfRefraction": ClosureReader.glass,
    "ShaderNodeSubsurfaceScattering": ClosureReader.subsurface,
    "ShaderNodeBsdfSheen": ClosureReader.sheen,
    "ShaderNodeEmission": ClosureReader.emission,
    "ShaderNodeBsdfTransparent": ClosureReader.transparent,
    "ShaderNodeBsdfTranslucent": ClosureReader.as_diffuse,
    "ShaderNodeBsdfToon": ClosureReader.as_diffuse,
    "ShaderNodeEeveeSpecular": ClosureReader.as_diffuse,
    "ShaderNodeBsdfHair": ClosureReader.as_diffuse,
    "ShaderNodeBsdfHairPrincipled": ClosureReader.as_diffuse,
    "ShaderNodeMixShader": ClosureReader.mix_shader,
    "ShaderNodeAddShader": ClosureReader.add_shader,
}


def material_surface(material: bpy.types.Material, target: str, reader: ClosureReader) -> Surface:
    """Return the surface at the output of `material` for `target`, of TARGETS, or where it has none at another."""
    tree = material.node_tree
    outputs = [found for each in (target, *TARGETS) if (found := tree.get_output_node(each))] if tree else []
    output = next(iter(outputs), None)
    if output is None:
        reader.losses.append(Loss("", "", "a material without an output", "black takes its place"))
        return nothing()
    found = reader.surface(Place(output.inputs["Surface"]))
    others = [other for other in (tree.get_output_node(each) for each in ENGINES) if other and other != output]
    if others:
        reader.losses.append(Loss("", others[0].label or others[0].name, "another engine's output", f"{output.name} counts"))
    for name in ("Displacement", "Volume"):
        if source(Place(output.inputs[name])).socket.is_output:
            reader.losses.append(Loss("", output.label or output.name, f"{name} at the output", "the surface is without it"))
    unused = {name for weight, names in WEIGHTS.items() if not found.uses(weight) for name in names}
    if reader.emits:
        unused.discard("emission_color")
    reader.losses = [loss for loss in reader.losses if loss.parameter not in unused]
    is_blended, is_culled = material.surface_render_method == "BLENDED", material.use_backface_culling
    return replace(found, is_blended=is_blended, is_culled=is_culled)
