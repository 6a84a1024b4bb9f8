// SPDX-License-Identifier: GPL-3.0-or-later
// A reflectance model in three.js r187, WebGLRenderer: the diffuse reflection of a MeshStandardMaterial or MeshPhysicalMaterial.
// Its color, maps, metalness, specular layer, coat and sheen stay three's. A RectAreaLight reflects as Lambert's law has it.

import { calls } from "./calls.js"

// Gives `material` a model and returns the uniforms of its parameters.
// model: the STEM of its file. text: the GLSL of its files. parameters: numbers, its roughness or index if it has one.
export function setReflectance(material, model, text, parameters = []) {
  const names = parameters.map((_, k) => `reflectanceParameter${k}`)
  const uniforms = parameters.map((value) => ({ value }))
  const call = calls(model, text, names)
  const formal = "const in vec3 position, const in vec3 n, const in vec3 v, const in vec3 clearcoatN"
  const passed = "position, n, v, clearcoatN, reflectanceMaterial(material, "
  const ambient = `${passed}${call.albedo("dot(n, v)", "material.diffuseColor")}), reflected`
  const last = "const in PhysicalMaterial material, inout ReflectedLight reflected"
  // three multiplies what it takes for Lambert's color by (N.L) / pi of a light, and by irradiance / pi of the surroundings.
  const functions = `
    ${names.map((name) => `uniform float ${name};`).join("\n")}
    ${text}
    ${call.type} reflectanceSurface;
    PhysicalMaterial reflectanceMaterial(PhysicalMaterial material, vec3 color) {
      material.diffuseContribution = color * (1.0 - material.metalness);
      return material;
    }
    void RE_Direct_Reflectance(const in IncidentLight light, ${formal}, ${last}) {
      vec3 color = ${call.radiance("reflectanceSurface", "light.direction")} * (PI / max(dot(n, light.direction), 1e-9));
      RE_Direct_Physical(light, ${passed}color), reflected);
    }
    void RE_IndirectDiffuse_Reflectance(const in vec3 irradiance, ${formal}, ${last}) {
      RE_IndirectDiffuse_Physical(irradiance, ${ambient});
    }
    void RE_IndirectSpecular_Reflectance(
      const in vec3 radiance, const in vec3 irradiance, const in vec3 clearcoatRadiance, ${formal}, ${last}
    ) {
      RE_IndirectSpecular_Physical(radiance, irradiance, clearcoatRadiance, ${ambient});
    }
    ${["Direct", "IndirectDiffuse", "IndirectSpecular"].map((name) => `
      #undef RE_${name}
      #define RE_${name} RE_${name}_Reflectance`).join("")}`
  const view = "isOrthographic ? vec3(0.0, 0.0, 1.0) : normalize(vViewPosition)"
  const begin = `reflectanceSurface = ${call.surface("normal", view, "diffuseColor.rgb")};`
  material.diffuseRoughness = 0 // three's own rough model, in whose place this one stands
  material.onBeforeCompile = (shader) => {
    names.forEach((name, k) => (shader.uniforms[name] = uniforms[k]))
    const after = "#include <lights_physical_pars_fragment>"
    const before = "#include <lights_fragment_begin>"
    for (const part of [after, before]) if (!shader.fragmentShader.includes(part)) throw Error(`${material.type} lacks ${part}`)
    shader.fragmentShader = shader.fragmentShader.replace(after, `${after}\n${functions}`).replace(before, `${begin}\n${before}`)
  }
  material.customProgramCacheKey = () => model
  material.needsUpdate = true
  return uniforms
}
