// SPDX-License-Identifier: GPL-3.0-or-later
// three.js as a competitor: times frames of a glTF file. scripts/studies/competitors.py says what `load` is given.

import * as THREE from "three"
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js"
import { setReflectance } from "/shaders/engines/three.js"
import { base64 } from "./pixels.js"

const renderer = new THREE.WebGLRenderer() // whose canvas is in no document, so that no frame of it is put into a window
const gl = renderer.getContext()
let scene, camera, materials

window.driver = () => gl.getParameter(gl.getExtension("WEBGL_debug_renderer_info").UNMASKED_RENDERER_WEBGL)

window.load = async ({ file, size, projection, camera: place, suns, shadows, middle, radius, sky, models }) => {
  scene = new THREE.Scene().add((await new GLTFLoader().loadAsync(file)).scene)
  renderer.setSize(...size)
  renderer.shadowMap.enabled = shadows
  renderer.shadowMap.autoUpdate = false // nothing moves
  camera = new THREE.PerspectiveCamera()
  camera.matrixAutoUpdate = false
  camera.matrix.fromArray(place)
  camera.matrixWorldNeedsUpdate = true
  camera.projectionMatrix.fromArray(projection)
  camera.projectionMatrixInverse.copy(camera.projectionMatrix).invert()
  scene.add(new THREE.AmbientLight(0xffffff, Math.PI * sky))
  scene.background = new THREE.Color(sky, sky, sky)
  for (const { direction, irradiance } of suns) {
    const light = new THREE.DirectionalLight(0xffffff, irradiance)
    light.target.position.set(...middle)
    light.position.set(...direction).setLength(2 * radius).add(light.target.position)
    if (shadows) {
      light.castShadow = true
      light.shadow.mapSize.setScalar(4096 / Math.ceil(Math.sqrt(suns.length))) // all together as large as Realtime's
      light.shadow.normalBias = 0.02
      Object.assign(light.shadow.camera, { left: -radius, right: radius, bottom: -radius, top: radius, near: 0, far: 4 * radius })
    }
    scene.add(light, light.target)
  }
  materials = new Map()
  scene.traverse((mesh) => {
    if (!mesh.isMesh) return
    mesh.castShadow = mesh.receiveShadow = shadows
    const file = mesh.material
    const reflectance = file.clone()
    const { model, text, parameters } = models[file.name] ?? models["Lambert"]
    setReflectance(reflectance, model, text, parameters)
    const { color, vertexColors, side } = file
    materials.set(mesh, { file, reflectance, lambert: new THREE.MeshLambertMaterial({ color, vertexColors, side }) })
  })
}

function use(name) {
  materials.forEach((all, mesh) => (mesh.material = all[name]))
}

// Draws `count` frames and returns the seconds until the last one is there.
window.framesOf = (name, count) => {
  use(name)
  renderer.shadowMap.needsUpdate = count === 1
  const pixel = new Uint8Array(4)
  const wait = () => gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel)
  wait()
  const start = performance.now()
  for (let k = 0; k < count; k++) {
    renderer.render(scene, camera)
    wait()
  }
  return (performance.now() - start) / 1000
}

// Returns the linear colors of all pixels.
window.pixelsOf = (name) => {
  use(name)
  const target = new THREE.WebGLRenderTarget(renderer.domElement.width, renderer.domElement.height, { type: THREE.FloatType })
  renderer.setRenderTarget(target)
  renderer.render(scene, camera)
  const pixels = new Float32Array(4 * target.width * target.height)
  renderer.readRenderTargetPixels(target, 0, 0, target.width, target.height, pixels)
  renderer.setRenderTarget(null)
  target.dispose()
  return base64(pixels)
}
