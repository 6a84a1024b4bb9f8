// SPDX-License-Identifier: GPL-3.0-or-later
// A reflectance model in Babylon.js 9 on WebGL: the diffuse reflection of a PBRMaterial or PBRMetallicRoughnessMaterial.
// Its color, textures, metallic, specular layer, coat and sheen stay Babylon's. Hemispheric, area and clustered lights reflect as
// Babylon has it.

import { calls } from "./calls.js"

// Gives `material` a model by a plugin, which it returns, with the `parameters` that may be changed.
// model: the STEM of its file. text: the GLSL of its files. parameters: numbers, its roughness or index if it has one.
export function setReflectance(MaterialPluginBase, material, model, text, parameters = []) {
  if (material.pluginManager?.getPlugin("Reflectance")) throw Error("the material has a reflectance model already")
  const name = "reflectanceParameters"
  const call = calls(model, text, parameters.map((_, k) => `${name}.${"xy"[k]}`))
  // Babylon multiplies by the base color at last, and for metals by what is left of it.
  const over = "/ max(baseColor, vec3(1e-9))"
  const codes = {
    CUSTOM_FRAGMENT_DEFINITIONS: text.replace(/\/\/.*/g, ""), // Babylon ends a line at a semicolon, in comments, too
    CUSTOM_FRAGMENT_BEFORE_LIGHTS: `
      ${call.type} reflectanceSurface = ${call.surface("normalW", "viewDirectionW", "surfaceAlbedo")};`,
    "!computeDiffuseLighting\\(preInfo,(\\w+)\\.rgb\\)([^;]*);":
      `${call.radiance("reflectanceSurface", "preInfo.L")} ${over} * preInfo.attenuation * $1.rgb$2;`,
    CUSTOM_FRAGMENT_BEFORE_FINALCOLORCOMPOSITION: `
      #ifndef UNLIT
        vec3 reflectanceOfSky = ${call.albedo("dot(normalW, viewDirectionW)", "baseColor")} ${over};
        finalAmbient *= reflectanceOfSky;
      #ifdef REFLECTION
        finalIrradiance *= reflectanceOfSky;
      #endif
      #endif`,
  }
  class Reflectance extends MaterialPluginBase {
    parameters = [...parameters]

    getClassName() {
      return "Reflectance"
    }

    getUniforms() {
      return parameters.length ? { ubo: [{ name, size: 2, type: "vec2" }], fragment: `uniform vec2 ${name};` } : {}
    }

    bindForSubMesh(buffer) {
      if (parameters.length) buffer.updateFloat2(name, this.parameters[0], this.parameters[1] ?? 0)
    }

    getCustomCode(shaderType) {
      return shaderType == "fragment" ? codes : null
    }
  }
  // The define tells materials of different models apart, which would share a shader otherwise.
  return new Reflectance(material, "Reflectance", 200, { [`REFLECTANCE_${model.toUpperCase()}`]: true }, true, true)
}
