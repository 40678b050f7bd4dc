//! Closed solutions for two and three rotary axes.

pub(crate) mod degenerate;
pub(crate) mod direction_pair;
pub(crate) mod free_plane;
pub(crate) mod inverse_solution;
pub(crate) mod linear_tables;
pub(crate) mod middle_rotary;
pub(crate) mod rotary_triples;
pub(crate) mod screw_chain;
pub(crate) mod summed_rotaries;
pub(crate) mod three_rotaries;
pub(crate) mod tip_condition;
pub(crate) mod trig_roots;

use nalgebra::{Point3, Unit, Vector3};

use crate::axes::axis::{Axis, AxisKind};
use crate::machine_file::error::MachineError;
use crate::solver::degenerate::refuse_degenerate;
use crate::solver::direction_pair::{DirectionPair, PARALLEL_SINE, PairFault};
use crate::solver::inverse_solution::Branch;
use crate::solver::linear_tables::LinearTables;
use crate::solver::rotary_triples::{RotaryTriple, Target, Triples};
use crate::solver::screw_chain::{Screw, ScrewChain};
use crate::solver::summed_rotaries::SummedRotaries;
use crate::solver::three_rotaries::ThreeRotaries;
use crate::solver::tip_condition::TipCondition;

/// Method of a machine's inverse solution.
#[derive(Clone, Debug, PartialEq)]
#[expect(clippy::large_enum_variant, reason = "one per machine, and the larger one is read in every solution")]
pub(crate) enum Solver {
    /// Two rotary joints follow from the tool axis alone, three linear ones from the tip.
    Closed { rotaries: DirectionPair, linears: [usize; 3], tables: Box<LinearTables> },
    /// Three rotary joints follow from the tool axis and one condition on the tip, two linear ones
    /// from the rest.
    Numeric(Box<NumericSolver>),
}

/// The inverse solution of two linear and three rotary joints.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct NumericSolver {
    /// Axes of the rotary joints, from the table to the tool.
    pub(crate) rotaries: [usize; 3],
    /// Axes of the linear joints, from the table to the tool.
    pub(crate) linears: [usize; 2],
    condition: TipCondition,
    elimination: Elimination,
}

#[derive(Clone, Debug, PartialEq)]
enum Elimination {
    Three(ThreeRotaries),
    Summed(SummedRotaries),
}

impl Solver {
    /// Axes of the linear joints, in chain order.
    pub(crate) fn linears(&self) -> &[usize] {
        match self {
            Self::Closed { linears, .. } => linears,
            Self::Numeric(numeric) => &numeric.linears,
        }
    }

    /// Sets up the solution of a chain of five joints.
    pub(crate) fn new(chain: &ScrewChain, axes: &[Axis]) -> Result<Self, MachineError> {
        let of_kind = |kind| chain.screws.iter().filter(move |s| s.kind == kind);
        let rotary: Vec<&Screw> = of_kind(AxisKind::Rotary).collect();
        let linear: Vec<usize> = of_kind(AxisKind::Linear).map(|s| s.axis).collect();
        let letter = |s: &Screw| axes[s.axis].letter;
        let spindle = chain.spindle_at_zero();
        let fault = |fault, first: &Screw, second: &Screw| match fault {
            PairFault::Parallel => MachineError::ParallelRotaries { first: letter(first), second: letter(second) },
            PairFault::SpindleAlongSecond => MachineError::ToolAlongRotary { axis: letter(second) },
        };
        if let [first, second] = rotary[..] {
            let rotaries = DirectionPair::new((first.axis, first.direction), (second.axis, second.direction), &spindle)
                .map_err(|f| fault(f, first, second))?;
            let tables = Box::new(LinearTables::new(chain, [first.axis, second.axis]));
            return Ok(Self::Closed { rotaries, linears: [linear[0], linear[1], linear[2]], tables });
        }
        let (first, middle, last) = (rotary[0], rotary[1], rotary[2]);
        let w = [first, middle, last].map(|s| s.direction);
        let rotaries = [first, middle, last].map(|s| s.axis);
        let parallel = |a: &Unit<Vector3<f64>>, b: &Unit<Vector3<f64>>| a.cross(b).norm() < PARALLEL_SINE;
        if parallel(&spindle, &w[2]) {
            return Err(MachineError::ToolAlongRotary { axis: letter(last) });
        }
        let (elimination, condition) = match (parallel(&w[0], &w[1]), parallel(&w[1], &w[2])) {
            (false, false) => {
                let three = ThreeRotaries::new(w, &spindle);
                let condition = three.condition(chain, rotaries);
                (Elimination::Three(three), condition)
            }
            (first_two, _) => {
                let summed = SummedRotaries::new(w, &spindle, first_two).map_err(|f| fault(f, first, last))?;
                (Elimination::Summed(summed), TipCondition::new(chain, rotaries, [0.0; 3]))
            }
        };
        refuse_degenerate(chain, axes)?;
        let linears = [linear[0], linear[1]];
        Ok(Self::Numeric(Box::new(NumericSolver { rotaries, linears, condition, elimination })))
    }
}

impl NumericSolver {
    pub(crate) fn target(&self, tip: &Point3<f64>, tool_axis: &Vector3<f64>, tool_length: f64) -> Target<'_> {
        Target::new(&self.condition, tip, tool_axis, tool_length)
    }

    /// Returns the rotary values of all solutions.
    pub(crate) fn solve(&self, target: &Target<'_>, reference: [f64; 3]) -> Triples {
        match &self.elimination {
            Elimination::Three(three) => three.solve(target, reference),
            Elimination::Summed(summed) => summed.solve(target, reference),
        }
    }

    /// Returns the solution that Newton's method reaches from a reference position.
    pub(crate) fn near(&self, target: &Target<'_>, reference: [f64; 3]) -> Option<RotaryTriple> {
        match &self.elimination {
            Elimination::Three(three) => three.near(target, reference),
            Elimination::Summed(summed) => summed.near(target, reference),
        }
    }

    /// Returns the branch of rotary values.
    pub(crate) fn branch_of(&self, values: [f64; 3]) -> Branch {
        match &self.elimination {
            Elimination::Three(three) if three.is_positive(values[2]) => Branch::Positive,
            Elimination::Three(_) => Branch::Negative,
            Elimination::Summed(summed) => summed.branch_of(values),
        }
    }

    /// Returns the angle by which a direction is out of reach, 0 within.
    pub(crate) fn out_of_reach(&self, tool_axis: &Vector3<f64>) -> f64 {
        match &self.elimination {
            Elimination::Three(three) => three.out_of_reach(tool_axis),
            Elimination::Summed(summed) => summed.out_of_reach(tool_axis),
        }
    }

    /// Returns rotary values that give the tool axis, at one value of the unknown and on one side.
    pub(crate) fn values_at(&self, target: &Target<'_>, value: f64, positive: bool) -> Option<[f64; 3]> {
        match &self.elimination {
            Elimination::Three(three) => three.values_at(target, value, positive),
            Elimination::Summed(summed) => summed.values_at(target, value, positive),
        }
    }
}
