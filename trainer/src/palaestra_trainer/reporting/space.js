"use strict";
/* Draws recorded scenes with WebGL. One hidden canvas draws for all figures, because a browser limits the
   number of WebGL contexts; each figure has a copy of the result. `space` is null without WebGL. */
const space = (() => {
  const VERTEX = `
    attribute vec3 point, normal;
    uniform mat4 eye, body;
    uniform mat3 turn;
    varying vec3 side;
    void main() { side = turn * normal; gl_Position = eye * body * vec4(point, 1.0); }`;
  const FRAGMENT = `
    precision mediump float;
    uniform vec4 color;
    varying vec3 side;
    void main() {
      vec3 n = normalize(side) * (gl_FrontFacing ? 1.0 : -1.0);
      float light = 0.62 + 0.16 * n.z + 0.34 * max(0.0, dot(n, vec3(0.36, -0.48, 0.8)));
      gl_FragColor = vec4(color.rgb * light, color.a);
    }`;
  const ENDLESS_M = 20, FIELD = 0.7, SIDES = 28, RINGS = 10;

  const canvas = document.createElement("canvas");
  const gl = canvas.getContext("webgl", {antialias: true});
  if (!gl) return null;
  let lost = false;
  canvas.addEventListener("webglcontextlost", () => { lost = true; });

  const program = gl.createProgram();
  for (const [kind, text] of [[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, FRAGMENT]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    gl.attachShader(program, shader);
  }
  gl.bindAttribLocation(program, 0, "point");
  gl.bindAttribLocation(program, 1, "normal");
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS)) return null;
  gl.useProgram(program);
  const at = Object.fromEntries(
    ["eye", "body", "turn", "color"].map(name => [name, gl.getUniformLocation(program, name)]));
  gl.enable(gl.DEPTH_TEST);
  gl.enableVertexAttribArray(0);
  gl.enableVertexAttribArray(1);
  gl.blendFuncSeparate(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA, gl.ONE, gl.ONE_MINUS_SRC_ALPHA);

  /* Vectors, and column-major matrices from poses: x, y, z and the quaternion w, i, j, k. */
  const minus = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
  const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  const unit = a => { const length = Math.hypot(...a) || 1; return a.map(one => one / length); };
  function matrix([x, y, z, w, i, j, k]) {
    return [
      1 - 2 * (j * j + k * k), 2 * (i * j + k * w), 2 * (i * k - j * w), 0,
      2 * (i * j - k * w), 1 - 2 * (i * i + k * k), 2 * (j * k + i * w), 0,
      2 * (i * k + j * w), 2 * (j * k - i * w), 1 - 2 * (i * i + j * j), 0, x, y, z, 1];
  }
  function times(a, b) {
    const product = new Array(16).fill(0);
    for (let c = 0; c < 4; c++) for (let r = 0; r < 4; r++) for (let n = 0; n < 4; n++)
      product[4 * c + r] += a[4 * n + r] * b[4 * c + n];
    return product;
  }

  /* Solids of size 1, as triangles: three coordinates and three numbers of the normal for each corner. */
  const corners = (list, ...points) => { for (const [point, normal] of points) list.push(...point, ...normal); };
  function square(list, center, u, v) {
    const normal = unit(cross(u, v));
    const [a, b, c, d] = [[-1, -1], [1, -1], [1, 1], [-1, 1]].map(
      ([p, q]) => [center.map((one, n) => one + (p * u[n] + q * v[n]) / 2), normal]);
    corners(list, a, b, c, a, c, d);
  }
  function box() {
    const list = [];
    for (const sign of [1, -1]) {
      square(list, [0, 0, sign / 2], [1, 0, 0], [0, sign, 0]);
      square(list, [sign / 2, 0, 0], [0, 1, 0], [0, 0, sign]);
      square(list, [0, sign / 2, 0], [0, 0, 1], [sign, 0, 0]);
    }
    return list;
  }
  /* A body of revolution from rings [radius, height, normal's radius, normal's height]. */
  function turned(rings) {
    const list = [];
    for (let r = 0; r + 1 < rings.length; r++) for (let s = 0; s < SIDES; s++) {
      const [a, b, c, d] = [[r, s], [r, s + 1], [r + 1, s + 1], [r + 1, s]].map(([ring, side]) => {
        const [radius, height, out, up] = rings[ring], angle = 2 * Math.PI * side / SIDES;
        const [x, y] = [Math.cos(angle), Math.sin(angle)];
        return [[radius * x, radius * y, height], [out * x, out * y, up]];
      });
      corners(list, a, b, c, a, c, d);
    }
    return list;
  }
  const ball = middle => turned(Array.from({length: 2 * RINGS}, (_, n) => {
    const angle = Math.PI * (n / (2 * RINGS - 1) - 0.5), [out, up] = [Math.cos(angle), Math.sin(angle)];
    return [out / 2, up / 2 + (n < RINGS ? -middle : middle), out, up];
  }));
  const solids = {
    box, plane: () => { const list = []; square(list, [0, 0, 0], [1, 0, 0], [0, 1, 0]); return list; },
    sphere: () => ball(0),
    cylinder: () => turned([
      [0, -0.5, 0, -1], [0.5, -0.5, 0, -1], [0.5, -0.5, 1, 0], [0.5, 0.5, 1, 0], [0.5, 0.5, 0, 1], [0, 0.5, 0, 1]]),
  };
  function mesh({points, triangles}) {
    const list = [];
    for (let n = 0; n + 2 < triangles.length; n += 3) {
      const [a, b, c] = [0, 1, 2].map(one => points.slice(3 * triangles[n + one], 3 * triangles[n + one] + 3));
      const normal = unit(cross(minus(b, a), minus(c, a)));
      corners(list, [a, normal], [b, normal], [c, normal]);
    }
    return list;
  }
  function stored(list) {
    const buffer = gl.createBuffer();
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(list), gl.STATIC_DRAW);
    return {buffer, count: list.length / 6};
  }
  const kept = new Map();
  function solid(name, make) {
    if (!kept.has(name)) kept.set(name, stored(make()));
    return kept.get(name);
  }

  /* A scene as parts to draw; the parts with a transparent color come last. */
  function prepared(scene) {
    const meshes = scene.meshes.map(one => stored(mesh(one))), parts = [];
    scene.nodes.forEach((node, index) => node.shapes.forEach(shape => {
      let [x, y, z] = shape.size, form;
      if (shape.kind === "mesh") form = meshes[shape.mesh];
      else if (shape.kind === "capsule") {
        const middle = Math.max(0, (z / x - 1) / 2);
        form = solid(`capsule ${middle}`, () => ball(Number.isFinite(middle) ? middle : 0));
        z = y = x;
      } else form = solid(shape.kind, solids[shape.kind]);
      if (shape.kind === "plane") [x, y, z] = [x || ENDLESS_M, y || ENDLESS_M, 1];
      parts.push({node: index, form, pose: matrix(shape.pose), size: [x, y, z], color: shape.color});
    }));
    return parts.sort((a, b) => (b.color[3] >= 1) - (a.color[3] >= 1));
  }
  /* The center and the radius of all solids that are not as large as a landscape. */
  function extent(scene) {
    const reach = scene.meshes.map(({points}) => points.reduce((most, one) => Math.max(most, Math.abs(one)), 0));
    let low = [Infinity, Infinity, Infinity], high = low.map(one => -one);
    scene.nodes.forEach(node => node.shapes.forEach(({kind, size, pose, mesh}) => {
      const place = times(matrix(node.pose), matrix(pose));
      const half = size.map(one => one * (kind === "mesh" ? reach[mesh] : 0.5));
      if (kind === "plane" && !(size[0] && size[1]) || Math.max(...half) > 30) return;
      for (let n = 0; n < 3; n++) {
        const wide = half.reduce((sum, one, c) => sum + one * Math.abs(place[4 * c + n]), 0);
        low[n] = Math.min(low[n], place[12 + n] - wide);
        high[n] = Math.max(high[n], place[12 + n] + wide);
      }
    }));
    if (!Number.isFinite(low[0])) [low, high] = [[-2, -2, 0], [2, 2, 1]];
    return {center: low.map((one, n) => (one + high[n]) / 2), radius: Math.hypot(...minus(high, low)) / 2 || 1};
  }
  /* The projection of an eye that looks at the center from a direction, at a distance. */
  function looking({center, radius, azimuth, elevation, away}, aspect) {
    const far = away * radius / Math.sin(FIELD / 2) * Math.max(1, 0.9 / aspect);
    const back = [Math.cos(elevation) * Math.cos(azimuth), Math.cos(elevation) * Math.sin(azimuth), Math.sin(elevation)];
    const right = [-Math.sin(azimuth), Math.cos(azimuth), 0], up = cross(back, right);
    const place = center.map((one, n) => one + far * back[n]);
    const view = [
      right[0], up[0], back[0], 0, right[1], up[1], back[1], 0, right[2], up[2], back[2], 0,
      -dot(right, place), -dot(up, place), -dot(back, place), 1];
    const focus = 1 / Math.tan(FIELD / 2), near = far / 50, end = far * 4 + 4 * radius;
    return times([
      focus / aspect, 0, 0, 0, 0, focus, 0, 0, 0, 0, (end + near) / (near - end), -1, 0, 0, 2 * end * near / (near - end), 0],
      view);
  }
  function paint(part, body) {
    const whole = times(body, part.pose), [x, y, z] = part.size;
    const scale = [x, y, z].map(one => Math.abs(one) > 1e-9 ? one : 1e-9);
    gl.uniformMatrix3fv(at.turn, false, [0, 1, 2].flatMap(c => [0, 1, 2].map(r => whole[4 * c + r] / scale[c])));
    gl.uniformMatrix4fv(at.body, false, whole.map((one, n) => n < 12 ? one * scale[n >> 2] : one));
    gl.uniform4fv(at.color, part.color);
    gl.bindBuffer(gl.ARRAY_BUFFER, part.form.buffer);
    gl.vertexAttribPointer(0, 3, gl.FLOAT, false, 24, 0);
    gl.vertexAttribPointer(1, 3, gl.FLOAT, false, 24, 12);
    gl.drawArrays(gl.TRIANGLES, 0, part.form.count);
  }
  /* Draw parts at the poses of their nodes into a figure's canvas; return whether WebGL still works. */
  function draw(shown, parts, poses, view) {
    const {width, height} = shown;
    if (lost || gl.isContextLost() || !width || !height) return !lost;
    if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
    gl.viewport(0, 0, width, height);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.uniformMatrix4fv(at.eye, false, looking(view, width / height));
    const bodies = poses.map(matrix);
    for (const part of parts) {
      if (part.color[3] < 1) gl.enable(gl.BLEND); else gl.disable(gl.BLEND);
      paint(part, bodies[part.node]);
    }
    const flat = shown.getContext("2d");
    flat.clearRect(0, 0, width, height);
    flat.drawImage(canvas, 0, 0);
    return true;
  }
  return {prepared, extent, draw};
})();
