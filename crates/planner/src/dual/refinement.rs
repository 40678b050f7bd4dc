//! Stops added where the program of two heads exceeds its limits.

use std::collections::BTreeSet;

use facemill_cutter_location::{Hints, PairTest, PoseTest};
use facemill_tool_path::moves::MoveKind;

use crate::dual::moves::{DualMove, DualMover};
use crate::dual::output::{BlockPlace, DualTexts};
use crate::dual::pair::run_planner;
use crate::dual::parts::{ProgramPart, TwoHeadContext};
use crate::passes::move_settings::move_settings;

/// Adds tested stops to each block of a run on these lines, at least one in its middle, and returns
/// their number. A block stays as it is if none is feasible, or if one head works alone.
pub(crate) fn refine(
    context: &TwoHeadContext<'_>,
    parts: &mut [ProgramPart<'_>],
    texts: &DualTexts,
    lines: &BTreeSet<u32>,
) -> usize {
    let on_them: Vec<BlockPlace> =
        texts.places.iter().filter(|(line, _)| lines.contains(line)).map(|(_, place)| *place).collect();
    let mut put_in = 0;
    for (k, part) in parts.iter_mut().enumerate() {
        let own: Vec<BlockPlace> = on_them.iter().filter(|p| p.part == k).copied().collect();
        let ([Some(a), Some(b)], Some(pair)) = (part.files, &part.pair) else { continue };
        if own.is_empty() {
            continue;
        }
        let (files, file) = ([a, b], pair.file.clone());
        let cells = [context.cell(0, a), context.cell(1, b)];
        let tests = [PoseTest::new(&cells[0]), PoseTest::new(&cells[1])];
        let settings = [0, 1].map(|h| move_settings(context.scenes[h].job, context.scenes[h].setup, files[h]));
        let mover = DualMover {
            test: PairTest { tests: [&tests[0], &tests[1]], shared: context.shared },
            settings: [&settings[0], &settings[1]],
        };
        let planner = run_planner(&mover, files, &settings, &file, [&[], &[]]);
        let mut hints = [Hints::default(), Hints::default()];
        // Backwards, so that the blocks before keep their indices.
        for place in own.into_iter().rev() {
            let section = &mut part.sections[place.section];
            let is_cut = section.moves[place.at].kind == MoveKind::Cut;
            let Some(run) = section.run.as_mut().filter(|_| is_cut && place.at > 0) else { continue };
            let ranges = planner.ranges(run.uncut_left);
            let (from, to) = (&run.stops[place.at - 1], &run.stops[place.at]);
            let Some(stops) = planner.refined(&ranges, from, to, &mut hints) else { continue };
            put_in += stops.len();
            // Between the same stops the chips are no larger.
            let chips = section.moves[place.at].chips;
            for stop in stops.into_iter().rev() {
                let axes = mover.turned(&stop.pose.axes, &section.moves[place.at - 1].axes);
                section.moves.insert(place.at, DualMove { kind: MoveKind::Cut, axes, working: [true; 2], chips });
                run.stops.insert(place.at, stop);
            }
        }
    }
    put_in
}
