//! Drawing of a machine's kinematic chain in three views, with the dimensions of its pivots.

mod pivots;
mod view;

use std::fmt::Write;

use facemill_inverse_kinematics::machine_file::AssumedValue;
use facemill_inverse_kinematics::{Axis, AxisKind, AxisValues, Carrier, Machine};
use nalgebra::{Point3, Vector3};

use crate::machine_svg::pivots::{Chain, Pivot, named};
use crate::machine_svg::view::{SheetView, VIEWS};
use crate::svg_text::{INK, LEADING, SIZE, draw_lines, escape, lines, more_lines, text_width};

/// Room of symbols around the points of a view, in pixels.
const PAD: f64 = 104.0;

/// Edge, width of the drawing, and room of two views beside or below each other, in pixels.
const MARGIN: f64 = 24.0;
const WIDTH: f64 = 1060.0;
const ROOM: [f64; 2] = [440.0, 560.0];

/// Distance of dimension lines.
const LANE: f64 = 19.0;

/// Largest scale, pixels per mm: pivots of some millimetres fill the page.
const LARGEST_SCALE: f64 = 5.0;

/// Colours: linear axes, rotary axes, head, table, dimensions.
const LINEAR: &str = "#2f9e62";
const ROTARY: &str = "#c9503f";
const HEAD: &str = "#2f6f9e";
const TABLE: &str = "#c07b1c";
const LINE: &str = "#5b646b";

/// Returns the drawing of a machine, one view of it for each head, all axes at 0: front, side and
/// top of the table frame in one scale, with the table's origin, the spindle noses, the lines of
/// the rotary axes through their pivots, directions and senses of all axes, and the offsets of
/// pivots in mm. Below are the offsets by name and the axes with their limits; `*` marks what the
/// machine file lists as assumed.
///
/// Names are those of the options of `facemill machine new`: table tilt, pivot length, pivot
/// offset, C offset. Directions and senses are those of the tool's motion against the workpiece
/// (ISO 841).
#[must_use]
pub fn machine_svg(heads: &[Machine]) -> String {
    let Some(machine) = heads.first() else { return String::new() };
    let chains: Vec<Chain> = heads.iter().map(Chain::of).collect();
    let pivots: Vec<Pivot> = chains.iter().zip(heads).flat_map(|(chain, head)| named(chain, head)).collect();
    let sheet = Sheet::of(&chains, &pivots);
    let families: Vec<String> = heads.iter().map(|head| head.family().to_string()).collect();
    let title = lines(&format!("{}: {}", machine.name(), families.join("; ")), 16.0, true, WIDTH - 2.0 * MARGIN);
    let down = LEADING * 16.0 * (title.len() - 1) as f64;
    let notes = notes(heads, &pivots);
    let notes: Vec<Vec<String>> = notes.iter().map(|note| lines(note, SIZE, false, WIDTH - 2.0 * MARGIN)).collect();
    let rows: f64 = notes.iter().map(|note| note.len() as f64 * LEADING * SIZE + 4.0).sum();
    let below = sheet.bottom() + down;
    let height = below + rows + MARGIN;
    let mut svg = String::new();
    // Writing to a string does not fail.
    let _ = writeln!(
        svg,
        r##"<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {height:.2}" width="{WIDTH}" height="{height:.2}" font-family="Helvetica, Arial, sans-serif" font-size="{SIZE}" fill="{INK}">
<rect width="{WIDTH}" height="{height:.2}" fill="#ffffff"/>"##
    );
    draw_lines(&mut svg, &title, [MARGIN, 34.0], 16.0, r#" font-weight="bold""#);
    let _ = writeln!(svg, r#"<g transform="translate(0 {down:.2})">"#);
    for view in sheet.views() {
        draw_view(&mut svg, &view, &chains, heads);
    }
    sheet.draw_dimensions(&mut svg, &pivots);
    sheet.draw_scale(&mut svg);
    svg.push_str("</g>\n");
    let mut y = below + SIZE;
    for note in &notes {
        draw_lines(&mut svg, note, [MARGIN, y], SIZE, "");
        y += more_lines(note, SIZE) + LEADING * SIZE + 4.0;
    }
    svg.push_str("</svg>\n");
    svg
}

/// Returns a number with at most four decimals, without zeros at its end or a sign of 0.
fn short(value: f64) -> String {
    let text = format!("{value:.4}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".to_owned() } else { text.to_owned() }
}

/// Places of the views on the sheet, and of the dimensions of each coordinate.
struct Sheet {
    /// Pixels per mm.
    scale: f64,
    /// Smallest and largest coordinates of all points, mm.
    low: Point3<f64>,
    high: Point3<f64>,
    /// Number of dimensions along x, y and z.
    n: [usize; 3],
}

impl Sheet {
    fn of(chains: &[Chain], pivots: &[Pivot]) -> Self {
        let points = chains.iter().flat_map(Chain::points);
        let (mut low, mut high) = (Point3::origin(), Point3::origin());
        for point in points {
            (low, high) = (low.inf(&point), high.sup(&point));
        }
        let size = high - low;
        let scale = (ROOM[0] / (size.x + size.y)).min(ROOM[1] / (size.y + size.z)).min(LARGEST_SCALE);
        let n = [0, 1, 2].map(|k| pivots.iter().filter(|pivot| pivot.is_seen(k)).count());
        Self { scale, low, high, n }
    }

    /// Returns width or height of a view along a coordinate, pixels.
    fn extent(&self, k: usize) -> f64 {
        (self.high[k] - self.low[k]) * self.scale + 2.0 * PAD
    }

    fn lanes(&self, k: usize) -> f64 {
        if self.n[k] == 0 { 16.0 } else { LANE * self.n[k] as f64 + 26.0 }
    }

    /// Returns left and top edge of a view, pixels.
    fn corner(&self, view: usize) -> [f64; 2] {
        const TOP: f64 = 64.0;
        let beside = MARGIN + self.extent(0) + self.lanes(2);
        let below = TOP + self.extent(2) + self.lanes(0) + 18.0;
        [[MARGIN, TOP], [beside, TOP], [MARGIN, below]][view]
    }

    fn bottom(&self) -> f64 {
        self.corner(2)[1] + self.extent(1) + 24.0
    }

    fn views(&self) -> impl Iterator<Item = SheetView> + '_ {
        VIEWS.iter().enumerate().map(|(k, of)| {
            let [x, y] = self.corner(k);
            let origin = [x + PAD - self.low[of.right] * self.scale, y + PAD + self.high[of.up] * self.scale];
            SheetView {
                of,
                corner: [x, y],
                size: [self.extent(of.right), self.extent(of.up)],
                origin,
                scale: self.scale,
            }
        })
    }

    /// Draws the offsets: along x below the front view, along y below the side view, along z
    /// between both.
    fn draw_dimensions(&self, svg: &mut String, pivots: &[Pivot]) {
        let views: Vec<SheetView> = self.views().collect();
        for (k, view) in [(0, &views[0]), (1, &views[1]), (2, &views[0])] {
            for (lane, pivot) in pivots.iter().filter(|pivot| pivot.is_seen(k)).enumerate() {
                let [from, to] = [pivot.from, pivot.to].map(|p| view.at(&p));
                let text = pivot.label(k);
                if k == 2 {
                    let x = view.corner[0] + view.size[0] + 18.0 + LANE * lane as f64;
                    draw_dimension(svg, [[from[0], from[1]], [to[0], to[1]]], [x, from[1]], [x, to[1]], &text);
                } else {
                    let y = view.corner[1] + view.size[1] + 20.0 + LANE * lane as f64;
                    draw_dimension(svg, [[from[0], from[1]], [to[0], to[1]]], [from[0], y], [to[0], y], &text);
                }
            }
        }
    }

    /// Draws a scale of a round length beside the top view.
    fn draw_scale(&self, svg: &mut String) {
        let decade = 10_f64.powf((60.0 / self.scale).log10().floor());
        let steps = [1.0, 2.0, 5.0, 10.0].map(|step| step * decade);
        let length = steps.into_iter().find(|length| length * self.scale >= 60.0).unwrap_or(steps[3]);
        let [x, y] = [self.corner(1)[0], self.corner(2)[1] + self.extent(1) - 12.0];
        let end = x + length * self.scale;
        let _ = writeln!(
            svg,
            r#"<path class="scale" d="M{x:.3},{:.2} V{y:.2} H{end:.3} V{:.2}" fill="none" stroke="{INK}"/><text x="{x:.2}" y="{:.2}">{} mm</text>"#,
            y - 5.0,
            y - 5.0,
            y - 9.0,
            short(length)
        );
    }
}

/// Draws a dimension line with its text, and thin lines from both points to its ends.
fn draw_dimension(svg: &mut String, points: [[f64; 2]; 2], from: [f64; 2], to: [f64; 2], text: &str) {
    for (point, end) in points.iter().zip([from, to]) {
        let _ = writeln!(
            svg,
            r#"<path d="M{:.2},{:.2} L{:.2},{:.2}" stroke="{LINE}" stroke-width="0.4"/>"#,
            point[0], point[1], end[0], end[1]
        );
    }
    let _ = writeln!(
        svg,
        r#"<path class="dimension" d="M{:.3},{:.3} L{:.3},{:.3}" stroke="{LINE}"/>"#,
        from[0], from[1], to[0], to[1]
    );
    for end in [from, to] {
        let _ = writeln!(svg, r#"<circle cx="{:.2}" cy="{:.2}" r="1.8" fill="{LINE}"/>"#, end[0], end[1]);
    }
    let middle = [0.5 * (from[0] + to[0]), 0.5 * (from[1] + to[1])];
    let upright = (from[0] - to[0]).abs() < 1e-6;
    let [x, y] = if upright { [middle[0] - 3.0, middle[1]] } else { [middle[0], middle[1] - 3.0] };
    let turn = if upright { format!(r#" transform="rotate(-90 {x:.2} {y:.2})""#) } else { String::new() };
    let _ = writeln!(
        svg,
        r##"<text x="{x:.2}" y="{y:.2}" font-size="11" text-anchor="middle" fill="{LINE}" stroke="#ffffff" stroke-width="3" paint-order="stroke"{turn}>{}</text>"##,
        escape(text)
    );
}

fn draw_view(svg: &mut String, view: &SheetView, chains: &[Chain], heads: &[Machine]) {
    let ([x, y], [width, height]) = (view.corner, view.size);
    let _ = writeln!(
        svg,
        r##"<rect x="{x:.2}" y="{y:.2}" width="{width:.2}" height="{height:.2}" fill="none" stroke="#d5d9dc"/>
<text x="{:.2}" y="{:.2}" font-size="12" fill="{LINE}">{}</text>"##,
        x + 8.0,
        y + 16.0,
        view.of.name
    );
    draw_table(svg, view);
    for (h, (chain, head)) in chains.iter().zip(heads).enumerate() {
        draw_nose(svg, view, chain);
        for (k, line) in chain.rotary.iter().filter(|line| h == 0 || !head.is_shared(line.axis)).enumerate() {
            let letter = head.axes()[line.axis].letter.to_string();
            draw_rotary(svg, view, (&line.point, &line.direction), &letter, k + 3 * h);
        }
        // Of two heads one in each lower corner.
        let at = if h == 0 { [x + 34.0, y + height - 30.0] } else { [x + width - 38.0, y + height - 52.0] };
        for line in chain.linear.iter().filter(|line| h == 0 || !head.is_shared(line.axis)) {
            let side = if line.carrier == Carrier::Table { " (table)" } else { "" };
            let text = format!("{}{side}", head.axes()[line.axis].letter);
            draw_direction(svg, at, view.along(&line.direction), view.toward(&line.direction), &text);
        }
    }
}

/// Draws the table's origin: its level, or its circle from above.
fn draw_table(svg: &mut String, view: &SheetView) {
    let [x, y] = view.at(&Point3::origin());
    let _ = if view.of.up == 2 {
        writeln!(svg, r#"<path d="M{:.2},{:.2} h72" stroke="{TABLE}" stroke-width="5"/>"#, x - 36.0, y + 2.5)
    } else {
        writeln!(svg, r#"<circle cx="{x:.2}" cy="{y:.2}" r="36" fill="none" stroke="{TABLE}" stroke-width="2"/>"#)
    };
    let below = if view.of.up == 2 { 18.0 } else { 50.0 };
    let _ = writeln!(
        svg,
        r#"<circle class="table" cx="{x:.3}" cy="{y:.3}" r="2.5" fill="{TABLE}"/><text x="{:.2}" y="{:.2}" fill="{TABLE}">table</text>"#,
        x - 38.0,
        y + below
    );
}

/// Draws the spindle nose, which widens into the spindle, with a tool.
fn draw_nose(svg: &mut String, view: &SheetView, chain: &Chain) {
    let [x, y] = view.at(&chain.nose);
    let [u, v] = view.along(&chain.spindle);
    if u.hypot(v) > 0.2 {
        let corner =
            |along: f64, across: f64| format!("{:.2},{:.2}", x + along * u - across * v, y + along * v + across * u);
        let _ = writeln!(
            svg,
            r##"<polygon points="{} {} {} {}" fill="#cfe0ee" stroke="{HEAD}"/><path d="M{x:.2},{y:.2} L{}" stroke="{HEAD}" stroke-width="3"/>"##,
            corner(0.0, -8.0),
            corner(0.0, 8.0),
            corner(24.0, 14.0),
            corner(24.0, -14.0),
            corner(-26.0, 0.0),
        );
    } else {
        let _ = writeln!(svg, r##"<circle cx="{x:.2}" cy="{y:.2}" r="14" fill="#cfe0ee" stroke="{HEAD}"/>"##);
    }
    let _ = writeln!(
        svg,
        r#"<circle class="nose" cx="{x:.3}" cy="{y:.3}" r="2.5" fill="{HEAD}"/><text x="{:.2}" y="{:.2}" fill="{HEAD}">nose</text>"#,
        x + 18.0,
        y - 6.0
    );
}

/// Draws the line of a rotary axis through its pivot: with an arrow about which it turns
/// right-handed, and where it leans out of the view with its turn and a dot or a cross.
fn draw_rotary(
    svg: &mut String,
    view: &SheetView,
    (point, direction): (&Point3<f64>, &Vector3<f64>),
    letter: &str,
    k: usize,
) {
    let [x, y] = view.at(point);
    let [u, v] = view.along(direction);
    let (flat, toward) = (u.hypot(v), view.toward(direction));
    let radius = 24.0 + 8.0 * k as f64;
    let half = 78.0 + 8.0 * k as f64;
    let _ = writeln!(svg, r#"<circle class="pivot-{letter}" cx="{x:.3}" cy="{y:.3}" r="3" fill="{ROTARY}"/>"#);
    if flat > 0.05 {
        let [from, to] = [-half, half].map(|t| [x + t * u, y + t * v]);
        let _ = writeln!(
            svg,
            r#"<path d="M{:.2},{:.2} L{:.2},{:.2}" stroke="{ROTARY}" stroke-width="1.3" stroke-dasharray="10 3 2 3"/>"#,
            from[0], from[1], to[0], to[1]
        );
        draw_head(svg, to, [u / flat, v / flat], ROTARY);
        let _ = writeln!(
            svg,
            r#"<text x="{:.2}" y="{:.2}" fill="{ROTARY}" font-weight="bold">{letter}</text>"#,
            to[0] + 8.0 * u / flat + 4.0,
            to[1] + 8.0 * v / flat + 4.0
        );
    }
    if toward.abs() < 0.05 {
        return;
    }
    // The turn about the axis as it is seen, from 20° on through 250°, at the end of a line that
    // leans.
    let (a, b) = view.frame(direction);
    let middle = [x + 0.55 * half * u, y + 0.55 * half * v];
    let at = |deg: f64| {
        let (sin, cos) = deg.to_radians().sin_cos();
        [0, 1].map(|i| middle[i] + radius * (a[i] * cos + b[i] * sin))
    };
    let arc: Vec<String> =
        (0..=50).map(|step| at(20.0 + 5.0 * f64::from(step))).map(|p| format!("{:.2},{:.2}", p[0], p[1])).collect();
    let _ = writeln!(
        svg,
        r#"<polyline class="turn-{letter}" points="{}" fill="none" stroke="{ROTARY}" stroke-width="1.5"/>"#,
        arc.join(" ")
    );
    let (end, before) = (at(270.0), at(262.0));
    let way = [end[0] - before[0], end[1] - before[1]];
    let length = way[0].hypot(way[1]).max(1e-9);
    draw_head(svg, end, [way[0] / length, way[1] / length], ROTARY);
    if flat <= 0.05 {
        draw_end_on(svg, [x, y], toward, ROTARY);
        let (sin, cos) = (35.0 + 40.0 * k as f64).to_radians().sin_cos();
        let _ = writeln!(
            svg,
            r#"<text x="{:.2}" y="{:.2}" fill="{ROTARY}" font-weight="bold">{letter}</text>"#,
            x + (radius + 6.0) * cos,
            y - (radius + 6.0) * sin + 4.0
        );
    }
}

/// Draws the direction of a linear axis from a corner of a view.
fn draw_direction(svg: &mut String, at: [f64; 2], [u, v]: [f64; 2], toward: f64, text: &str) {
    let flat = u.hypot(v);
    if flat <= 0.05 {
        let _ =
            writeln!(svg, r##"<circle cx="{:.2}" cy="{:.2}" r="6" fill="#ffffff" stroke="{LINEAR}"/>"##, at[0], at[1]);
        draw_end_on(svg, at, toward, LINEAR);
        let x = at[0] - 10.0 - text_width(text, 12.0, false).min(20.0);
        let _ =
            writeln!(svg, r#"<text x="{x:.2}" y="{:.2}" font-size="12" fill="{LINEAR}">{text}</text>"#, at[1] + 16.0);
        return;
    }
    let end = [at[0] + 34.0 * u, at[1] + 34.0 * v];
    let _ = writeln!(
        svg,
        r#"<path class="linear" d="M{:.2},{:.2} L{:.2},{:.2}" stroke="{LINEAR}" stroke-width="1.6"/>"#,
        at[0], at[1], end[0], end[1]
    );
    draw_head(svg, end, [u / flat, v / flat], LINEAR);
    let _ = writeln!(
        svg,
        r#"<text x="{:.2}" y="{:.2}" font-size="12" fill="{LINEAR}">{text}</text>"#,
        end[0] + 6.0,
        end[1] + if v < -0.5 { 0.0 } else { 14.0 }
    );
}

/// Draws the head of an arrow.
fn draw_head(svg: &mut String, [x, y]: [f64; 2], [u, v]: [f64; 2], color: &str) {
    let _ = writeln!(
        svg,
        r#"<polygon points="{:.2},{:.2} {:.2},{:.2} {:.2},{:.2}" fill="{color}"/>"#,
        x + 3.0 * u,
        y + 3.0 * v,
        x - 7.0 * u - 3.5 * v,
        y - 7.0 * v + 3.5 * u,
        x - 7.0 * u + 3.5 * v,
        y - 7.0 * v - 3.5 * u
    );
}

/// Draws an arrow that is seen from its end: a dot toward the eye, a cross away from it.
fn draw_end_on(svg: &mut String, [x, y]: [f64; 2], toward: f64, color: &str) {
    let _ = if toward > 0.0 {
        writeln!(svg, r#"<circle class="toward" cx="{x:.2}" cy="{y:.2}" r="3" fill="{color}"/>"#)
    } else {
        writeln!(
            svg,
            r#"<path class="away" d="M{:.2},{:.2} l8,8 m-8,0 l8,-8" stroke="{color}" stroke-width="1.5" fill="none"/>"#,
            x - 4.0,
            y - 4.0
        )
    };
}

/// Lists offsets and axes in lines.
fn notes(heads: &[Machine], pivots: &[Pivot]) -> Vec<String> {
    let mut notes = vec![
        "All axes at 0, seen in the frame of the table, lengths in mm. Arrows show how the tool moves against the \
         workpiece when a word grows (ISO 841); a rotary axis turns right-handed about its arrow. Dot: toward you, \
         cross: away. * assumed, not measured."
            .to_owned(),
    ];
    notes.extend(pivots.iter().map(Pivot::line));
    for (h, head) in heads.iter().enumerate() {
        let (lines, file) = (head.joint_lines(), head.to_file());
        for line in lines.iter().filter(|line| h == 0 || !head.is_shared(line.axis)) {
            let axis = &head.axes()[line.axis];
            let side = if line.carrier == Carrier::Table { "table" } else { "head" };
            let letter = axis.letter.to_string();
            let marked = |value: AssumedValue| if file.is_assumed(value, &letter) { " *" } else { "" };
            let d = line.direction;
            let way = match line.kind {
                AxisKind::Linear => "moves along",
                AxisKind::Rotary => "turns about",
            };
            notes.push(format!(
                "{letter}, {side}: {way} ({}, {}, {}){}; {}{}",
                short(d.x),
                short(d.y),
                short(d.z),
                marked(AssumedValue::Sense),
                limits(axis),
                marked(AssumedValue::Limits)
            ));
        }
    }
    notes
}

fn limits(axis: &Axis) -> String {
    let unit = match axis.kind {
        AxisKind::Linear => " mm",
        AxisKind::Rotary => "°",
    };
    if axis.has_no_stops() {
        return "endless".to_owned();
    }
    let [min, max] = [axis.min, axis.max].map(|value| short(axis.in_word_unit(value)));
    format!("{min} to {max}{unit}")
}

/// Returns the pose with all axes at 0.
fn zero(machine: &Machine) -> AxisValues {
    AxisValues::zeros(machine.axes().len())
}

#[cfg(test)]
#[path = "../tests/unit/machine_svg.rs"]
mod tests;
