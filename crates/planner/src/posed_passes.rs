//! Postures of the passes of a plan, for maps of some of them.

use facemill_tool_path::segments::PassSegment;

use crate::passes::operation::PlannedOperation;

/// Piece of a pass in a place of the pattern, with its tested postures.
#[derive(Clone, Debug)]
pub struct PosedPass {
    /// Name of the operation.
    pub operation: String,
    /// The piece.
    pub(crate) piece: PassSegment,
}

/// Returns the pieces of all operations, in the order of the program.
pub(crate) fn posed_passes(operations: &[PlannedOperation<'_>]) -> Vec<PosedPass> {
    let of = |o: &PlannedOperation<'_>| {
        let pieces = o.moves.pieces.iter().map(|moves| moves.piece.clone());
        pieces.map(|piece| PosedPass { operation: o.operation.name.clone(), piece }).collect::<Vec<_>>()
    };
    operations.iter().flat_map(of).collect()
}
