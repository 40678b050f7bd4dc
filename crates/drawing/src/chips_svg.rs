//! Picture of chip area and removal rate along the passes.

use std::fmt::Write;

use crate::svg_text::{INK, LEADING, SIZE, draw_lines, flow, lines, more_lines, text_width};

/// Chip at a point of an operation's passes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChartPoint {
    /// Length of the path along the passes up to here, mm.
    pub way: f64,
    /// Section of the chip, mm².
    pub area: f64,
    /// Whether the material left by the pass before is known.
    pub is_known: bool,
    /// Removal rates before feeds are set and as written, cm³/min; `None` where no block arrives.
    pub removal_rates: Option<[f64; 2]>,
}

/// Panels of an operation.
#[derive(Clone, Copy, Debug)]
pub struct Row<'r> {
    /// Name of the operation.
    pub name: &'r str,
    /// Points in cutting order.
    pub points: &'r [ChartPoint],
    /// Target of the removal rate, cm³/min.
    pub target: Option<f64>,
}

/// Position of the plots in the picture, in pixels.
const LEFT: f64 = 84.0;

const TOP: f64 = 84.0;

const WIDTH: f64 = 820.0;

const AREA_HEIGHT: f64 = 130.0;

const RATE_HEIGHT: f64 = 170.0;

const GAP: f64 = 26.0;

/// Room right of the plots.
const RIGHT: f64 = 30.0;

/// Distance from a mark of the legend to its text.
const MARK: f64 = 20.0;

/// Number of parts of the path that are drawn by their extremes: a pixel each.
const COLUMNS: usize = 820;

const AREA: &str = "#2f6f5e";

const BEFORE: &str = "#d98a3d";

const AFTER: &str = "#2f5f9e";

/// Returns the picture: for each operation the chip area over the cutting length, and below it the
/// removal rate at the job's cutting feed and as written. Draws smallest and largest of the points
/// in one column, so that no extreme is lost.
pub fn chips_svg(title: &str, rows: &[Row<'_>]) -> String {
    let title = lines(title, SIZE, false, WIDTH + RIGHT - 10.0);
    let mut top = TOP + more_lines(&title, SIZE);
    let rows: Vec<Placed<'_>> = rows.iter().map(|row| Placed::new(row, &mut top)).collect();
    let (w, h) = (LEFT + WIDTH + RIGHT, top);
    let mut svg = String::new();
    // Writing to a string does not fail.
    let _ = writeln!(
        svg,
        r##"<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {w} {h}" width="{w}" height="{h}" font-family="Helvetica, Arial, sans-serif" font-size="{SIZE}" fill="{INK}">
<rect width="{w}" height="{h}" fill="#ffffff"/>
<text x="{LEFT}" y="26" font-size="16" font-weight="bold">Chip area and removal rate along the passes</text>"##
    );
    draw_lines(&mut svg, &title, [LEFT, 46.0], SIZE, r##" fill="#5b646b""##);
    rows.iter().for_each(|row| row.draw(&mut svg));
    svg.push_str("</svg>\n");
    svg
}

/// Panels with their position.
struct Placed<'r> {
    row: &'r Row<'r>,
    name: Vec<String>,
    /// Top of the upper panel.
    top: f64,
    /// Colours with their texts, position and line.
    legend: Vec<(&'static str, &'static str, (f64, usize))>,
}

impl<'r> Placed<'r> {
    /// Distances from the lower panel to the legend, and from there to the next row.
    const AROUND_LEGEND: [f64; 2] = [60.0, 38.0];

    /// Places a row below `top`, and advances `top`.
    fn new(row: &'r Row<'r>, top: &mut f64) -> Self {
        let name = lines(row.name, SIZE, true, WIDTH + RIGHT - 10.0);
        let own_top = *top + more_lines(&name, SIZE);
        let entries = legend(row);
        let widths: Vec<f64> = entries.iter().map(|(_, text)| MARK + 16.0 + text_width(text, SIZE, false)).collect();
        let places = flow(&widths, WIDTH + RIGHT - 10.0);
        let n_lines = places.last().map_or(1, |(_, line)| line + 1) as f64;
        let [above, below] = Self::AROUND_LEGEND;
        *top = own_top + AREA_HEIGHT + GAP + RATE_HEIGHT + above + LEADING * SIZE * (n_lines - 1.0) + below;
        let legend = entries.into_iter().zip(places).map(|((color, text), at)| (color, text, at)).collect();
        Self { row, name, top: own_top, legend }
    }

    fn draw(&self, svg: &mut String) {
        let (row, top) = (self.row, self.top);
        let length = row.points.last().map_or(0.0, |p| p.way).max(1e-9);
        let name_top = top - 12.0 - more_lines(&self.name, SIZE);
        draw_lines(svg, &self.name, [LEFT, name_top], SIZE, r#" font-weight="bold""#);
        let area = Panel::new(row, top, AREA_HEIGHT, length, |p| Some([p.area; 2]));
        area.frame(svg, "chip area, mm²", None);
        area.unknown(svg, row);
        area.envelope(svg, 0, AREA);
        let rate = Panel::new(row, top + AREA_HEIGHT + GAP, RATE_HEIGHT, length, |p| p.removal_rates);
        rate.frame(svg, "removal rate, cm³/min", Some("cutting length, m"));
        rate.envelope(svg, 0, BEFORE);
        rate.envelope(svg, 1, AFTER);
        if let Some(target) = row.target {
            rate.target(svg, target);
        }
        let below = top + AREA_HEIGHT + GAP + RATE_HEIGHT + Self::AROUND_LEGEND[0];
        for (color, text, (along, line)) in &self.legend {
            let (x, y) = (LEFT + along, below + LEADING * SIZE * *line as f64);
            let _ = writeln!(
                svg,
                r#"<rect x="{x:.2}" y="{:.2}" width="14" height="4" fill="{color}"/><text x="{:.2}" y="{y:.2}">{text}</text>"#,
                y - 6.0,
                x + MARK
            );
        }
    }
}

/// Plot of two values along the path.
struct Panel {
    top: f64,
    height: f64,
    length: f64,
    /// Value at the upper edge.
    most: f64,
    /// Smallest and largest of both values in each column.
    columns: Vec<Option<[[f64; 2]; 2]>>,
}

impl Panel {
    fn new(
        row: &Row<'_>,
        top: f64,
        height: f64,
        length: f64,
        values: impl Fn(&ChartPoint) -> Option<[f64; 2]>,
    ) -> Self {
        let mut columns = vec![None; COLUMNS];
        let mut most = 0.0;
        for p in row.points {
            let Some(values) = values(p) else { continue };
            most = values.into_iter().fold(most, f64::max);
            let column = &mut columns[column_of(p, length)];
            let [a, b]: [[f64; 2]; 2] = column.unwrap_or(values.map(|v| [v, v]));
            let wider = |[low, high]: [f64; 2], v: f64| [low.min(v), high.max(v)];
            *column = Some([wider(a, values[0]), wider(b, values[1])]);
        }
        // No stock is cut.
        let most = if most > 0.0 { most } else { 1.0 };
        let step = nice_step(most / 4.0);
        Self { top, height, length, most: step * (most / step).ceil().max(1.0), columns }
    }

    fn x(&self, column: usize) -> f64 {
        LEFT + (column as f64 + 0.5) * WIDTH / COLUMNS as f64
    }

    fn y(&self, value: f64) -> f64 {
        self.top + self.height * (1.0 - value / self.most)
    }

    fn frame(&self, svg: &mut String, unit: &str, below: Option<&str>) {
        let (bottom, right) = (self.top + self.height, LEFT + WIDTH);
        let step = nice_step(self.most / 4.0);
        let decimals = decimals(step);
        for k in 0..=(self.most / step).round() as u32 {
            let value = step * f64::from(k);
            let y = self.y(value);
            let _ = writeln!(
                svg,
                r##"<line x1="{LEFT}" y1="{y:.2}" x2="{right}" y2="{y:.2}" stroke="#dfe3e6"/><text x="{}" y="{:.2}" text-anchor="end">{}</text>"##,
                LEFT - 8.0,
                y + 4.5,
                label(value, decimals)
            );
        }
        let metres = self.length / 1000.0;
        let step = nice_step(metres / 8.0);
        let at = |k: u32| (step * f64::from(k), LEFT + WIDTH * step * f64::from(k) / metres);
        let decimals = self::decimals(step);
        for k in 0..=(metres / step + 1e-9).floor() as u32 {
            let (value, x) = at(k);
            let _ =
                writeln!(svg, r#"<line x1="{x:.2}" y1="{bottom}" x2="{x:.2}" y2="{}" stroke="{INK}"/>"#, bottom + 5.0);
            if below.is_some() {
                let y = bottom + 20.0;
                let _ =
                    writeln!(svg, r#"<text x="{x:.2}" y="{y}" text-anchor="middle">{}</text>"#, label(value, decimals));
            }
        }
        let _ = writeln!(
            svg,
            r#"<rect x="{LEFT}" y="{}" width="{WIDTH}" height="{}" fill="none" stroke="{INK}"/>
<text transform="translate(24 {}) rotate(-90)" text-anchor="middle">{unit}</text>"#,
            self.top,
            self.height,
            self.top + 0.5 * self.height
        );
        if let Some(text) = below {
            let _ = writeln!(
                svg,
                r#"<text x="{right}" y="{}" text-anchor="end">{text}</text>"#,
                self.top + self.height + 36.0
            );
        }
    }

    /// Draws smallest and largest of a value in every column, as one line.
    fn envelope(&self, svg: &mut String, which: usize, color: &str) {
        let mut points = String::new();
        let known = self.columns.iter().enumerate().filter_map(|(k, c)| Some((k, (*c)?[which])));
        for (n, (k, [low, high])) in known.enumerate() {
            // Up in one column and down in the next.
            let ends = if n % 2 == 0 { [low, high] } else { [high, low] };
            for value in ends {
                let _ = write!(points, "{:.1},{:.1} ", self.x(k), self.y(value));
            }
        }
        let points = points.trim_end();
        let _ = writeln!(
            svg,
            r#"<polyline points="{points}" fill="none" stroke="{color}" stroke-width="1.1" stroke-linejoin="round"/>"#
        );
    }

    /// Marks columns with points that count full stock.
    fn unknown(&self, svg: &mut String, row: &Row<'_>) {
        let mut marked = vec![false; COLUMNS];
        row.points.iter().filter(|p| !p.is_known).for_each(|p| marked[column_of(p, self.length)] = true);
        let y = self.top + self.height - 5.0;
        for k in (0..COLUMNS).filter(|&k| marked[k]) {
            let x = self.x(k) - 0.5;
            let _ = writeln!(svg, r##"<rect x="{x:.2}" y="{y}" width="1.4" height="5" fill="#c9503f"/>"##);
        }
    }

    fn target(&self, svg: &mut String, target: f64) {
        if target > self.most {
            return;
        }
        let y = self.y(target);
        let _ = writeln!(
            svg,
            r#"<line x1="{LEFT}" y1="{y:.2}" x2="{}" y2="{y:.2}" stroke="{INK}" stroke-dasharray="6 4"/>"#,
            LEFT + WIDTH
        );
    }
}

fn column_of(p: &ChartPoint, length: f64) -> usize {
    ((p.way / length * COLUMNS as f64) as usize).min(COLUMNS - 1)
}

/// Returns the meaning of the colours in the row.
fn legend(row: &Row<'_>) -> Vec<(&'static str, &'static str)> {
    let mut entries = vec![
        (AREA, "chip area"),
        (BEFORE, "removal rate at the job's cutting feed"),
        (AFTER, "removal rate as written"),
    ];
    if row.points.iter().any(|p| !p.is_known) {
        entries.push(("#c9503f", "full stock counted"));
    }
    if row.target.is_some() {
        entries.push((INK, "target (dashed)"));
    }
    entries
}

/// Returns a value of an axis, short enough for the room beside it.
fn label(value: f64, decimals: usize) -> String {
    if decimals > 4 || value >= 1e6 { format!("{value:.0e}") } else { format!("{value:.decimals$}") }
}

/// Returns the next of 1, 2, 5 times a power of ten.
fn nice_step(least: f64) -> f64 {
    let least = least.max(1e-9);
    let power = 10f64.powf(least.log10().floor());
    [1.0, 2.0, 5.0, 10.0].into_iter().map(|k| k * power).find(|step| *step >= least * (1.0 - 1e-9)).unwrap_or(least)
}

/// Returns the number of decimals that distinguish multiples of a step.
fn decimals(step: f64) -> usize {
    (-step.log10().floor()).max(0.0) as usize
}

#[cfg(test)]
#[path = "../tests/unit/chips_svg.rs"]
mod tests;
