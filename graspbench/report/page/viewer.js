// The interactive view of a trial: WebGL, no library. Drag turns, two fingers or the wheel zoom, right drag moves.
const LOOKS = {
  surface: [.55, .70, .86], hand: [.48, .51, .56], contact: [.72, .03, .15], centroid: [.1, .1, .1],
  via: [.98, .90, .25], approach: [0, .52, .38], grasp: [.72, .03, .15], ground: [.75, .77, .78],
};

const VERTEX = `attribute vec3 position; attribute vec3 normal; uniform mat4 view; uniform mat4 projection;
varying vec3 facing; varying vec3 place;
void main() { vec4 p = view * vec4(position, 1.); place = p.xyz; facing = mat3(view) * normal; gl_Position = projection * p; }`;
const FRAGMENT = `precision mediump float; varying vec3 facing; varying vec3 place; uniform vec4 color;
void main() { vec3 n = normalize(facing), eye = normalize(-place); if (dot(n, eye) < 0.) n = -n;
  vec3 light = normalize(vec3(-.45, .6, .7)); float d = max(dot(n, light), 0.);
  float s = pow(max(dot(n, normalize(light + eye)), 0.), 40.);
  gl_FragColor = vec4(color.rgb * (.42 + .22 * max(dot(n, eye), 0.) + .45 * d) + .15 * s, color.a); }`;

function bytes(text) { return Uint8Array.from(atob(text), c => c.charCodeAt(0)).buffer; }

/** A stored mesh as flat arrays in the world. */
function unpackMesh(mesh, shared) {
  const own = name => typeof mesh[name] === "string" ? shared[mesh[name]] : mesh[name];
  const packed = own("points"), steps = new Uint16Array(bytes(packed.data));
  const points = new Float32Array(steps.length), faces = new Uint16Array(bytes(own("faces")));
  for (let i = 0; i < steps.length; i += 3) {
    const p = [0, 1, 2].map(k => packed.low[k] + steps[i + k] * packed.step[k]);
    for (let k = 0; k < 3; k++) {
      const row = mesh.pose && mesh.pose[k];
      points[i + k] = row ? row[0] * p[0] + row[1] * p[1] + row[2] * p[2] + row[3] : p[k];
    }
  }
  return { points, faces };
}

function normalsOf(points, faces) {
  const normals = new Float32Array(points.length);
  for (let f = 0; f < faces.length; f += 3) {
    const [a, b, c] = [3 * faces[f], 3 * faces[f + 1], 3 * faces[f + 2]];
    const u = [0, 1, 2].map(k => points[b + k] - points[a + k]), v = [0, 1, 2].map(k => points[c + k] - points[a + k]);
    const n = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
    for (const corner of [a, b, c]) for (let k = 0; k < 3; k++) normals[corner + k] += n[k];
  }
  return normals;
}

function ball(centre, radius) {
  const points = [], faces = [], m = 14, n = 8;
  for (let i = 0; i <= n; i++) for (let j = 0; j < m; j++) {
    const t = Math.PI * i / n, p = 2 * Math.PI * j / m;
    points.push(centre[0] + radius * Math.sin(t) * Math.cos(p), centre[1] + radius * Math.sin(t) * Math.sin(p), centre[2] + radius * Math.cos(t));
    if (i < n) {
      const a = i * m + j, b = i * m + (j + 1) % m;
      faces.push(a, a + m, b, b, a + m, b + m);
    }
  }
  return { points, faces };
}

function tube(line, radius, end = radius) {
  const points = [], faces = [], m = 8;
  for (let i = 0; i < line.length; i++) {
    const a = line[Math.max(i - 1, 0)], b = line[Math.min(i + 1, line.length - 1)];
    const along = unit([0, 1, 2].map(k => b[k] - a[k])), other = Math.abs(along[2]) < .9 ? [0, 0, 1] : [1, 0, 0];
    const side = unit(cross(along, other)), up = cross(along, side), r = radius + (end - radius) * i / (line.length - 1 || 1);
    for (let j = 0; j < m; j++) {
      const c = r * Math.cos(2 * Math.PI * j / m), s = r * Math.sin(2 * Math.PI * j / m);
      for (let k = 0; k < 3; k++) points.push(line[i][k] + c * side[k] + s * up[k]);
      if (i + 1 < line.length) {
        const p = i * m + j, q = i * m + (j + 1) % m;
        faces.push(p, q, p + m, q, q + m, p + m);
      }
    }
  }
  return { points, faces };
}

function cross(a, b) { return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]; }
function unit(a) { const n = Math.hypot(...a) || 1; return a.map(v => v / n); }

/** All bodies of a trial: what, its layer, its colour. */
function bodiesOf(geometry, shared) {
  const bodies = [], add = (layer, look, mesh, alpha = 1) => bodies.push({ layer, color: [...LOOKS[look], alpha], ...mesh });
  for (const mesh of geometry.meshes || []) add(mesh.role, mesh.role, unpackMesh(mesh, shared));
  for (const { point, normal } of geometry.contacts || []) {
    add("contacts", "contact", ball(point, .0045));
    const tip = k => point.map((v, i) => v + k * normal[i]);
    add("contacts", "contact", tube([tip(.035), tip(.014)], .0013));
    add("contacts", "contact", tube([tip(.014), tip(.003)], .0036, 0));
  }
  if (geometry.centroid) add("contacts", "centroid", ball(geometry.centroid, .005));
  for (const path of geometry.paths || []) {
    for (const point of path.via) add("paths", "via", ball(point, .0028));
    if (path.approach.length > 1) add("paths", "approach", tube(path.approach, .0014));
    if (path.grasp.length > 1) add("paths", "grasp", tube(path.grasp, .0014));
  }
  return bodies;
}

class Viewer {
  constructor(canvas) {
    this.canvas = canvas;
    this.gl = canvas.getContext("webgl", { antialias: true, preserveDrawingBuffer: true });
    if (!this.gl) return;
    const gl = this.gl, program = this.program = gl.createProgram();
    for (const [kind, source] of [[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, FRAGMENT]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, source);
      gl.compileShader(shader);
      gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    this.hidden = new Set();
    this.listen();
  }

  show(geometry, shared) {
    const gl = this.gl;
    if (!gl) return;
    for (const body of this.bodies || []) for (const buffer of Object.values(body.buffers)) gl.deleteBuffer(buffer);
    this.bodies = bodiesOf(geometry, shared);
    const low = [1e9, 1e9, 1e9], high = [-1e9, -1e9, -1e9];
    for (const body of this.bodies) if (body.layer !== "hand") for (let i = 0; i < body.points.length; i++) {
      low[i % 3] = Math.min(low[i % 3], body.points[i]); high[i % 3] = Math.max(high[i % 3], body.points[i]);
    }
    this.target = low.map((v, k) => (v + high[k]) / 2);
    const radius = Math.max(Math.hypot(...low.map((v, k) => high[k] - v)) / 2, .03);
    Object.assign(this, { turn: -.9, tilt: .42, distance: 3.4 * radius, shift: [0, 0] });
    if (geometry.ground_m !== undefined) {
      const r = 1.9 * radius, [x, y] = this.target, z = geometry.ground_m - .0005;
      this.bodies.push({ layer: "table", color: [...LOOKS.ground, .45], points: [x - r, y - r, z, x + r, y - r, z, x + r, y + r, z, x - r, y + r, z], faces: [0, 1, 2, 0, 2, 3] });
    }
    for (const body of this.bodies) {
      const load = (kind, data) => { const b = gl.createBuffer(); gl.bindBuffer(kind, b); gl.bufferData(kind, data, gl.STATIC_DRAW); return b; };
      body.buffers = {
        points: load(gl.ARRAY_BUFFER, new Float32Array(body.points)),
        normals: load(gl.ARRAY_BUFFER, normalsOf(body.points, body.faces)),
        faces: load(gl.ELEMENT_ARRAY_BUFFER, new Uint16Array(body.faces)),
      };
    }
    this.draw();
  }

  toggle(layer, visible) { visible ? this.hidden.delete(layer) : this.hidden.add(layer); this.draw(); }

  draw() {
    const gl = this.gl, canvas = this.canvas, ratio = Math.min(devicePixelRatio || 1, 2);
    canvas.width = canvas.clientWidth * ratio || 640; canvas.height = canvas.clientHeight * ratio || 480;
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST); gl.enable(gl.BLEND);
    gl.blendFuncSeparate(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA, gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    gl.useProgram(this.program);
    const at = name => gl.getUniformLocation(this.program, name);
    gl.uniformMatrix4fv(at("view"), false, this.viewMatrix());
    gl.uniformMatrix4fv(at("projection"), false, this.projectionMatrix());
    for (const body of this.bodies) {
      if (this.hidden.has(body.layer)) continue;
      gl.uniform4fv(at("color"), body.color);
      for (const name of ["position", "normal"]) {
        const slot = gl.getAttribLocation(this.program, name);
        gl.bindBuffer(gl.ARRAY_BUFFER, name === "position" ? body.buffers.points : body.buffers.normals);
        gl.enableVertexAttribArray(slot);
        gl.vertexAttribPointer(slot, 3, gl.FLOAT, false, 0, 0);
      }
      gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, body.buffers.faces);
      gl.drawElements(gl.TRIANGLES, body.faces.length, gl.UNSIGNED_SHORT, 0);
    }
  }

  viewMatrix() {
    const [ct, st, ce, se] = [Math.cos(this.turn), Math.sin(this.turn), Math.cos(this.tilt), Math.sin(this.tilt)];
    const right = [-st, ct, 0], up = [-se * ct, -se * st, ce], back = [ce * ct, ce * st, se], t = this.target;
    const dot = a => a[0] * t[0] + a[1] * t[1] + a[2] * t[2];
    return [right[0], up[0], back[0], 0, right[1], up[1], back[1], 0, right[2], up[2], back[2], 0,
      this.shift[0] - dot(right), this.shift[1] - dot(up), -this.distance - dot(back), 1];
  }

  projectionMatrix() {
    const aspect = this.canvas.width / this.canvas.height, f = 1 / Math.tan(.35), near = this.distance / 50, far = this.distance * 20;
    return [f / aspect, 0, 0, 0, 0, f, 0, 0, 0, 0, (far + near) / (near - far), -1, 0, 0, 2 * far * near / (near - far), 0];
  }

  listen() {
    const canvas = this.canvas, fingers = new Map();
    canvas.addEventListener("pointerdown", e => { canvas.setPointerCapture(e.pointerId); fingers.set(e.pointerId, e); });
    for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, e => fingers.delete(e.pointerId));
    canvas.addEventListener("pointermove", e => {
      const before = fingers.get(e.pointerId);
      if (!before) return;
      const dx = e.clientX - before.clientX, dy = e.clientY - before.clientY;
      if (fingers.size === 2) {
        const other = [...fingers.values()].find(f => f.pointerId !== e.pointerId);
        const gap = p => Math.hypot(p.clientX - other.clientX, p.clientY - other.clientY) || 1;
        this.distance *= gap(before) / gap(e);
      } else if (e.buttons & 2 || e.shiftKey) {
        const scale = .7 * this.distance / canvas.clientHeight;
        this.shift = [this.shift[0] + dx * scale, this.shift[1] - dy * scale];
      } else {
        this.turn -= .008 * dx;
        this.tilt = Math.max(-1.5, Math.min(1.5, this.tilt + .008 * dy));
      }
      fingers.set(e.pointerId, e);
      this.draw();
    });
    canvas.addEventListener("wheel", e => { e.preventDefault(); this.distance *= Math.exp(.001 * e.deltaY); this.draw(); }, { passive: false });
    canvas.addEventListener("contextmenu", e => e.preventDefault());
    new ResizeObserver(() => this.bodies && this.draw()).observe(canvas);
  }
}
