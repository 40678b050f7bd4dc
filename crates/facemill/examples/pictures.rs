//! Makes the pictures of the documentation from the sample job: `cargo run --release -p facemill
//! --example pictures` writes `docs/pictures/*.svg`; with `machines` behind it only those of the
//! machines, with `dual` only that of the two heads, with `deviation` only that of the deviation,
//! with `levels` only that of the sample's passes by cylinders, with `laid` only those of fronts, a
//! flow and a spiral.

use std::fmt::Write as _;
use std::path::Path;

use facemill::cl_data::Posture;
use facemill::cl_file::{AptPoint, AptPointKind, read_apt};
use facemill::tool_model::{Cusp, Cutter, FeedCurvature, Outline, cusp_height_between};
use facemill::z_map::{ZMap, ZMapSettings};
use facemill::{Job, PlanSettings, SilentStages, files, plan_setup, read_mesh};
use nalgebra::{Isometry3, Point3};

#[path = "pictures/deviation.rs"]
mod deviation;
#[path = "pictures/dual.rs"]
mod dual;
#[path = "pictures/figure.rs"]
mod figure;
#[path = "pictures/laid.rs"]
mod laid;
#[path = "pictures/machines.rs"]
mod machines;
#[path = "pictures/method.rs"]
mod method;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let argument = std::env::args().nth(1);
    if argument.as_deref() == Some("dual") {
        return Ok(files::write_all(Path::new("docs/pictures"), &[dual_picture()?])?);
    }
    if argument.as_deref() == Some("deviation") {
        return Ok(files::write_all(Path::new("docs/pictures"), &[deviation_picture()?])?);
    }
    if argument.as_deref() == Some("laid") {
        return Ok(files::write_all(Path::new("docs/pictures"), &laid::laid()?)?);
    }
    files::write_all(Path::new("docs/pictures"), &machines::machines()?)?;
    if argument.as_deref() == Some("machines") {
        return Ok(());
    }
    if argument.as_deref() == Some("levels") {
        let picture = plan("assets/propeller/job-cylinders.json")?.passes.into_bytes();
        return Ok(files::write_all(Path::new("docs/pictures"), &[("passes-cylinders.svg".to_owned(), picture)])?);
    }
    let path = argument.unwrap_or_else(|| "assets/propeller/job.json".to_owned());
    let Planned { job, passes, solution_space } = plan(&path)?;
    let pictures = vec![
        dual_picture()?,
        deviation_picture()?,
        ("passes.svg".to_owned(), passes.into_bytes()),
        ("solution-space.svg".to_owned(), solution_space),
        ("cusp.svg".to_owned(), cusp(job.tool.cutter()).into_bytes()),
        ("contact.svg".to_owned(), method::contact()?.into_bytes()),
        ("test-body.svg".to_owned(), method::test_body()?.into_bytes()),
        ("seating.svg".to_owned(), method::seating()?.into_bytes()),
        ("chip.svg".to_owned(), method::chip()?.into_bytes()),
    ];
    files::write_all(Path::new("docs/pictures"), &pictures)?;
    files::write_all(Path::new("docs/pictures"), &laid::laid()?)?;
    Ok(())
}

/// Pictures of a planned job.
struct Planned {
    job: Job,
    /// Path of the tool tip.
    passes: String,
    /// Solution space of the first point.
    solution_space: Vec<u8>,
}

/// Plans a job and draws its passes over its first mesh.
fn plan(path: &str) -> Result<Planned, Box<dyn std::error::Error>> {
    let job = Job::read(Path::new(path))?;
    let planned = plan_setup(&job, 0, PlanSettings { verify: true, certificates: false }, &SilentStages)?;
    let text = |name: &str| planned.files.iter().find(|(n, _)| n == name).map(|(_, bytes)| bytes.clone());
    let apt = read_apt(text("program.apt").ok_or("no APT file")?)?;
    let mesh_file = &job.file.setups[0].meshes[0];
    let mesh = read_mesh(&job.beside(&mesh_file.file), mesh_file.unit, mesh_file.up_axis)?.mesh;
    let map = ZMap::build(&mesh, &Isometry3::identity(), &ZMapSettings { cell: 24.0, margin: 0.0 })?;
    let passes = passes(&map, &apt.points);
    let solution_space = text("solution-space.svg").ok_or("no picture in the plan")?;
    Ok(Planned { job, passes, solution_space })
}

/// A picture and its name.
type Picture = (String, Vec<u8>);

fn dual_picture() -> Result<Picture, Box<dyn std::error::Error>> {
    Ok(("dual-pass.svg".to_owned(), dual::dual_pass()?.into_bytes()))
}

fn deviation_picture() -> Result<Picture, Box<dyn std::error::Error>> {
    Ok(("deviation.svg".to_owned(), deviation::deviation()?.into_bytes()))
}

/// Begins an empty picture with white ground.
fn picture(width: f64, height: f64, title: &str) -> String {
    format!(
        r##"<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" height="{height}" font-family="Helvetica, Arial, sans-serif" font-size="13" fill="#22282d">
<rect width="{width}" height="{height}" fill="#ffffff"/>
<text x="20" y="28" font-size="16" font-weight="bold">{title}</text>
"##
    )
}

/// Room around the part for entries and links, pixels.
const MARGIN: f64 = 80.0;

/// Draws the part from above, shaded by its slope, with the tool tip's path: cuts dark, entries and
/// exits orange, rapids blue.
fn passes(map: &ZMap, points: &[AptPoint]) -> String {
    let [nx, ny] = map.n_cells();
    let [x0, y0] = map.node_position(0, 0);
    let [x1, y1] = map.node_position(nx, ny);
    let scale = 680.0 / (x1 - x0).max(y1 - y0);
    let at = |x: f64, y: f64| (MARGIN + (x - x0) * scale, MARGIN + (y1 - y) * scale);
    let mut svg = picture(
        2.0 * MARGIN + (x1 - x0) * scale,
        2.0 * MARGIN + (y1 - y0) * scale,
        "Sample job from above: path of the tool tip",
    );
    svg.push_str("<g shape-rendering=\"crispEdges\">\n");
    for j in 0..ny {
        let shades: Vec<Option<u8>> = (0..nx).map(|i| shade(map, i, j)).collect();
        let mut i = 0;
        for run in shades.chunk_by(|a, b| a == b) {
            if let Some(level) = run[0] {
                let [x, y] = map.node_position(i, j);
                let (px, py) = at(x, y + map.cell());
                let side = map.cell() * scale;
                let gray = 150 + 10 * u32::from(level);
                let _ = writeln!(
                    svg,
                    r#"<rect x="{px:.1}" y="{py:.1}" width="{:.1}" height="{side:.1}" fill="rgb({gray},{gray},{gray})"/>"#,
                    side * run.len() as f64
                );
            }
            i += run.len();
        }
    }
    svg.push_str("</g>\n");
    let paths = TipPaths::of(points);
    for (lines, color, width) in
        [(&paths.rapids, "#3b6fb5", 0.6), (&paths.approaches, "#d97b1f", 1.2), (&paths.passes, "#17324a", 0.8)]
    {
        for line in lines {
            let places: Vec<String> =
                line.iter().map(|p| at(p.x, p.y)).map(|(x, y)| format!("{x:.1},{y:.1}")).collect();
            let _ = writeln!(
                svg,
                r#"<polyline points="{}" fill="none" stroke="{color}" stroke-width="{width}"/>"#,
                places.join(" ")
            );
        }
    }
    let y = 1.85 * MARGIN + (y1 - y0) * scale;
    let _ = writeln!(
        svg,
        r##"<text x="20" y="{y}"><tspan fill="#17324a">passes</tspan>   <tspan fill="#d97b1f">entries and exits</tspan>   <tspan fill="#3b6fb5">rapids</tspan></text>
</svg>"##
    );
    svg
}

/// Returns the brightness of a cell, 0 steep to 8 level; `None` if there is no part.
fn shade(map: &ZMap, i: usize, j: usize) -> Option<u8> {
    let z = |i, j| map.node_height(i, j);
    let (a, b, c) = (z(i, j)?, z(i + 1, j)?, z(i, j + 1)?);
    let slope = ((b - a) / map.cell()).hypot((c - a) / map.cell());
    Some((8.0 / (1.0 + slope * slope).sqrt()).round() as u8)
}

/// Polylines of the tool tip, by kind of move.
#[derive(Default)]
struct TipPaths {
    rapids: Vec<Vec<Point3<f64>>>,
    /// Entries and exits: along them the tool axis does not turn.
    approaches: Vec<Vec<Point3<f64>>>,
    passes: Vec<Vec<Point3<f64>>>,
}

impl TipPaths {
    fn of(points: &[AptPoint]) -> Self {
        let mut paths = Self::default();
        let mut before: Option<&AptPoint> = None;
        for run in points.chunk_by(|a, b| is_rapid(a) == is_rapid(b)) {
            let tips: Vec<&AptPoint> = before.into_iter().chain(run).collect();
            before = run.last();
            if is_rapid(&run[0]) {
                paths.rapids.push(thinned(&tips));
                continue;
            }
            let still =
                |end: &AptPoint, p: &&&AptPoint| (p.cl.axis.into_inner() - end.cl.axis.into_inner()).norm() < 1e-6;
            let entry = tips.iter().take_while(|p| still(tips[0], p)).count();
            let exit = tips.iter().rev().take_while(|p| still(tips[tips.len() - 1], p)).count();
            let (first, last) = (entry - 1, (tips.len() - exit).max(entry - 1));
            paths.approaches.extend([thinned(&tips[..=first]), thinned(&tips[last..])]);
            paths.passes.push(thinned(&tips[first..=last]));
        }
        paths
    }
}

fn is_rapid(p: &AptPoint) -> bool {
    p.kind == AptPointKind::Rapid
}

/// Returns the tips of points at least 8 mm apart, and the last one.
fn thinned(points: &[&AptPoint]) -> Vec<Point3<f64>> {
    let mut kept: Vec<Point3<f64>> = Vec::new();
    for (k, p) in points.iter().enumerate() {
        let tip = p.cl.tip;
        if k + 1 == points.len() || kept.last().is_none_or(|last| (tip - last).norm() >= 8.0) {
            kept.push(tip);
        }
    }
    kept
}

/// Draws two neighbouring passes seen along the feed: outlines of the tilted cutter and the cusp
/// between them, heights twenty times too large.
fn cusp(cutter: &Cutter) -> String {
    let posture = Posture { tilt: 3f64.to_radians(), rotate: 0.0 };
    let (step, curvature) = (30.0, 1.0 / 3000.0);
    let outline = Outline::new(cutter, posture);
    let Cusp::Height(height) = cusp_height_between(&outline, &outline, step, &FeedCurvature::straight(curvature))
    else {
        return String::new();
    };
    let (sx, sy, origin) = (6.0, 120.0, (360.0, 250.0));
    let surface = |y: f64| -0.5 * curvature * (y - 0.5 * step).powi(2);
    let line = |f: &dyn Fn(f64) -> Option<f64>, color: &str, width: f64| {
        let places: Vec<String> = (-500..=500)
            .map(|k| 0.5 * step + 0.11 * f64::from(k))
            .filter_map(|y| f(y).map(|z| (y, z)))
            .map(|(y, z)| (origin.0 - (y - 0.5 * step) * sx, origin.1 - z * sy))
            .filter(|(_, py)| (50.0..330.0).contains(py))
            .map(|(px, py)| format!("{px:.1},{py:.1}"))
            .collect();
        format!(
            "<polyline points=\"{}\" fill=\"none\" stroke=\"{color}\" stroke-width=\"{width}\"/>\n",
            places.join(" ")
        )
    };
    let pass_at = |at: f64| {
        move |y: f64| outline.height_at(y - at).map(|z| z + surface(at) + slope(curvature, step, at) * (y - at))
    };
    let mut svg = picture(720.0, 380.0, "Cusp between two passes, seen along the feed (heights × 20)");
    svg.push_str(&line(&|y| Some(surface(y)), "#22282d", 2.0));
    svg.push_str(&line(&pass_at(0.0), "#2f6f9e", 1.6));
    svg.push_str(&line(&pass_at(step), "#c9503f", 1.6));
    let _ = writeln!(
        svg,
        r##"<text x="20" y="352">surface (black), outlines of the cutter R {} r {} at tilt 3° (blue, red), step-over {step} mm: cusp {height:.3} mm</text>
</svg>"##,
        cutter.radius(),
        cutter.corner_radius()
    );
    svg
}

/// Returns the slope of the drawn surface.
fn slope(curvature: f64, step: f64, y: f64) -> f64 {
    -curvature * (y - 0.5 * step)
}
