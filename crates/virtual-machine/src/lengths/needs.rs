//! Needs of a run through a program, per length of an assembly.

use facemill_cl_data::ClPoint;
use facemill_tool_model::AssemblyLength;
use nalgebra::Point3;
use schemars::JsonSchema;
use serde::Serialize;

/// The place of a program that a length is as long as it is for.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct ForcedBy {
    /// Line of the block, from 1.
    pub line: u32,
    /// Its number (N).
    pub block_number: Option<u32>,
    /// Its text.
    pub block_text: String,
    /// The body that the length keeps free.
    pub body: String,
    /// Obstacle that it keeps free of.
    pub obstacle: String,
    /// Where they meet with a shorter one, workpiece frame, mm.
    pub place_work_mm: [f64; 3],
    /// The tool tip there, workpiece frame, mm.
    pub tip_work_mm: [f64; 3],
    /// The tool axis there, workpiece frame.
    pub axis_work: [f64; 3],
}

/// One length taken up.
#[derive(Clone, Debug)]
pub(crate) struct Raise {
    /// The length that is free there, mm; infinite where none is up to the longest.
    pub(crate) to: f64,
    /// Index of the block.
    pub(crate) block: usize,
    pub(crate) body: String,
    pub(crate) obstacle: String,
    pub(crate) place: Point3<f64>,
    pub(crate) cl: ClPoint,
}

/// Needs of each length.
#[derive(Clone, Debug, Default)]
pub(crate) struct Needs {
    raises: [Option<Raise>; 4],
}

impl Needs {
    pub(crate) fn is_none(&self) -> bool {
        self.raises.iter().all(Option::is_none)
    }

    pub(crate) fn of(&self, length: AssemblyLength) -> Option<&Raise> {
        self.raises[length.index()].as_ref()
    }

    /// Takes a raise, where it is higher than those before it.
    pub(crate) fn add(&mut self, length: AssemblyLength, raise: Raise) {
        let slot = &mut self.raises[length.index()];
        if slot.as_ref().is_none_or(|before| raise.to > before.to) {
            *slot = Some(raise);
        }
    }

    /// Takes those of later blocks.
    pub(crate) fn add_all(&mut self, later: Self) {
        for (length, raise) in AssemblyLength::ALL.into_iter().zip(later.raises) {
            if let Some(raise) = raise {
                self.add(length, raise);
            }
        }
    }

    /// The first length that nothing up to the longest is free of.
    pub(crate) fn hopeless(&self) -> Option<(AssemblyLength, &Raise)> {
        let all = AssemblyLength::ALL.into_iter().zip(&self.raises);
        all.filter_map(|(length, raise)| raise.as_ref().map(|r| (length, r))).find(|(_, r)| r.to.is_infinite())
    }
}
