//! What is proven of every block: how deep the cutter is at most at any time, and how near a body comes.

use facemill_cl_data::{Cancelled, Monitor};
use facemill_nc_program::ReadProgram;
use rayon::prelude::*;
use schemars::JsonSchema;
use serde::Serialize;

use crate::moves::resolve;
use crate::prover::{Proof, Prover};
use crate::scene::Scene;
use crate::{VerifyError, VerifySettings, VirtualSetup, setup};

/// What is proven of one block's motion, from its start to its end under the machine's motion law.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Certificate {
    /// Line of the program, from 1.
    pub line: u32,
    /// Number (N) of the block.
    pub block_number: Option<u32>,
    /// No point of the cutter is ever deeper than this below an obstacle's allowance, mm; in rapid below the stock. `null`
    /// where nothing up to the gouge limit could be proven.
    pub depth_mm: Option<f64>,
    /// The same with what the control may leave the programmed motion by (its path tolerance, and its orientation tolerance
    /// at the rim).
    pub depth_with_control_mm: Option<f64>,
    /// No non-cutting body ever comes nearer than this to anything it is tested against, mm; of the body as it is, without
    /// its clearance. `null` where not even its required clearance could be proven, or there is nothing to meet.
    pub clearance_mm: Option<f64>,
    /// The bodies of that pair.
    pub clearance_between: Option<[String; 2]>,
    /// Whether all of it is proven: the depth within the limit, and every body's required clearance.
    pub certified: bool,
    /// Intervals of time that the proof took.
    pub intervals: u32,
}

/// Certificates of a program.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Certificates {
    /// Blocks with a motion.
    pub blocks: usize,
    /// Those that are certified.
    pub certified: usize,
    /// Largest proven depth, mm; `null` where a block has none.
    pub largest_depth_mm: Option<f64>,
    /// One for each block with a motion, in program order.
    pub certificates: Vec<Certificate>,
}

/// Proves for every block of a program what the cutter and the bodies do between its ends: not at positions, but at every
/// time.
///
/// Each block is taken in intervals of time. Over an interval the motion relative to an obstacle is a velocity, told to a
/// proven deviation, and the mesh's tree proves that the moving body stays away by a distance
/// ([`Interference::sweep`](facemill_interference::Interference::sweep)); where it does not, the interval is halved. For
/// the cutter the distance is that of its test body for a depth: a little more than the depth at sampled times first, then
/// more, up to the gouge limit. What is not proven is told as such, and says nothing about the motion.
///
/// Proven are motions under every law. Where no bound on the axes' accelerations is known, nothing is: beside the places where
/// linear axes cannot follow the tip, and near the pole under
/// [`TipLinearVectorTurned`](facemill_cl_data::CuttingLaw::TipLinearVectorTurned) where bodies of the machine are asked for.
/// The result does not depend on the number of threads; `monitor` is told of every block once.
///
/// # Errors
/// When the setup or a setting makes no sense, or the monitor cancels.
pub fn certify(
    program: &ReadProgram,
    setup: &VirtualSetup<'_>,
    settings: &VerifySettings,
    monitor: &dyn Monitor,
) -> Result<Certificates, VerifyError> {
    setup::check(setup, settings)?;
    let resolved = resolve(program, setup, settings);
    let scene = Scene::new(setup, settings)?;
    let control = setup.machine.motion_law().control_tolerance.charge(setup.tool.cutter().radius());
    let of_moves: Result<Vec<Proof>, Cancelled> = resolved
        .moves
        .par_iter()
        .map(|m| {
            monitor.checkpoint()?;
            let proof = Prover::new(&scene, m).map_or_else(Proof::unknown, |mut p| p.prove());
            monitor.advance(1);
            Ok(proof)
        })
        .collect();
    let of_moves = of_moves?;
    let mut certificates = Vec::new();
    let mut first = 0;
    for run in resolved.moves.chunk_by(|a, b| a.block == b.block) {
        let proofs = &of_moves[first..first + run.len()];
        first += run.len();
        let block = &program.blocks[run[0].block];
        let whole = proofs.iter().cloned().reduce(Proof::and).unwrap_or_else(Proof::unknown);
        let names = |(body, obstacle): (usize, usize)| {
            [scene.bodies[body].name.clone(), scene.obstacles[obstacle].name.clone()]
        };
        certificates.push(Certificate {
            line: block.line,
            block_number: block.number,
            depth_mm: whole.depth,
            depth_with_control_mm: whole.depth.map(|d| d + control),
            clearance_mm: whole.clearance.map(|c| c.0),
            clearance_between: whole.clearance.map(|c| names(c.1)),
            certified: whole.depth.is_some() && whole.bodies_clear,
            intervals: whole.intervals,
        });
    }
    let mut depths = certificates.iter().map(|c| c.depth_mm);
    Ok(Certificates {
        blocks: certificates.len(),
        certified: certificates.iter().filter(|c| c.certified).count(),
        largest_depth_mm: depths.try_fold(0.0, |worst, d| Some(f64::max(worst, d?))),
        certificates,
    })
}
