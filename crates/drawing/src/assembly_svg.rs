//! Picture of a tool assembly from the side, with its dimensions.

use std::fmt::Write;

use facemill_tool_model::{Stack, ToolAssembly};

use crate::svg_text::{INK, LEADING, SIZE, draw_lines, lines, more_lines, text_width};

/// Height of the tool and half of its largest width, in pixels.
const TOOL_HEIGHT: f64 = 520.0;
const HALF_WIDTH: f64 = 160.0;

/// Room left of the widest tool, for the corner radius, and between edge and heading.
const LEFT: f64 = 110.0;
const MARGIN: f64 = 24.0;

/// Room above the tool, for heading and the holder's diameter, and below it, for the cutter's.
const ABOVE: f64 = 96.0;
const BELOW: f64 = 76.0;

/// Width of the picture, and of its texts.
const WIDTH: f64 = 720.0;
const TEXT_WIDTH: f64 = WIDTH - 2.0 * MARGIN;

/// Distance between dimension lines, and from the tool to the first.
const DIMENSION: f64 = 24.0;

/// Colours of cutter, body, holder, dead core and dimensions.
const CUTTER: &str = "#d9a23b";
const BODY: &str = "#aab2b9";
const HOLDER: &str = "#6f7a83";
const DEAD_CORE: &str = "#c9503f";
const LINE: &str = "#3a6ea5";

/// Most sections of a stack that the text lists.
const MOST_LISTED: usize = 12;

/// Returns the picture of an assembly: cutter, body and holder to scale, with diameters, corner
/// radius, flute length, stick-out and gauge length in mm; below it the sections and what is
/// assumed. The gauge line is where the spindle's nose is.
#[must_use]
pub fn assembly_svg(tool: &ToolAssembly) -> String {
    let file = tool.to_file();
    let title = lines(&format!("T{} {}", file.number, file.name), 16.0, true, TEXT_WIDTH);
    let down = LEADING * 16.0 * (title.len() - 1) as f64;
    let notes: Vec<Vec<String>> = notes(tool).iter().map(|note| lines(note, SIZE, false, TEXT_WIDTH)).collect();
    let rows: f64 = notes.iter().map(|note| note.len() as f64 * LEADING * SIZE + 6.0).sum();
    let place = ToolPlacement::of(tool, ABOVE + down);
    let (below, height) = (place.base + BELOW, place.base + BELOW + rows + MARGIN);
    let mut svg = String::new();
    // Writing to a string does not fail.
    let _ = writeln!(
        svg,
        r##"<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {height:.2}" width="{WIDTH}" height="{height:.2}" font-family="Helvetica, Arial, sans-serif" font-size="{SIZE}" fill="{INK}">
<rect width="{WIDTH}" height="{height:.2}" fill="#ffffff"/>"##
    );
    draw_lines(&mut svg, &title, [MARGIN, 32.0], 16.0, r#" font-weight="bold""#);
    draw_stack(&mut svg, &place, &file.body, file.flute_length_mm, BODY, "b");
    draw_stack(&mut svg, &place, &file.holder, file.stick_out_mm, HOLDER, "h");
    draw_cutter(&mut svg, &place, tool);
    draw_axis(&mut svg, &place, file.gauge_length_mm);
    draw_heights(&mut svg, &place, tool);
    draw_diameters(&mut svg, &place, tool);
    let mut y = below + SIZE;
    for note in &notes {
        draw_lines(&mut svg, note, [MARGIN, y], SIZE, "");
        y += more_lines(note, SIZE) + LEADING * SIZE + 6.0;
    }
    svg.push_str("</svg>\n");
    svg
}

/// Scale and position of the tool in the picture.
struct ToolPlacement {
    /// Pixels per mm.
    scale: f64,
    /// Axis, pixels from the left.
    axis: f64,
    /// Tip, pixels from the top.
    base: f64,
    /// Largest radius and height, mm.
    radius: f64,
    top: f64,
}

impl ToolPlacement {
    fn of(tool: &ToolAssembly, above: f64) -> Self {
        let sections = tool.sections();
        let cutter = tool.cutter();
        let radius = sections.iter().map(|s| s.frustum.radius_low.max(s.frustum.radius_high));
        let radius = radius.fold(cutter.radius(), f64::max);
        let top = sections.iter().map(|s| s.frustum.z_high).fold(tool.gauge_length(), f64::max);
        let scale = (TOOL_HEIGHT / top).min(HALF_WIDTH / radius);
        Self { scale, axis: LEFT + HALF_WIDTH, base: above + scale * top, radius, top }
    }

    fn x(&self, radius: f64) -> f64 {
        self.axis + self.scale * radius
    }

    fn y(&self, height: f64) -> f64 {
        self.base - self.scale * height
    }
}

/// Returns a length in mm with at most four decimals, without zeros at its end.
fn mm(value: f64) -> String {
    let text = format!("{value:.4}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

/// Draws a stack from a height on, with a mark in each section that is high and wide enough.
fn draw_stack(svg: &mut String, place: &ToolPlacement, stack: &Stack, from: f64, color: &str, mark: &str) {
    let mut z = from;
    for (k, section) in stack.sections.iter().enumerate() {
        let (low, high) = (0.5 * section.diameter_low_mm, 0.5 * section.diameter_high_mm);
        let (bottom, top) = (place.y(z), place.y(z + section.length_mm));
        z += section.length_mm;
        let _ = writeln!(
            svg,
            r##"<path d="M{:.2},{bottom:.2} L{:.2},{bottom:.2} L{:.2},{top:.2} L{:.2},{top:.2} Z" fill="{color}" stroke="{INK}" stroke-width="0.8"/>"##,
            place.x(-low),
            place.x(low),
            place.x(high),
            place.x(-high),
        );
        let text = format!("{mark}{}", k + 1);
        let (room, narrow) = (bottom - top, 2.0 * place.scale * low.min(high));
        if room > 16.0 && narrow > text_width(&text, 11.0, false) + 6.0 {
            let y = 0.5 * (bottom + top) + 4.0;
            let x = place.axis + 0.25 * narrow;
            let ink = if color == BODY { INK } else { "#ffffff" };
            let _ = writeln!(
                svg,
                r#"<text x="{x:.2}" y="{y:.2}" font-size="11" text-anchor="middle" fill="{ink}">{text}</text>"#
            );
        }
    }
}

/// Draws the cutter, and its dead core as a line below its flat.
fn draw_cutter(svg: &mut String, place: &ToolPlacement, tool: &ToolAssembly) {
    let cutter = tool.cutter();
    let (radius, corner, flute) = (cutter.radius(), cutter.corner_radius(), cutter.flute_length());
    let (rim, arc) = (cutter.rim_radius(), place.scale * corner);
    let (bottom, above, top) = (place.y(0.0), place.y(corner), place.y(flute));
    let _ = writeln!(
        svg,
        r##"<path d="M{:.2},{bottom:.2} L{:.2},{bottom:.2} A{arc:.2},{arc:.2} 0 0 0 {:.2},{above:.2} L{:.2},{top:.2} L{:.2},{top:.2} L{:.2},{above:.2} A{arc:.2},{arc:.2} 0 0 0 {:.2},{bottom:.2} Z" fill="{CUTTER}" stroke="{INK}" stroke-width="0.8"/>"##,
        place.x(-rim),
        place.x(rim),
        place.x(radius),
        place.x(radius),
        place.x(-radius),
        place.x(-radius),
        place.x(-rim),
    );
    let core = tool.dead_core_radius();
    if core > 0.0 {
        let _ = writeln!(
            svg,
            r#"<path d="M{:.2},{:.2} L{:.2},{:.2}" stroke="{DEAD_CORE}" stroke-width="3"/>"#,
            place.x(-core),
            bottom + 2.5,
            place.x(core),
            bottom + 2.5
        );
    }
}

/// Draws the axis and the gauge line.
fn draw_axis(svg: &mut String, place: &ToolPlacement, gauge: f64) {
    let (low, high, line) = (place.y(0.0) + 10.0, place.y(place.top) - 10.0, place.y(gauge));
    let half = place.scale * place.radius + 14.0;
    let _ = writeln!(
        svg,
        r##"<path d="M{0:.2},{low:.2} L{0:.2},{high:.2}" stroke="{INK}" stroke-width="0.7" stroke-dasharray="12 3 2 3" fill="none"/>
<path d="M{1:.2},{line:.2} L{2:.2},{line:.2}" stroke="{DEAD_CORE}" stroke-width="1.2" stroke-dasharray="8 4" fill="none"/>
<text x="{3:.2}" y="{4:.2}" font-size="11" text-anchor="end">gauge line</text>"##,
        place.axis,
        place.axis - half,
        place.axis + half,
        place.axis - half - 4.0,
        line + 4.0,
    );
}

/// Draws flute length, stick-out and gauge length right of the tool, each from the tip, with their
/// texts spread where they are close.
fn draw_heights(svg: &mut String, place: &ToolPlacement, tool: &ToolAssembly) {
    let heights = [
        ("flute length", tool.cutter().flute_length()),
        ("stick-out", tool.stick_out()),
        ("gauge length", tool.gauge_length()),
    ];
    let edge = place.x(place.radius) + 12.0;
    let last = edge + DIMENSION * heights.len() as f64;
    let mut free = place.base;
    let from = place.y(0.0);
    let _ = writeln!(
        svg,
        r#"<path d="M{:.2},{from:.2} L{last:.2},{from:.2}" stroke="{LINE}" stroke-width="0.7" fill="none"/>"#,
        place.axis + place.scale * tool.cutter().rim_radius()
    );
    for (k, (name, height)) in heights.into_iter().enumerate() {
        let (x, y) = (edge + DIMENSION * (k + 1) as f64 - 8.0, place.y(height));
        let text_y = (y + 4.0).min(free);
        free = text_y - LEADING * SIZE;
        let _ = writeln!(
            svg,
            r#"<path d="M{:.2},{y:.2} L{last:.2},{y:.2} L{:.2},{:.2}" stroke="{LINE}" stroke-width="0.7" fill="none"/>"#,
            edge - 6.0,
            last + 12.0,
            text_y - 4.0,
        );
        arrow(svg, [x, from], [x, y]);
        let _ = writeln!(svg, r#"<text x="{:.2}" y="{text_y:.2}">{name} {}</text>"#, last + 16.0, mm(height));
    }
}

/// Draws the diameters of cutter and holder, and the corner radius.
fn draw_diameters(svg: &mut String, place: &ToolPlacement, tool: &ToolAssembly) {
    let cutter = tool.cutter();
    let radius = cutter.radius();
    let y = place.base + 26.0;
    for side in [-radius, radius] {
        let from = place.y(cutter.corner_radius());
        let _ = writeln!(
            svg,
            r#"<path d="M{0:.2},{from:.2} L{0:.2},{1:.2}" stroke="{LINE}" stroke-width="0.7" fill="none"/>"#,
            place.x(side),
            y + 6.0
        );
    }
    arrow(svg, [place.x(-radius), y], [place.x(radius), y]);
    let (x, text) = (place.axis, mm(2.0 * radius));
    let _ = writeln!(svg, r#"<text x="{x:.2}" y="{:.2}" text-anchor="middle">Ø {text}</text>"#, y + 20.0);
    if place.radius > radius {
        let y = place.y(place.top) - 16.0;
        arrow(svg, [place.x(-place.radius), y], [place.x(place.radius), y]);
        let text = mm(2.0 * place.radius);
        let _ = writeln!(svg, r#"<text x="{x:.2}" y="{:.2}" text-anchor="middle">Ø {text}</text>"#, y - 6.0);
    }
    let corner = cutter.corner_radius();
    let diagonal = corner * std::f64::consts::FRAC_1_SQRT_2;
    let at = [place.x(-cutter.rim_radius() - diagonal), place.y(corner - diagonal)];
    let (to, text_y) = (LEFT - 6.0, place.base + 14.0);
    let _ = writeln!(
        svg,
        r#"<path d="M{:.2},{:.2} L{:.2},{1:.2}" stroke="{LINE}" stroke-width="0.7" fill="none"/><path d="M{:.2},{1:.2} L{:.2},{:.2}" stroke="{LINE}" stroke-width="0.7" fill="none"/><text x="{:.2}" y="{text_y:.2}" text-anchor="end">r {}</text>"#,
        to,
        text_y - 4.0,
        to + 14.0,
        to + 14.0,
        at[0],
        at[1],
        to - 4.0,
        mm(corner),
    );
}

/// Draws a dimension line with marks at both ends.
fn arrow(svg: &mut String, from: [f64; 2], to: [f64; 2]) {
    let length = (to[0] - from[0]).hypot(to[1] - from[1]).max(1e-9);
    let along = [(to[0] - from[0]) / length, (to[1] - from[1]) / length];
    let head = 7.0f64.min(0.4 * length);
    let mut path = format!("M{:.2},{:.2} L{:.2},{:.2}", from[0], from[1], to[0], to[1]);
    for (end, sense) in [(from, 1.0), (to, -1.0)] {
        for side in [-0.35, 0.35] {
            let x = end[0] + sense * head * along[0] - side * head * along[1];
            let y = end[1] + sense * head * along[1] + side * head * along[0];
            let _ = write!(path, " M{:.2},{:.2} L{x:.2},{y:.2}", end[0], end[1]);
        }
    }
    let _ = writeln!(svg, r#"<path d="{path}" stroke="{LINE}" stroke-width="1" fill="none"/>"#);
}

/// Returns the texts below the picture.
fn notes(tool: &ToolAssembly) -> Vec<String> {
    let file = tool.to_file();
    let core = match file.dead_core_radius_mm {
        0.0 => "cuts to its centre".to_owned(),
        core => format!("does not cut within Ø {} (red)", mm(2.0 * core)),
    };
    let mut notes = vec![
        format!(
            "Lengths in mm. Cutter: {} teeth, {core}, ramps up to {}°.",
            file.n_inserts,
            mm(file.max_ramp_angle_deg)
        ),
        list("Body", "b", &file.body),
        list("Holder", "h", &file.holder),
    ];
    if !file.assumed.is_empty() {
        let keys: Vec<&str> = file.assumed.iter().map(|assumed| assumed.key.as_str()).collect();
        notes.push(format!("Assumed: {}.", keys.join(", ")));
    }
    notes
}

fn list(name: &str, mark: &str, stack: &Stack) -> String {
    let section = |(k, s): (usize, &facemill_tool_model::Section)| {
        let (low, high) = (mm(s.diameter_low_mm), mm(s.diameter_high_mm));
        let diameter = if low == high { low } else { format!("{low} to {high}") };
        format!("{mark}{} Ø {diameter}, {} long", k + 1, mm(s.length_mm))
    };
    let mut listed: Vec<String> = stack.sections.iter().enumerate().take(MOST_LISTED).map(section).collect();
    if stack.sections.len() > MOST_LISTED {
        listed.push(format!("and {} more", stack.sections.len() - MOST_LISTED));
    }
    let listed = if listed.is_empty() { "none".to_owned() } else { listed.join("; ") };
    format!("{name} (clearance {}): {listed}.", mm(stack.clearance_mm))
}

#[cfg(test)]
#[path = "../tests/unit/assembly_svg.rs"]
mod tests;
