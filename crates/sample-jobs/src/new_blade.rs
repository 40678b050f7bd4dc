//! Example jobs for blades from files of others.

use std::path::Path;

use facemill_blade_file::BladeFile;
use facemill_sample_parts::{LoftEnd, LoftedBlade};
use facemill_surface_model::{TriMesh, write_obj};
use nalgebra::{Matrix3, Point3, Rotation3, Unit, UnitQuaternion, Vector3};
use serde_json::{Value, json};

use crate::blade_set::{SetBlade, lofted_blades, read_blade_file, set_mesh};
use crate::job_parts::{
    FLANGE_DIAMETER, JobFiles, MOST_TILT_DEG, ROTOR_SCALES, ReadFile, cutter_radius, job_file, job_folder, operation,
    round_to, stock_for,
};
use crate::propeller_mesh::{nodes_in_place, parts_by_group};

/// Height of the lowest place of a blade above the table, mm, and what is added for its size: the
/// spindle nose comes down beside it where the tool leans.
const HEIGHT: f64 = 100.0;
const HEIGHT_SHARE: f64 = 0.5;

/// A side of a blade, which is cut in a setup of its own: its group, and the name of both.
const SIDES: [(&str, &str); 2] = [("suction", "suction side"), ("pressure", "pressure side")];

/// Radii of the cutter that passes keep from the hub along the span.
const HUB_RADII: f64 = 2.0;

/// Distance that bodies keep from the hub, and from the other blades of a set, mm.
const CHECK_ALLOWANCE: f64 = 1.0;

/// Groups of a blade's mesh that are no part of the blade: the hub beside it, and the other facets
/// of its sector.
const HUB_GROUPS: [&str; 2] = ["hub", "hub-ends"];

/// Radius of the arbor's flange, mm.
const FLANGE_RADIUS: f64 = 0.5 * FLANGE_DIAMETER;

/// Rounds of widths of a side.
const WIDTH_ROUNDS: u32 = 3;

/// Mesh file of a blade's job.
const MESH_FILE: &str = "blade.obj";

/// Characters of a file's name in the name of its job.
const NAME_CHARS: usize = 30;

/// Most characters of a job's name: with the name of a setup it is a comment of the programs, whose
/// lines have at most 120.
const MOST_NAME: usize = 84;

/// Returns the job of a blade, or of a set of blades, by its `.inf` file: both sides of each, each
/// side in a setup in which it lies with that side up; with a sector of its hub if requested.
pub(crate) fn blade_job(file: &Path, scale: f64, with_hub: bool, read: ReadFile<'_>) -> Result<JobFiles, String> {
    described_job(file, scale, with_hub, read).map(|(files, _)| files)
}

/// Returns a description of a blade's job: its name, where each blade ends, and with a hub the
/// share of each side that has passes.
pub(crate) fn blade_text(file: &Path, scale: f64, with_hub: bool, read: ReadFile<'_>) -> Result<String, String> {
    described_job(file, scale, with_hub, read).map(|(_, text)| text)
}

fn described_job(file: &Path, scale: f64, with_hub: bool, read: ReadFile<'_>) -> Result<(JobFiles, String), String> {
    if !ROTOR_SCALES.contains(&scale) {
        return Err(format!("scale must be from {} to {}, is {scale}", ROTOR_SCALES.start(), ROTOR_SCALES.end()));
    }
    let in_file = |why: String| format!("{}: {why}", file.display());
    let described = read_blade_file(file, read)?;
    let blades = lofted_blades(&described, scale, with_hub).map_err(in_file)?;
    let mesh = set_mesh(&blades)?;
    // The tool is for the smallest blade.
    let chord = blades.iter().map(|blade| leading_to_trailing(&blade.lofted.mesh)).fold(f64::INFINITY, f64::min);
    let mesh_chord = blades.iter().map(|blade| blade.lofted.chord_mm).fold(0.0, f64::max);
    let (names, obj) = groups_obj(&mesh)?;
    let radius = cutter_radius(0.04 * chord);
    let (mut setups, mut operations, mut shares) = (Vec::new(), Vec::new(), Vec::new());
    // The flange of the arbor is above the hub and other blades, also where the tool leans.
    let mut reach = 4.0 * radius;
    for (blade, (side, side_name)) in blades.iter().flat_map(|blade| SIDES.map(|side| (blade, side))) {
        let name = blade.word() + side_name;
        if !names.contains(&blade.group(side)) {
            return Err(in_file(format!("the blade has no {name}")));
        }
        let SideSetup { setup, middle, rise, above_hub } = setup(&mesh, (blade, side), &name, radius)?;
        setups.push(setup);
        reach = f64::max(reach, rise + FLANGE_RADIUS * MOST_TILT_DEG.to_radians().sin());
        if let Some((_, share)) = above_hub {
            if share <= 0.0 {
                return Err(in_file(format!(
                    "two cutter radii above the hub, nothing is left of the blade's {name}; leave the hub out"
                )));
            }
            shares.push(format!("{share:.2}"));
        }
        // Along the span, which is along x: across it the tool would turn from edge to edge and
        // back.
        let seed = json!({ "plane": { "normal": [0.0, 1.0, 0.0], "origin_mm": [0.0, middle, 0.0] } });
        let mut strategy = json!({ "constant_scallop": { "seed": seed } });
        if let Some((above_hub, _)) = above_hub {
            let within = json!({ "parallel_planes": { "normal": [1.0, 0.0, 0.0], "from_mm": above_hub } });
            strategy["constant_scallop"]["within"] = within;
        }
        let mut operation = operation(&name, radius, &strategy, chord / 2240.0);
        operation["setup"] = json!(name);
        operation["path"]["strategy"]["width_rounds"] = json!(WIDTH_ROUNDS);
        // Rounded up to the next thousandth.
        operation["tolerances"]["mesh_chord_mm"] = json!(round_to((1000.0 * mesh_chord).ceil() / 1000.0, 3));
        operations.push(operation);
    }
    let [short, whole] = names_of(file, (&described, &blades), scale, &shares);
    let name = if whole.chars().count() > MOST_NAME { &short } else { &whole };
    let mut job = job_file(name, Value::Null, Value::Null);
    job["setups"] = Value::Array(setups);
    job["operations"] = Value::Array(operations);
    Ok((job_folder((MESH_FILE, obj), &job, (radius, reach.ceil())), whole))
}

/// Returns the name of a job without and with the ends of its blades and the shares of their sides.
fn names_of(file: &Path, (described, blades): (&BladeFile, &[SetBlade]), scale: f64, shares: &[String]) -> [String; 2] {
    let stem = file.file_stem().map(|stem| stem.to_string_lossy().chars().take(NAME_CHARS).collect::<String>());
    let stem = stem.unwrap_or_default();
    let sets = if blades.len() > 1 { format!(" sets of {}", blades.len()) } else { String::new() };
    let around = described.n_blades.map(|n| format!(", one of {n}{sets}")).unwrap_or_default();
    let short = format!("blade {stem}{around}, scale {scale}");
    let mut ends = blades.iter().map(ends_text).collect::<String>();
    if !shares.is_empty() {
        ends += &format!(", passes on {} of the sides", shares.join(" and "));
    }
    let whole = format!("{short}{ends}");
    [short, whole]
}

/// Returns where a blade ends at hub and shroud.
fn ends_text(blade: &SetBlade) -> String {
    let word = blade.word();
    let text = |end: LoftEnd, wall: &str, name: &str| match end {
        LoftEnd::Wall => format!(", {word}cut at the {wall}"),
        LoftEnd::SectionOnWall => format!(", {word}{name} on the {wall}"),
        LoftEnd::SectionBeforeWall { gap_mm } => format!(", {word}{name} {gap_mm:.2} mm off the {wall}"),
        _ => String::new(),
    };
    let [root, tip] = blade.lofted.ends;
    text(root, "hub", "root") + &text(tip, "shroud", "tip")
}

/// Returns the names of a mesh's groups, and the mesh as a file in which each is an object.
pub(crate) fn groups_obj(mesh: &TriMesh) -> Result<(Vec<String>, Vec<u8>), String> {
    let (names, parts) = parts_by_group(mesh);
    let obj = write_obj(&parts.iter().collect::<Vec<_>>(), &nodes_in_place(&names)).map_err(|e| e.to_string())?;
    Ok((names, obj))
}

/// Setup of a side.
struct SideSetup {
    /// The side faces up, and the span is along x.
    setup: Value,
    /// Middle of the side along y, mm.
    middle: f64,
    /// Height of the highest place of other bodies above the lowest of the side, mm; 0 without any.
    rise: f64,
    /// With a hub, the place along x from which the cutter is clear of it, mm, and the share of the
    /// side that is beyond.
    above_hub: Option<(f64, f64)>,
}

/// Returns the setup of a side of a blade, in which other blades of the set are obstacles. `mesh`
/// has all of them.
fn setup(mesh: &TriMesh, (blade, side): (&SetBlade, &str), name: &str, radius: f64) -> Result<SideSetup, String> {
    let turn = side_up(&blade.lofted, side).ok_or_else(|| format!("the blade's {name} faces nowhere"))?;
    let group = blade.group(side);
    let (axis, angle) = turn.axis_angle().unwrap_or((Vector3::z_axis(), 0.0));
    let axis = axis.iter().map(|c| round_to(*c, 9)).collect::<Vec<_>>();
    let angle = round_to(angle.to_degrees(), 6);
    let turned: Vec<Point3<f64>> = mesh.vertices().iter().map(|p| turn * p).collect();
    let [x, y, z] = [0, 1, 2].map(|k| bounds(&turned, k));
    let middle = |[low, high]: [f64; 2]| -round_to(0.5 * (low + high), 0);
    let down = -z[0].floor();
    let stock = stock_for(radius);
    let size = [x, y, z].iter().map(|[low, high]| high - low).fold(0.0, f64::max);
    let vertices_of = |is_of: &dyn Fn(&str) -> bool| -> Vec<Point3<f64>> {
        let groups = mesh.groups().iter().filter(|g| is_of(&g.name));
        groups
            .flat_map(|g| mesh.triangles()[g.triangles.clone()].iter().flatten())
            .map(|&v| turned[v as usize])
            .collect()
    };
    // The hub beside the blade alone: it may rise far before or behind it.
    let own: Vec<String> = blade.lofted.mesh.groups().iter().map(|g| blade.group(&g.name)).collect();
    let is_of_hub = |name: &str, group: &str| name.rsplit('/').next() == Some(group);
    let is_part =
        |name: &str| own.iter().any(|own| own == name) && !HUB_GROUPS.iter().any(|group| is_of_hub(name, group));
    let off_hub = vertices_of(&is_part);
    let [front, back] =
        [f64::min as fn(f64, f64) -> f64, f64::max].map(|of| off_hub.iter().map(|p| p.y).reduce(of).unwrap_or(0.0));
    let beside = front - HUB_RADII * radius..=back + HUB_RADII * radius;
    let on_hub = vertices_of(&|name| is_of_hub(name, HUB_GROUPS[0]));
    let above_hub = on_hub.iter().filter(|p| beside.contains(&p.y)).map(|p| p.x + middle(x)).reduce(f64::max);
    let above_hub = above_hub.map(|top| (top + HUB_RADII * radius + CHECK_ALLOWANCE).ceil());
    let share_above = |from: f64| {
        let of = mesh.groups().iter().filter(|g| g.name == group).flat_map(|g| g.triangles.clone());
        let (mut above, mut all) = (0.0, 0.0);
        for corners in of.map(|t| mesh.triangles()[t].map(|v| turned[v as usize])) {
            let [a, b, c] = corners;
            let area = (b - a).cross(&(c - a)).norm();
            all += area;
            let is_above = (a.x + b.x + c.x) / 3.0 + middle(x) > from;
            above += if is_above { area } else { 0.0 };
        }
        above / f64::max(all, f64::MIN_POSITIVE)
    };
    let mut meshes = vec![
        json!({ "file": MESH_FILE, "groups": [group], "role": "drive", "unit": "millimetre", "up_axis": "z" }),
        json!({ "file": MESH_FILE, "role": "part", "unit": "millimetre", "up_axis": "z" }),
    ];
    let all = || mesh.groups().iter().map(|g| g.name.as_str());
    let others: Vec<&str> = all().filter(|name| !is_part(name)).collect();
    if !others.is_empty() {
        meshes[1]["groups"] = json!(all().filter(|name| is_part(name)).collect::<Vec<_>>());
        let mut check = meshes[0].clone();
        (check["groups"], check["role"]) = (json!(others), json!("check"));
        check["allowance_mm"] = json!(CHECK_ALLOWANCE);
        meshes.push(check);
    }
    let setup = json!({
        "name": name,
        "work_from_part": {
            "translation_mm": [middle(x), middle(y), down],
            "rotation_axis": axis,
            "rotation_deg": angle,
        },
        "table_from_work": { "translation_mm": [0.0, 0.0, (HEIGHT + HEIGHT_SHARE * size).ceil()] },
        "meshes": meshes,
        "stock": { "offset": { "allowance_mm": stock } },
        "clearance": { "plane": { "origin_mm": [0.0, 0.0, (z[1] + down + stock + 10.0).ceil()] } },
    });
    let on_side = vertices_of(&|name| name == group);
    let middle = round_to(middle(y) - middle(bounds(&on_side, 1)), 0);
    // Farther away the flange is not, whichever pass the tool is on.
    let [along, across] = [0, 1].map(|k| bounds(&on_side, k));
    let is_near = |p: &Point3<f64>| {
        [(along, p.x), (across, p.y)]
            .iter()
            .all(|([low, high], c)| (low - FLANGE_RADIUS..=high + FLANGE_RADIUS).contains(c))
    };
    let mut around = vertices_of(&|name| !is_part(name));
    around.retain(is_near);
    let rise = if around.is_empty() { 0.0 } else { (bounds(&around, 2)[1] - bounds(&on_side, 2)[0]).max(0.0) };
    Ok(SideSetup { setup, middle, rise, above_hub: above_hub.map(|from| (from, share_above(from))) })
}

/// Returns the smallest and the largest of one coordinate of points.
fn bounds(points: &[Point3<f64>], k: usize) -> [f64; 2] {
    let range = points.iter().map(|p| p[k]);
    [range.clone().fold(f64::INFINITY, f64::min), range.fold(f64::NEG_INFINITY, f64::max)]
}

/// Returns the rotation after which a side's mean normal is +z and the span +x.
fn side_up(blade: &LoftedBlade, group: &str) -> Option<UnitQuaternion<f64>> {
    let mesh = &blade.mesh;
    let up = Unit::try_new(sum_over(mesh, group, |t| mesh.scaled_normal(t))?, 0.0)?;
    let span = centre(mesh, "tip")? - centre(mesh, "root").or_else(|| middle_of_root(blade))?;
    let along = Unit::try_new(span - *up * span.dot(&up), 0.0)?;
    let across = up.cross(&along);
    let work_from_part = Matrix3::from_rows(&[along.transpose(), across.transpose(), up.transpose()]);
    Some(UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(work_from_part)))
}

/// Returns the middle of the line around a blade's root, where a hub takes the place of its facets.
/// The middle of the hub is elsewhere: it may reach far before or behind the blade.
fn middle_of_root(blade: &LoftedBlade) -> Option<Point3<f64>> {
    let of_root = |(p, [span, _]): (&Point3<f64>, &[f64; 2])| (*span == 0.0).then_some(*p);
    let line: Vec<Point3<f64>> = blade.mesh.vertices().iter().zip(&blade.coordinates).filter_map(of_root).collect();
    let (mut moment, mut whole) = (Vector3::zeros(), 0.0);
    for (a, b) in line.iter().zip(line.iter().cycle().skip(1)) {
        let length = (b - a).norm();
        moment += (a.coords + b.coords) * (0.5 * length);
        whole += length;
    }
    (whole > 0.0).then(|| Point3::from(moment / whole))
}

/// Returns the distance of the middles of both edges.
fn leading_to_trailing(mesh: &TriMesh) -> f64 {
    let ends = [centre(mesh, "leading-edge"), centre(mesh, "trailing-edge")];
    if let [Some(leading), Some(trailing)] = ends { (trailing - leading).norm() } else { 0.0 }
}

fn centre(mesh: &TriMesh, group: &str) -> Option<Point3<f64>> {
    let area = |t: usize| mesh.scaled_normal(t).norm();
    let whole = sum_over(mesh, group, |t| Vector3::repeat(area(t)))?.x;
    let moment = sum_over(mesh, group, |t| {
        let [a, b, c] = mesh.corners(t);
        (a.coords + b.coords + c.coords) * (area(t) / 3.0)
    })?;
    (whole > 0.0).then(|| Point3::from(moment / whole))
}

fn sum_over(mesh: &TriMesh, group: &str, of: impl Fn(usize) -> Vector3<f64>) -> Option<Vector3<f64>> {
    let triangles = mesh.groups().iter().find(|g| g.name == group)?.triangles.clone();
    Some(triangles.map(of).sum())
}
