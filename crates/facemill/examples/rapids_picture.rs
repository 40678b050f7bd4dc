//! Makes the picture of links before and after: `cargo run --release -p facemill --example
//! rapids_picture` writes `docs/pictures/rapids.svg`.
//!
//! The example patch is planned, and its links are led over a plane far above it, as programs from
//! elsewhere do; they are then replaced as `facemill rapids` does.

use std::path::Path;

use facemill::inverse_kinematics::{AxisValues, Machine};
use facemill::nc_program::{Dialect, MappedAxis, WordMap, WorkOffset, read_program};
use facemill::new_job::{NewJob, new_job};
use facemill::rapids::{RapidsFile, RapidsRequest, faster_rapids};
use facemill::z_map::DexelMap;
use facemill::{CutRequest, Job, PlanSettings, SilentStages, clock, files, plan_setup, read_mesh};
use nalgebra::{Isometry3, Point3};

#[expect(dead_code, reason = "the other pictures use more of it")]
#[path = "pictures/figure.rs"]
mod figure;

use figure::{BLUE, Figure, RED};

type Failed = Box<dyn std::error::Error>;

/// Z word that the links go to, mm: 65 mm above the workpiece's zero where the tool is upright.
const FAR: f64 = 365.0;

fn main() -> Result<(), Failed> {
    let folder = tempfile::tempdir()?;
    files::write_all(folder.path(), &new_job(&NewJob::Patch { size_mm: 160.0 })?)?;
    let job = Job::read(&folder.path().join("job.json"))?;
    let planned = plan_setup(&job, 0, PlanSettings { verify: false, certificates: false }, &SilentStages)?;
    let (name, text) = planned.files.iter().find(|(n, _)| n.ends_with(".nc")).ok_or("no program")?;
    let cut = CutRequest::on_lines(0.5, 0.05);
    let program = Path::new(name);
    let dialect = Dialect::Fanuc;
    let request = RapidsRequest { program, dialect, setup: 0, gouge_limit: None, cut, clearance: None };
    let text = &with_far_links(text)?;
    let made = faster_rapids(&job, text, &request, &SilentStages)?;
    print!("{}", made.file.table());
    let ways = [tip_ways(&job, text)?, tip_ways(&job, &made.text)?];
    let setup = &job.file.setups[0];
    let mesh = read_mesh(&job.beside(&setup.meshes[0].file), setup.meshes[0].unit, setup.meshes[0].up_axis)?.mesh;
    let stock = DexelMap::of_layer(&mesh, &Isometry3::identity(), 0.5, ALLOWANCE)?;
    let svg = picture(&stock, &ways, &made.file);
    files::write_one(Path::new("docs/pictures/rapids.svg"), svg.into_bytes())?;
    Ok(())
}

/// Returns the program with links straight up, over, and straight down.
fn with_far_links(text: &[u8]) -> Result<Vec<u8>, Failed> {
    let program = read_program(text, Dialect::Fanuc)?;
    let motions: Vec<_> = program.motions().collect();
    let runs: Vec<_> = motions.chunk_by(|a, b| a.1.kind.is_rapid() == b.1.kind.is_rapid()).collect();
    let mut lines: Vec<String> = std::str::from_utf8(text)?.lines().map(str::to_owned).collect();
    let is_link = |k: usize| k > 0 && k + 1 < runs.len() && runs[k][0].1.kind.is_rapid();
    for run in (0..runs.len()).rev().filter(|k| is_link(*k)).map(|k| runs[k]) {
        let [first, last] = [run[0].0.line, run[run.len() - 1].0.line].map(|line| line as usize);
        let end = run[run.len() - 1].1.position.words();
        let word = |letter: &str| end.iter().find(|w| w.letter.to_string() == letter).map_or(0.0, |w| w.value);
        let [x, y, z, b, c] = ["X", "Y", "Z", "B", "C"].map(word);
        let far = [format!("G0 Z{FAR:.3}"), format!("X{x:.3} Y{y:.3} B{b:.4} C{c:.4}"), format!("Z{z:.3}")];
        lines.splice(first - 1..last, far);
    }
    Ok((lines.join("\n") + "\n").into_bytes())
}

/// Thickness of the stock that is drawn, mm: that of the example.
const ALLOWANCE: f64 = 1.0;

/// Path of the tip on the work, and whether it is a rapid.
type TipPath = (bool, Vec<Point3<f64>>);

/// Returns the paths of the tip behind its first cut and before its last one.
fn tip_ways(job: &Job, text: &[u8]) -> Result<Vec<TipPath>, Failed> {
    let machine = &job.machine;
    let length = job.tool.gauge_length();
    let words = word_map(machine, length)?;
    let home: Vec<f64> = machine.home().iter().collect();
    let program = read_program(text, Dialect::Fanuc)?;
    let table_from_work: Isometry3<f64> = nalgebra::Translation3::new(0.0, 0.0, 300.0).into();
    let mut at: Option<AxisValues> = None;
    let mut ways: Vec<TipPath> = Vec::new();
    for (_, motion) in program.motions() {
        let Some(end) = words.joints_at(motion, &home).ok().and_then(|j| AxisValues::from_slice(&j)) else { continue };
        if let Some(start) = at.replace(end) {
            let tip = |t: f64| table_from_work.inverse() * machine.cl_point(&start.lerp(&end, t), length).tip;
            ways.push((motion.kind.is_rapid(), (0..=PARTS).map(|k| tip(f64::from(k) / f64::from(PARTS))).collect()));
        }
    }
    let first = ways.iter().position(|w| !w.0).unwrap_or(0);
    let last = ways.iter().rposition(|w| !w.0).unwrap_or(0);
    Ok(ways[first..=last].to_vec())
}

/// Number of straight parts that draw a motion.
const PARTS: u32 = 12;

fn word_map(machine: &Machine, length: f64) -> Result<WordMap, Failed> {
    let travel = machine.length_compensation_travel().ok_or("no axis along the spindle")?;
    let axis = |(k, a): (usize, &facemill::inverse_kinematics::Axis)| -> Result<MappedAxis, Failed> {
        Ok(MappedAxis { letter: a.letter.as_str().parse()?, offset: 0.0, along_spindle: travel.get_or_zero(k) })
    };
    let axes = machine.axes().iter().enumerate().map(axis).collect::<Result<_, _>>()?;
    Ok(WordMap::new(axes, WorkOffset::default(), length)?)
}

/// Colour of the stock.
const GROUND: &str = "#c9ced2";

/// Draws from the side the stock, and the path of the tip before and after, one above the other.
fn picture(stock: &DexelMap, ways: &[Vec<TipPath>; 2], file: &RapidsFile) -> String {
    let mut figure = Figure::new(760.0, 650.0, "Links of a sculptured surface, from the side");
    let titles = [
        format!("before: {} at rapid rate", clock(file.time_before_s)),
        format!("after: {}, the lower bound is {}", clock(file.time_after_s), clock(file.lower_bound_s)),
    ];
    for (k, (ways, (title, top))) in ways.iter().zip(titles.iter().zip([105.0, 42.0])).enumerate() {
        figure.scale = [3.4, 3.4];
        figure.origin = [380.0, 400.0 + 210.0 * k as f64];
        let mut ground = outline(stock);
        let ends = [ground.last(), ground.first()].map(|end| end.map_or(0.0, |[x, _]| *x));
        ground.extend(ends.map(|x| [x, -6.0]));
        figure.area(&ground, GROUND);
        for (_, way) in ways.iter().filter(|(is_rapid, _)| *is_rapid) {
            let seen: Vec<[f64; 2]> = way.iter().map(|p| [p.x, p.z]).collect();
            figure.curve(&seen, [RED, BLUE][k], 0.8, "");
        }
        figure.text([-105.0, top], [0.0, 0.0], [RED, BLUE][k], title);
    }
    figure.finish()
}

/// Returns the highest place of the stock along y, over x.
fn outline(stock: &DexelMap) -> Vec<[f64; 2]> {
    let [nx, ny] = stock.grid().n_lines();
    let highest = |i: usize| {
        let tops = (0..ny).filter_map(|j| stock.intervals(i, j).last()).map(|interval| interval.top);
        tops.reduce(f64::max).map(|top| [stock.grid().x(i), top])
    };
    (0..nx).filter_map(highest).collect()
}
