//! Stock on which a setup is planned: its own, or an outside bound of what the programs before it
//! leave.

use std::fmt;

use facemill_surface_model::TriMesh;
use facemill_z_map::DexelMap;

use crate::format::report::stock::OWN_STOCK;

/// Stock on which postures, entries, links and chips of a setup are planned.
#[derive(Clone, Debug, PartialEq)]
pub enum PlanningStock {
    /// The setup's own; with the reason why it is not what the programs before leave, where there
    /// are such programs.
    Own {
        /// The reason.
        why: Option<String>,
    },
    /// An outside bound of what the programs of other setups leave.
    LeftByPrograms {
        /// Names of these setups.
        setups: Vec<String>,
        /// Names of setups of whose cuts nothing counts: the tool is too small for these lines, or
        /// the program has a fault.
        not_counted: Vec<String>,
        /// Distance of the lines of the bound, mm.
        cell: f64,
        /// Thickness of the layer that uncut surfaces have around them, mm; cut surfaces have some
        /// more.
        layer: f64,
    },
}

impl PlanningStock {
    /// Returns the distance by which the stock may be thicker than what is left, mm.
    pub(crate) fn error(&self) -> f64 {
        match self {
            Self::Own { .. } => 0.0,
            Self::LeftByPrograms { cell, layer, .. } => cell + 2.0 * layer,
        }
    }
}

impl fmt::Display for PlanningStock {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let names = |setups: &[String]| {
            let quoted: Vec<String> = setups.iter().map(|name| format!("\"{name}\"")).collect();
            quoted.join(", ")
        };
        match self {
            Self::Own { why: None } => f.write_str(OWN_STOCK),
            Self::Own { why: Some(why) } => write!(f, "{OWN_STOCK}, because {why}"),
            Self::LeftByPrograms { setups, not_counted, cell, layer } => {
                write!(
                    f,
                    "all that {} may leave, on lines {cell} mm apart with {layer:.2} mm around it",
                    names(setups)
                )?;
                if not_counted.is_empty() {
                    return Ok(());
                }
                write!(
                    f,
                    "; cuts of {} do not count: the cutter is too small for these lines, or the program has a fault",
                    names(not_counted)
                )
            }
        }
    }
}

/// A setup's own stock: its mesh, or part and check surfaces with an allowance around them.
#[derive(Clone)]
pub(crate) struct OwnStock {
    pub(crate) mesh: TriMesh,
    /// Allowance, mm.
    pub(crate) allowance: f64,
    pub(crate) is_solid: bool,
}

/// Outside bound of a stock that some programs leave.
#[derive(Clone)]
pub(crate) struct CutStock {
    /// Identity of the stock in its workpiece frame.
    pub(crate) origin: Vec<u8>,
    /// Requested distance of its lines, mm.
    pub(crate) requested: Option<f64>,
    /// Digests of the programs, in their order.
    pub(crate) programs: Vec<[u8; 32]>,
    /// Names of their setups, those of which cuts are known and the others.
    pub(crate) setups: [Vec<String>; 2],
    pub(crate) lines: DexelMap,
    /// Largest error of cuts on a line, mm.
    pub(crate) tolerance: f64,
}
