//! Pictures of passes as they are laid by strategies that have no levels in space.

use std::f64::consts::TAU;
use std::path::Path;

use facemill::cc_path::files::StrategyFile;
use facemill::job_file::{JobFile, PathFile};
use facemill::new_job::{NewJob, Series, new_job};
use facemill::strategies::{default_strategies, lay_paths};
use facemill::surface_model::{NamedNode, TriMesh, write_obj};
use facemill::{Job, SilentStages, files};
use facemill_test_kit::grid_around;
use nalgebra::{Isometry3, Point3};
use serde_json::{Value, json};

type Result<T> = std::result::Result<T, Box<dyn std::error::Error>>;

/// Draws the passes of fronts from a border, of a flow, and of a spiral.
pub(crate) fn laid() -> Result<Vec<(String, Vec<u8>)>> {
    Ok(vec![
        ("passes-scallop.svg".to_owned(), fronts()?),
        ("passes-flow.svg".to_owned(), flow()?),
        ("passes-spiral.svg".to_owned(), spiral()?),
    ])
}

/// Draws fronts from the border of a side of a blade.
fn fronts() -> Result<Vec<u8>> {
    let folder = one_blade("constant scallop from the border")?;
    let path = folder.path().join("job.json");
    changed(&path, |job| {
        let strategy = &mut job["operations"][0]["path"]["strategy"];
        let within = strategy["strategy"].take();
        strategy["strategy"] = json!({ "constant_scallop": { "seed": "border", "within": within } });
        strategy["min_pass_length_mm"] = json!(10.0);
    })?;
    picture(&path)
}

/// Draws a flow from the inner to the outer end of the same side.
fn flow() -> Result<Vec<u8>> {
    let folder = one_blade("flow from end to end")?;
    let path = folder.path().join("job.json");
    let is_flow = |file: &JobFile| {
        let of = |o: &facemill::job_file::OperationFile| match &o.path {
            PathFile::Strategy(s) => matches!(s.strategy, StrategyFile::Flow(_)),
            _ => false,
        };
        file.operations.iter().all(of)
    };
    let all = default_strategies(&Job::read(&path)?)?;
    let flow = all.into_iter().find(|s| is_flow(&s.file)).ok_or("no flow")?;
    files::write_one(&path, facemill::file_format::to_json(&flow.file).into_bytes())?;
    picture(&path)
}

/// Radii of a ring on a dome, and the dome's own, mm.
const RING: [f64; 2] = [10.0, 38.0];
const DOME: f64 = 80.0;

/// Draws a spiral around a boss: a ring on a dome.
fn spiral() -> Result<Vec<u8>> {
    let folder = tempfile::tempdir()?;
    files::write_all(folder.path(), &new_job(&NewJob::Patch { size_mm: 80.0 })?)?;
    let (vertices, triangles) = grid_around([28, 240], |j, k| {
        let radius = RING[0] + (RING[1] - RING[0]) * f64::from(j) / 28.0;
        let (sin, cos) = (TAU * f64::from(k) / 240.0).sin_cos();
        Point3::new(radius * cos, radius * sin, (DOME * DOME - radius * radius).sqrt() - DOME)
    });
    let mesh = TriMesh::new(vertices, triangles)?;
    let node = NamedNode { name: "patch", mesh: 0, transform: Isometry3::identity() };
    files::write_one(&folder.path().join("patch.obj"), write_obj(&[&mesh], &[node])?)?;
    let path = folder.path().join("job.json");
    changed(&path, |job| {
        job["name"] = json!("spiral around a boss");
        job["operations"][0]["path"]["strategy"]["strategy"] = json!({ "spiral": { "cylindrical_sections": {
            "axis_direction": [0.0, 0.0, 1.0], "from_radius_mm": RING[0] + 1.5, "to_radius_mm": RING[1] - 1.5,
        } } });
        job["operations"][0]["path"]["strategy"]["order"] = json!("decreasing");
        job["operations"][0]["tolerances"]["max_step_mm"] = json!(1.5);
    })?;
    picture(&path)
}

/// Writes the sample job with one blade under a name.
fn one_blade(name: &str) -> Result<tempfile::TempDir> {
    let folder = tempfile::tempdir()?;
    let job = NewJob::Propeller { series: Series::Dtmb4119, diameter_mm: 3048.0 };
    files::write_all(folder.path(), &new_job(&job)?)?;
    changed(&folder.path().join("job.json"), |job| {
        job["name"] = json!(format!("DTMB 4119, {name}"));
        job["operations"][0]["pattern"] = Value::Null;
    })?;
    Ok(folder)
}

fn changed(path: &Path, change: impl Fn(&mut Value)) -> Result<()> {
    let mut job: Value = serde_json::from_slice(&files::read(path)?)?;
    change(&mut job);
    Ok(files::write_one(path, facemill::file_format::to_json(&job).into_bytes())?)
}

/// Lays the passes of a job and returns their picture.
fn picture(path: &Path) -> Result<Vec<u8>> {
    let laid = lay_paths(&Job::read(path)?, &SilentStages)?;
    let picture = laid.files.into_iter().find(|(name, _)| name.ends_with(".svg"));
    Ok(picture.ok_or("no picture")?.1)
}
