//! How often lines are taken apart.

use std::cell::Cell;

use facemill_nc_program::Dialect;

use crate::expand;

thread_local! {
    /// Lines that this thread took apart.
    pub(super) static N_LINES: Cell<usize> = const { Cell::new(0) };
}

/// However many subprograms there are and however often they run, no line is taken apart twice.
#[test]
fn every_line_is_taken_apart_once() {
    let n = 300;
    let calls: String = (2..n).map(|k| format!("M98 P{k} L50\n")).collect();
    let subs: String = (2..n).map(|k| format!("O{k}\nG1 X{k}.\nM99\n")).collect();
    let text = format!("O1\n{calls}M98 P9000\nM30\n{subs}");
    let own = "%\nO9000\nG1 X1.\nM99\n%\n";
    let beside = |_: &[String]| Some(("O9000.nc".to_owned(), own.as_bytes().to_vec()));
    N_LINES.with(|n| n.set(0));
    let found = expand(text.as_bytes(), "main.nc", Dialect::Fanuc, &beside).expect("no fault").expect("calls");
    assert_eq!(found.n_calls, n - 1);
    assert_eq!(N_LINES.with(Cell::get), text.lines().count() + own.lines().count());
}
