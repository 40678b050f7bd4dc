//! Chip areas of a job's first setup against what its program takes out of the stock, pass by pass:
//! `chip-volumes JOB [CELL MM] [MARGIN MM] [X0,Y0,X1,Y1 PLACE]`. Of every piece of a pass the ends
//! are left out up to the margin; lines may be over a rectangle of the workpiece frame only, which
//! should hold all of one place of the pattern.

use std::path::Path;
use std::process::ExitCode;

use facemill::StockRegion;
use facemill_tests::oracles::chip_trial::{plan_and_cut, request, summary, trial};

/// How far from the truth what is cut may be, mm.
const TOLERANCE: f64 = 0.005;

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let Some(path) = arguments.first() else {
        eprintln!("chip-volumes JOB [CELL MM] [MARGIN MM] [X0,Y0,X1,Y1 PLACE]");
        return ExitCode::FAILURE;
    };
    let parse = |text: &str| text.parse::<f64>().unwrap_or_else(|_| panic!("{text} is no number"));
    let number = |k: usize, default: f64| arguments.get(k).map_or(default, |a| parse(a));
    let (cell, margin) = (number(1, 1.0), number(2, 100.0));
    let region = arguments.get(3).map_or(StockRegion::Operations, |corners| {
        let [x0, y0, x1, y1] = corners.split(',').map(parse).collect::<Vec<_>>()[..] else {
            panic!("{corners} are not four numbers")
        };
        StockRegion::Rectangle([[x0, y0], [x1, y1]])
    });
    let (table, verified) = plan_and_cut(Path::new(path), request(cell, TOLERANCE, region));
    let mut pieces = trial(&table, &verified.cuts);
    if let Some(place) = arguments.get(4) {
        pieces.retain(|p| f64::from(p.place) == parse(place));
    }
    print!("{}", summary(&pieces, margin));
    ExitCode::SUCCESS
}
