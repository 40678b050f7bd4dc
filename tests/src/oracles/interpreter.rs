//! A tiny FANUC interpreter: enough for what the planner writes, and nothing taken from its reader.
//!
//! It follows G0, G1, G43, G43.4, G49, G28, G90, G91, G93, G94 and the words X Y Z B C F. Comments,
//! macro blocks, M and T words do not move anything. Motions begin at the first block with G43 or
//! G43.4 on, when every axis has been stated.

/// Words of the axes: mm and deg. Under RTCP X, Y, Z are those of the tip in the frame of the work
/// offset, which is fixed to the table.
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
    /// F word in force: mm/min, or 1/min under G93.
    pub feed: Option<f64>,
    /// G93: F is the reciprocal of the block's minutes.
    pub inverse_time: bool,
    /// G43.4: the words are the tip's, which goes straight while the rotaries turn.
    pub rtcp: bool,
}

impl Motion {
    /// How long a cutting block takes, s: G93 60/F; G94 the way over F, with 1 deg as 1 mm; RTCP
    /// the tip's way over F.
    ///
    /// # Panics
    /// On rapids, and where no F is in force.
    pub fn seconds(&self) -> f64 {
        assert!(!self.rapid, "line {}: a rapid has no feed", self.line);
        let f = self.feed.unwrap_or_else(|| panic!("line {}: no F", self.line));
        let (a, b) = (&self.from, &self.to);
        let tip_sq = (b.x - a.x).powi(2) + (b.y - a.y).powi(2) + (b.z - a.z).powi(2);
        let turn_sq = (b.b - a.b).powi(2) + (b.c - a.c).powi(2);
        match (self.inverse_time, self.rtcp) {
            (true, _) => 60.0 / f,
            (false, true) => 60.0 * tip_sq.sqrt() / f,
            (false, false) => 60.0 * (tip_sq + turn_sq).sqrt() / f,
        }
    }
}

/// The motions of a program between G43 or G43.4 and G49.
///
/// # Panics
/// On a word it does not know: the program is not of the kind this is made for; and on a cutting
/// block under G93 without F, which a control stops at.
pub fn run(text: &str) -> Vec<Motion> {
    let mut motions = Vec::new();
    let (mut at, mut rapid, mut compensated, mut feed) = (Axes::default(), true, false, None);
    let (mut inverse_time, mut rtcp) = (false, false);
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
        if has('G', 93.0) || has('G', 94.0) {
            inverse_time = has('G', 93.0);
            // F of one mode means nothing in the other.
            feed = None;
        }
        let stated = words.iter().find(|w| w.0 == 'F').map(|f| f.1);
        feed = stated.or(feed);
        let mut to = at;
        let mut moves = false;
        for &(letter, value) in words.iter().filter(|w| "XYZBC".contains(w.0)) {
            to.set(letter, value);
            moves = true;
        }
        let starts = has('G', 43.0) || has('G', 43.4);
        if has('G', 49.0) {
            compensated = false;
        }
        if moves && compensated {
            assert!(rapid || !inverse_time || stated.is_some(), "line {}: G93 wants an F in every block", k + 1);
            motions.push(Motion { line: k + 1, rapid, from: at, to, feed, inverse_time, rtcp });
        }
        if starts {
            (compensated, rtcp) = (true, has('G', 43.4));
        }
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

/// The text with the word `letter` of a line (from 1) set to `value`, which is added where it is
/// missing.
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

    #[test]
    fn feed_modes_give_the_time_of_a_block() {
        let g94 = run("G94 G43 Z0.\nG1 X3. Y4. F100.\nB12. F60.\n");
        assert_eq!((g94[0].seconds(), g94[1].seconds()), (3.0, 12.0));
        let g93 = run("G94 F7.\nG93\nG43 Z0.\nG0 X1.\nG1 X3. F120.\nG0 X9.\n");
        assert!(g93[1].inverse_time && g93[1].seconds() == 0.5 && g93[0].feed.is_none());
        let rtcp = run("G94\nG43.4 Z0. H1\nG1 X3. Y4. B80. F100.\n");
        assert!(rtcp[0].rtcp && rtcp[0].seconds() == 3.0);
    }

    #[test]
    #[should_panic(expected = "G93 wants an F")]
    fn inverse_time_without_a_word_is_refused() {
        run("G93 G43 Z0.\nG1 X3. F120.\nX5.\n");
    }
}
