//! The picture of a part in the colours of its deviation, as the GLB of `facemill verify
//! --deviation` has them.

use std::fmt::Write as _;
use std::path::Path;

use facemill::new_job::{NewJob, new_job};
use facemill::report::deviation::DeviationReport;
use facemill::{
    CutRequest, DeviationRequest, Job, PlanSettings, SilentStages, VerifyRequest, files, plan_setup, verify_program,
};

type Result<T> = std::result::Result<T, Box<dyn std::error::Error>>;

/// Side of the patch, mm.
const SIZE: f64 = 60.0;
/// Cells of the picture to a side; of the stock twice as many, which sees cusps between passes that
/// are 2 mm apart.
const CELLS: usize = 120;
/// Pixels to a cell.
const PIXELS: f64 = 4.0;

/// Draws a wavy patch from above: planned, with some blocks 0.3 mm deeper, and the last passes left
/// out.
pub(crate) fn deviation() -> Result<String> {
    let folder = tempfile::tempdir()?;
    files::write_all(folder.path(), &new_job(&NewJob::Patch { size_mm: SIZE })?)?;
    let path = folder.path().join("job.json");
    let mut job: serde_json::Value = serde_json::from_slice(&files::read(&path)?)?;
    // More than the planted gouge: below the stock of an open surface nothing is known.
    job["setups"][0]["stock"]["offset"]["allowance_mm"] = 0.5.into();
    files::write_one(&path, facemill::file_format::to_json(&job).into_bytes())?;
    let job = Job::read(&path)?;
    let planned = plan_setup(&job, 0, PlanSettings { verify: false, certificates: false }, &SilentStages)?;
    let text = planned.files.iter().find(|(name, _)| name == "program.nc").ok_or("no program")?;
    let text = spoilt(std::str::from_utf8(&text.1)?);
    let request = VerifyRequest {
        cut: Some(CutRequest {
            deviation: Some(DeviationRequest { tolerance: Some(0.06), painted: true, since_stock: false }),
            ..CutRequest::on_lines(0.5 * SIZE / CELLS as f64, 0.005)
        }),
        ..VerifyRequest::new(Path::new("program.nc"), job.post.dialect())
    };
    let verified = verify_program(&job, text.as_bytes(), &request, &SilentStages)?;
    let report = verified.file.deviation.ok_or("no report")?;
    drawn(&seen_from_above(&verified.painted.ok_or("no colours")?)?, &report)
}

/// Removes the blocks behind three quarters of the cuts, and deepens a few in the middle.
fn spoilt(text: &str) -> String {
    let lines: Vec<&str> = text.lines().collect();
    let is_cut = |l: &str| [" Z", " B", " F"].iter().all(|word| l.contains(word));
    let cuts: Vec<usize> = (0..lines.len()).filter(|&k| is_cut(lines[k])).collect();
    let (deep, end) = (cuts[cuts.len() * 2 / 5], cuts[cuts.len() * 3 / 4]);
    let lowered = |word: &str| match word.strip_prefix('Z').and_then(|z| z.parse::<f64>().ok()) {
        Some(z) => format!("Z{:.3}", z - 0.3),
        None => word.to_owned(),
    };
    let mut out = String::new();
    for (k, line) in lines.iter().enumerate().take(end) {
        let words: Vec<String> =
            line.split(' ').map(|w| if (deep..deep + 4).contains(&k) { lowered(w) } else { w.to_owned() }).collect();
        let _ = writeln!(out, "{}", words.join(" "));
    }
    out + "M30\n"
}

/// Returns the colour of each cell, for screens.
fn seen_from_above(glb: &[u8]) -> Result<Vec<Option<[u8; 3]>>> {
    let length = u32::from_le_bytes(glb[12..16].try_into()?) as usize;
    let json: serde_json::Value = serde_json::from_slice(&glb[20..20 + length])?;
    let bin = &glb[28 + length..];
    let attributes = &json["meshes"][0]["primitives"][0]["attributes"];
    let data = |name: &str| -> Option<(&[u8], usize)> {
        let accessor = &json["accessors"][attributes[name].as_u64()? as usize];
        let view = &json["bufferViews"][accessor["bufferView"].as_u64()? as usize];
        Some((bin.get(view["byteOffset"].as_u64()? as usize..)?, accessor["count"].as_u64()? as usize))
    };
    let ((points, n), (colours, _)) = data("POSITION").zip(data("COLOR_0")).ok_or("no colours in the GLB")?;
    let mut cells = vec![([0.0; 3], 0.0); CELLS * CELLS];
    for k in 0..n {
        let at =
            |c: usize| -> Result<f64> { Ok(f64::from(f32::from_le_bytes(points[12 * k + 4 * c..][..4].try_into()?))) };
        // glTF: metres, +Y up.
        let cell = |v: f64| ((v / SIZE + 0.5) * CELLS as f64).clamp(0.0, CELLS as f64 - 1.0) as usize;
        let (column, row) = (cell(at(0)? * 1000.0), cell(-at(2)? * 1000.0));
        let (sum, weight) = &mut cells[row * CELLS + column];
        for c in 0..3 {
            sum[c] += f64::from(u16::from_le_bytes(colours[8 * k + 2 * c..][..2].try_into()?)) / 65535.0;
        }
        *weight += 1.0;
    }
    let byte = |light: f64| {
        let c = if light <= 0.003_130_8 { 12.92 * light } else { 1.055 * light.powf(1.0 / 2.4) - 0.055 };
        // Few colours make long rows of one.
        ((c * 255.0 / 10.0).round() * 10.0) as u8
    };
    Ok(cells.iter().map(|(sum, n)| (*n > 0.0).then(|| sum.map(|s| byte(s / n)))).collect())
}

fn drawn(cells: &[Option<[u8; 3]>], report: &DeviationReport) -> Result<String> {
    let side = CELLS as f64 * PIXELS;
    // The legend's longest line fits in DejaVu Sans, the widest of usual fonts.
    let (width, height) = (side + 400.0, side + 70.0);
    let mut svg = crate::picture(width, height, "Deviation of the cut stock from the part");
    for row in 0..CELLS {
        let colours = &cells[row * CELLS..(row + 1) * CELLS];
        let mut column = 0;
        for run in colours.chunk_by(|a, b| a == b) {
            if let Some([r, g, b]) = run[0] {
                let (x, y) = (20.0 + column as f64 * PIXELS, 50.0 + side - (row + 1) as f64 * PIXELS);
                let long = run.len() as f64 * PIXELS;
                let _ =
                    writeln!(svg, r##"<path d="M{x} {y}h{long}v{PIXELS}h-{long}z" fill="#{r:02x}{g:02x}{b:02x}"/>"##);
            }
            column += run.len();
        }
    }
    let figures = &report.part;
    let area = &figures.area_mm2;
    let reported = |place: &Option<facemill::report::deviation::DeviationPlace>| {
        place.map_or("none".to_owned(), |p| format!("{:.3} mm", p.value_mm))
    };
    let limit = report.tolerance_mm;
    let rows = [
        ("#3caa50", format!("within {limit:.2} mm: {:.0} mm²", area.within)),
        ("#faaa3c", format!("gouged by {limit:.2} mm: {:.0} mm²", area.gouged)),
        ("#be0014", format!("  by {:.2} mm and more; deepest {}", 4.0 * limit, reported(&figures.largest_gouge))),
        ("#78befa", format!("left by {limit:.2} mm: {:.0} mm²", area.excess)),
        ("#0a28aa", format!("  by {:.2} mm and more; most {}", 4.0 * limit, reported(&figures.largest_excess))),
        ("#cdcdcd", format!("not reached: {:.0} mm²", area.not_reached)),
        ("#5f5f5f", format!("not measured: {:.0} mm²", area.not_measured)),
    ];
    for (k, (colour, text)) in rows.iter().enumerate() {
        let (x, y) = (side + 40.0, 60.0 + 30.0 * k as f64);
        let _ = writeln!(svg, r##"<rect x="{x}" y="{y}" width="20" height="20" fill="{colour}"/>"##);
        let _ = writeln!(svg, r##"<text x="{}" y="{}">{text}</text>"##, x + 30.0, y + 15.0);
    }
    if let Some((c, r)) = report.cusps.as_ref().and_then(|c| Some((c, c.ratio?))) {
        let text = format!("cusps by predicted: {:.2} to {:.2} ({} places)", r.p5, r.p95, c.compared);
        let _ = writeln!(svg, r##"<text x="{}" y="{}">{text}</text>"##, side + 40.0, 60.0 + 30.0 * 7.0 + 15.0);
    }
    svg.push_str("</svg>\n");
    Ok(svg)
}
