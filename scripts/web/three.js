// SPDX-License-Identifier: GPL-3.0-or-later
// three.js as a referee: draws a glTF file into linear floats. engines.py says what `load` and `draw` are given.

import * as THREE from "three"
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js"
import { base64 } from "./pixels.js"

const renderer = new THREE.WebGLRenderer() // whose render targets are linear and are neither tone-mapped nor clipped
renderer.setClearColor(0, 0)
let camera, target, lights

const geometry = (shown) => new THREE.ShaderMaterial({
  side: THREE.DoubleSide,
  vertexShader: `varying vec3 shown;
    void main() {
      vec4 world = modelMatrix * vec4(position, 1.0);
      shown = ${shown};
      gl_Position = projectionMatrix * viewMatrix * world;
    }`,
  fragmentShader: `varying vec3 shown;
    void main() { gl_FragColor = vec4(shown, 1.0); }`,
})
const overrides = {
  position: geometry("world.xyz"),
  normal: geometry("(vec4(normalMatrix * normal, 0.0) * viewMatrix).xyz"),
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
  const worn = new Map()
  if (what == "albedo") {
    scene.traverse((mesh) => {
      if (!mesh.isMesh) return
      worn.set(mesh, mesh.material)
      const { color, map, vertexColors, side, alphaTest } = mesh.material
      mesh.material = new THREE.MeshBasicMaterial({ color, map, vertexColors, side, alphaTest })
    })
  }
  scene.overrideMaterial = overrides[what] ?? null
  renderer.setRenderTarget(target)
  renderer.clear()
  renderer.render(scene, camera)
  worn.forEach((material, mesh) => (mesh.material = material))
  const pixels = new Float32Array(4 * target.width * target.height)
  renderer.readRenderTargetPixels(target, 0, 0, target.width, target.height, pixels)
  return base64(pixels)
}
