// SPDX-License-Identifier: GPL-3.0-or-later
// The program of page.html. Axes: x right, y up, z to the viewer; lengths in meters, angles in degrees but sigma, which is in radians.

const data = JSON.parse(document.getElementById("data").textContent);
const element = (id) => document.getElementById(id);
const stage = element("stage"), canvas = element("canvas"), controls = element("controls");
const DRAWN = { picture: 0, error: 1, radiance: 2, other: 3, normal: 4, view: 5, albedo: 6 }; // of surface_fragment.glsl
const SHADOW_SIZE = 2048, MOST_PIXELS = 2; // for each of the page's, where the screen has more
const NARROWEST = 112; // pixels of a view, for the caption on one line
const NEAREST = 12, FARTHEST = 0.4, STEEPEST = 85;
const encode = (x) => (x > 0.0031308 ? 1.055 * x ** (1 / 2.4) - 0.055 : 12.92 * x); // in sRGB
const degrees = (radians) => (radians * 180) / Math.PI;
const radians = (degrees) => (degrees * Math.PI) / 180;

function fail(text) {
  element("message").textContent = text;
  element("message").hidden = false;
  stage.hidden = controls.hidden = element("hint").hidden = true;
}

// ---- The character, as geometry.py packs it

async function unpacked(mesh) {
  const packed = Uint8Array.from(atob(mesh.data), (letter) => letter.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
  const bytes = new Uint8Array(await new Response(stream).arrayBuffer());
  const columns = new Uint16Array(10 * mesh.vertices); // vertex by vertex
  let at = 0;
  for (let column = 0; column < 10; column++, at += 2 * mesh.vertices) {
    for (let k = 0, value = 0; k < mesh.vertices; k++) {
      const code = bytes[at + k] | (bytes[at + mesh.vertices + k] << 8);
      value += code & 1 ? -(code + 1) / 2 : code / 2;
      columns[10 * k + column] = value;
    }
  }
  const indices = new Uint32Array(mesh.indices);
  for (let k = 0, following = 0; k < mesh.indices; k++) {
    const below = bytes[at + k] | (bytes[at + mesh.indices + k] << 8) | (bytes[at + 2 * mesh.indices + k] << 16);
    indices[k] = following - below;
    following += below === 0;
  }
  return { columns, indices };
}

// ---- Drawing

class Program {
  constructor(gl, [vertex, fragment]) {
    this.gl = gl;
    this.program = gl.createProgram();
    for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      gl.attachShader(this.program, shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS) && !gl.isContextLost()) throw Error(gl.getShaderInfoLog(shader));
    }
    gl.linkProgram(this.program);
    if (!gl.getProgramParameter(this.program, gl.LINK_STATUS) && !gl.isContextLost()) throw Error(gl.getProgramInfoLog(this.program));
    this.places = {};
  }

  /** Use it, with these uniforms by name, each with what WebGL calls its type. */
  use(uniforms) {
    const { gl, program, places } = this;
    gl.useProgram(program);
    for (const [name, [type, value]] of Object.entries(uniforms)) {
      places[name] ??= gl.getUniformLocation(program, name);
      if (type.startsWith("Matrix")) gl[`uniform${type}`](places[name], false, value);
      else gl[`uniform${type}`](places[name], value);
    }
  }
}

function direction(azimuth, elevation) {
  const [a, e] = [radians(azimuth), radians(elevation)];
  return [Math.sin(a) * Math.cos(e), Math.sin(e), Math.cos(a) * Math.cos(e)];
}

/** The columns of the rotation of a character whose camera goes around it: by yaw around y, then by pitch around x. */
function turn(yaw, pitch) {
  const [cy, sy, cp, sp] = [Math.cos(yaw), Math.sin(yaw), Math.cos(pitch), Math.sin(pitch)];
  return [cy, sp * sy, -cp * sy, 0, cp, sp, sy, -sp * cy, cp * cy];
}

const turned = (m, v) => [0, 1, 2].map((row) => m[row] * v[0] + m[3 + row] * v[1] + m[6 + row] * v[2]);

/** The roughness of the EON that comes nearest to Oren-Nayar: two polynomials in sigma^2, one over the other. */
function eonRoughness(sigma) {
  const [above, below] = [data.eon.above, data.eon.below].map((each) => each.reduceRight((sum, x) => sum * sigma * sigma + x, 0));
  return Math.min(above / below, 1);
}

/** Pixels per meter at which a view of so many pixels shows the frame. */
const fitting = (width, height) => Math.min(width / data.frame.width, height / data.frame.height);

/** Where the pivot is in a view, from -1 at the bottom to 1: so that busts have what is spare below them, and figures around them.
    Nearer, it comes to the middle. */
function raised(width, height, zoom) {
  const { top, height: shown, pivot } = data.frame, perMeter = fitting(width, height);
  const spare = top - shown > 0 ? 0 : height - perMeter * shown;
  return (1 - (spare + 2 * perMeter * (top - pivot)) / height) / Math.max(zoom, 1);
}

class Scene {
  constructor(gl, { columns, indices }, images) {
    const { mesh, scale } = data;
    this.gl = gl;
    this.surface = new Program(gl, data.shaders.surface);
    this.shadow = new Program(gl, data.shaders.shadow);
    this.hasFloats = gl.getExtension("EXT_color_buffer_float") !== null;
    gl.bindVertexArray(gl.createVertexArray());
    gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ARRAY_BUFFER, columns, gl.STATIC_DRAW);
    for (const [place, size, offset] of [[0, 3, 0], [1, 2, 6], [2, 3, 10], [3, 2, 16]]) {
      gl.enableVertexAttribArray(place);
      gl.vertexAttribPointer(place, size, gl.UNSIGNED_SHORT, true, 20, offset);
    }
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, indices, gl.STATIC_DRAW);
    gl.enable(gl.DEPTH_TEST);
    gl.enable(gl.SCISSOR_TEST);

    const size = mesh.high.map((high, k) => high - mesh.low[k]);
    this.bounds = { low: ["3fv", mesh.low], size: ["3fv", size], uv_bounds: ["2fv", mesh.uv], image: ["1i", 0] };
    this.middle = mesh.low.map((low, k) => low + size[k] / 2);
    this.reach = Math.hypot(...size) / 2 + Math.abs(this.middle[1] - data.frame.pivot) + Math.hypot(this.middle[0], this.middle[2]);
    this.fixed = {
      ...this.bounds,
      pivot: ["3fv", [0, data.frame.pivot, 0]],
      far: ["1f", data.frame.far],
      reach: ["1f", this.reach],
      irradiance: ["1f", data.irradiance],
      b_average: ["1f", data.eon.b_average],
      nearest: ["1i", 1],
      diverging: ["3fv", scale.colors.flat().map((x) => x / 255)],
      not_measured: ["3fv", scale.not_measured.map((x) => x / 255)],
      luminance_weights: ["3fv", scale.luminance],
      knee: ["1f", scale.knee],
    };
    gl.pixelStorei(gl.UNPACK_FLIP_Y_WEBGL, true); // Blender's images begin at the bottom
    gl.pixelStorei(gl.UNPACK_COLORSPACE_CONVERSION_WEBGL, gl.NONE);
    this.images = images.map((image) => {
      const texture = gl.createTexture();
      gl.bindTexture(gl.TEXTURE_2D, texture);
      gl.texImage2D(gl.TEXTURE_2D, 0, gl.SRGB8_ALPHA8, gl.RGBA, gl.UNSIGNED_BYTE, image);
      gl.generateMipmap(gl.TEXTURE_2D);
      gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.LINEAR_MIPMAP_LINEAR);
      return texture;
    });
    this.depth = gl.createTexture();
    gl.activeTexture(gl.TEXTURE1);
    gl.bindTexture(gl.TEXTURE_2D, this.depth);
    gl.texStorage2D(gl.TEXTURE_2D, 1, gl.DEPTH_COMPONENT24, SHADOW_SIZE, SHADOW_SIZE);
    for (const filter of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, filter, gl.LINEAR);
    for (const wrap of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(gl.TEXTURE_2D, wrap, gl.CLAMP_TO_EDGE);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_COMPARE_MODE, gl.COMPARE_REF_TO_TEXTURE);
    this.shadowBuffer = gl.createFramebuffer();
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.shadowBuffer);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.TEXTURE_2D, this.depth, 0);
    gl.drawBuffers([gl.NONE]);
    this.floatBuffer = gl.createFramebuffer();
    this.floatSize = [0, 0];
    this.shadowed = "";
  }

  triangles(program, uniforms) {
    const { gl } = this;
    program.use(uniforms);
    gl.activeTexture(gl.TEXTURE0);
    for (const { image, first, count } of data.mesh.runs) {
      program.use({ has_image: ["1i", image !== null] });
      gl.bindTexture(gl.TEXTURE_2D, this.images[image] ?? null);
      gl.drawElements(gl.TRIANGLES, count, gl.UNSIGNED_INT, 4 * first);
    }
  }

  window(x, y, width, height) {
    this.gl.viewport(x, y, width, height);
    this.gl.scissor(x, y, width, height);
  }

  /** Draw what is nearest to the light, where that has moved; it shows all there is of the character. */
  drawShadow(light) {
    if (this.shadowed === String(light)) return;
    this.shadowed = String(light);
    const { gl, middle } = this;
    const radius = Math.hypot(...this.bounds.size[1]) / 2;
    const across = Math.hypot(light[0], light[2]) > 1e-6 ? [light[2], 0, -light[0]] : [1, 0, 0];
    const right = across.map((x) => x / Math.hypot(...across));
    const up = [0, 1, 2].map((k) => light[(k + 1) % 3] * right[(k + 2) % 3] - light[(k + 2) % 3] * right[(k + 1) % 3]);
    const rows = [right, up, light.map((x) => -x)].map((row) => row.map((x) => x / radius));
    this.toLight = [0, 1, 2].flatMap((k) => [...rows.map((row) => row[k]), 0]);
    this.toLight.push(...rows.map((row) => -row.reduce((sum, x, k) => sum + x * middle[k], 0)), 1);
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.shadowBuffer);
    this.window(0, 0, SHADOW_SIZE, SHADOW_SIZE);
    gl.clear(gl.DEPTH_BUFFER_BIT);
    this.triangles(this.shadow, { ...this.bounds, to_light: ["Matrix4fv", this.toLight] });
  }

  /** Draw a look into the window that is set, `width` and `height` [pixels]. */
  draw(look, state, drawn, width, height) {
    const { gl } = this;
    const light = direction(state.azimuth, state.elevation), rotation = turn(radians(state.yaw), radians(state.pitch));
    const perMeter = state.zoom * fitting(width, height), [x, y] = state.shift;
    this.triangles(this.surface, {
      ...this.fixed,
      drawn: ["1i", drawn],
      model: ["1i", look.model],
      sigma: ["1f", look.sigma ?? 0],
      is_eon: ["1i", state.show === "eon"],
      roughness: ["1f", eonRoughness(look.sigma ?? 0)],
      highlight: ["2fv", look.highlight ?? [0, 0]],
      light: ["3fv", turned(rotation, light)],
      sky: ["1f", state.sky ? data.sky : 0],
      turn: ["Matrix3fv", rotation],
      scale: ["2fv", [(2 * perMeter) / width, (2 * perMeter) / height]],
      shift: ["2fv", [x, y + raised(width, height, state.zoom)]],
      has_shadows: ["1i", state.shadows],
      to_light: ["Matrix4fv", this.toLight],
    });
  }

  /** Return what is `drawn` of a look as 32-bit floats: red, green, blue, and 1 where a pixel is seen and lit, from the bottom left. */
  pixels(look, state, drawn, width, height) {
    const { gl } = this;
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.floatBuffer);
    if (String(this.floatSize) !== String([width, height])) {
      this.floatSize = [width, height];
      for (const [place, format] of [[gl.COLOR_ATTACHMENT0, gl.RGBA32F], [gl.DEPTH_ATTACHMENT, gl.DEPTH_COMPONENT24]]) {
        const buffer = gl.createRenderbuffer();
        gl.deleteRenderbuffer(gl.getFramebufferAttachmentParameter(gl.FRAMEBUFFER, place, gl.FRAMEBUFFER_ATTACHMENT_OBJECT_NAME));
        gl.bindRenderbuffer(gl.RENDERBUFFER, buffer);
        gl.renderbufferStorage(gl.RENDERBUFFER, format, width, height);
        gl.framebufferRenderbuffer(gl.FRAMEBUFFER, place, gl.RENDERBUFFER, buffer);
      }
    }
    this.window(0, 0, width, height);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    this.draw(look, state, drawn, width, height);
    const values = new Float32Array(4 * width * height);
    gl.readPixels(0, 0, width, height, gl.RGBA, gl.FLOAT, values);
    return values;
  }

  /** Return sqrt(sum (L - Lref)^2 / sum Lref^2) of what stands in for a look, over its pixels that are seen and lit. */
  error(look, state, width, height) {
    const reference = this.pixels(look, state, DRAWN.radiance, width, height);
    const other = this.pixels(look, state, DRAWN.other, width, height);
    let squares = 0, total = 0;
    for (let k = 0; k < reference.length; k++) {
      if (k % 4 === 3 || reference[k | 3] === 0) continue;
      squares += (other[k] - reference[k]) ** 2;
      total += reference[k] ** 2;
    }
    return total > 0 ? Math.sqrt(squares / total) : NaN;
  }
}

// ---- The page

const [x, y, z] = data.light;
const initial = {
  yaw: 0, pitch: 0, zoom: 1, shift: [0, 0], show: "picture", shadows: true, sky: true,
  azimuth: degrees(Math.atan2(x, z)), elevation: degrees(Math.asin(y)), sigma: data.looks.at(-1).sigma,
};
const state = { ...initial };
const looks = () => [...data.looks.slice(0, -1), { ...data.looks.at(-1), sigma: state.sigma }];
const digits = (x) => Number(x.toFixed(4));
const label = (look) => look.label.replace(/=.*/, `= ${digits(look.sigma ?? 0)}`);
const percent = (x) => (Number.isNaN(x) ? "\u2013" : `${(100 * x).toFixed(x < 0.1 ? 2 : 1)} %`);
const marked = (x) => (x === 0 ? "0" : `${x < 0 ? "\u2212" : "+"}${Math.abs(100 * x)} %`);
const aside = (x, before, after) => {
  const whole = Math.round(Math.abs(x));
  return whole ? `${whole}\u00b0 ${x < 0 ? before : after}` : "0\u00b0";
};
const NAMES = { lambert: "Lambert", eon: "The EON that glTF carries" };

const views = data.looks.map((look) => {
  const figure = document.createElement("figure");
  figure.innerHTML = '<div class="view"></div><figcaption><span></span><output></output></figcaption>';
  element("views").append(figure);
  return figure;
});
{
  const colors = data.scale.colors.map((color) => `rgb(${color})`);
  element("bar").style.background = `linear-gradient(to right, ${colors})`;
  for (const [mark, place] of data.scale.marks) {
    const span = document.createElement("span");
    span.textContent = marked(mark);
    span.style.left = `${50 + 50 * place}%`;
    element("marks").append(span);
  }
}

/** Have as many views in a row as show the characters largest. */
function arrange() {
  const { clientWidth: width, clientHeight: height } = stage;
  const caption = views[0].querySelector("figcaption").offsetHeight, count = views.length;
  let best = 0;
  for (let columns = 1; columns <= Math.max(1, Math.min(count, width / NARROWEST)); columns++) {
    const rows = Math.ceil(count / columns);
    const perMeter = fitting(width / columns, height / rows - caption);
    if (perMeter <= best) continue;
    best = perMeter;
    for (const view of views) [view.style.width, view.style.height] = [`${100 / columns}%`, `${100 / rows}%`];
  }
}

/** Show the state in the controls and captions. */
function write() {
  const { elements } = controls;
  elements.show.value = state.show;
  for (const name of ["shadows", "sky"]) elements[name].checked = state[name];
  const texts = {
    sigma: `${digits(state.sigma)} rad`,
    azimuth: aside(state.azimuth, "left", "right"),
    elevation: aside(state.elevation, "below", "above"),
  };
  for (const [name, text] of Object.entries(texts)) {
    elements[name].value = state[name];
    elements[name].setAttribute("aria-valuetext", text);
    controls.querySelector(`output[for=${name}]`).value = text;
  }
  const isError = state.show !== "picture";
  element("legend").hidden = !isError;
  element("compared").textContent = NAMES[state.show] ?? "";
  for (const name of ["shadows", "sky"]) elements[name].disabled = isError;
  looks().forEach((look, k) => (views[k].querySelector("span").textContent = label(look)));
  for (const view of views) {
    const output = view.querySelector("output");
    output.hidden = !isError;
    if (stage.dataset.show !== state.show) output.value = "\u2026"; // until it is measured
  }
  stage.dataset.show = state.show;
}

function draw(gl, scene) {
  const ratio = Math.min(devicePixelRatio, MOST_PIXELS), place = stage.getBoundingClientRect();
  const width = Math.round(place.width * ratio), height = Math.round(place.height * ratio);
  if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
  scene.drawShadow(direction(state.azimuth, state.elevation));
  gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  scene.window(0, 0, width, height);
  gl.clearColor(0, 0, 0, 0);
  gl.clear(gl.COLOR_BUFFER_BIT);
  const back = state.show === "picture" ? Array(3).fill(backdrop()) : data.scale.not_measured.map((x) => x / 255);
  gl.clearColor(...back, 1);
  looks().forEach((look, k) => {
    const [left, top, wide, high] = inside(views[k], place).map((x) => Math.round(x * ratio));
    scene.window(left, height - top - high, wide, high);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    scene.draw(look, state, state.show === "picture" ? DRAWN.picture : DRAWN.error, wide, high);
  });
}

/** The sRGB gray of the wall behind the characters, as Lambert has it under the light where it stands at first. */
function backdrop() {
  return encode(data.background * ((data.irradiance / Math.PI) * data.light[2] + data.sky));
}

/** Where a view is on the stage: left, top, width, height. */
function inside(view, place) {
  const own = view.querySelector(".view").getBoundingClientRect();
  return [own.left - place.left, own.top - place.top, own.width, own.height];
}

function measure(scene) {
  const [, , width, height] = inside(views[0], stage.getBoundingClientRect()).map(Math.round);
  looks().forEach((look, k) => {
    views[k].querySelector("output").value = scene.hasFloats ? percent(scene.error(look, state, width, height)) : "not measured here";
  });
  stage.ariaBusy = "false";
}

function listen(changed) {
  const pointers = new Map();
  const size = () => inside(views[0], stage.getBoundingClientRect()).slice(2);
  const rotate = (x, y) => {
    state.yaw += x;
    state.pitch = Math.max(-STEEPEST, Math.min(STEEPEST, state.pitch + y));
  };
  const move = (x, y) => {
    const [width, height] = size();
    state.shift = [state.shift[0] + (2 * x) / width, state.shift[1] - (2 * y) / height];
  };
  /** Zoom around a point of the page, or the pivot. */
  const zoom = (factor, x, y) => {
    const [width, height] = size(), before = state.zoom, rise = () => raised(width, height, state.zoom);
    const view = views.map((each) => each.querySelector(".view").getBoundingClientRect())
      .find((own) => x >= own.left && x < own.right && y >= own.top && y < own.bottom);
    const [across, up] = [state.shift[0], state.shift[1] + rise()]; // where the pivot is
    state.zoom = Math.max(FARTHEST, Math.min(NEAREST, state.zoom * factor));
    if (!view) return;
    const kept = [(2 * (x - view.left)) / width - 1, 1 - (2 * (y - view.top)) / height];
    const [a, b] = [across, up].map((each, k) => kept[k] + ((each - kept[k]) * state.zoom) / before);
    state.shift = [a, b - rise()];
  };
  /** How far two fingers are apart, and the point between them. */
  const fingers = () => {
    const [a, b] = [...pointers.values()];
    return [Math.hypot(a.clientX - b.clientX, a.clientY - b.clientY), (a.clientX + b.clientX) / 2, (a.clientY + b.clientY) / 2];
  };
  stage.addEventListener("pointerdown", (event) => {
    stage.setPointerCapture(event.pointerId);
    pointers.set(event.pointerId, event);
  });
  for (const name of ["pointerup", "pointercancel"]) stage.addEventListener(name, (event) => pointers.delete(event.pointerId));
  stage.addEventListener("pointermove", (event) => {
    const before = pointers.get(event.pointerId);
    if (!before) return;
    const x = event.clientX - before.clientX, y = event.clientY - before.clientY, many = pointers.size > 1;
    const apart = many ? fingers()[0] : 1;
    pointers.set(event.pointerId, event);
    if (many) {
      const [now, ...middle] = fingers();
      zoom(now / (apart || 1), ...middle);
    }
    if (many || event.shiftKey || event.buttons > 1) move(x / pointers.size, y / pointers.size);
    else rotate(0.5 * x, 0.5 * y);
    changed();
  });
  stage.addEventListener("contextmenu", (event) => event.preventDefault());
  stage.addEventListener("wheel", (event) => {
    event.preventDefault();
    zoom(Math.exp(-event.deltaY * (event.deltaMode ? 0.05 : 0.0015)), event.clientX, event.clientY);
    changed();
  }, { passive: false });
  stage.addEventListener("keydown", (event) => {
    const arrows = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
    const arrow = arrows[event.key];
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    if (arrow && event.shiftKey) move(12 * arrow[0], 12 * arrow[1]);
    else if (arrow) rotate(5 * arrow[0], 5 * arrow[1]);
    else if (event.key === "+" || event.key === "=") zoom(1.15);
    else if (event.key === "-") zoom(1 / 1.15);
    else if (event.key === "0") Object.assign(state, { yaw: 0, pitch: 0, zoom: 1, shift: [0, 0] });
    else return;
    event.preventDefault();
    changed();
  });
  controls.addEventListener("input", ({ target }) => {
    state[target.name || target.id] = target.type === "range" ? target.valueAsNumber : target.type === "radio" ? target.value : target.checked;
    changed();
  });
  controls.addEventListener("submit", (event) => event.preventDefault());
  controls.addEventListener("reset", (event) => {
    event.preventDefault(); // the state is what the controls show
    Object.assign(state, initial);
    changed();
  });
  new ResizeObserver(changed).observe(stage);
}

async function start() {
  const gl = canvas.getContext("webgl2", { antialias: true });
  if (!gl) return fail("This page draws with WebGL 2, which this browser lacks or has turned off. Most browsers since 2022 have it.");
  if (!("DecompressionStream" in window)) return fail("This browser is too old for this page: it lacks DecompressionStream.");
  canvas.addEventListener("webglcontextlost", () => fail("The graphics driver has stopped. Load this page again to go on."));
  const images = data.images.map((source) => Object.assign(new Image(), { src: source }));
  await Promise.all(images.map((image) => image.decode()));
  const scene = new Scene(gl, await unpacked(data.mesh), images);
  let asked = 0, measuring = 0;
  const show = () => {
    asked = 0;
    write();
    arrange();
    draw(gl, scene);
    clearTimeout(measuring);
    if (state.show !== "picture") measuring = setTimeout(() => measure(scene), 60);
    else stage.ariaBusy = "false";
  };
  /** For tests: the state of the page, and what is drawn of the look `k`, as numbers. */
  window.viewer = { state, pixels: (k, drawn, width, height) => scene.pixels(looks()[k], state, DRAWN[drawn], width, height) };
  listen(() => {
    stage.ariaBusy = "true";
    asked ||= requestAnimationFrame(show);
  });
  show();
}

start().catch((error) => {
  console.error(error);
  fail(`This page cannot draw: ${error.message}`);
});
