// SPDX-License-Identifier: GPL-3.0-or-later
// Babylon.js as a referee: draws a glTF file into linear floats. engines.py says what `load` and `draw` are given.

import { base64 } from "./pixels.js"

const engine = new BABYLON.Engine(document.createElement("canvas"), false)
let camera, target

BABYLON.Effect.ShadersStore.geometryVertexShader = `
  attribute vec3 position, normal;
  uniform mat4 world, viewProjection;
  varying vec3 shownPosition, shownNormal;
  void main() {
    shownPosition = (world * vec4(position, 1.0)).xyz;
    shownNormal = transpose(inverse(mat3(world))) * normal;
    gl_Position = viewProjection * vec4(shownPosition, 1.0);
  }`
const fragment = (shown) => `
  varying vec3 shownPosition, shownNormal;
  void main() { gl_FragColor = vec4(${shown}, 1.0); }`
BABYLON.Effect.ShadersStore.geometryPositionFragmentShader = fragment("shownPosition")
// glTF: a back face has the opposite normal
BABYLON.Effect.ShadersStore.geometryNormalFragmentShader = fragment("gl_FrontFacing ? shownNormal : -shownNormal")

window.load = async ({ file, size, eye, at, degrees, near, far }) => {
  window.scene?.dispose()
  engine.setSize(size, size) // whose shape the camera's picture has
  window.scene = new BABYLON.Scene(engine)
  scene.useRightHandedSystem = true // glTF's axes
  scene.clearColor = new BABYLON.Color4(0, 0, 0, 0)
  scene.imageProcessingConfiguration.applyByPostProcess = true // else materials write sRGB, clipped at 1; here it is linear, up to 30
  await BABYLON.AppendSceneAsync(file, scene)
  camera = new BABYLON.FreeCamera("", new BABYLON.Vector3(...eye), scene)
  camera.setTarget(new BABYLON.Vector3(...at))
  Object.assign(camera, { fov: (degrees * Math.PI) / 180, minZ: near, maxZ: far })
  scene.activeCamera = camera
  target = new BABYLON.RenderTargetTexture("", size, scene, {
    type: BABYLON.Constants.TEXTURETYPE_FLOAT, generateMipMaps: false, samplingMode: BABYLON.Texture.NEAREST_SAMPLINGMODE,
  })
  camera.outputRenderTarget = target
}

// In place of a mesh's own material
const geometry = (shown) => ({ backFaceCulling, sideOrientation }) => {
  const options = { attributes: ["position", "normal"], uniforms: ["world", "viewProjection"] }
  const material = new BABYLON.ShaderMaterial("", scene, { vertex: "geometry", fragment: `geometry${shown}` }, options)
  return Object.assign(material, { backFaceCulling, sideOrientation })
}
const materials = {
  albedo: (own) => Object.assign(own.clone(""), { unlit: true }),
  position: geometry("Position"),
  normal: geometry("Normal"),
}

window.draw = async (what, suns) => {
  scene.lights.slice().forEach((light) => light.dispose())
  for (const { direction, irradiance } of suns) {
    const light = new BABYLON.DirectionalLight("", new BABYLON.Vector3(...direction).negate(), scene)
    light.diffuse = light.specular = new BABYLON.Color3(...irradiance)
  }
  const meshes = scene.meshes.filter((mesh) => mesh.getTotalVertices())
  const own = meshes.map((mesh) => mesh.material)
  if (what in materials) meshes.forEach((mesh) => (mesh.material = materials[what](mesh.material)))
  for (let frame = 0; frame < 2; frame++) {
    await scene.whenReadyAsync()
    scene.render() // which may find that it needs other shaders, and leave out the mesh until they are compiled
  }
  meshes.forEach((mesh, i) => (mesh.material = own[i]))
  return base64(await target.readPixels())
}
