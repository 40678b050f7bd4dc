//! Texts of pictures: upper bounds of their widths, and line breaks that make them fit.
//!
//! Renderers differ in fonts: a picture names Helvetica, and is drawn with Liberation, DejaVu or
//! Verdana. Texts placed here fit with the widest of them.

use std::fmt::Write;

/// Distance of the lines of a text, in sizes of its font.
pub const LEADING: f64 = 1.4;

/// Size of all letters of a picture except those of its heading.
pub(crate) const SIZE: f64 = 13.0;

/// Colour of letters and lines.
pub(crate) const INK: &str = "#22282d";

/// Returns an upper bound of a text's width for usual fonts without serifs, in the unit of `size`.
pub fn text_width(text: &str, size: f64, bold: bool) -> f64 {
    let wider = if bold { 1.2 } else { 1.0 };
    text.chars().map(advance).sum::<f64>() * size * wider
}

/// Returns the advance of a letter, in sizes of the font.
fn advance(letter: char) -> f64 {
    match letter {
        'i' | 'j' | 'l' | 'I' | 'J' | '.' | ',' | ':' | ';' | '\'' | '|' | '!' => 0.46,
        ' ' => 0.36,
        'f' | 't' | 'r' | '(' | ')' | '[' | ']' | '-' | '"' | '²' | '³' => 0.48,
        'm' | 'w' | 'M' | 'W' | '%' | '@' => 1.08,
        'A'..='Z' | '+' | '=' | '<' | '>' | '~' | '_' | '#' | '^' | '&' => 0.86,
        '°' => 0.56,
        ' '..='~' => 0.66,
        'α' | 'β' => 0.72,
        _ => 1.1,
    }
}

/// Breaks a text into lines no wider than this: between words, and within a word that is wider
/// alone.
pub fn lines(text: &str, size: f64, bold: bool, width: f64) -> Vec<String> {
    let fits = |line: &str| text_width(line, size, bold) <= width;
    let mut lines: Vec<String> = vec![String::new()];
    for word in text.split_whitespace() {
        let last = lines.len() - 1;
        let longer = if lines[last].is_empty() { word.to_owned() } else { format!("{} {word}", lines[last]) };
        if fits(&longer) {
            lines[last] = longer;
            continue;
        }
        if !lines[last].is_empty() {
            lines.push(String::new());
        }
        for letter in word.chars() {
            let last = lines.len() - 1;
            let longer = format!("{}{letter}", lines[last]);
            if fits(&longer) || lines[last].is_empty() {
                lines[last] = longer;
            } else {
                lines.push(letter.to_string());
            }
        }
    }
    lines
}

/// Draws a text in lines from a position on, with `attributes`; returns the additional height
/// compared with one line.
pub fn draw_lines(svg: &mut String, lines: &[String], [x, y]: [f64; 2], size: f64, attributes: &str) -> f64 {
    for (k, line) in lines.iter().enumerate() {
        let y = y + LEADING * size * k as f64;
        // Writing to a string does not fail.
        let _ = writeln!(svg, r#"<text x="{x}" y="{y}" font-size="{size}"{attributes}>{}</text>"#, escape(line));
    }
    more_lines(lines, size)
}

/// Returns the additional height of lines compared with one line.
pub fn more_lines(lines: &[String], size: f64) -> f64 {
    LEADING * size * lines.len().saturating_sub(1) as f64
}

/// Returns the positions of consecutive entries of these widths from 0 to `width`: each with its
/// line from 0.
pub fn flow(widths: &[f64], width: f64) -> Vec<(f64, usize)> {
    let (mut x, mut line) = (0.0, 0);
    let mut places = Vec::with_capacity(widths.len());
    for &own in widths {
        if x > 0.0 && x + own > width {
            (x, line) = (0.0, line + 1);
        }
        places.push((x, line));
        x += own;
    }
    places
}

/// Escapes a text for XML.
pub fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

#[cfg(test)]
#[path = "../tests/unit/svg_text.rs"]
mod tests;
