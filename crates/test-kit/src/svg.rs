//! Texts of pictures, drawn with the widest font that renderers fall back to.

/// Advances of the letters from space to tilde in DejaVu Sans and its bold face, thousandths of the
/// size: the widest font that renderers fall back to.
const DEJAVU: [[u16; 95]; 2] = [
    [
        318, 401, 460, 838, 636, 950, 780, 275, 390, 390, 500, 838, 318, 361, 318, 337, 636, 636, 636, 636, 636, 636,
        636, 636, 636, 636, 337, 337, 838, 838, 838, 531, 1000, 684, 686, 698, 770, 632, 575, 775, 752, 295, 295, 656,
        557, 863, 748, 787, 603, 787, 695, 635, 611, 732, 684, 989, 685, 611, 685, 390, 337, 390, 838, 500, 500, 613,
        635, 550, 635, 615, 352, 635, 634, 278, 278, 579, 278, 974, 634, 612, 635, 635, 411, 521, 392, 634, 592, 818,
        592, 592, 525, 636, 337, 636, 838,
    ],
    [
        348, 456, 521, 838, 696, 1002, 872, 306, 457, 457, 523, 838, 380, 415, 380, 365, 696, 696, 696, 696, 696, 696,
        696, 696, 696, 696, 400, 400, 838, 838, 838, 580, 1000, 774, 762, 734, 830, 683, 683, 821, 837, 372, 372, 775,
        637, 995, 837, 850, 733, 850, 770, 720, 682, 812, 774, 1103, 771, 724, 725, 457, 365, 457, 838, 500, 500, 675,
        716, 593, 716, 678, 435, 716, 712, 343, 343, 665, 343, 1042, 712, 687, 716, 716, 493, 595, 478, 712, 652, 924,
        645, 652, 582, 712, 365, 712, 838,
    ],
];

/// Returns the width of a text in DejaVu Sans; other letters count as wide as their size, since °
/// and Greek ones are narrower.
pub fn drawn_width(text: &str, size: f64, bold: bool) -> f64 {
    let of = |letter: char| match (letter as usize).checked_sub(32).filter(|k| *k < 95) {
        Some(k) => f64::from(DEJAVU[usize::from(bold)][k]) / 1000.0,
        None if letter == '°' || letter == '²' || letter == '³' => 0.5,
        None => 0.72,
    };
    text.chars().map(of).sum::<f64>() * size
}

/// Returns the value of an attribute in a tag.
fn attribute<'t>(tag: &'t str, name: &str) -> Option<&'t str> {
    let start = tag.find(&format!(" {name}=\""))? + name.len() + 3;
    tag[start..].split('"').next()
}

fn number(tag: &str, name: &str) -> Option<f64> {
    attribute(tag, name)?.parse().ok()
}

/// Returns the texts of a picture that are not wholly in it, drawn with a wide font. Groups may
/// only move their content down.
pub fn texts_outside(svg: &str) -> Vec<String> {
    let head = &svg[svg.find("<svg").expect("a picture")..];
    let frame: Vec<f64> =
        attribute(head, "viewBox").expect("a view box").split(' ').map(|v| v.parse().expect("a number")).collect();
    let base = number(head, "font-size").expect("a size");
    let mut outside = Vec::new();
    let mut moved = 0.0;
    for tag in svg.split('<').skip(1) {
        if tag.starts_with("g ") {
            moved = attribute(tag, "transform").map_or(moved, |t| {
                t.trim_start_matches("translate(0 ").trim_end_matches(')').parse().expect("a way down")
            });
        }
        let Some((tag, text)) = tag.strip_prefix("text").and_then(|_| tag.split_once('>')) else { continue };
        let text = text.replace("&lt;", "<").replace("&gt;", ">").replace("&amp;", "&");
        let size = number(tag, "font-size").unwrap_or(base);
        let width = drawn_width(&text, size, tag.contains("bold"));
        let start = match attribute(tag, "text-anchor") {
            Some("middle") => -0.5 * width,
            Some("end") => -width,
            _ => 0.0,
        };
        let turned = attribute(tag, "transform").map(|t| t.split(['(', ' ', ')']).collect::<Vec<_>>());
        let is_in = match turned {
            Some(parts) => {
                let y: f64 = parts[2].parse().expect("a number");
                y - start - width >= -moved && y - start <= frame[3] - moved
            }
            None => {
                let (x, y) = (number(tag, "x").expect("x"), number(tag, "y").expect("y") + moved);
                x + start >= 0.0 && x + start + width <= frame[2] && y - size >= 0.0 && y + 0.3 * size <= frame[3]
            }
        };
        if !is_in {
            outside.push(text);
        }
    }
    outside
}
