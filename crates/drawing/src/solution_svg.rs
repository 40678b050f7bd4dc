//! Picture of the feasible solution space (CLOPT fig. 3).

use std::fmt::Write;

use facemill_cl_data::Posture;
use facemill_cutter_location::search::map::{CellState, SolutionMap};
use facemill_cutter_location::{Infeasible, SearchCurve};

use crate::svg_text::{LEADING, SIZE, draw_lines, flow, lines, more_lines, text_width};

/// State of a cell of the picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Feasible,
    Gouge,
    Collision,
    Limits,
    Cone,
}

impl Kind {
    const ALL: [(Self, &'static str, &'static str); 5] = [
        (Self::Feasible, "#2f9e62", "feasible"),
        (Self::Gouge, "#c9503f", "cutter gouges"),
        (Self::Collision, "#d9a23b", "body collides"),
        (Self::Limits, "#7a6fb0", "axis limits"),
        (Self::Cone, "#9aa3ab", "outside the tool-axis cone"),
    ];

    fn of(blocked_by: Option<&Infeasible>) -> Self {
        match blocked_by {
            None => Self::Feasible,
            Some(Infeasible::Gouge { .. }) => Self::Gouge,
            Some(Infeasible::Collision { .. }) => Self::Collision,
            Some(Infeasible::OutsideCone { .. } | Infeasible::Singular { .. }) => Self::Cone,
            // The machine has no axis values; others are reasons of links.
            Some(_) => Self::Limits,
        }
    }

    fn color(self) -> &'static str {
        Self::ALL.iter().find(|(k, ..)| *k == self).map_or("#000000", |(_, color, _)| color)
    }
}

/// Position of the plot in the picture, in pixels.
const LEFT: f64 = 78.0;

const TOP: f64 = 62.0;

const WIDTH: f64 = 560.0;

const HEIGHT: f64 = 380.0;

/// Room right of the plot.
const RIGHT: f64 = 30.0;

/// Width of texts below the plot from their mark on.
const TEXT_WIDTH: f64 = WIDTH + RIGHT - 10.0 - MARK;

/// Distance from a mark of the legend to its text.
const MARK: f64 = 20.0;

/// Returns the picture: tilt to the right, amount of rotate upward; cells in the colour of the
/// proven state, without a proof paler, in that of the posture in the middle; the search curve as a
/// line, the posture taken as a ring.
pub fn map_svg(map: &SolutionMap, curve: &SearchCurve, taken: Option<Posture>, title: &str) -> String {
    let plot = Plot::of_map(map);
    let kinds: Vec<Kind> = map.cells.iter().map(|c| kind_of(&c.state)).collect();
    let area = map.fractions();
    let percent = |share: f64| 100.0 * share;
    let known = format!(
        "proven at {:.3}° or coarser: {:.1} % feasible, {:.1} % blocked",
        map.resolution.to_degrees(),
        percent(area.free),
        percent(area.blocked)
    );
    let unknown = format!("paler: not proven ({:.1} %), verdict in the middle of the cell", percent(area.uncertain));
    picture(title, &plot, curve, taken, &kinds, &[&known, &unknown], |svg| map_cells(svg, map, &plot))
}

/// Draws heading, cells, axes, curve, and a legend that ends with notes.
fn picture(
    title: &str,
    plot: &Plot,
    curve: &SearchCurve,
    taken: Option<Posture>,
    kinds: &[Kind],
    notes: &[&str],
    draw_cells: impl FnOnce(&mut String),
) -> String {
    let below = Legend::new(kinds, notes);
    let title = lines(title, SIZE, false, WIDTH + RIGHT - 10.0);
    let down = more_lines(&title, SIZE);
    let (w, h) = (LEFT + WIDTH + RIGHT, TOP + HEIGHT + down + below.height());
    let mut svg = String::new();
    // Writing to a string does not fail.
    let _ = writeln!(
        svg,
        r##"<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {w} {h}" width="{w}" height="{h}" font-family="Helvetica, Arial, sans-serif" font-size="{SIZE}" fill="#22282d">
<rect width="{w}" height="{h}" fill="#ffffff"/>
<text x="{LEFT}" y="26" font-size="16" font-weight="bold">Feasible tilt and rotate at one CC point</text>"##
    );
    draw_lines(&mut svg, &title, [LEFT, 46.0], SIZE, r##" fill="#5b646b""##);
    let _ = writeln!(svg, r#"<g transform="translate(0 {down})">"#);
    draw_cells(&mut svg);
    axes(&mut svg, plot);
    search_curve(&mut svg, curve, taken, plot);
    below.draw(&mut svg);
    svg.push_str("</g>\n</svg>\n");
    svg
}

/// Map from postures to pixels.
struct Plot {
    tilt: [f64; 2],
    rotate: [f64; 2],
}

impl Plot {
    /// Returns the map's own edges, with rotate 0 at the bottom.
    fn of_map(map: &SolutionMap) -> Self {
        let [a, b] = map.range.rotate;
        let rotate = if a.abs() <= b.abs() { [a, b] } else { [b, a] };
        Self { tilt: map.range.tilt, rotate }
    }

    /// Returns the position of a posture.
    fn at(&self, p: Posture) -> (f64, f64) {
        let share = |v: f64, ends: [f64; 2]| if ends[1] == ends[0] { 0.5 } else { (v - ends[0]) / (ends[1] - ends[0]) };
        (LEFT + share(p.tilt, self.tilt) * WIDTH, TOP + HEIGHT - share(p.rotate, self.rotate) * HEIGHT)
    }
}

fn kind_of(state: &CellState) -> Kind {
    match state {
        CellState::Free => Kind::Feasible,
        CellState::Blocked(why) => Kind::of(Some(why)),
        CellState::Uncertain(middle) => Kind::of(middle.as_ref()),
    }
}

fn map_cells(svg: &mut String, map: &SolutionMap, plot: &Plot) {
    svg.push_str("<g shape-rendering=\"crispEdges\">\n");
    for cell in &map.cells {
        let corner = |k: usize| plot.at(Posture { tilt: cell.range.tilt[k], rotate: cell.range.rotate[k] });
        let ((x0, y0), (x1, y1)) = (corner(0), corner(1));
        let opacity = if matches!(cell.state, CellState::Uncertain(_)) { r#" fill-opacity="0.45""# } else { "" };
        let _ = writeln!(
            svg,
            r#"<rect x="{:.3}" y="{:.3}" width="{:.3}" height="{:.3}" fill="{}"{opacity}/>"#,
            x0.min(x1),
            y0.min(y1),
            (x1 - x0).abs(),
            (y1 - y0).abs(),
            kind_of(&cell.state).color()
        );
    }
    svg.push_str("</g>\n");
}

fn axes(svg: &mut String, plot: &Plot) {
    let _ = writeln!(
        svg,
        r##"<rect x="{LEFT}" y="{TOP}" width="{WIDTH}" height="{HEIGHT}" fill="none" stroke="#22282d"/>"##
    );
    for k in 0..=5 {
        let share = f64::from(k) / 5.0;
        let tilt = plot.tilt[0] + share * (plot.tilt[1] - plot.tilt[0]);
        let rotate = plot.rotate[0] + share * (plot.rotate[1] - plot.rotate[0]);
        let (x, _) = plot.at(Posture { tilt, rotate });
        let (_, y) = plot.at(Posture { tilt, rotate });
        let (bottom, left) = (TOP + HEIGHT, LEFT);
        let _ = writeln!(
            svg,
            r##"<line x1="{x:.2}" y1="{bottom}" x2="{x:.2}" y2="{:.2}" stroke="#22282d"/><text x="{x:.2}" y="{:.2}" text-anchor="middle">{:.1}°</text>
<line x1="{left}" y1="{y:.2}" x2="{:.2}" y2="{y:.2}" stroke="#22282d"/><text x="{:.2}" y="{:.2}" text-anchor="end">{:.0}°</text>"##,
            bottom + 5.0,
            bottom + 20.0,
            tilt.to_degrees(),
            left - 5.0,
            left - 9.0,
            y + 4.5,
            // Adding 0 turns -0 into 0.
            rotate.to_degrees() + 0.0
        );
    }
    let (middle_x, middle_y) = (LEFT + 0.5 * WIDTH, TOP + 0.5 * HEIGHT);
    let _ = writeln!(
        svg,
        r#"<text x="{middle_x}" y="{}" text-anchor="middle">tilt α</text>
<text transform="translate(22 {middle_y}) rotate(-90)" text-anchor="middle">rotate β</text>"#,
        TOP + HEIGHT + 42.0
    );
}

fn search_curve(svg: &mut String, curve: &SearchCurve, taken: Option<Posture>, plot: &Plot) {
    let points: Vec<String> =
        (0..=60).map(|k| plot.at(curve.at(f64::from(k) / 60.0))).map(|(x, y)| format!("{x:.2},{y:.2}")).collect();
    let _ = writeln!(
        svg,
        r##"<polyline points="{}" fill="none" stroke="#ffffff" stroke-width="4"/><polyline points="{}" fill="none" stroke="#10222e" stroke-width="1.8"/>"##,
        points.join(" "),
        points.join(" ")
    );
    if let Some((x, y)) = taken.map(|p| plot.at(p)) {
        let _ = writeln!(
            svg,
            r##"<circle cx="{x:.2}" cy="{y:.2}" r="7" fill="#ffffff" stroke="#10222e" stroke-width="2.4"/>"##
        );
    }
}

/// Meaning of the colours present, and notes behind that on the search curve.
struct Legend {
    /// Colour and text, with position and line, of each entry.
    entries: Vec<(&'static str, &'static str, (f64, usize))>,
    n_lines: usize,
    notes: Vec<Vec<String>>,
}

impl Legend {
    /// Distance from the plot to the first line.
    const ABOVE: f64 = 62.0;

    /// Distance of the lines of entries.
    const LINE: f64 = 22.0;

    fn new(kinds: &[Kind], notes: &[&str]) -> Self {
        let there = Kind::ALL.into_iter().filter(|(kind, ..)| kinds.contains(kind));
        let there: Vec<(&str, &str)> = there.map(|(_, color, text)| (color, text)).collect();
        let widths: Vec<f64> = there.iter().map(|(_, text)| MARK + 14.0 + text_width(text, SIZE, false)).collect();
        let places = flow(&widths, TEXT_WIDTH + MARK);
        let n_lines = places.last().map_or(1, |(_, line)| line + 1);
        let entries = there.into_iter().zip(places).map(|((color, text), at)| (color, text, at)).collect();
        let notes = ["search curve, ring: posture taken"].iter().chain(notes);
        Self { entries, n_lines, notes: notes.map(|note| lines(note, SIZE, false, TEXT_WIDTH)).collect() }
    }

    /// Returns the height below the plot, with the axis.
    fn height(&self) -> f64 {
        let n_notes: usize = self.notes.iter().map(Vec::len).sum();
        Self::ABOVE + Self::LINE * self.n_lines as f64 + LEADING * SIZE * n_notes as f64 + 10.0
    }

    fn draw(&self, svg: &mut String) {
        let top = TOP + HEIGHT + Self::ABOVE;
        for (color, text, (along, line)) in &self.entries {
            let (x, y) = (LEFT + along, top + Self::LINE * *line as f64);
            let _ = writeln!(
                svg,
                r##"<rect x="{x:.2}" y="{y}" width="14" height="14" fill="{color}"/><text x="{:.2}" y="{}">{text}</text>"##,
                x + MARK,
                y + 12.0
            );
        }
        let mut y = top + Self::LINE * self.n_lines as f64 + SIZE;
        let mark = y - 4.5;
        let _ = writeln!(
            svg,
            r##"<line x1="{LEFT}" y1="{mark:.2}" x2="{}" y2="{mark:.2}" stroke="#10222e" stroke-width="1.8"/>"##,
            LEFT + 14.0
        );
        for note in &self.notes {
            draw_lines(svg, note, [LEFT + MARK, y], SIZE, "");
            y += LEADING * SIZE * note.len() as f64;
        }
    }
}

#[cfg(test)]
#[path = "../tests/unit/solution_svg.rs"]
mod tests;
