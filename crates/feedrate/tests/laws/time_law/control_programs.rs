//! Four kinds of program on which controls differ, starting at the origin: X, Y, Z in mm, B and C
//! in deg.

/// A program of straight cuts.
pub(crate) struct ControlProgram {
    pub(crate) name: &'static str,
    /// Speed along X, Y and Z, mm/min.
    pub(crate) feed: f64,
    /// Largest distance from corners, mm; 0: exact stops.
    pub(crate) tolerance: f64,
    /// Ends of the cuts.
    pub(crate) ends: Vec<[f64; 5]>,
}

/// Returns all of them with about so many seconds of motion for each on a fast machine; 1 is the
/// least.
pub(crate) fn control_programs(size: usize) -> [ControlProgram; 4] {
    let program = |name, feed, tolerance, n: usize, at: fn(f64) -> [f64; 5]| {
        let start = at(0.0);
        let end = |k: usize| std::array::from_fn(|i| ((at(k as f64)[i] - start[i]) * 1e4).round() / 1e4);
        ControlProgram { name, feed, tolerance, ends: (1..=n).map(end).collect() }
    };
    [
        program("five-axis patch of 0.5 mm blocks", 20_000.0, 0.02, 25 * size, patch),
        program("smooth three-axis blocks of 0.3 mm", 6000.0, 0.02, 330 * size, smooth),
        program("zigzag", 3000.0, 0.02, 7 * size, zigzag),
        program("exact stops", 3000.0, 0.0, 7 * size, zigzag),
    ]
}

/// Rows to and fro over a hill, with both rotary axes turning.
fn patch(k: f64) -> [f64; 5] {
    let s = 0.5 * k;
    let row = (s / 40.0).floor();
    let along = s - 40.0 * row;
    let x = if row % 2.0 == 0.0 { along } else { 40.0 - along };
    let z = 8.0 * (x / 15.0 + 0.1 * row).sin();
    [x, 2.0 * row, z, 6.0 * (x / 20.0 + 0.3 * row).sin(), 20.0 * (x / 25.0 + 0.2 * row).cos()]
}

fn smooth(k: f64) -> [f64; 5] {
    let s = 0.3 * k;
    [0.7 * s, 20.0 * (s / 18.0).sin(), 5.0 * (s / 11.0).cos(), 0.0, 0.0]
}

fn zigzag(k: f64) -> [f64; 5] {
    [2.0 * k, if k % 2.0 == 0.0 { 0.0 } else { 6.0 }, 0.0, 0.0, 0.0]
}
