//! Picture of passes, coloured by their use of the strip.

use std::fmt::Write;

use nalgebra::{Matrix3, Point2, Point3, SymmetricEigen, Unit, Vector3};

use crate::svg_text::{INK, LEADING, SIZE, draw_lines, escape, flow, lines, more_lines, text_width};

/// Point of a drawn pass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DrawnPoint {
    /// Position.
    pub position: Point3<f64>,
    /// Outward normal.
    pub normal: Unit<Vector3<f64>>,
    /// Distance to the pass beside that is cut before, over the width that the cusp allows there;
    /// `None` where no pass is beside.
    pub strip_use: Option<f64>,
}

/// Position of the drawing in the picture, in pixels.
const LEFT: f64 = 30.0;

const TOP: f64 = 66.0;

/// Largest width and height of a view.
const WIDTH: f64 = 900.0;

const HEIGHT: f64 = 620.0;

/// Room between views, and right of them.
const GAP: f64 = 40.0;

/// Points nearer than this in the picture are one, pixels.
const SAME_PIXEL: f64 = 0.4;

/// Share of points that face away from which on they get a view from behind.
const BEHIND: f64 = 0.02;

/// Length of the mean of unit normals below which a surface has no side to look at.
const NO_SIDE: f64 = 0.3;

/// Ratio of the spreads in a picture above which the longer one lies across; squarer regions are
/// seen along the axes of the workpiece frame.
const LONG: f64 = 1.5;

/// Upper bounds of the classes of strip use, with colours for the colour-blind (viridis; vermilion
/// for strips that are too wide), and their texts.
const CLASSES: [(f64, &str, &str); 6] = [
    (0.5, "#440154", "below 50 %"),
    (0.7, "#414487", "to 70 %"),
    (0.8, "#2a788e", "to 80 %"),
    (0.9, "#22a884", "to 90 %"),
    (1.005, "#8fd744", "to 100 %"),
    (f64::INFINITY, "#d55e00", "wider than allowed"),
];

/// Colour and text of points without a pass beside that is cut before.
const NONE_BESIDE: (&str, &str) = ("#a0a7ad", "no pass beside");

/// Returns the class of a strip use; the last one if there is none.
fn class_of(strip_use: Option<f64>) -> usize {
    strip_use.map_or(CLASSES.len(), |share| CLASSES.iter().position(|(to, ..)| share <= *to).unwrap_or(0))
}

/// Returns colour and text of a class.
fn style(class: usize) -> (&'static str, &'static str) {
    CLASSES.get(class).map_or(NONE_BESIDE, |(_, color, text)| (color, text))
}

/// Returns the picture of passes: seen against their mean normal, and from behind where some face
/// away. `figures` is the text below the title.
pub fn passes_svg(title: &str, figures: &str, passes: &[Vec<DrawnPoint>]) -> String {
    let View { across, up, toward } = View::of(passes);
    let flat = |p: &DrawnPoint| Point2::new(p.position.coords.dot(&across), p.position.coords.dot(&up));
    let faces = |p: &DrawnPoint| p.normal.dot(&toward) >= 0.0;
    let all = || passes.iter().flatten();
    let [low, high] = bounds(all().map(flat));
    let size = high - low;
    let scale = (WIDTH / size.x.max(1e-9)).min(HEIGHT / size.y.max(1e-9));
    let n_behind = all().filter(|p| !faces(p)).count() as f64;
    let has_behind = n_behind > BEHIND * all().count() as f64;
    let title = lines(title, 16.0, true, WIDTH);
    let figures = lines(figures, SIZE, false, WIDTH);
    let top = TOP + more_lines(&title, 16.0) + more_lines(&figures, SIZE);
    let mut svg = String::new();
    let mut shares = [0.0; CLASSES.len() + 1];
    let mut below = top;
    for behind in [false, true].into_iter().filter(|behind| has_behind || !behind) {
        let place = |p: &DrawnPoint| {
            let at = flat(p) - low;
            Point2::new(LEFT + scale * if behind { size.x - at.x } else { at.x }, below + scale * (size.y - at.y))
        };
        draw_view(&mut svg, passes, &place, &|p| !has_behind || faces(p) != behind, &mut shares);
        below += scale * size.y + GAP;
        if has_behind {
            let text = if behind { "from behind" } else { "from the front" };
            let _ = writeln!(svg, r#"<text x="{LEFT}" y="{:.1}">{text}</text>"#, below - GAP + 18.0);
        }
    }
    scale_bar(&mut svg, scale, below - 14.0);
    let bottom = legend(&mut svg, &shares, below + 14.0);
    let (w, h) = (LEFT + WIDTH + LEFT, bottom + 16.0);
    let mut text = String::new();
    let _ = writeln!(
        text,
        r##"<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {w:.0} {h:.0}" width="{w:.0}" height="{h:.0}" font-family="Helvetica, Arial, sans-serif" font-size="{SIZE}" fill="{INK}">
<rect width="{w:.0}" height="{h:.0}" fill="#ffffff"/>"##
    );
    draw_lines(&mut text, &title, [LEFT, 26.0], 16.0, r#" font-weight="bold""#);
    let under = 46.0 + more_lines(&title, 16.0);
    draw_lines(&mut text, &figures, [LEFT, under], SIZE, r##" fill="#5b646b""##);
    text + &svg + "</svg>\n"
}

/// Directions of a picture, workpiece frame.
struct View {
    across: Vector3<f64>,
    up: Vector3<f64>,
    /// Toward the eye.
    toward: Vector3<f64>,
}

impl View {
    /// Returns the view against the mean normal of points, with their longest extent across; of a
    /// closed surface, whose normals cancel, along its shortest extent.
    fn of(passes: &[Vec<DrawnPoint>]) -> Self {
        let all = || passes.iter().flatten();
        let n = all().count().max(1) as f64;
        let mean = all().fold(Vector3::zeros(), |sum, p| sum + p.normal.into_inner()) / n;
        let centre = all().fold(Vector3::zeros(), |sum, p| sum + p.position.coords) / n;
        let spread = all().fold(Matrix3::zeros(), |sum, p| {
            let from = p.position.coords - centre;
            sum + from * from.transpose()
        });
        let toward = if mean.norm() >= NO_SIDE { mean.normalize() } else { extreme_direction(&spread, false) };
        // The spread in the plane of the picture.
        let flat = Matrix3::identity() - toward * toward.transpose();
        let seen = flat * spread * flat;
        // The two larger ones are those in the plane.
        let mut spreads = SymmetricEigen::new(seen).eigenvalues;
        spreads.as_mut_slice().sort_by(f64::total_cmp);
        let is_long = spreads[2] > LONG * spreads[1];
        let axis = if is_long { extreme_direction(&seen, true) } else { across_axis(&toward) };
        let across = (flat * axis).try_normalize(1e-9).unwrap_or_else(|| across_axis(&toward));
        Self { across, up: toward.cross(&across), toward }
    }
}

/// Returns the axis of the workpiece frame that lies flattest in a picture seen along a direction;
/// of equal ones the first.
fn across_axis(toward: &Vector3<f64>) -> Vector3<f64> {
    let mut axis = Vector3::zeros();
    axis[toward.iamin()] = 1.0;
    axis
}

/// Returns the direction of the largest or smallest spread, with a positive largest component.
fn extreme_direction(spread: &Matrix3<f64>, largest: bool) -> Vector3<f64> {
    let found = SymmetricEigen::new(*spread);
    let which = if largest { found.eigenvalues.imax() } else { found.eigenvalues.imin() };
    let direction: Vector3<f64> = found.eigenvectors.column(which).into();
    direction * direction[direction.iamax()].signum()
}

fn bounds(points: impl Iterator<Item = Point2<f64>>) -> [Point2<f64>; 2] {
    let found = points.fold(None, |found: Option<[Point2<f64>; 2]>, p| {
        let [low, high] = found.unwrap_or([p, p]);
        Some([low.inf(&p), high.sup(&p)])
    });
    found.unwrap_or([Point2::origin(); 2])
}

/// Draws the ways between points for which `is_seen` holds, class by class, those that are too
/// wide on top; adds their lengths to `shares`.
fn draw_view(
    svg: &mut String,
    passes: &[Vec<DrawnPoint>],
    place: &dyn Fn(&DrawnPoint) -> Point2<f64>,
    is_seen: &dyn Fn(&DrawnPoint) -> bool,
    shares: &mut [f64],
) {
    let mut of_class: Vec<Vec<String>> = vec![Vec::new(); CLASSES.len() + 1];
    for pass in passes {
        let class = |k: usize| class_of(pass[k].strip_use.or(pass[k + 1].strip_use));
        let mut k = 0;
        while k + 1 < pass.len() {
            if !is_seen(&pass[k]) {
                k += 1;
                continue;
            }
            let own = class(k);
            let mut end = k + 1;
            while end + 1 < pass.len() && is_seen(&pass[end]) && class(end) == own {
                end += 1;
            }
            let stretch = &pass[k..=end];
            shares[own] += stretch.windows(2).map(|w| (w[1].position - w[0].position).norm()).sum::<f64>();
            of_class[own].push(polyline(stretch, place));
            k = end;
        }
    }
    // Ways without a neighbour lie lowest.
    for class in std::iter::once(CLASSES.len()).chain(0..CLASSES.len()) {
        let _ = writeln!(
            svg,
            r#"<g fill="none" stroke="{}" stroke-width="1.5" stroke-linejoin="round" stroke-linecap="round">"#,
            style(class).0
        );
        of_class[class].iter().for_each(|line| svg.push_str(line));
        svg.push_str("</g>\n");
    }
}

fn polyline(stretch: &[DrawnPoint], place: &dyn Fn(&DrawnPoint) -> Point2<f64>) -> String {
    let mut text = String::from("<polyline points=\"");
    let mut last: Option<Point2<f64>> = None;
    for (k, point) in stretch.iter().enumerate() {
        let at = place(point);
        let is_end = k == 0 || k + 1 == stretch.len();
        if is_end || last.is_none_or(|last| (at - last).norm() >= SAME_PIXEL) {
            let _ = write!(text, "{}{:.1},{:.1}", if last.is_some() { " " } else { "" }, at.x, at.y);
            last = Some(at);
        }
    }
    text + "\"/>\n"
}

/// Draws a bar of 1, 2 or 5 times a power of ten mm, at most a quarter of the picture long.
fn scale_bar(svg: &mut String, scale: f64, y: f64) {
    let most = 0.25 * WIDTH / scale;
    let power = 10f64.powf(most.log10().floor());
    let length = [5.0, 2.0, 1.0].into_iter().map(|k| k * power).find(|l| *l <= most).unwrap_or(power);
    let right = LEFT + scale * length;
    let _ = writeln!(
        svg,
        r#"<path d="M{LEFT} {0:.1}v6h{1:.1}v-6" fill="none" stroke="{INK}"/><text x="{2:.1}" y="{3:.1}">{length} mm</text>"#,
        y - 6.0,
        scale * length,
        right + 8.0,
        y + 2.0
    );
}

/// Draws the classes with their shares of the length; returns the lower edge.
fn legend(svg: &mut String, shares: &[f64], top: f64) -> f64 {
    let total: f64 = shares.iter().sum::<f64>().max(f64::MIN_POSITIVE);
    let _ = writeln!(svg, r#"<text x="{LEFT}" y="{top:.1}">Step as a share of the width that the cusp allows:</text>"#);
    let used: Vec<usize> = (0..shares.len()).filter(|&k| shares[k] > 0.0).collect();
    let text = |k: usize| format!("{} ({:.1} %)", style(k).1, 100.0 * shares[k] / total);
    let widths: Vec<f64> = used.iter().map(|&k| 40.0 + text_width(&text(k), SIZE, false)).collect();
    let places = flow(&widths, WIDTH);
    let mut bottom = top;
    for (&k, (x, line)) in used.iter().zip(places) {
        let (x, y) = (LEFT + x, top + LEADING * SIZE * (line + 1) as f64);
        let _ = writeln!(
            svg,
            r#"<rect x="{x:.1}" y="{:.1}" width="18" height="5" fill="{}"/><text x="{:.1}" y="{y:.1}">{}</text>"#,
            y - 7.0,
            style(k).0,
            x + 24.0,
            escape(&text(k))
        );
        bottom = y;
    }
    bottom
}

#[cfg(test)]
#[path = "../tests/unit/passes_svg.rs"]
mod tests;
