//! Heads that cut one stock: whether they are those of one machine, and go through the text
//! together.

use facemill_nc_program::ReadProgram;

use crate::motion::moves::ResolvedMoves;
use crate::motion::setup::{VerifyError, VirtualSetup, own_head};

/// Checks that each setup is of another head, and that all have one mounting of the workpiece.
///
/// # Errors
/// [`VerifyError::OneStock`] where not.
pub(crate) fn check_setups(setups: &[&VirtualSetup<'_>]) -> Result<(), VerifyError> {
    for (k, setup) in setups.iter().enumerate().skip(1) {
        let wrong = |what: &str| Err(VerifyError::OneStock { setup: k + 1, what: what.to_owned() });
        let own = own_head(setup);
        if own.is_none() || setups[..k].iter().any(|before| own_head(before) == own) {
            return wrong("is of no head of its own");
        }
        if setup.table_from_work != setups[0].table_from_work {
            return wrong("has the workpiece mounted at another place");
        }
    }
    Ok(())
}

/// Checks that the program is the same motions of all axes in each setup, one by one.
///
/// # Errors
/// [`VerifyError::OneStock`] with the line of the first motion that is not.
pub(crate) fn check_moves(program: &ReadProgram, resolved: &[ResolvedMoves]) -> Result<(), VerifyError> {
    for (k, own) in resolved.iter().enumerate().skip(1) {
        let (first, own) = (&resolved[0].moves, &own.moves);
        let differs = first.iter().zip(own).position(|(a, b)| {
            (a.block, a.law, a.is_rapid) != (b.block, b.law, b.is_rapid) || (a.start, a.end) != (b.start, b.end)
        });
        let shorter = first.len().min(own.len());
        let Some(at) = differs.or((first.len() != own.len()).then_some(shorter)) else { continue };
        let block = first.get(at).or(own.get(at)).map_or(0, |m| m.block);
        let what = format!("makes other motions of the program, from line {} on", program.blocks[block].line);
        return Err(VerifyError::OneStock { setup: k + 1, what });
    }
    Ok(())
}
