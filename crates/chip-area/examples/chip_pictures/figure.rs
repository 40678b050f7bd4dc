//! Drawings of sections, written as SVG.

use std::fmt::Write as _;

pub(crate) const INK: &str = "#22282d";
pub(crate) const GRAY: &str = "#5b646b";
pub(crate) const BLUE: &str = "#2f6f9e";
pub(crate) const RED: &str = "#c9503f";
pub(crate) const GREEN: &str = "#2f9e62";
pub(crate) const STOCK: &str = "#efe6d2";
pub(crate) const PART: &str = "#d9d3c7";
pub(crate) const TOOL: &str = "#d5e3ee";
pub(crate) const CHIP: &str = "#e3a08f";

/// A point of a drawing, mm: x to the right, y up.
pub(crate) type Mm = [f64; 2];

/// A drawing of one or more panels.
pub(crate) struct Figure {
    svg: String,
    n_panels: u32,
    origin: Mm,
    scale: f64,
}

impl Figure {
    /// An empty drawing of this size in pixels, on white ground.
    pub(crate) fn new(width: f64, height: f64, title: &str) -> Self {
        let svg = format!(
            r##"<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" height="{height}" font-family="Helvetica, Arial, sans-serif" font-size="13" fill="{INK}">
<rect width="{width}" height="{height}" fill="#ffffff"/>
<text x="20" y="28" font-size="16" font-weight="bold">{title}</text>
"##
        );
        Self { svg, n_panels: 0, origin: [0.0; 2], scale: 1.0 }
    }

    /// Begins a panel: what is drawn in it is cut off at its border. `corner` and `size` in pixels,
    /// `origin` in pixels from the corner, `scale` in pixels per mm.
    pub(crate) fn panel(&mut self, corner: Mm, size: Mm, origin: Mm, scale: f64) {
        self.end_panel();
        self.n_panels += 1;
        let ([x, y], [width, height], n) = (corner, size, self.n_panels);
        let _ = writeln!(
            self.svg,
            r#"<clipPath id="p{n}"><rect x="{x}" y="{y}" width="{width}" height="{height}"/></clipPath><g clip-path="url(#p{n})">"#
        );
        (self.origin, self.scale) = ([x + origin[0], y + origin[1]], scale);
    }

    fn end_panel(&mut self) {
        if self.n_panels > 0 {
            self.svg.push_str("</g>\n");
        }
    }

    /// The SVG text.
    pub(crate) fn finish(mut self) -> String {
        self.end_panel();
        self.svg.push_str("</svg>\n");
        self.svg
    }

    fn pixels(&self, [x, y]: Mm) -> Mm {
        [self.origin[0] + x * self.scale, self.origin[1] - y * self.scale]
    }

    /// The points in pixels, without those that are close to both the one kept before and the next.
    fn places(&self, points: &[Mm]) -> String {
        const APART: f64 = 4.0;
        let pixels: Vec<Mm> = points.iter().map(|p| self.pixels(*p)).collect();
        let apart = |p: &Mm, q: &Mm| (p[0] - q[0]).abs().max((p[1] - q[1]).abs()) >= APART;
        let mut kept: Vec<Mm> = Vec::new();
        for (i, p) in pixels.iter().enumerate() {
            if kept.last().is_none_or(|q| apart(p, q)) || pixels.get(i + 1).is_none_or(|q| apart(p, q)) {
                kept.push(*p);
            }
        }
        kept.iter().map(|[x, y]| format!("{x:.1},{y:.1}")).collect::<Vec<_>>().join(" ")
    }

    /// A curve; `dash` in pixels, empty for a full line.
    pub(crate) fn curve(&mut self, points: &[Mm], color: &str, width: f64, dash: &str) {
        let places = self.places(points);
        let _ = writeln!(
            self.svg,
            r#"<polyline points="{places}" fill="none" stroke="{color}" stroke-width="{width}" stroke-dasharray="{dash}" stroke-linejoin="round"/>"#
        );
    }

    /// A closed curve.
    pub(crate) fn ring(&mut self, points: &[Mm], color: &str, width: f64, dash: &str) {
        let closed: Vec<Mm> = points.iter().chain(points.first()).copied().collect();
        self.curve(&closed, color, width, dash);
    }

    /// A filled area without a border; holes by the even-odd rule.
    pub(crate) fn area(&mut self, contours: &[Vec<Mm>], fill: &str) {
        let path: Vec<String> = contours.iter().map(|c| format!("M{}Z", self.places(c))).collect();
        let _ = writeln!(self.svg, r#"<path d="{}" fill="{fill}" fill-rule="evenodd"/>"#, path.join(" "));
    }

    /// A dot of 3.5 pixels.
    pub(crate) fn dot(&mut self, at: Mm, color: &str) {
        let [x, y] = self.pixels(at);
        let _ = writeln!(self.svg, r#"<circle cx="{x:.1}" cy="{y:.1}" r="3.5" fill="{color}"/>"#);
    }

    /// An arrow.
    pub(crate) fn arrow(&mut self, from: Mm, to: Mm, color: &str) {
        self.curve(&[from, to], color, 1.5, "");
        let (a, b) = (self.pixels(from), self.pixels(to));
        let length = (b[0] - a[0]).hypot(b[1] - a[1]).max(1e-9);
        let (x, y) = ((b[0] - a[0]) / length, (b[1] - a[1]) / length);
        let _ = writeln!(
            self.svg,
            r#"<polygon points="{:.1},{:.1} {:.1},{:.1} {:.1},{:.1}" fill="{color}"/>"#,
            b[0] + 1.5 * x,
            b[1] + 1.5 * y,
            b[0] - 8.0 * x - 3.0 * y,
            b[1] - 8.0 * y + 3.0 * x,
            b[0] - 8.0 * x + 3.0 * y,
            b[1] - 8.0 * y - 3.0 * x
        );
    }

    /// A line with arrows at both ends.
    pub(crate) fn measure(&mut self, from: Mm, to: Mm, color: &str) {
        self.arrow(from, to, color);
        self.arrow(to, from, color);
    }

    /// Text that begins this many pixels right of and below a point.
    pub(crate) fn text(&mut self, at: Mm, [right, down]: Mm, color: &str, text: &str) {
        let [x, y] = self.pixels(at);
        let _ = writeln!(self.svg, r#"<text x="{:.1}" y="{:.1}" fill="{color}">{text}</text>"#, x + right, y + down);
    }
}
