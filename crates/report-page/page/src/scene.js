// The 3-D scene: part, fixtures, stock, machine and tool, the tip's path, frames.

import {
  AmbientLight, AxesHelper, Box3, BoxGeometry, BufferAttribute, BufferGeometry, Color, DirectionalLight, DoubleSide, Group,
  HemisphereLight, LatheGeometry, LineBasicMaterial, LineSegments, Matrix4, Mesh, MeshLambertMaterial, PerspectiveCamera,
  Plane, Raycaster, Scene, SphereGeometry, Vector2, Vector3, WebGLRenderer,
} from 'three';
import { OrbitControls } from 'three/examples/jsm/controls/OrbitControls.js';
import { coarseSegments, coarseTriangles } from './coarse.js';
import { triples, numbers } from './data.js';
import { IDENTITY, inverse, multiply, transformed } from './kinematics.js';
import { lastUpTo } from './motion.js';

/** Colours of the scene by theme. */
const THEMES = {
  light: { background: 0xeef1f4, part: 0x9fb0be, stock: 0xc9a86a, cutStock: 0xdcc8a0, fixture: 0x7b6f8f, check: 0x8fa08a, table: 0xc3cad0, head: 0xaab3bb, bed: 0xb0b8be, tool: 0x4d5760, cutter: 0xd88a1f, holder: 0x79828b, rapid: 0x6b7a86, ahead: 0x9aa5af, grid: 0xc9d0d6 },
  dark: { background: 0x14191e, part: 0x8496a5, stock: 0xb08f52, cutStock: 0xcdb88c, fixture: 0x83749c, check: 0x7f937a, table: 0x39424a, head: 0x7d868e, bed: 0x30383f, tool: 0xa7b0b8, cutter: 0xe8a33d, holder: 0x6c757d, rapid: 0x8fa0ad, ahead: 0x4d5760, grid: 0x2b333a },
};

/** Triangles of meshes in a picture in motion that the processor draws. */
const MOST_IN_MOTION = 12000;
/** Segments of the path in such a picture, as far as it can be drawn with so few. */
const MOST_SEGMENTS_IN_MOTION = 8000;
/** Pixels of such a picture, as a share along each side. */
const PIXELS_IN_MOTION = 0.75;
/** Time without motion after which all is drawn, ms. */
const REST = 250;

const matrix4 = (m) => new Matrix4().set(...m, 0, 0, 0, 1);

function place(object, m) {
  object.matrixAutoUpdate = false;
  object.matrix.copy(matrix4(m));
  object.matrixWorldNeedsUpdate = true;
}

/** Splits vertices where a face is turned from the mean of its neighbours: edges stay sharp. */
function creased(positions, normals, triangles) {
  const n = positions.length / 3;
  const corners = new Uint32Array(triangles.length);
  const origin = new Uint32Array(n + triangles.length);
  const out = new Float32Array(3 * (n + triangles.length));
  // Vertices with a smooth face keep their place; those with sharp ones are added.
  for (let v = 0; v < n; v++) origin[v] = v;
  out.set(normals.subarray(0, 3 * n));
  let used = n;
  const sharp = new Map();
  for (let t = 0; t < triangles.length; t += 3) {
    const [a, b, c] = [3 * triangles[t], 3 * triangles[t + 1], 3 * triangles[t + 2]];
    const [ux, uy, uz] = [positions[b] - positions[a], positions[b + 1] - positions[a + 1], positions[b + 2] - positions[a + 2]];
    const [vx, vy, vz] = [positions[c] - positions[a], positions[c + 1] - positions[a + 1], positions[c + 2] - positions[a + 2]];
    let [x, y, z] = [uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx];
    const size = Math.hypot(x, y, z) || 1;
    [x, y, z] = [x / size, y / size, z / size];
    for (let k = 0; k < 3; k++) {
      const v = triangles[t + k];
      if (x * normals[3 * v] + y * normals[3 * v + 1] + z * normals[3 * v + 2] > 0.8) {
        corners[t + k] = v;
        continue;
      }
      const key = v + n * (Math.round(4 * (x + 1)) + 9 * Math.round(4 * (y + 1)) + 81 * Math.round(4 * (z + 1)));
      let at = sharp.get(key);
      if (at === undefined) {
        at = used++;
        sharp.set(key, at);
        origin[at] = v;
        out[3 * at] = x;
        out[3 * at + 1] = y;
        out[3 * at + 2] = z;
      }
      corners[t + k] = at;
    }
  }
  const split = new Float32Array(3 * used);
  for (let at = 0; at < used; at++) for (let c = 0; c < 3; c++) split[3 * at + c] = positions[3 * origin[at] + c];
  const geometry = new BufferGeometry();
  geometry.setAttribute('position', new BufferAttribute(split, 3));
  geometry.setAttribute('normal', new BufferAttribute(out.slice(0, 3 * used), 3));
  geometry.setIndex(new BufferAttribute(corners, 1));
  return { geometry, origin: origin.slice(0, used) };
}

function bodyGeometry(shape) {
  if (shape.box) return new BoxGeometry(...shape.box.map((half) => 2 * half));
  if (shape.frustum) {
    const [low, high, radiusLow, radiusHigh] = shape.frustum;
    return turnedBody([[0, low], [radiusLow, low], [radiusHigh, high], [0, high]]);
  }
  const { vertices, triangles } = shape.hull;
  const flat = new BufferGeometry();
  flat.setAttribute('position', new BufferAttribute(new Float32Array(triangles.flat().flatMap((v) => vertices[v])), 3));
  flat.computeVertexNormals();
  return flat;
}

/** A body of revolution about z from its profile of radius and height. */
function turnedBody(profile) {
  const edges = [];
  for (let k = 0; k + 1 < profile.length; k++) {
    const [from, to] = [profile[k], profile[k + 1]];
    if (from[0] === to[0] && from[1] === to[1]) continue;
    // Each stretch by itself, so that edges are sharp.
    const lathe = new LatheGeometry([new Vector2(from[0], from[1]), new Vector2(to[0], to[1])], 48);
    lathe.rotateX(Math.PI / 2);
    edges.push(lathe);
  }
  return joined(edges);
}

function joined(geometries) {
  const all = { position: [], normal: [], index: [] };
  let base = 0;
  for (const geometry of geometries) {
    all.position.push(...geometry.attributes.position.array);
    all.normal.push(...geometry.attributes.normal.array);
    all.index.push(...[...geometry.index.array].map((k) => k + base));
    base += geometry.attributes.position.count;
  }
  const geometry = new BufferGeometry();
  geometry.setAttribute('position', new BufferAttribute(new Float32Array(all.position), 3));
  geometry.setAttribute('normal', new BufferAttribute(new Float32Array(all.normal), 3));
  geometry.setIndex(all.index);
  return geometry;
}

/** Profile of the cutter from the middle of its bottom up to the end of its flute. */
export function cutterProfile(tool) {
  const [R, r] = [tool.radius_mm, tool.corner_radius_mm];
  const profile = [[0, 0], [R - r, 0]];
  for (let k = 1; k <= 12 && r > 0; k++) {
    const turn = ((k / 12) * Math.PI) / 2;
    profile.push([R - r + r * Math.sin(turn), r - r * Math.cos(turn)]);
  }
  profile.push([R, Math.max(tool.flute_length_mm, r)], [0, Math.max(tool.flute_length_mm, r)]);
  return profile;
}

/** Sections of a tool's body and holder with their names in findings. */
export function toolSections(tool) {
  const stack = (name, sections, from) => {
    let z = from;
    return sections.map((section, k) => {
      const low = z;
      z += section.length_mm;
      return { name: `${name} section ${k + 1}`, low, high: z, radiusLow: section.diameter_low_mm / 2, radiusHigh: section.diameter_high_mm / 2 };
    });
  };
  return [...stack('cutter body', tool.body.sections, tool.flute_length_mm), ...stack('holder', tool.holder.sections, tool.stick_out_mm)];
}

export class View {
  constructor(doc, machine, canvasParent) {
    this.doc = doc;
    this.machine = machine;
    this.parent = canvasParent;
    const probe = document.createElement('canvas').getContext('webgl2');
    const info = probe && probe.getExtension('WEBGL_debug_renderer_info');
    const name = info ? String(probe.getParameter(info.UNMASKED_RENDERER_WEBGL)) : '';
    this.isSoftware = /swiftshader|llvmpipe|software|basic render/i.test(name);
    this.renderer = new WebGLRenderer({ antialias: !this.isSoftware, preserveDrawingBuffer: true, powerPreference: 'high-performance' });
    this.renderer.setPixelRatio(this.isSoftware ? 1 : Math.min(window.devicePixelRatio, 2));
    this.renderer.localClippingEnabled = true;
    // Asking for errors waits until a shader is compiled.
    this.renderer.debug.checkShaderErrors = false;
    canvasParent.append(this.renderer.domElement);
    this.scene = new Scene();
    this.root = new Group();
    this.scene.add(this.root);
    this.camera = new PerspectiveCamera(35, 1, 1, 1e5);
    this.camera.up.set(0, 0, 1);
    this.controls = new OrbitControls(this.camera, this.renderer.domElement);
    this.controls.screenSpacePanning = true;
    this.controls.zoomToCursor = true;
    this.controls.addEventListener('change', () => this.drawInMotion());
    this.scene.add(new HemisphereLight(0xffffff, 0x8d98a3, 1.4), new AmbientLight(0xffffff, 0.35));
    this.sun = new DirectionalLight(0xffffff, 1.6);
    this.camera.add(this.sun);
    this.sun.position.set(0.4, 0.6, 1);
    this.scene.add(this.camera);
    this.clip = new Plane(new Vector3(-1, 0, 0), 0);
    this.clipping = [];
    this.groups = {};
    this.named = new Map();
    this.materials = {};
    this.meshes = [];
    this.frameMode = 'part';
    this.theme = 'light';
    this.bed = new Group();
    this.table = new Group();
    this.work = new Group();
    this.table.add(this.work);
    this.root.add(this.bed, this.table);
    place(this.work, doc.setup.table_from_work);
    new ResizeObserver(() => this.resize()).observe(canvasParent);
  }

  material(name, options = {}) {
    if (!this.materials[name]) {
      this.materials[name] = new MeshLambertMaterial({ side: DoubleSide, clippingPlanes: this.clipping, ...options });
      this.materials[name].userData.name = name;
    }
    return this.materials[name];
  }

  group(name, label, parent, isShown = true) {
    const group = new Group();
    group.visible = isShown;
    parent.add(group);
    const known = this.groups[name];
    if (known) known.objects.push(group);
    else this.groups[name] = { label, objects: [group], isShown };
    return group;
  }

  setVisible(name, isShown) {
    this.groups[name].isShown = isShown;
    for (const object of this.groups[name].objects) object.visible = isShown;
    this.draw();
  }

  name(mesh, name) {
    mesh.userData.name = name;
    if (!this.named.has(name)) this.named.set(name, []);
    this.named.get(name).push(mesh);
  }

  async build(motion) {
    this.motion = motion;
    // What decodes and what prepares meshes go on side by side.
    const paths = this.readPaths();
    await this.buildMeshes();
    this.buildMachine();
    this.buildTools();
    this.buildPaths(await paths);
    this.buildFrames();
    this.marks = this.group('marks', 'marks', this.work);
    this.setTheme(this.theme);
    this.setPosition(motion.end(-1), -1);
    this.resize();
    this.look('iso');
  }

  /** Adds the stock as it is at any moment. */
  addStock(stock) {
    this.stock = stock;
    const group = this.group('stockNow', 'stock now', this.work, !this.doc.meshes.length || stockIsSolid(this.doc));
    const mesh = new Mesh(stock.geometry, this.material('stockNow', { vertexColors: true, polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1 }));
    mesh.frustumCulled = false;
    group.add(mesh);
    this.colourStock();
  }

  /** Adds marks where maps of feasible postures are. */
  addNarrowPoints(maps) {
    this.narrowPoints = maps.map((map) => map.tip_mm);
    if (!maps.length) return;
    const group = this.group('narrow', 'narrowest points', this.work, false);
    const material = new MeshLambertMaterial({ color: 0xcc79a7, emissive: 0xcc79a7, emissiveIntensity: 0.35, clippingPlanes: this.clipping });
    const ball = new SphereGeometry(this.size() * 0.004, 12, 8);
    for (const tip of this.narrowPoints) {
      const mesh = new Mesh(ball, material);
      mesh.position.set(...tip);
      group.add(mesh);
    }
  }

  /** Mark of a narrow point at a place of the canvas; −1: none, or they are hidden. */
  narrowPointAt(x, y, within = 9) {
    if (!this.groups.narrow || !this.groups.narrow.isShown) return -1;
    let best = { distance: within, depth: Infinity, index: -1 };
    this.narrowPoints.forEach((tip, index) => {
      const at = this.onScreen(tip);
      const distance = Math.hypot(at.x - x, at.y - y);
      if (at.isVisible && distance < within && (distance < best.distance - 2 || at.depth < best.depth)) best = { distance, depth: at.depth, index };
    });
    return best.index;
  }

  async buildMeshes() {
    for (const data of this.doc.meshes) {
      const [positions, normals, triangles] = await Promise.all([triples(data.positions), triples(data.normals), numbers(data.triangles, Uint32Array)]);
      const { geometry, origin } = creased(positions, normals, triangles);
      const isStock = data.role === 'stock';
      const options = isStock ? { transparent: true, opacity: 0.25, depthWrite: false } : {};
      const mesh = new Mesh(geometry, this.material(isStock ? 'stockBefore' : data.role, options));
      const labels = { part: ['part', 'part'], check: ['check', 'check surfaces'], fixture: ['fixtures', 'fixtures'], stock: ['stockBefore', 'stock before'] };
      const [name, label] = labels[data.role];
      this.group(name, label, this.work, !isStock).add(mesh);
      this.name(mesh, data.name);
      this.meshes.push(mesh);
      if (data.role === 'part') {
        this.part = { mesh, origin, positions };
      }
    }
  }

  buildMachine() {
    const { machine, doc } = this;
    this.links = [];
    for (const body of doc.machine.bodies) {
      const mesh = new Mesh(bodyGeometry(body.shape), this.material(body.carrier === 'table' ? 'table' : body.carrier === 'bed' ? 'bed' : 'head', body.carrier === 'table' || body.carrier === 'bed' ? {} : { transparent: true, opacity: 0.55 }));
      const isTable = body.carrier === 'table';
      const label = isTable ? 'machine: table' : body.carrier === 'bed' ? 'machine: bed' : 'machine: head';
      const holder = this.group(isTable ? 'table' : body.carrier === 'bed' ? 'bed' : 'head', label, this.bed);
      place(mesh, body.pose);
      const link = new Group();
      link.add(mesh);
      holder.add(link);
      this.name(mesh, body.name);
      const chain = isTable ? machine.table : body.carrier === 'bed' ? [] : machine.heads[body.carrier === 'head' ? 0 : 1] || [];
      this.links.push({ link, chain, row: body.row });
    }
  }

  buildTools() {
    this.tools = this.doc.tools.map((tool, head) => {
      const group = this.group('tool', 'tool and holder', this.table);
      const frame = new Group();
      group.add(frame);
      const cutter = new Mesh(turnedBody(cutterProfile(tool)), this.material('cutter'));
      frame.add(cutter);
      this.name(cutter, 'cutter');
      for (const section of toolSections(tool)) {
        const { low, high, radiusLow, radiusHigh, name } = section;
        const mesh = new Mesh(turnedBody([[0, low], [radiusLow, low], [radiusHigh, high], [0, high]]), this.material(name.startsWith('holder') ? 'holder' : 'tool'));
        frame.add(mesh);
        this.name(mesh, name);
      }
      return { frame, head };
    });
  }

  readPaths() {
    return Promise.all(this.doc.motion.paths.map((data) => Promise.all([triples(data.points), numbers(data.motions, Uint32Array)])));
  }

  /** Groups of the path: what is at a feed in one, or apart by whether it cuts where the page knows it. */
  pathGroups() {
    const { isCut } = this.motion;
    const cut = isCut ? [['path', 'path at the surface'], ['links', 'entries, exits and links']] : [['path', 'path at a feed']];
    return [...cut, ['rapids', 'rapids']];
  }

  /** Group of a motion. */
  pathGroupOf(motion) {
    if (this.motion.kinds[motion] === 0) return 'rapids';
    return this.motion.isCut && !this.motion.isCut(motion) ? 'links' : 'path';
  }

  buildPaths(read) {
    this.paths = [];
    for (const [points, motions] of read) {
      const split = { path: [], links: [], rapids: [] };
      for (let k = 1; k < motions.length; k++) split[this.pathGroupOf(motions[k])].push(k);
      const lines = {};
      for (const [name, label] of this.pathGroups()) {
        const list = split[name];
        const positions = new Float32Array(6 * list.length);
        list.forEach((k, at) => {
          positions.set(points.subarray(3 * k - 3, 3 * k), 6 * at);
          positions.set(points.subarray(3 * k, 3 * k + 3), 6 * at + 3);
        });
        const geometry = new BufferGeometry();
        geometry.setAttribute('position', new BufferAttribute(positions, 3));
        geometry.setAttribute('color', new BufferAttribute(new Float32Array(positions.length).fill(0.5), 3));
        const material = new LineBasicMaterial(name === 'rapids' ? { transparent: true, opacity: 0.6, clippingPlanes: this.clipping } : { vertexColors: true, clippingPlanes: this.clipping });
        const object = new LineSegments(geometry, material);
        object.frustumCulled = false;
        this.group(name, label, this.work).add(object);
        lines[name] = { object, motions: Uint32Array.from(list, (k) => motions[k]) };
      }
      this.paths.push({ points, motions, lines });
    }
    this.pathDone = 'all';
  }

  /** Makes what is drawn in motion, where the processor draws. */
  prepareMotion() {
    if (!this.isSoftware) return;
    const all = this.meshes.reduce((sum, mesh) => sum + mesh.geometry.index.count, 0) / 3;
    for (const mesh of this.meshes) {
      const { position, normal } = mesh.geometry.attributes;
      const fine = mesh.geometry.index;
      const coarse = coarseTriangles(position.array, normal.array, fine.array, Math.ceil((MOST_IN_MOTION * fine.count) / 3 / Math.max(all, 1)));
      if (all > MOST_IN_MOTION && coarse) mesh.userData.indices = [fine, new BufferAttribute(coarse, 1)];
    }
    const lines = this.paths.flatMap((path) => Object.values(path.lines));
    for (let within = 0.001 * this.size(), n = Infinity; n > MOST_SEGMENTS_IN_MOTION && within < 0.05 * this.size(); within *= 2) {
      n = 0;
      for (const line of lines) {
        const { index, motions } = coarseSegments(line.object.geometry.attributes.position.array, line.motions, within);
        line.coarse = { index: new BufferAttribute(index, 1), motions };
        n += motions.length;
      }
    }
    this.isPrepared = true;
  }

  /** Takes coarse shapes, or all. */
  setCoarse(isCoarse) {
    if (!this.isPrepared || this.isCoarse === isCoarse) return;
    this.isCoarse = isCoarse;
    this.renderer.setPixelRatio(isCoarse ? PIXELS_IN_MOTION : 1);
    for (const mesh of this.meshes) if (mesh.userData.indices) mesh.geometry.setIndex(mesh.userData.indices[isCoarse ? 1 : 0]);
    for (const path of this.paths) {
      for (const { object, coarse } of Object.values(path.lines)) object.geometry.setIndex(isCoarse ? coarse.index : null);
    }
    this.updateDone();
  }

  /** Draws soon, with coarse shapes where the processor draws; all of them when it rests. */
  drawInMotion() {
    if (this.isPrepared) {
      this.setCoarse(true);
      clearTimeout(this.rest);
      this.rest = setTimeout(() => {
        this.setCoarse(false);
        this.draw();
      }, REST);
    }
    this.draw();
  }

  buildFrames() {
    const size = this.size() * 0.12;
    const axes = (parent, m, name) => {
      const helper = new AxesHelper(size);
      helper.setColors(0xc8442e, 0x2f8f4e, 0x2f6fd0);
      helper.material.depthTest = false;
      helper.material.transparent = true;
      helper.renderOrder = 5;
      place(helper, m);
      this.group('frames', 'frames', parent).add(helper);
      this.frames = this.frames || [];
      this.frames.push({ helper, name });
    };
    axes(this.work, IDENTITY, 'workpiece');
    axes(this.table, IDENTITY, 'table');
    axes(this.bed, IDENTITY, 'machine bed');
    if (this.doc.setup.table_from_words) axes(this.table, this.doc.setup.table_from_words, 'words');
  }

  /** Largest extent of what stands in the workpiece frame, mm. */
  size() {
    const box = this.doc.setup.part_box || this.doc.setup.stock_box;
    if (!box) return 500;
    return Math.max(...box[0].map((low, k) => box[1][k] - low), 1);
  }

  centre() {
    const box = this.doc.setup.part_box || this.doc.setup.stock_box || [[0, 0, 0], [0, 0, 0]];
    return box[0].map((low, k) => 0.5 * (low + box[1][k]));
  }

  /** Places machine and tool at a position; motion `k` is the last one done, −1: none. */
  setPosition(q, k) {
    const { machine } = this;
    const bedFromTable = machine.bedFromTable(q);
    place(this.table, bedFromTable);
    for (const { link, chain, row } of this.links) {
      place(link, chain.length ? machine.frames(chain, q)[row] || IDENTITY : IDENTITY);
    }
    for (const { frame, head } of this.tools) place(frame, machine.tableFromTool(q, head));
    const base = this.frameMode === 'part' ? inverse(multiply(bedFromTable, this.doc.setup.table_from_work)) : IDENTITY;
    place(this.root, base);
    this.q = q;
    this.k = k;
    this.updateDone();
    if (this.stock && this.groups.stockNow.isShown) this.stock.show(k + 1);
    this.drawInMotion();
  }

  setFrameMode(mode) {
    this.frameMode = mode;
    this.setPosition(this.q, this.k);
    this.look('iso');
  }

  /** Shows all of the path, or what is done. */
  setPathDone(mode) {
    this.pathDone = mode;
    this.updateDone();
    this.draw();
  }

  updateDone() {
    for (const path of this.paths || []) {
      for (const { object, motions: fine, coarse } of Object.values(path.lines)) {
        const motions = this.isCoarse ? coarse.motions : fine;
        const n = this.pathDone === 'all' ? motions.length : lastUpTo(motions, this.k) + 1;
        object.geometry.setDrawRange(0, 2 * n);
      }
    }
  }

  /** Colours the path at a feed: `colour(k)` of motion k. */
  colourPath(colour) {
    const feeds = this.paths.flatMap(({ lines }) => [lines.path, lines.links]).filter((line) => line);
    for (const { object, motions } of feeds) {
      const colours = object.geometry.attributes.color;
      let [last, rgb] = [-1, null];
      for (let at = 0; at < motions.length; at++) {
        if (motions[at] !== last) rgb = colour((last = motions[at]));
        for (let c = 0; c < 3; c++) colours.array[6 * at + c] = colours.array[6 * at + 3 + c] = rgb[c];
      }
      colours.needsUpdate = true;
    }
    this.draw();
  }

  /** Colours the part: `colour(vertex)`, or none for its plain colour. */
  colourPart(colour) {
    if (!this.part) return;
    const { mesh, origin } = this.part;
    if (!colour) {
      mesh.material = this.material('part');
    } else {
      const colours = new Float32Array(3 * origin.length);
      origin.forEach((v, k) => colours.set(colour(v), 3 * k));
      mesh.geometry.setAttribute('color', new BufferAttribute(colours, 3));
      mesh.material = this.material('partColoured', { vertexColors: true });
      mesh.material.color.set(0xffffff);
    }
    this.draw();
  }

  setTheme(theme) {
    this.theme = theme;
    const colours = THEMES[theme];
    this.scene.background = new Color(colours.background);
    const set = (name, colour) => this.materials[name] && this.materials[name].color.set(colour);
    for (const name of ['part', 'check', 'fixture', 'table', 'head', 'bed', 'tool', 'cutter', 'holder']) set(name, colours[name]);
    set('stockBefore', colours.stock);
    set('stockNow', 0xffffff);
    for (const { lines } of this.paths || []) lines.rapids.object.material.color.set(colours.rapid);
    this.colourStock();
    this.draw();
  }

  colourStock() {
    const colours = THEMES[this.theme];
    if (this.stock) this.stock.setColours(new Color(colours.stock).toArray(), new Color(colours.cutStock).toArray());
  }

  /** Section along x, y or z of the workpiece (−1: none) at a share of the part's box. */
  setSection(axis, share, flip) {
    this.clipping.length = 0;
    if (axis >= 0) {
      const box = this.doc.setup.stock_box || this.doc.setup.part_box || [[-1, -1, -1], [1, 1, 1]];
      const at = box[0][axis] + (box[1][axis] - box[0][axis]) * share;
      this.section = { axis, at, flip };
      this.clipping.push(this.clip);
    } else {
      this.section = null;
    }
    for (const material of Object.values(this.materials)) material.needsUpdate = true;
    for (const { lines } of this.paths) for (const { object } of Object.values(lines)) object.material.needsUpdate = true;
    this.draw();
  }

  updateSection() {
    if (!this.section) return;
    const { axis, at, flip } = this.section;
    const normal = new Vector3().setComponent(axis, flip ? 1 : -1);
    this.work.updateWorldMatrix(true, false);
    this.clip.setFromNormalAndCoplanarPoint(normal, new Vector3().setComponent(axis, at)).applyMatrix4(this.work.matrixWorld);
  }

  /** Looks from a side: `iso`, `top`, `bottom`, `front`, `back`, `left`, `right`, `tool`, `place`. */
  look(from, target) {
    this.root.updateMatrixWorld(true);
    const isMachine = this.frameMode === 'machine';
    const centre = target ? new Vector3(...target) : new Vector3(...this.centre());
    this.work.localToWorld(centre);
    const radius = target || from === 'tool' ? this.doc.tools[0].radius_mm * 4 : isMachine ? this.machineSize() : this.size() * 0.62;
    const distance = (radius / Math.sin((0.5 * this.camera.fov * Math.PI) / 180)) * Math.max(1, 1 / this.camera.aspect);
    const sides = { iso: [0.9, -1.25, 0.85], top: [0, -1e-4, 1], bottom: [0, -1e-4, -1], front: [0, -1, 0], back: [0, 1, 0], left: [-1, 0, 0], right: [1, 0, 0] };
    let direction = new Vector3(...(sides[from] || sides.iso));
    if (from === 'place') direction = this.camera.position.clone().sub(this.controls.target);
    if (from === 'tool') {
      const { frame } = this.tools[0];
      frame.updateWorldMatrix(true, false);
      centre.setFromMatrixPosition(frame.matrixWorld);
      direction.set(0.9, -1.25, 0.35);
    }
    direction.normalize();
    this.camera.position.copy(centre).addScaledVector(direction, distance);
    this.controls.target.copy(centre);
    this.camera.near = distance / 200;
    this.camera.far = distance * 40;
    this.camera.updateProjectionMatrix();
    this.controls.update();
    this.draw();
  }

  /** Radius of what is shown around the part, with the machine's bodies, mm. */
  machineSize() {
    const box = new Box3();
    for (const { link } of this.links) if (link.parent.visible) box.expandByObject(link);
    const half = box.isEmpty() ? 0 : 0.5 * box.getSize(new Vector3()).length();
    return Math.min(Math.max(this.size(), 0.75 * half), 8 * this.size());
  }

  resize() {
    const { clientWidth: width, clientHeight: height } = this.parent;
    if (!width || !height) return;
    this.renderer.setSize(width, height);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.draw();
  }

  /** Draws before the next picture of the screen. */
  draw() {
    if (this.isWaiting || this.isHeld) return;
    this.isWaiting = true;
    requestAnimationFrame(() => {
      this.isWaiting = false;
      this.drawNow();
    });
  }

  drawNow() {
    if (!this.tools) return;
    this.updateSection();
    this.renderer.render(this.scene, this.camera);
    if (this.ondraw) this.ondraw();
  }

  /** Place of a point of the workpiece frame on the canvas, px; depth in front of the camera. */
  onScreen(point) {
    const p = new Vector3(...point);
    this.work.localToWorld(p);
    p.project(this.camera);
    const { clientWidth: width, clientHeight: height } = this.parent;
    return { x: (0.5 + 0.5 * p.x) * width, y: (0.5 - 0.5 * p.y) * height, depth: p.z, isVisible: p.z > -1 && p.z < 1 };
  }

  /** Motion whose path is nearest to a place of the canvas within `within` px; −1: none. */
  motionAt(x, y, within = 9) {
    this.root.updateMatrixWorld(true);
    const m = new Matrix4().multiplyMatrices(this.camera.projectionMatrix, this.camera.matrixWorldInverse).multiply(this.work.matrixWorld).elements;
    const { clientWidth: width, clientHeight: height } = this.parent;
    let best = { distance: within, depth: Infinity, k: -1 };
    for (const { points, motions } of this.paths) {
      let last = null;
      for (let p = 0; p < motions.length; p++) {
        const [px, py, pz] = [points[3 * p], points[3 * p + 1], points[3 * p + 2]];
        const w = m[3] * px + m[7] * py + m[11] * pz + m[15];
        const here = { x: (0.5 + (0.5 * (m[0] * px + m[4] * py + m[8] * pz + m[12])) / w) * width, y: (0.5 - (0.5 * (m[1] * px + m[5] * py + m[9] * pz + m[13])) / w) * height, w };
        if (last && w > 0 && last.w > 0 && this.groups[this.pathGroupOf(motions[p])].isShown) {
          const [dx, dy] = [here.x - last.x, here.y - last.y];
          const share = Math.min(Math.max(((x - last.x) * dx + (y - last.y) * dy) / (dx * dx + dy * dy || 1), 0), 1);
          const distance = Math.hypot(last.x + share * dx - x, last.y + share * dy - y);
          if (distance < best.distance - 1 || (distance < best.distance + 1 && distance < within && w < best.depth)) best = { distance: Math.min(distance, best.distance), depth: w, k: motions[p] };
        }
        last = here;
      }
    }
    return best.k;
  }

  /** Point of a shown surface at a place of the canvas, workpiece frame. */
  pointAt(x, y) {
    this.setCoarse(false);
    const { clientWidth: width, clientHeight: height } = this.parent;
    const ray = new Raycaster();
    ray.setFromCamera(new Vector2((2 * x) / width - 1, 1 - (2 * y) / height), this.camera);
    const targets = [];
    this.root.traverseVisible((object) => object.isMesh && targets.push(object));
    const hits = ray.intersectObjects(targets, false).filter((hit) => !this.section || this.clip.distanceToPoint(hit.point) >= 0);
    if (!hits.length) return null;
    const at = this.work.worldToLocal(hits[0].point.clone());
    return { at: at.toArray(), name: hits[0].object.userData.name };
  }

  /** Marks places of the workpiece frame by small balls. */
  setMarks(places) {
    this.marks.clear();
    for (const { at, colour, size } of places) {
      const mesh = new Mesh(new SphereGeometry((size || 1) * this.size() * 0.006, 16, 12), new MeshLambertMaterial({ color: colour, emissive: colour, emissiveIntensity: 0.4, depthTest: false, transparent: true }));
      mesh.renderOrder = 4;
      mesh.position.set(...at);
      this.marks.add(mesh);
    }
    this.draw();
  }

  /** Shows bodies of these names in red. */
  highlight(names) {
    for (const mesh of this.lit || []) mesh.material = mesh.userData.plain;
    this.lit = [];
    const bare = (name) => name.replace(/ \(.*\)$/, '');
    for (const [name, meshes] of this.named) {
      if (!names.some((wanted) => wanted === name || bare(wanted) === bare(name))) continue;
      for (const mesh of meshes) {
        mesh.userData.plain = mesh.material;
        mesh.material = mesh.material.clone();
        mesh.material.emissive = new Color(0xd00020);
        mesh.material.emissiveIntensity = 0.55;
        mesh.material.opacity = Math.max(mesh.material.opacity, 0.8);
        this.lit.push(mesh);
      }
    }
    this.draw();
  }

  /** Frames with their origins, workpiece frame. */
  frameLabels() {
    if (!this.groups.frames.isShown) return [];
    return this.frames.map(({ helper, name }) => {
      const p = new Vector3().setFromMatrixPosition(helper.matrixWorld);
      return { name, at: this.work.worldToLocal(p).toArray() };
    });
  }

  toolTip(head = 0) {
    return transformed(inverse(this.doc.setup.table_from_work), [3, 7, 11].map((c) => this.machine.tableFromTool(this.q, head)[c]));
  }
}

function stockIsSolid(doc) {
  return !doc.setup.file.stock.offset;
}
