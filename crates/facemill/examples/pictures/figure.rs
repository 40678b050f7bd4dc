//! A drawing in mm, written as SVG.

use std::fmt::Write as _;

/// Colours of the pictures.
pub(crate) const INK: &str = "#22282d";
pub(crate) const GRAY: &str = "#5b646b";
pub(crate) const BLUE: &str = "#2f6f9e";
pub(crate) const RED: &str = "#c9503f";
pub(crate) const GREEN: &str = "#2f9e62";

/// A point of the drawing, mm: x to the right, y up.
pub(crate) type Mm = [f64; 2];

/// A drawing; `origin` (pixels) and `scale` (pixels per mm, of x and y) may be changed between two
/// things drawn.
pub(crate) struct Figure {
    svg: String,
    pub(crate) origin: Mm,
    pub(crate) scale: Mm,
}

impl Figure {
    /// Begins an empty drawing of this size in pixels, on white ground.
    pub(crate) fn new(width: f64, height: f64, title: &str) -> Self {
        let mut svg = format!(
            r##"<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" height="{height}" font-family="Helvetica, Arial, sans-serif" font-size="13" fill="{INK}">
<rect width="{width}" height="{height}" fill="#ffffff"/>
"##
        );
        for (k, line) in title_lines(title, width).iter().enumerate() {
            let y = 28 + 20 * k;
            let _ = writeln!(svg, r#"<text x="20" y="{y}" font-size="16" font-weight="bold">{line}</text>"#);
        }
        Self { svg, origin: [0.0, 0.0], scale: [1.0, 1.0] }
    }

    /// Returns the SVG text.
    pub(crate) fn finish(mut self) -> String {
        self.svg.push_str("</svg>\n");
        self.svg
    }

    fn pixels(&self, [x, y]: Mm) -> Mm {
        [self.origin[0] + x * self.scale[0], self.origin[1] - y * self.scale[1]]
    }

    fn places(&self, points: &[Mm]) -> String {
        let place = |p: &Mm| {
            let [x, y] = self.pixels(*p);
            format!("{x:.1},{y:.1}")
        };
        points.iter().map(place).collect::<Vec<_>>().join(" ")
    }

    /// Draws a curve; `dash` in pixels, empty for a full line.
    pub(crate) fn curve(&mut self, points: &[Mm], color: &str, width: f64, dash: &str) {
        let places = self.places(points);
        let _ = writeln!(
            self.svg,
            r#"<polyline points="{places}" fill="none" stroke="{color}" stroke-width="{width}" stroke-dasharray="{dash}" stroke-linejoin="round"/>"#
        );
    }

    /// Draws a filled area without a border.
    pub(crate) fn area(&mut self, points: &[Mm], fill: &str) {
        let places = self.places(points);
        let _ = writeln!(self.svg, r#"<polygon points="{places}" fill="{fill}"/>"#);
    }

    /// Draws a dot of 3.5 pixels.
    pub(crate) fn dot(&mut self, at: Mm, color: &str) {
        let [x, y] = self.pixels(at);
        let _ = writeln!(self.svg, r#"<circle cx="{x:.1}" cy="{y:.1}" r="3.5" fill="{color}"/>"#);
    }

    /// Draws an arrow.
    pub(crate) fn arrow(&mut self, from: Mm, to: Mm, color: &str) {
        self.curve(&[from, to], color, 1.6, "");
        let (a, b) = (self.pixels(from), self.pixels(to));
        let length = (b[0] - a[0]).hypot(b[1] - a[1]).max(1e-9);
        let (x, y) = ((b[0] - a[0]) / length, (b[1] - a[1]) / length);
        let _ = writeln!(
            self.svg,
            r#"<polygon points="{:.1},{:.1} {:.1},{:.1} {:.1},{:.1}" fill="{color}"/>"#,
            b[0] + 2.0 * x,
            b[1] + 2.0 * y,
            b[0] - 9.0 * x - 3.5 * y,
            b[1] - 9.0 * y + 3.5 * x,
            b[0] - 9.0 * x + 3.5 * y,
            b[1] - 9.0 * y - 3.5 * x
        );
    }

    /// Writes text that begins this many pixels right of and below a point.
    pub(crate) fn text(&mut self, at: Mm, [right, down]: Mm, color: &str, text: &str) {
        let [x, y] = self.pixels(at);
        let _ = writeln!(self.svg, r#"<text x="{:.1}" y="{:.1}" fill="{color}">{text}</text>"#, x + right, y + down);
    }

    /// Draws an arc about `center` from one angle (rad, from +x toward +y) to another.
    pub(crate) fn arc(&mut self, center: Mm, radius: f64, [from, to]: Mm, color: &str, width: f64) {
        self.curve(&arc(center, radius, from, to), color, width, "");
    }
}

/// Width that a letter of a bold title of 16 pixels is given, pixels: in DejaVu Sans, the widest
/// font that pictures are drawn with, those of a title take 8.9 on the mean.
const TITLE_LETTER: f64 = 10.0;

/// Breaks a title into lines that fit a picture of this width.
fn title_lines(title: &str, width: f64) -> Vec<String> {
    let most = ((width - 40.0) / TITLE_LETTER) as usize;
    let mut lines: Vec<String> = Vec::new();
    for word in title.split(' ') {
        match lines.last_mut().filter(|line| line.chars().count() + 1 + word.chars().count() <= most) {
            Some(line) => *line = format!("{line} {word}"),
            None => lines.push(word.to_owned()),
        }
    }
    lines
}

/// Points of an arc.
pub(crate) fn arc(center: Mm, radius: f64, from: f64, to: f64) -> Vec<Mm> {
    // A chord every 4°.
    let steps = ((to - from).abs().to_degrees() / 4.0).ceil().max(1.0) as u32;
    (0..=steps)
        .map(|k| from + (to - from) * f64::from(k) / f64::from(steps))
        .map(|angle| [center[0] + radius * angle.cos(), center[1] + radius * angle.sin()])
        .collect()
}
