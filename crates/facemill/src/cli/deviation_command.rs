//! Output of `facemill verify` on the cut stock's deviation and mesh.

use std::path::{Path, PathBuf};

use facemill::Failure;
use facemill::report::deviation::{CuspReport, CuspsNotCompared, DeviationFigures, DeviationPlace, DeviationReport};
use facemill::surface_model::{NamedNode, write_glb, write_obj, write_stl_binary};
use facemill::z_map::DexelMap;
use nalgebra::Isometry3;

/// Writer of a scene.
type Writer =
    fn(&[&facemill::surface_model::TriMesh], &[NamedNode<'_>]) -> Result<Vec<u8>, facemill::surface_model::ExportError>;

/// Returns the writer for a file's extension.
fn writer(file: &Path) -> Option<Writer> {
    match file.extension()?.to_str()?.to_ascii_lowercase().as_str() {
        "obj" => Some(write_obj),
        "stl" => Some(write_stl_binary),
        "glb" => Some(write_glb),
        _ => None,
    }
}

/// Returns a file for the rest as a mesh.
pub(crate) fn rest_mesh(text: &str) -> Result<PathBuf, String> {
    let file = PathBuf::from(text);
    if writer(&file).is_some() { Ok(file) } else { Err("must end in .obj, .stl or .glb".to_owned()) }
}

/// Returns a file for the part in colours.
pub(crate) fn painted_mesh(text: &str) -> Result<PathBuf, String> {
    let file = PathBuf::from(text);
    let is_glb = file.extension().is_some_and(|e| e.eq_ignore_ascii_case("glb"));
    if is_glb { Ok(file) } else { Err("must end in .glb, the format that keeps colours".to_owned()) }
}

/// Returns the rest as a closed mesh in the workpiece frame, in the format of the file's extension.
pub(crate) fn mesh_bytes(file: &Path, rest: &DexelMap) -> Result<Vec<u8>, Failure> {
    let coarser = |e: String| Failure::input(file, format!("{e}; take a larger --stock-cell-mm"));
    let mesh = rest.to_mesh().map_err(|e| coarser(e.to_string()))?;
    let node = NamedNode { name: "rest", mesh: 0, transform: Isometry3::identity() };
    let write = writer(file).ok_or_else(|| Failure::input(file, "must end in .obj, .stl or .glb"))?;
    if mesh.triangles().is_empty() {
        return Err(Failure::input(file, "no stock is left, so there is no mesh to write"));
    }
    write(&[&mesh], &[node]).map_err(|e| coarser(e.to_string()))
}

/// Returns the lines of the summary.
pub(crate) fn deviation_lines(report: &DeviationReport) -> Vec<String> {
    let tolerance = report.tolerance_mm;
    let mut lines = vec![format!(
        "  deviation         within tolerance to {tolerance:.3} mm; known to {:.3} mm on every line",
        report.uncertainty_mm
    )];
    for (name, figures) in [("drive surface", &report.drive), ("part", &report.part)] {
        lines.extend(figures_lines(name, figures));
    }
    if let Some(c) = &report.cavity {
        lines.push(format!("    hole in the part  {:.3} mm from its surface{}", c.value_mm, at(c)));
    }
    if let Some((c, r)) = report.cusps.as_ref().and_then(|c| Some((c, c.ratio?))) {
        lines.push(format!(
            "    cusps             {:.3} mm, predicted {:.3} mm; ratio at {} of {} places {:.2} to {:.2}, median {:.2}",
            c.largest_measured_mm, c.largest_predicted_mm, c.compared, c.sampled, r.p5, r.p95, r.median
        ));
    }
    lines.extend(report.cusps.as_ref().and_then(not_compared_lines));
    if report.exceeds_gouge_limit {
        lines.push("    DEEPER THAN ALLOWED: the program has cut into the part".to_owned());
    }
    lines
}

/// Returns the line on places where cusps are not compared, with reasons; `None` if there are none.
fn not_compared_lines(cusps: &CuspReport) -> Option<String> {
    let CuspsNotCompared { no_neighbour, too_close, beside_an_end, too_low, not_measured } = cusps.not_compared;
    let why = [
        (no_neighbour, "without a neighbouring pass"),
        (too_close, "nearer to it than four cells"),
        (beside_an_end, "beside the end of a pass"),
        (too_low, "lower than twice the uncertainty"),
        (not_measured, "without stock to measure"),
        (cusps.uncut, "beside an uncut strip"),
    ];
    let reasons: Vec<String> = why.iter().filter(|(n, _)| *n > 0).map(|(n, why)| format!("{n} {why}")).collect();
    (!reasons.is_empty()).then(|| format!("      not compared    {}", reasons.join(", ")))
}

fn figures_lines(name: &str, figures: &DeviationFigures) -> [String; 2] {
    let place_text = |place: &Option<DeviationPlace>| match place {
        Some(p) => format!("{:.3} mm{}", p.value_mm, at(p)),
        None => "none".to_owned(),
    };
    let a = &figures.area_mm2;
    let all = a.within + a.gouged + a.excess + a.not_reached + a.no_stock + a.not_measured;
    let share = |area: f64| if all > 0.0 { 100.0 * area / all } else { 0.0 };
    [
        format!(
            "    {name:<17} gouge {}, excess {}, left uncut {}",
            place_text(&figures.largest_gouge),
            place_text(&figures.largest_excess),
            place_text(&figures.largest_not_reached)
        ),
        format!(
            "      of {:.1} cm2      {:.1} % within, {:.1} % gouged, {:.1} % excess, {:.1} % not reached, \
             {:.1} % without stock, {:.1} % not measured",
            all / 100.0,
            share(a.within),
            share(a.gouged),
            share(a.excess),
            share(a.not_reached),
            share(a.no_stock),
            share(a.not_measured)
        ),
    ]
}

fn at(place: &DeviationPlace) -> String {
    let [x, y, z] = place.at_mm;
    format!(" at ({x:.2}, {y:.2}, {z:.2})")
}

#[cfg(test)]
#[path = "../../tests/unit/cli/deviation_command.rs"]
mod tests;
