//! Both heads along one pass of the dual mill, drawn from a plan.

use facemill::cl_data::ClPoint;
use facemill::inverse_kinematics::{AxisKind, AxisValues, Machine};
use facemill::nc_program::read::MotionKind;
use facemill::nc_program::read_program;
use facemill::new_job::{NewJob, new_job};
use facemill::surface_model::{Surface, SurfaceSettings};
use facemill::tool_model::{Cutter, ToolAssembly};
use facemill::{Job, PlanSettings, Planned, SilentStages, plan_setup, read_mesh};
use nalgebra::{Translation3, Unit, Vector3};
use serde_json::{Value, json};

use crate::figure::{BLUE, Figure, GRAY, GREEN, INK, Mm, RED};

type Result<T> = std::result::Result<T, Box<dyn std::error::Error>>;

/// Passes of the example job that are planned: on sections between these parts of the diameter.
const BAND: [f64; 2] = [0.432, 0.449];

/// Diameter of the propeller, mm.
const DIAMETER: f64 = 1000.0;

/// State of both heads at one time.
struct Moment {
    /// Since the pass began, s.
    time: f64,
    /// deg.
    c: f64,
    /// Of both heads, deg.
    b: [f64; 2],
    /// Of both heads, deg.
    tilt: [f64; 2],
}

/// Draws C, B1, B2 and both tilts over the time of one pass.
pub(crate) fn dual_pass() -> Result<String> {
    let folder = tempfile::tempdir()?;
    for (name, bytes) in new_job(&NewJob::DualPropeller { diameter_mm: DIAMETER })? {
        let bytes = if name == "job.json" { narrowed(&bytes)? } else { bytes };
        std::fs::write(folder.path().join(name), bytes)?;
    }
    let job = Job::read(&folder.path().join("job.json"))?;
    let planned = plan_setup(&job, 0, PlanSettings { verify: false, certificates: false }, &SilentStages)?;
    let moments = moments(&job, &planned)?;
    Ok(draw(&moments, tilt_range(&job)))
}

/// Returns the job with passes of the band alone, on one blade.
fn narrowed(job: &[u8]) -> Result<Vec<u8>> {
    let mut job: Value = serde_json::from_slice(job)?;
    for operation in job["operations"].as_array_mut().ok_or("no operations")? {
        operation.as_object_mut().ok_or("no operation")?.remove("pattern");
        let sections = &mut operation["path"]["strategy"]["strategy"]["cylindrical_sections"];
        sections["from_radius_mm"] = json!(BAND[0] * DIAMETER);
        sections["to_radius_mm"] = json!(BAND[1] * DIAMETER);
    }
    Ok(serde_json::to_vec(&job)?)
}

fn tilt_range(job: &Job) -> [f64; 2] {
    job.file.operations[0].search.tilt_deg
}

/// Returns the second pass of both heads: a row of cuts in which rotary axes move; in those of
/// entries and exits they are at rest.
fn moments(job: &Job, planned: &Planned) -> Result<Vec<Moment>> {
    let nc = planned.files.iter().find(|(name, _)| name == "program.nc").ok_or("no program")?;
    let program = read_program(&nc.1, job.post.dialect())?;
    let views = Machine::heads_from_json(&std::fs::read(job.beside(&job.file.machine))?)?;
    let second = job.file.second_tool.as_ref().ok_or("no second tool")?;
    let tools = [job.tool.clone(), ToolAssembly::from_json(&std::fs::read(job.beside(second))?)?];
    let sides = sides(job)?;
    let mut rows: Vec<Vec<(AxisValues, f64)>> = vec![Vec::new()];
    let mut before: Option<AxisValues> = None;
    for motion in program.blocks.iter().filter_map(|b| b.motion.as_ref()) {
        let value = |k: usize| {
            let axis = &views[0].axes()[k];
            let word =
                axis.letter.as_str().parse().ok().and_then(|letter| motion.position.words().get(letter)).unwrap_or(0.0);
            let length =
                (0..2).find(|h| axis.letter.as_str() == format!("Z{}", h + 1)).map(|h| tools[h].gauge_length());
            if axis.kind == AxisKind::Rotary { word.to_radians() } else { word + length.unwrap_or(0.0) }
        };
        let axes = AxisValues::from_fn(views[0].axes().len(), value);
        let from = before.replace(axes);
        let turned = |from: &AxisValues| {
            let rotary = |k: &usize| views[0].axes()[*k].kind == AxisKind::Rotary;
            (0..axes.len()).filter(rotary).any(|k| axes[k] != from[k])
        };
        match (motion.kind, motion.feed, from) {
            (MotionKind::Linear, Some(feed), Some(from)) if turned(&from) => {
                let way = views[0].axes().iter().zip(axes.iter().zip(from.iter()));
                let way = way.map(|(axis, (a, b))| axis.in_word_unit(a - b).powi(2)).sum::<f64>().sqrt();
                if let Some(row) = rows.last_mut() {
                    if row.is_empty() {
                        row.push((from, 0.0));
                    }
                    row.push((axes, 60.0 * way / feed.value));
                }
            }
            _ if rows.last().is_some_and(|row| !row.is_empty()) => rows.push(Vec::new()),
            _ => {}
        }
    }
    let row = rows.into_iter().nth(1).filter(|row| row.len() > 1).ok_or("no second pass")?;
    let degrees = |axes: &AxisValues, name: &str| -> Result<f64> {
        let k = views[0].axis_index(name).ok_or("no such axis")?;
        Ok(axes[k].to_degrees())
    };
    let work_from_table = Translation3::from(-Vector3::from(job.file.setups[0].table_from_work.translation_mm));
    let mut time = 0.0;
    let mut moments = Vec::new();
    for (axes, seconds) in row {
        time += seconds;
        let tilt = |h: usize| {
            let cl = views[h].cl_point(&axes, tools[h].gauge_length()).transformed(&work_from_table.into());
            tilt(&sides[h], tools[h].cutter(), &cl).ok_or("no surface below the cutter")
        };
        moments.push(Moment {
            time,
            c: degrees(&axes, "C")?,
            b: [degrees(&axes, "B1")?, degrees(&axes, "B2")?],
            tilt: [tilt(0)?, tilt(1)?],
        });
    }
    Ok(moments)
}

/// Returns the sides of the blade that head 1 and head 2 cut.
fn sides(job: &Job) -> Result<[Surface; 2]> {
    let file = &job.file.setups[0].meshes[0];
    let mesh = read_mesh(&job.beside(&file.file), file.unit, file.up_axis)?.mesh;
    let side = |group: &str| Surface::new(mesh.select_groups(|name| name == group), SurfaceSettings::default());
    Ok([side("blade-1/suction"), side("blade-1/pressure")])
}

/// Returns the angle between the tool's axis and the normal of the surface at the contact, deg. The
/// contact is found by turns from the normal, and the normal from the contact.
fn tilt(side: &Surface, cutter: &Cutter, cl: &ClPoint) -> Option<f64> {
    let axis = cl.axis.into_inner();
    let mut normal = side.normal_at(&side.closest_point(&cl.tip, f64::INFINITY)?);
    for _ in 0..20 {
        let across = normal.into_inner() - axis * normal.dot(&axis);
        let rim = Unit::try_new(across, 1e-9).map_or_else(Vector3::zeros, Unit::into_inner);
        let center = cl.tip + axis * cutter.corner_radius() - rim * cutter.rim_radius();
        let contact = center - normal.into_inner() * cutter.corner_radius();
        normal = side.normal_at(&side.closest_point(&contact, f64::INFINITY)?);
    }
    Some(normal.angle(&cl.axis).to_degrees())
}

/// Height of a panel and room between two, pixels.
const PANEL: f64 = 120.0;
const GAP: f64 = 46.0;

/// Left border and width of the panels, pixels.
const LEFT: f64 = 80.0;
const WIDTH: f64 = 640.0;

fn draw(moments: &[Moment], tilts: [f64; 2]) -> String {
    let mut f = Figure::new(860.0, 560.0, "Both heads along one pass: one C, and each head's posture follows");
    let end = moments.last().map_or(1.0, |m| m.time);
    let curve = |value: &dyn Fn(&Moment) -> f64| -> Vec<Mm> { moments.iter().map(|m| [m.time, value(m)]).collect() };
    let c = vec![("C", curve(&|m| m.c), INK)];
    let b = vec![("B1", curve(&|m| m.b[0]), BLUE), ("B2", curve(&|m| m.b[1]), RED)];
    let t = vec![("head 1", curve(&|m| m.tilt[0]), BLUE), ("head 2", curve(&|m| m.tilt[1]), RED)];
    panel(&mut f, 0, "C, deg", end, &c, &[]);
    panel(&mut f, 1, "B1 and B2, deg", end, &b, &[]);
    panel(&mut f, 2, "tilt of both heads, deg (green: smallest and largest)", end, &t, &tilts);
    for k in 0..=4 {
        let time = end * f64::from(k) / 4.0;
        f.text([time, 0.0], [-14.0, 560.0 - f.origin[1] - 14.0], GRAY, &format!("{time:.1} s"));
    }
    f.finish()
}

fn panel(f: &mut Figure, index: usize, title: &str, end: f64, curves: &[(&str, Vec<Mm>, &str)], limits: &[f64]) {
    let values = || curves.iter().flat_map(|c| c.1.iter().map(|p| p[1])).chain(limits.iter().copied());
    let low = values().fold(f64::INFINITY, f64::min).floor();
    let high = values().fold(f64::NEG_INFINITY, f64::max).ceil().max(low + 1.0);
    let top = 64.0 + index as f64 * (PANEL + GAP);
    f.scale = [WIDTH / end, PANEL / (high - low)];
    f.origin = [LEFT, top + PANEL + low * f.scale[1]];
    f.text([0.0, high], [0.0, -8.0], INK, title);
    for value in [low, 0.5 * (low + high), high] {
        f.curve(&[[0.0, value], [end, value]], "#d9dde0", 0.8, "");
        f.text([0.0, value], [-46.0, 4.0], GRAY, &format!("{value:.1}"));
    }
    for &limit in limits {
        f.curve(&[[0.0, limit], [end, limit]], GREEN, 1.0, "6 4");
    }
    for (name, points, color) in curves {
        f.curve(points, color, 1.8, "");
        if let Some(&last) = points.last() {
            f.text(last, [8.0, 4.0], color, name);
        }
    }
}
