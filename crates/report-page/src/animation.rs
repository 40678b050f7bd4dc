//! Machine, part and tool in motion as binary glTF 2.0, for other viewers.

use facemill_inverse_kinematics::machine_file::{DhRow, Joint, Sense};
use facemill_inverse_kinematics::{Machine, Motion};
use nalgebra::{UnitQuaternion, Vector3};
use serde_json::{Value, json};

use crate::document::{PageData, ShownSurface};
use crate::format::{BodyData, Matrix, ShapeData};
use crate::motion::{ProgramMotion, Segment};

/// Largest turn of an axis between two keys, rad: viewers turn the short way.
const TURN: f64 = 0.35;

/// Least time between two keys, s: single precision tells times of some hours apart by less.
const STEP: f64 = 2e-3;

/// Returns the program of a page in motion: part, check surfaces and fixtures on the table, bodies
/// of the machine, and tools, with a track for each axis over the time of the program. Lengths are
/// m, y is up.
///
/// Between keys axes move evenly; under laws that keep the tip straight this is within the turn of
/// 20° of a key. `machine` is the view whose motion the page shows.
#[must_use]
pub fn animation_glb(data: &PageData, machine: &Machine) -> Vec<u8> {
    let mut glb = Glb::default();
    let keys = keys(&data.motion, machine, data.document.tools.first().map_or(0.0, |t| t.file.gauge_length_mm));
    let input = glb.floats(keys.iter().map(|k| [k.time as f32]).collect(), "SCALAR", true);
    let document = &data.document;
    let work = data.surfaces.iter().map(|surface| glb.surface_node(surface)).collect();
    let work =
        glb.node(placed(json!({ "name": "workpiece", "children": list(work) }), &document.setup.table_from_work));
    let mut tracks = Tracks { keys: &keys, machine, input, samplers: Vec::new(), channels: Vec::new() };
    let bodies = |carrier: &'static str| document.machine.bodies.iter().filter(move |b| b.carrier == carrier);
    let table =
        glb.chain(&document.machine.workpiece_rows, ("table", bodies("table").collect()), vec![work], &mut tracks);
    let mut roots = vec![table];
    for (head, rows) in document.machine.tool_rows.iter().enumerate() {
        let tool = document.tools.get(head).map(|tool| glb.tool_node(tool)).into_iter().collect();
        let carrier = if head == 0 { "head" } else { "other_head" };
        roots.push(glb.chain(rows, (carrier, bodies(carrier).collect()), tool, &mut tracks));
    }
    let bed: Vec<usize> = bodies("bed").map(|body| glb.body_node(body)).collect();
    roots.extend(bed);
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let (children, scale) = (list(roots), [1e-3; 3]);
    let root = glb.node(json!({ "name": document.machine.name, "rotation": [-half, 0.0, 0.0, half], "scale": scale, "children": children }));
    let animation =
        json!({ "name": document.program.stamp.file, "samplers": tracks.samplers, "channels": tracks.channels });
    let animations = if tracks.channels.is_empty() { Vec::new() } else { vec![animation] };
    glb.finish(root, animations)
}

/// Position of the axes at a time.
struct Key {
    time: f64,
    values: Vec<f64>,
}

/// Returns positions over the time of a program, near enough to each other for viewers.
fn keys(motion: &ProgramMotion, machine: &Machine, tool_length: f64) -> Vec<Key> {
    let mut keys = vec![Key { time: 0.0, values: motion.start.iter().collect() }];
    let mut time = 0.0;
    for segment in &motion.segments {
        let n = pieces(segment, machine);
        let path = Motion::new(machine, segment.law, &segment.from, &segment.to, tool_length).ok();
        for k in 1..=n {
            let share = f64::from(k) / f64::from(n);
            let at =
                path.as_ref().and_then(|m| m.at(share).ok()).unwrap_or_else(|| segment.from.lerp(&segment.to, share));
            let key = Key { time: time + share * segment.time, values: at.iter().collect() };
            let (n_keys, last) = (keys.len(), keys.last_mut());
            match last {
                // Motions without time, or too short to tell apart: the last one stays.
                Some(last) if key.time - last.time < STEP && n_keys > 1 => last.values = key.values,
                Some(last) => {
                    let time = key.time.max(last.time + STEP);
                    keys.push(Key { time, ..key });
                }
                None => keys.push(key),
            }
        }
        time += segment.time;
    }
    keys
}

fn pieces(segment: &Segment, machine: &Machine) -> u32 {
    let rotary =
        machine.axes().iter().enumerate().filter(|(_, a)| a.kind == facemill_inverse_kinematics::AxisKind::Rotary);
    let turn = rotary.map(|(k, _)| (segment.to[k] - segment.from[k]).abs()).fold(0.0, f64::max);
    (turn / TURN).ceil().clamp(1.0, 1000.0) as u32
}

/// Tracks of the axes.
struct Tracks<'a> {
    keys: &'a [Key],
    machine: &'a Machine,
    input: usize,
    samplers: Vec<Value>,
    channels: Vec<Value>,
}

/// A file as it grows.
#[derive(Default)]
struct Glb {
    nodes: Vec<Value>,
    meshes: Vec<Value>,
    materials: Vec<Value>,
    accessors: Vec<Value>,
    views: Vec<Value>,
    bytes: Vec<u8>,
}

impl Glb {
    fn node(&mut self, mut node: Value) -> usize {
        if let Some(map) = node.as_object_mut() {
            map.retain(|_, value| !value.is_null());
        }
        self.nodes.push(node);
        self.nodes.len() - 1
    }

    /// Adds the links of a chain with their bodies; `end` are nodes in its last frame. Returns its
    /// first node.
    fn chain(
        &mut self,
        rows: &[DhRow],
        (name, bodies): (&str, Vec<&BodyData>),
        mut end: Vec<usize>,
        tracks: &mut Tracks<'_>,
    ) -> usize {
        for (k, row) in rows.iter().enumerate().rev() {
            end.extend(bodies.iter().filter(|b| b.row == k).map(|body| self.body_node(body)));
            let (theta, d) = (row.theta_deg.to_radians(), row.d_mm);
            let children = list(std::mem::take(&mut end));
            let joint = self.node(json!({
                "name": format!("{name} {}", k + 1), "translation": [0.0, 0.0, d], "rotation": about_z(theta), "children": children,
            }));
            tracks.add(self, joint, row);
            let half = 0.5 * row.alpha_deg.to_radians();
            let (at, turn) = ([row.a_mm, 0.0, 0.0], [half.sin(), 0.0, 0.0, half.cos()]);
            end = vec![self.node(json!({ "name": format!("{name} {} fixed", k + 1), "translation": at, "rotation": turn, "children": [joint] }))];
        }
        self.node(json!({ "name": name, "children": list(end) }))
    }

    fn body_node(&mut self, body: &BodyData) -> usize {
        let triangles = match &body.shape {
            ShapeData::Frustum([low, high, radius_low, radius_high]) => {
                turned(&[[0.0, *low], [*radius_low, *low], [*radius_high, *high], [0.0, *high]])
            }
            ShapeData::Box(half) => boxed(*half),
            ShapeData::Hull { vertices, triangles } => {
                triangles.iter().flatten().map(|&v| Vector3::from(vertices[v as usize])).collect()
            }
        };
        let grey =
            if body.carrier == "table" || body.carrier == "bed" { [0.30, 0.33, 0.36] } else { [0.55, 0.58, 0.61] };
        let mesh = self.flat_mesh(&body.name, &triangles, grey);
        self.node(placed(json!({ "name": body.name, "mesh": mesh }), &body.pose))
    }

    fn tool_node(&mut self, tool: &crate::format::ToolData) -> usize {
        let file = &tool.file;
        let (radius, corner) = (file.radius_mm, file.corner_radius_mm);
        let mut profile = vec![[0.0, 0.0], [radius - corner, 0.0]];
        profile.extend((1..=8).filter(|_| corner > 0.0).map(|k| {
            let turn = std::f64::consts::FRAC_PI_2 * f64::from(k) / 8.0;
            [radius - corner + corner * turn.sin(), corner - corner * turn.cos()]
        }));
        profile.extend([[radius, file.flute_length_mm], [0.0, file.flute_length_mm]]);
        let cutter = self.flat_mesh("cutter", &turned(&profile), [0.75, 0.38, 0.03]);
        let mut parts = vec![self.node(json!({ "name": "cutter", "mesh": cutter }))];
        for (name, stack, from) in
            [("cutter body", &file.body, file.flute_length_mm), ("holder", &file.holder, file.stick_out_mm)]
        {
            let mut z = from;
            for section in &stack.sections {
                let [low, high] = [section.diameter_low_mm, section.diameter_high_mm].map(|d| 0.5 * d);
                let top = z + section.length_mm;
                let mesh =
                    self.flat_mesh(name, &turned(&[[0.0, z], [low, z], [high, top], [0.0, top]]), [0.24, 0.27, 0.31]);
                parts.push(self.node(json!({ "name": name, "mesh": mesh })));
                z = top;
            }
        }
        self.node(
            json!({ "name": file.name, "translation": [0.0, 0.0, -file.gauge_length_mm], "children": list(parts) }),
        )
    }

    fn surface_node(&mut self, surface: &ShownSurface) -> usize {
        let floats = |v: &Vector3<f64>| [v.x as f32, v.y as f32, v.z as f32];
        let positions = self.floats(surface.shown.vertices.iter().map(|p| floats(&p.coords)).collect(), "VEC3", true);
        let up = |n: &Vector3<f64>| floats(&n.try_normalize(0.5).unwrap_or_else(Vector3::z));
        let normals = self.floats(surface.shown.normals.iter().map(up).collect(), "VEC3", false);
        let corners: Vec<u8> = surface.shown.triangles.iter().flatten().flat_map(|v| v.to_le_bytes()).collect();
        let view = self.view(&corners, Some(34963));
        let n = 3 * surface.shown.triangles.len();
        self.accessors.push(json!({ "bufferView": view, "componentType": 5125, "count": n, "type": "SCALAR" }));
        let indices = self.accessors.len() - 1;
        let colour = if surface.role == "part" { [0.35, 0.43, 0.51] } else { [0.28, 0.32, 0.25] };
        let material = self.material(colour);
        let attributes = json!({ "POSITION": positions, "NORMAL": normals });
        self.meshes
            .push(json!({ "primitives": [{ "attributes": attributes, "indices": indices, "material": material }] }));
        let mesh = self.meshes.len() - 1;
        self.node(json!({ "name": surface.name, "mesh": mesh }))
    }

    /// Adds triangles, three corners each, with the normals of their planes.
    fn flat_mesh(&mut self, name: &str, corners: &[Vector3<f64>], colour: [f64; 3]) -> usize {
        let (mut positions, mut normals) = (Vec::new(), Vec::new());
        for triangle in corners.as_chunks::<3>().0 {
            let [a, b, c] = triangle;
            let Some(normal) = (b - a).cross(&(c - a)).try_normalize(1e-12) else { continue };
            let floats = |v: &Vector3<f64>| [v.x as f32, v.y as f32, v.z as f32];
            positions.extend(triangle.iter().map(floats));
            normals.extend([floats(&normal); 3]);
        }
        let positions = self.floats(positions, "VEC3", true);
        let normals = self.floats(normals, "VEC3", false);
        let material = self.material(colour);
        let attributes = json!({ "POSITION": positions, "NORMAL": normals });
        self.meshes.push(json!({ "name": name, "primitives": [{ "attributes": attributes, "material": material }] }));
        self.meshes.len() - 1
    }

    fn material(&mut self, [r, g, b]: [f64; 3]) -> usize {
        let rough = json!({ "baseColorFactor": [r, g, b, 1.0], "metallicFactor": 0.2, "roughnessFactor": 0.7 });
        let material = json!({ "pbrMetallicRoughness": rough, "doubleSided": true });
        self.materials.iter().position(|known| *known == material).unwrap_or_else(|| {
            self.materials.push(material);
            self.materials.len() - 1
        })
    }

    /// Adds an accessor of numbers; with its least and greatest values where they are required.
    fn floats<const N: usize>(&mut self, values: Vec<[f32; N]>, kind: &str, bounded: bool) -> usize {
        let bytes: Vec<u8> = values.iter().flatten().flat_map(|v| v.to_le_bytes()).collect();
        let is_vertex = kind == "VEC3" && N == 3;
        let view = self.view(&bytes, is_vertex.then_some(34962).filter(|_| kind != "SCALAR"));
        let mut accessor = json!({ "bufferView": view, "componentType": 5126, "count": values.len(), "type": kind });
        if bounded {
            let bound = |pick: fn(f32, f32) -> f32| -> Vec<f32> {
                (0..N).map(|c| values.iter().map(|v| v[c]).reduce(pick).unwrap_or(0.0)).collect()
            };
            (accessor["min"], accessor["max"]) = (json!(bound(f32::min)), json!(bound(f32::max)));
        }
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }

    fn view(&mut self, bytes: &[u8], target: Option<u32>) -> usize {
        let offset = self.bytes.len();
        self.bytes.extend(bytes);
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        let mut view = json!({ "buffer": 0, "byteOffset": offset, "byteLength": bytes.len() });
        if let Some(target) = target {
            view["target"] = json!(target);
        }
        self.views.push(view);
        self.views.len() - 1
    }

    fn finish(self, root: usize, animations: Vec<Value>) -> Vec<u8> {
        let generator = format!("facemill {}", env!("CARGO_PKG_VERSION"));
        let mut file = json!({
            "asset": { "version": "2.0", "generator": generator },
            "scene": 0, "scenes": [{ "nodes": [root] }],
            "nodes": self.nodes, "meshes": self.meshes, "materials": self.materials, "accessors": self.accessors,
            "bufferViews": self.views, "buffers": [{ "byteLength": self.bytes.len() }],
        });
        if !animations.is_empty() {
            file["animations"] = json!(animations);
        }
        let mut text = file.to_string().into_bytes();
        text.resize(text.len().next_multiple_of(4), b' ');
        let total = 12 + 8 + text.len() + 8 + self.bytes.len();
        let mut out = Vec::with_capacity(total);
        out.extend(b"glTF");
        for word in [2, total as u32, text.len() as u32] {
            out.extend(word.to_le_bytes());
        }
        out.extend(b"JSON");
        out.extend(text);
        out.extend((self.bytes.len() as u32).to_le_bytes());
        out.extend(b"BIN\0");
        out.extend(self.bytes);
        out
    }
}

impl Tracks<'_> {
    /// Adds the track of a row's axis, if it has one.
    fn add(&mut self, glb: &mut Glb, node: usize, row: &DhRow) {
        let (letter, sense, is_linear) = match &row.joint {
            None => return,
            Some(Joint::Prismatic(j)) => (&j.axis, j.sense, true),
            Some(Joint::Revolute(j)) => (&j.axis, j.sense, false),
        };
        let Some(axis) = self.machine.axis_index(letter) else { return };
        let sign = if sense == Sense::Negative { -1.0 } else { 1.0 };
        let values = self.keys.iter().map(|key| sign * key.values[axis]);
        let (output, path) = if is_linear {
            let at = values.map(|v| [0.0, 0.0, (row.d_mm + v) as f32]).collect();
            (glb.track(at, "VEC3"), "translation")
        } else {
            let turn = values.map(|v| about_z(row.theta_deg.to_radians() + v).map(|c| c as f32)).collect();
            (glb.track(turn, "VEC4"), "rotation")
        };
        self.samplers.push(json!({ "input": self.input, "output": output, "interpolation": "LINEAR" }));
        let sampler = self.samplers.len() - 1;
        self.channels.push(json!({ "sampler": sampler, "target": { "node": node, "path": path } }));
    }
}

impl Glb {
    /// Adds an accessor of a track, which is no attribute of vertices.
    fn track<const N: usize>(&mut self, values: Vec<[f32; N]>, kind: &str) -> usize {
        let bytes: Vec<u8> = values.iter().flatten().flat_map(|v| v.to_le_bytes()).collect();
        let view = self.view(&bytes, None);
        self.accessors.push(json!({ "bufferView": view, "componentType": 5126, "count": values.len(), "type": kind }));
        self.accessors.len() - 1
    }
}

/// Children of a node; `null` without any, since an empty list is not permitted.
fn list(nodes: Vec<usize>) -> Value {
    if nodes.is_empty() { Value::Null } else { json!(nodes) }
}

/// Quaternion (x, y, z, w) of a turn about z.
fn about_z(turn: f64) -> [f64; 4] {
    let q = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), turn);
    [q.i, q.j, q.k, q.w]
}

/// Columns of a transform.
/// Returns a node at a pose; at the identity none is written.
fn placed(mut node: Value, pose: &Matrix) -> Value {
    const IDENTITY: Matrix = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    if *pose != IDENTITY {
        node["matrix"] = json!(columns(pose));
    }
    node
}

fn columns(m: &Matrix) -> Vec<f64> {
    (0..16).map(|k| if k % 4 == 3 { f64::from(k / 4 == 3) } else { m[4 * (k % 4) + k / 4] }).collect()
}

/// Corners of triangles around a body of revolution about z, from its profile of radius and height.
fn turned(profile: &[[f64; 2]]) -> Vec<Vector3<f64>> {
    const CORNERS: u32 = 32;
    let at = |[radius, z]: [f64; 2], k: u32| {
        let turn = std::f64::consts::TAU * f64::from(k % CORNERS) / f64::from(CORNERS);
        Vector3::new(radius * turn.cos(), radius * turn.sin(), z)
    };
    let mut corners = Vec::new();
    for pair in profile.windows(2) {
        for k in 0..CORNERS {
            let [a, b, c, d] = [at(pair[0], k), at(pair[0], k + 1), at(pair[1], k + 1), at(pair[1], k)];
            corners.extend([a, b, c, a, c, d]);
        }
    }
    corners
}

/// Corners of the triangles of a box about the origin.
fn boxed(half: [f64; 3]) -> Vec<Vector3<f64>> {
    let corner = |k: usize| Vector3::from_fn(|c, _| if k >> c & 1 == 1 { half[c] } else { -half[c] });
    let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    faces.into_iter().flat_map(|[a, b, c, d]| [a, b, c, a, c, d]).map(corner).collect()
}
