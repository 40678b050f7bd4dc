//! Draws the law of least time along the published path: the share of its limit that each axis
//! uses, over time.
//!
//! `cargo run --release -p facemill-feedrate --example time_law_picture >
//! docs/pictures/time-law.svg`

use std::fmt::Write;

use facemill_feedrate::{AxisMotion, TimeLawSettings, minimum_time_law};

#[path = "../tests/laws/time_law/spline_path.rs"]
#[expect(dead_code, reason = "the tests of the same path need more of it")]
mod spline_path;

const WIDTH: f64 = 760.0;
const HEIGHT: f64 = 130.0;
const LEFT: f64 = 92.0;
const COLOURS: [&str; 5] = ["#1b9e77", "#d95f02", "#7570b3", "#666666", "#e7298a"];

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let bounds = spline_path::published_bounds();
    let law = minimum_time_law(&spline_path::SplinePath, &bounds, &TimeLawSettings::default())?;
    let time = law.total_time();
    let mut svg = String::new();
    writeln!(
        svg,
        r#"<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {} 520" font-family="sans-serif" font-size="12">"#,
        LEFT + WIDTH + 20.0
    )?;
    writeln!(svg, r#"<rect width="100%" height="100%" fill="white"/>"#)?;
    type Row = (&'static str, fn(&AxisMotion, usize) -> f64, fn(&facemill_feedrate::AxisBounds) -> f64);
    let rows: [Row; 3] = [
        ("velocity", |m, k| m.velocity[k], |b| b.velocity),
        ("acceleration", |m, k| m.acceleration[k], |b| b.acceleration),
        ("jerk", |m, k| m.jerk[k], |b| b.jerk),
    ];
    for (row, (name, value, limit)) in rows.into_iter().enumerate() {
        let middle = 24.0 + (HEIGHT + 20.0) * row as f64 + HEIGHT / 2.0;
        let y = |share: f64| middle - share * HEIGHT / 2.0;
        for share in [-1.0, 0.0, 1.0] {
            let (y, end) = (y(share), LEFT + WIDTH);
            writeln!(svg, r##"<path d="M{LEFT} {y}H{end}" stroke="#cccccc" fill="none"/>"##)?;
            writeln!(svg, r#"<text x="{}" y="{}" text-anchor="end">{share}</text>"#, LEFT - 6.0, y + 4.0)?;
        }
        writeln!(svg, r#"<text x="4" y="{}">{name}</text>"#, middle - 14.0)?;
        for (axis, b) in bounds.axes.iter().enumerate() {
            let points: Vec<String> = (0..=380)
                .map(|k| {
                    let t = time * f64::from(k) / 380.0;
                    format!("{:.1},{:.1}", LEFT + 2.0 * f64::from(k), y(value(&law.at(t), axis) / limit(b)))
                })
                .collect();
            let colour = COLOURS[axis];
            writeln!(svg, r#"<polyline points="{}" fill="none" stroke="{colour}"/>"#, points.join(" "))?;
        }
    }
    for second in 0..=time as u32 {
        let x = LEFT + WIDTH * f64::from(second) / time;
        writeln!(svg, r#"<text x="{x:.1}" y="486" text-anchor="middle">{second} s</text>"#)?;
    }
    for (axis, name) in ["X", "Y", "Z", "A", "C"].into_iter().enumerate() {
        let x = LEFT + 60.0 * axis as f64;
        writeln!(svg, r#"<text x="{x}" y="508" fill="{}">{name}</text>"#, COLOURS[axis])?;
    }
    writeln!(svg, r#"<text x="{}" y="508">share of each limit, {time:.3} s in all</text>"#, LEFT + 320.0)?;
    writeln!(svg, "</svg>")?;
    print!("{svg}");
    Ok(())
}
