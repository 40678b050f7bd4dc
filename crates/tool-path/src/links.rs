//! Links: the fastest free way from one run of cuts to the next.

pub mod choose;
pub mod clock;
#[cfg(test)]
#[path = "../tests/unit/links/link_path_laws.rs"]
mod link_path_laws;
#[cfg(test)]
#[path = "../tests/unit/links/link_path_scenes.rs"]
mod link_path_scenes;
pub mod link_paths;
pub mod tour;
pub mod words;

use facemill_cutter_location::links::link::ClearanceSurface;
use facemill_inverse_kinematics::{AxisValues, Machine};
use facemill_virtual_machine::{LinkStage, ProgramLink};
use nalgebra::Isometry3;

use crate::links::choose::{Choice, Chooser};
use crate::links::clock::LinkClock;
use crate::links::link_paths::LinkEnds;

/// A machine with its tool and workpiece, and the surface over which long links lead.
#[derive(Clone, Copy)]
pub struct LinkScene<'a> {
    /// The machine.
    pub machine: &'a Machine,
    /// From the gauge line to the tip, mm.
    pub tool_length: f64,
    /// Mounting of the workpiece.
    pub table_from_work: Isometry3<f64>,
    /// Clearance surface, workpiece frame.
    pub clearance: ClearanceSurface,
}

impl LinkScene<'_> {
    /// Returns the ends of a link at these axis values.
    fn ends(&self, start: AxisValues, end: AxisValues) -> LinkEnds<'_> {
        LinkEnds {
            machine: self.machine,
            tool_length: self.tool_length,
            table_from_work: self.table_from_work,
            surface: &self.clearance,
            start,
            end,
            spindle: spindle_of(self.machine),
        }
    }
}

/// Returns the fastest free path of a link through positions given by `rounded`. `heads` is the
/// machine as each of its heads sees it, with its tool.
///
/// # Errors
/// When a way cannot be timed.
pub fn fastest(
    heads: &[LinkScene<'_>],
    clock: &LinkClock<'_>,
    (link, stage): (&ProgramLink, &LinkStage<'_, '_>),
    rounded: &(dyn Fn(&AxisValues) -> Option<AxisValues> + Sync),
) -> Result<Choice, String> {
    let end = link.ends.last().copied().unwrap_or(link.start);
    let heads: Vec<LinkEnds<'_>> = heads.iter().map(|head| head.ends(link.start, end)).collect();
    Chooser { heads: &heads, clock, law: link.law, rounded }.choose(link, stage)
}

/// Time of a link from a position through those of the way that the planner has for it, s; infinite
/// where it has none.
pub type LinkTime<'t> = dyn Fn(&AxisValues, &[AxisValues]) -> f64 + Sync + 't;

/// Returns the index of the linear axis along the spindle where the rotary axes are at 0, and the
/// sign of its motion away from the work.
pub fn spindle_of(machine: &Machine) -> (usize, f64) {
    let travel = machine.length_compensation_travel().unwrap_or_else(|| AxisValues::zeros(machine.axes().len()));
    let spindle = (0..travel.len()).max_by(|&a, &b| travel[a].abs().total_cmp(&travel[b].abs())).unwrap_or(0);
    (spindle, travel[spindle].signum())
}
