//! A tiny FANUC interpreter: enough for what the planner writes, and nothing taken from its reader.
//!
//! It follows G0, G1, G43, G49, G28, G90, G91 and the words X Y Z B C F. Comments, macro blocks, M and T words do not
//! move anything. Motions are told from the first block with G43 on, when every axis has been stated.

/// Words of the axes: mm and deg.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[expect(missing_docs, reason = "axis letters")]
pub struct Axes {
    pub x: f64,
    pub y: f64,
    pub z: f64,
    pub b: f64,
    pub c: f64,
}

impl Axes {
    /// All axes linear together: what the control does in a block.
    #[must_use]
    pub fn lerp(&self, to: &Self, t: f64) -> Self {
        let mix = |a: f64, b: f64| a + t * (b - a);
        Self {
            x: mix(self.x, to.x),
            y: mix(self.y, to.y),
            z: mix(self.z, to.z),
            b: mix(self.b, to.b),
            c: mix(self.c, to.c),
        }
    }

    fn set(&mut self, letter: char, value: f64) {
        match letter {
            'X' => self.x = value,
            'Y' => self.y = value,
            'Z' => self.z = value,
            'B' => self.b = value,
            'C' => self.c = value,
            _ => {}
        }
    }
}

/// A motion of the program.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    /// Line of the text, from 1.
    pub line: usize,
    /// G0.
    pub rapid: bool,
    /// Where it starts.
    pub from: Axes,
    /// Where it ends.
    pub to: Axes,
    /// F word in force.
    pub feed: Option<f64>,
}

/// The motions of a program between G43 and G49.
///
/// # Panics
/// On a word it does not know: the program is not of the kind this is made for.
pub fn run(text: &str) -> Vec<Motion> {
    let mut motions = Vec::new();
    let (mut at, mut rapid, mut compensated, mut feed) = (Axes::default(), true, false, None);
    for (k, line) in text.lines().enumerate() {
        let bare = without_comments(line);
        if bare.contains('#') || bare.contains('%') || bare.starts_with('O') {
            continue;
        }
        let words = words(&bare, k + 1);
        let has = |letter: char, value: f64| words.iter().any(|w| w.0 == letter && w.1 == value);
        assert!(!has('G', 2.0) && !has('G', 3.0), "line {}: arcs are not of this kind of program", k + 1);
        if has('G', 28.0) || has('G', 53.0) {
            compensated = false;
            continue;
        }
        if has('G', 0.0) || has('G', 1.0) {
            rapid = has('G', 0.0);
        }
        if let Some(f) = words.iter().find(|w| w.0 == 'F') {
            feed = Some(f.1);
        }
        let mut to = at;
        let mut moves = false;
        for &(letter, value) in words.iter().filter(|w| "XYZBC".contains(w.0)) {
            to.set(letter, value);
            moves = true;
        }
        let starts = has('G', 43.0);
        if has('G', 49.0) {
            compensated = false;
        }
        if moves && compensated {
            motions.push(Motion { line: k + 1, rapid, from: at, to, feed });
        }
        compensated |= starts;
        at = to;
    }
    motions
}

fn without_comments(line: &str) -> String {
    let mut depth = 0;
    line.chars()
        .filter(|&c| {
            let opens = c == '(';
            depth += i32::from(opens);
            let inside = depth > 0;
            depth -= i32::from(c == ')');
            !inside
        })
        .collect()
}

/// Letters and numbers of a block.
fn words(block: &str, line: usize) -> Vec<(char, f64)> {
    let mut words = Vec::new();
    let mut rest = block.trim();
    while let Some(letter) = rest.chars().next() {
        assert!(letter.is_ascii_uppercase(), "line {line}: `{rest}`");
        let tail = &rest[1..];
        let end = tail.find(|c: char| !(c.is_ascii_digit() || c == '.' || c == '-' || c == '+')).unwrap_or(tail.len());
        let value = tail[..end].parse().unwrap_or_else(|e| panic!("line {line}: `{rest}`: {e}"));
        words.push((letter, value));
        rest = tail[end..].trim_start();
    }
    words
}

/// The text with the word `letter` of a line (from 1) set to `value`, which is added where it is missing.
pub fn with_word(text: &str, line: usize, letter: char, value: f64) -> String {
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    let block = &mut lines[line - 1];
    let mut words: Vec<String> =
        block.split_whitespace().filter(|w| !w.starts_with(letter)).map(str::to_owned).collect();
    // Feed last, as it was.
    let place = words.iter().position(|w| w.starts_with('F')).unwrap_or(words.len());
    words.insert(place, format!("{letter}{value:.4}"));
    *block = words.join(" ");
    lines.join("\n") + "\n"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn modal_words_stay_and_comments_do_nothing() {
        let text = "O1 (X9. G1)\nG91 G28 Z0.\nG0 G90 B10. C-20.\nX1. Y2.\nG43 Z3. H1 (Z77.)\nG1 X5. F100.\nN7 (no) Z-1.5\nG0 Z50.\nG49\nX0.\n";
        let m = run(text);
        assert_eq!(m.len(), 3);
        assert_eq!(m[0].from, Axes { x: 1.0, y: 2.0, z: 3.0, b: 10.0, c: -20.0 });
        assert!(!m[1].rapid && m[1].to.z == -1.5 && m[1].to.x == 5.0 && m[1].feed == Some(100.0) && m[1].line == 7);
        assert!(m[2].rapid && m[2].to.z == 50.0);
        let edited = run(&with_word(text, 7, 'Z', -2.0));
        assert_eq!(edited[1].to.z, -2.0);
        assert_eq!(edited[0], m[0]);
    }
}
