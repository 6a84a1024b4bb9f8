// SPDX-License-Identifier: GPL-3.0-or-later
// three.js as a referee: draws a glTF file into linear floats. engines.py says what `load` and `draw` are given.

import * as THREE from "three"
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js"
import { base64 } from "./pixels.js"

const renderer = new THREE.WebGLRenderer() // whose render targets are linear and are neither tone-mapped nor clipped
renderer.setClearColor(0, 0)
let camera, target, lights

// In place of a mesh's own material; depths are computed as the engine does, so that the same surface is in front
const geometry = (shown, back = "shown") => ({ side }) => new THREE.ShaderMaterial({
  side,
  vertexShader: `varying vec3 shown;
    void main() {
      shown = ${shown};
      gl_Position = projectionMatrix * (modelViewMatrix * vec4(position, 1.0));
    }`,
  fragmentShader: `varying vec3 shown;
    void main() { gl_FragColor = vec4(gl_FrontFacing ? shown : ${back}, 1.0); }`,
})
const materials = {
  albedo: ({ color, map, vertexColors, side, alphaTest }) => new THREE.MeshBasicMaterial({ color, map, vertexColors, side, alphaTest }),
  position: geometry("(modelMatrix * vec4(position, 1.0)).xyz"),
  normal: geometry("(vec4(normalMatrix * normal, 0.0) * viewMatrix).xyz", "-shown"), // glTF: a back face has the opposite
}

window.load = async ({ file, size, eye, at, degrees, near, far }) => {
  lights = new THREE.Group()
  window.scene = new THREE.Scene().add((await new GLTFLoader().loadAsync(file)).scene, lights)
  camera = new THREE.PerspectiveCamera(degrees, 1, near, far)
  camera.position.set(...eye)
  camera.lookAt(...at)
  target?.dispose()
  target = new THREE.WebGLRenderTarget(size, size, { type: THREE.FloatType, generateMipmaps: false })
}

window.draw = async (what, suns) => {
  lights.clear()
  for (const { direction, irradiance } of suns) {
    // The intensity is E0, as the BRDF of white is 1 / pi
    const light = new THREE.DirectionalLight(new THREE.Color(...irradiance), 1)
    light.position.set(...direction) // towards it; the light's target is the origin
    lights.add(light)
  }
  const own = new Map()
  if (what in materials) {
    scene.traverse((mesh) => {
      if (!mesh.isMesh) return
      own.set(mesh, mesh.material)
      mesh.material = materials[what](mesh.material)
    })
  }
  renderer.setRenderTarget(target)
  renderer.clear()
  renderer.render(scene, camera)
  own.forEach((material, mesh) => (mesh.material = material))
  const pixels = new Float32Array(4 * target.width * target.height)
  renderer.readRenderTargetPixels(target, 0, 0, target.width, target.height, pixels)
  return base64(pixels)
}
