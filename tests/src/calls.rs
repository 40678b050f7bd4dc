//! Programs with a part in a subprogram.

/// Number of the subprogram.
pub const SUBPROGRAM: u32 = 2999;

/// A program for FANUC with some of its cuts, from the middle, in a subprogram of its own file: the
/// main program, and the text of `O2999.nc`.
///
/// # Panics
/// If it has fewer than six cuts one behind the other.
pub fn with_a_call(program: &str) -> [String; 2] {
    let lines: Vec<&str> = program.lines().collect();
    let is_cut = |k: &usize| {
        let words = lines[*k].split_whitespace();
        words.clone().any(|word| word.starts_with('X')) && !words.clone().any(|word| matches!(word, "G0" | "G00"))
    };
    let first = (0..lines.len()).find(|k| (*k..k + 6).all(|k| k < lines.len() && is_cut(&k))).expect("six cuts");
    let (from, to) = (first + 2, first + 5);
    let call = format!("M98 P{SUBPROGRAM}");
    let main = [&lines[..from], &[call.as_str()], &lines[to..]].concat();
    let sub = format!("%\nO{SUBPROGRAM} (PART OF A PASS)\n{}\nM99\n%\n", lines[from..to].join("\n"));
    [main.join("\n") + "\n", sub]
}
