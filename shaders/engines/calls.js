// SPDX-License-Identifier: GPL-3.0-or-later
// How a model's functions are called, for three.js and babylon.js.

// Returns the type of STEM_surface, and the calls with n, v, rho and mu to be filled in: by the rules of shaders/README.md.
// model: STEM. text: the GLSL of its files. parameters: GLSL expressions of its roughness or index, or of specular and exponent.
export function calls(model, text, parameters) {
  const type = text.match(new RegExp(`^(\\w+) ${model}_surface\\(`, "m"))?.[1]
  if (!type || !text.includes(`${model}_albedo(`)) throw Error(`the text lacks ${model}_surface or ${model}_albedo`)
  const values = parameters.join(", ")
  const last = text.includes(`${model}_coefficients(`) ? `, ${model}_coefficients(${values})` : values && `, ${values}`
  return {
    type,
    surface: (n, v, rho) => `${model}_surface(${n}, ${v}, ${rho}${last})`,
    radiance: (surface, l) => `${model}_radiance(${surface}, ${l})`,
    albedo: (mu, rho) => `${model}_albedo(${mu}, ${rho}${last})`,
  }
}
