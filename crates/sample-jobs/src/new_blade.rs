//! Example jobs for blades from files of others.

use std::path::Path;

use facemill_blade_file::{BladeFile, EdgeEnd, ProfileSection, read_blade};
use facemill_sample_parts::{BladeLoft, BladeSections, EdgeForm, Endwalls, HubSector, LoftEnd, LoftedBlade};
use facemill_surface_model::{TriMesh, write_obj};
use nalgebra::{Matrix3, Point3, Rotation3, Unit, UnitQuaternion, Vector3};
use serde_json::{Value, json};

use crate::job_parts::{
    JobFiles, ROTOR_SCALES, ReadFile, cutter_radius, job_file, job_folder, operation, round_to, stock_for,
};
use crate::propeller_mesh::{nodes_in_place, parts_by_group};

/// Chord tolerance of a blade's mesh as a share of its size, and its limits, mm.
const CHORD_SHARE: f64 = 1e-4;
const CHORD_LIMITS: [f64; 2] = [0.002, 0.02];

/// Height of the lowest place of a blade above the table, mm, and what is added for its size: the
/// spindle nose comes down beside it where the tool leans.
const HEIGHT: f64 = 100.0;
const HEIGHT_SHARE: f64 = 0.5;

/// A side of a blade, which is cut in a setup of its own: its group, and the name of both.
const SIDES: [(&str, &str); 2] = [("suction", "suction side"), ("pressure", "pressure side")];

/// Thickness of the hub's sector as a share of the blade's size.
const HUB_SHARE: f64 = 0.05;

/// Radii of the cutter that passes keep from the hub along the span, and what bodies keep from it,
/// mm.
const HUB_RADII: f64 = 2.0;
const HUB_ALLOWANCE: f64 = 1.0;

/// Groups of a blade's mesh that are no part of the blade.
const HUB_GROUPS: [&str; 2] = ["hub", "hub-ends"];

/// Characters of a file's name in the name of its job, which is a comment of the programs.
const NAME_CHARS: usize = 30;

/// Returns the job of a blade by its `.inf` file: both sides, each in a setup in which it lies with
/// that side up; with a sector of its hub if requested.
pub(crate) fn blade_job(file: &Path, scale: f64, with_hub: bool, read: ReadFile<'_>) -> Result<JobFiles, String> {
    if !ROTOR_SCALES.contains(&scale) {
        return Err(format!("scale must be from {} to {}, is {scale}", ROTOR_SCALES.start(), ROTOR_SCALES.end()));
    }
    let described = read_blade_file(file, read)?;
    let blade = loft(&described, scale, with_hub).map_err(|why| format!("{}: {why}", file.display()))?;
    let chord = leading_to_trailing(&blade.mesh);
    let (names, obj) = groups_obj(&blade.mesh)?;
    let radius = cutter_radius(0.04 * chord);
    let (mut setups, mut operations, mut shares) = (Vec::new(), Vec::new(), Vec::new());
    for (group, name) in SIDES {
        if !names.iter().any(|n| n == group) {
            return Err(format!("{}: the blade has no {name}", file.display()));
        }
        let (setup, above_hub) = setup(&blade.mesh, group, name, radius)?;
        setups.push(setup);
        if let Some((_, share)) = above_hub {
            if share <= 0.0 {
                return Err(format!(
                    "{}: two cutter radii above the hub, nothing is left of the blade's {name}; leave the hub out",
                    file.display()
                ));
            }
            shares.push(format!("{share:.2}"));
        }
        // Planes across the span, which is along x.
        let mut strategy = json!({ "parallel_planes": { "normal": [1.0, 0.0, 0.0] } });
        if let Some((above_hub, _)) = above_hub {
            strategy["parallel_planes"]["from_mm"] = json!(above_hub);
        }
        let mut side = operation(name, radius, &strategy, chord / 2240.0);
        side["setup"] = json!(name);
        // Rounded up to the next thousandth.
        side["tolerances"]["mesh_chord_mm"] = json!(round_to((1000.0 * blade.chord_mm).ceil() / 1000.0, 3));
        operations.push(side);
    }
    let stem = file.file_stem().map(|stem| stem.to_string_lossy().chars().take(NAME_CHARS).collect::<String>());
    let stem = stem.unwrap_or_default();
    let around = described.n_blades.map(|n| format!(", one of {n}")).unwrap_or_default();
    let mut ends = ends_text(blade.ends);
    if !shares.is_empty() {
        ends += &format!(", passes on {} of the sides", shares.join(" and "));
    }
    let mut job = job_file(&format!("blade {stem}{around}, scale {scale}{ends}"), Value::Null, Value::Null);
    job["setups"] = Value::Array(setups);
    job["operations"] = Value::Array(operations);
    Ok(job_folder(("blade.obj", obj), &job, (radius, 4.0 * radius)))
}

/// Returns where a blade ends at hub and shroud, for the job's name.
fn ends_text(ends: [LoftEnd; 2]) -> String {
    let text = |end: LoftEnd, wall: &str, name: &str| match end {
        LoftEnd::Wall => format!(", cut at the {wall}"),
        LoftEnd::SectionOnWall => format!(", {name} on the {wall}"),
        LoftEnd::SectionBeforeWall { gap_mm } => format!(", {name} {gap_mm:.2} mm off the {wall}"),
        _ => String::new(),
    };
    let [root, tip] = ends;
    text(root, "hub", "root") + &text(tip, "shroud", "tip")
}

/// Reads an `.inf` file with those that it names, all below its folder.
fn read_blade_file(file: &Path, read: ReadFile<'_>) -> Result<BladeFile, String> {
    let folder = file.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let open = |name: &str| {
        let path = folder.join(name);
        // Links may lead out of the folder, too.
        let real = |path: &Path| path.canonicalize().map_err(|e| format!("{}: {e}", path.display()));
        if !real(&path)?.starts_with(real(folder)?) {
            return Err(format!("{name} is a link out of the folder; put the file itself below it"));
        }
        read(&path)
    };
    let bytes = read(file)?;
    read_blade(&file.display().to_string(), &bytes, open).map_err(|e| e.to_string())
}

/// Returns the blade between its hub and shroud, as large as requested.
fn loft(file: &BladeFile, scale: f64, with_hub: bool) -> Result<LoftedBlade, String> {
    let enlarged = |points: &[Point3<f64>]| points.iter().map(|p| p * scale).collect::<Vec<_>>();
    let scaled = |section: &ProfileSection| enlarged(&section.points);
    let first = file.sections.first().ok_or("the blade has no sections")?;
    let given = BladeSections {
        sections: file.sections.iter().map(scaled).collect(),
        is_cut_off: !first.is_closed,
        leading: first.leading,
        trailing: first.trailing,
        forms: file.ends.map(|end| {
            end.map(|end| match end {
                EdgeEnd::Ellipse => EdgeForm::Round,
                EdgeEnd::CutOff => EdgeForm::Flat,
            })
        }),
    };
    let far = given.sections.iter().flatten().map(|p| (p - given.sections[0][0]).norm()).fold(0.0, f64::max);
    let tolerance = (CHORD_SHARE * far).clamp(CHORD_LIMITS[0], CHORD_LIMITS[1]);
    let loft = BladeLoft::new(&given, |p| file.downstream(&(p / scale))).map_err(|e| e.to_string())?;
    let hub_sector = match (with_hub, file.n_blades) {
        (false, _) => None,
        (true, None) => return Err("has no \"Number of Blade Sets\", which a hub needs; add it".to_owned()),
        (true, Some(_)) if file.hub.is_empty() => {
            return Err("has no \"Hub Data File\", which a hub needs; add it".to_owned());
        }
        (true, Some(n_blades)) => Some(HubSector { n_blades, thickness: round_to((HUB_SHARE * far).max(1.0), 1) }),
    };
    let walls = Endwalls {
        axis: Unit::new_normalize(file.axis.direction()),
        hub: enlarged(&file.hub),
        shroud: enlarged(&file.shroud),
        hub_sector,
    };
    loft.mesh_between(&walls, tolerance).map_err(|e| e.to_string())
}

/// Returns the names of a mesh's groups, and the mesh as a file in which each is an object.
pub(crate) fn groups_obj(mesh: &TriMesh) -> Result<(Vec<String>, Vec<u8>), String> {
    let (names, parts) = parts_by_group(mesh);
    let obj = write_obj(&parts.iter().collect::<Vec<_>>(), &nodes_in_place(&names)).map_err(|e| e.to_string())?;
    Ok((names, obj))
}

/// Returns the setup in which a side faces up and the span is along x, and with a hub the place
/// along x from which the cutter is clear of it, and the share of the side that is beyond.
fn setup(mesh: &TriMesh, group: &str, name: &str, radius: f64) -> Result<(Value, Option<(f64, f64)>), String> {
    let turn = side_up(mesh, group).ok_or_else(|| format!("the blade's {name} faces nowhere"))?;
    let (axis, angle) = turn.axis_angle().unwrap_or((Vector3::z_axis(), 0.0));
    let axis = axis.iter().map(|c| round_to(*c, 9)).collect::<Vec<_>>();
    let angle = round_to(angle.to_degrees(), 6);
    let turned: Vec<Point3<f64>> = mesh.vertices().iter().map(|p| turn * p).collect();
    let bounds = |k: usize| {
        let range = turned.iter().map(|p| p[k]);
        [range.clone().fold(f64::INFINITY, f64::min), range.fold(f64::NEG_INFINITY, f64::max)]
    };
    let [x, y, z] = [0, 1, 2].map(bounds);
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
    let blade = vertices_of(&|name| !HUB_GROUPS.contains(&name));
    let [front, back] =
        [f64::min as fn(f64, f64) -> f64, f64::max].map(|of| blade.iter().map(|p| p.y).reduce(of).unwrap_or(0.0));
    let beside = front - HUB_RADII * radius..=back + HUB_RADII * radius;
    let on_hub = vertices_of(&|name| name == HUB_GROUPS[0]);
    let above_hub = on_hub.iter().filter(|p| beside.contains(&p.y)).map(|p| p.x + middle(x)).reduce(f64::max);
    let above_hub = above_hub.map(|top| (top + HUB_RADII * radius + HUB_ALLOWANCE).ceil());
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
        json!({ "file": "blade.obj", "groups": [group], "role": "drive", "unit": "millimetre", "up_axis": "z" }),
        json!({ "file": "blade.obj", "role": "part", "unit": "millimetre", "up_axis": "z" }),
    ];
    if above_hub.is_some() {
        let blade: Vec<&str> =
            mesh.groups().iter().map(|g| g.name.as_str()).filter(|name| !HUB_GROUPS.contains(name)).collect();
        meshes[1]["groups"] = json!(blade);
        let mut hub = meshes[0].clone();
        (hub["groups"], hub["role"], hub["allowance_mm"]) = (json!(HUB_GROUPS), json!("check"), json!(HUB_ALLOWANCE));
        meshes.push(hub);
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
    Ok((setup, above_hub.map(|from| (from, share_above(from)))))
}

/// Returns the rotation after which a side's mean normal is +z and the span +x.
fn side_up(mesh: &TriMesh, group: &str) -> Option<UnitQuaternion<f64>> {
    let up = Unit::try_new(sum_over(mesh, group, |t| mesh.scaled_normal(t))?, 0.0)?;
    let span = centre(mesh, "tip")? - centre(mesh, "root").or_else(|| centre(mesh, "hub"))?;
    let along = Unit::try_new(span - *up * span.dot(&up), 0.0)?;
    let across = up.cross(&along);
    let work_from_part = Matrix3::from_rows(&[along.transpose(), across.transpose(), up.transpose()]);
    Some(UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(work_from_part)))
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
