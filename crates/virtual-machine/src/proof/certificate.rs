//! Certificates of every block: a bound on the depth of the cutter at any time, and on the distance
//! of each body.

use std::collections::BTreeMap;

use facemill_cl_data::{Cancelled, Monitor};
use facemill_nc_program::ReadProgram;
use facemill_nc_program::read::ReadBlock;
use rayon::prelude::*;
use schemars::JsonSchema;
use serde::Serialize;

use crate::motion::moves::{Move, resolve};
use crate::motion::setup;
use crate::motion::setup::{VerifyError, VerifySettings, VirtualSetup};
use crate::proof::doubts::{Doubt, Doubts};
use crate::proof::prover::Prover;
use crate::proof::{Open, Proof};
use crate::run::scene::RunScene;

/// Certificate of one block's motion, from its start to its end under the machine's motion law.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Certificate {
    /// Line of the program, from 1.
    pub line: u32,
    /// Number (N) of the block.
    pub block_number: Option<u32>,
    /// No point of the cutter is ever deeper than this below an obstacle's allowance, in rapid
    /// below the stock; in rapid, and against bodies of the machine, with the control's tolerance.
    /// `null` where nothing up to the limit could be proven.
    pub depth_mm: Option<f64>,
    /// The same with the control's tolerance in cutting moves, too: path + orientation × distance
    /// of the cutter's farthest point from the tip.
    pub depth_with_control_mm: Option<f64>,
    /// No non-cutting body ever comes nearer than this to anything it is tested against, mm, with
    /// the control's tolerance; of the body as it is, without its clearance. `null` where not even
    /// its required clearance could be proven, or there is nothing to meet.
    pub clearance_mm: Option<f64>,
    /// The bodies of that pair.
    pub clearance_between: Option<[String; 2]>,
    /// Whether all of it is proven: the depth within the limit, in rapid none, and every body's
    /// required clearance, both with the control's tolerance.
    pub certified: bool,
    /// Why it is not certified.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
    /// The first pair for which that could not be proven, where there is one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub uncertified_between: Option<[String; 2]>,
    /// Line of the fault in the text from which on the motion is not known to be the simulated one;
    /// nothing is proven then.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub doubted_since_line: Option<u32>,
    /// Intervals of time that the proof took.
    pub intervals: u32,
}

/// Certificates of a program.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Certificates {
    /// Blocks with a motion, and those with a fault that may hide one.
    pub blocks: usize,
    /// Those that are certified.
    pub certified: usize,
    /// Largest proven depth, mm; `null` where a block has none.
    pub largest_depth_mm: Option<f64>,
    /// One for each of these blocks, in program order.
    pub certificates: Vec<Certificate>,
}

impl Certificates {
    /// The blocks that are not certified.
    pub fn uncertified(&self) -> impl Iterator<Item = &Certificate> {
        self.certificates.iter().filter(|c| !c.certified)
    }

    /// The sums of certificates in program order.
    pub fn new(certificates: Vec<Certificate>) -> Self {
        let mut depths = certificates.iter().map(|c| c.depth_mm);
        Self {
            blocks: certificates.len(),
            certified: certificates.iter().filter(|c| c.certified).count(),
            largest_depth_mm: depths.try_fold(0.0, |worst, d| Some(f64::max(worst, d?))),
            certificates,
        }
    }
}

impl Certificate {
    /// Of a line that a fault of the text puts in doubt.
    fn doubted(line: u32, block_number: Option<u32>, doubt: &Doubt) -> Self {
        let reason = if doubt.line == line {
            doubt.what.clone()
        } else {
            format!("not known to be as simulated since line {}: {}", doubt.line, doubt.what)
        };
        Self {
            line,
            block_number,
            depth_mm: None,
            depth_with_control_mm: None,
            clearance_mm: None,
            clearance_between: None,
            certified: false,
            reason: Some(reason),
            uncertified_between: None,
            doubted_since_line: Some(doubt.line),
            intervals: 0,
        }
    }

    fn proven(block: &ReadBlock, proof: &Proof, scene: &RunScene<'_>) -> Self {
        let body = |k: usize| scene.bodies[k].name.clone();
        let obstacle = |k: usize| scene.obstacles[k].name.clone();
        let (reason, between) = match proof.open {
            None => (None, None),
            Some(Open::Motion) => (Some("the axes have no such motion".to_owned()), None),
            Some(Open::Cutter { obstacle: k, limit, is_rapid }) => {
                let reason = if is_rapid {
                    format!("the cutter is not proven to stay out of {} in rapid", obstacle(k))
                } else {
                    format!("the cutter is not proven to stay within {limit:.3} mm of depth in {}", obstacle(k))
                };
                (Some(reason), Some(["cutter".to_owned(), obstacle(k)]))
            }
            Some(Open::Body { body: index, obstacle: k, required }) => {
                let reason =
                    format!("{} is not proven to stay {required:.3} mm away from {}", body(index), obstacle(k));
                (Some(reason), Some([body(index), obstacle(k)]))
            }
        };
        Self {
            line: block.line,
            block_number: block.number,
            depth_mm: proof.depth.map(|d| d.programmed),
            depth_with_control_mm: proof.depth.map(|d| d.with_control),
            clearance_mm: proof.clearance.map(|c| c.0),
            clearance_between: proof.clearance.map(|(_, (index, k))| [body(index), obstacle(k)]),
            certified: proof.depth.is_some() && proof.bodies_clear,
            reason,
            uncertified_between: between,
            doubted_since_line: None,
            intervals: proof.intervals,
        }
    }
}

/// Proves for every block of a program what the cutter and the bodies do between its ends: not at
/// positions, but at every time.
///
/// Each block is taken in intervals of time. Over an interval the motion relative to an obstacle is
/// a velocity up to a proven deviation, and the mesh's tree proves that the moving body stays away
/// by a distance ([`Interference::sweep`](facemill_interference::Interference::sweep)); where it
/// does not, the interval is halved. For the cutter the distance is that of its test body for a
/// depth: a little more than the depth at sampled times first, then more, up to the gouge limit. An
/// unproven block is marked as such, which says nothing about its motion.
///
/// Bodies, and the cutter where it must not touch, are proven with what the control may leave the
/// motion by. Of stock that [`VerifySettings::as_cut`] leaves to the runs that cut it nothing is
/// said.
///
/// Motions under every law can be proven. Where no bound on the axes' accelerations is known,
/// nothing is proven: beside the places where linear axes cannot follow the tip, and near the pole
/// under [`TipLinearVectorTurned`](facemill_cl_data::CuttingLaw::TipLinearVectorTurned) where
/// bodies of the machine are tested. Nor is anything from a block on after which the positions of
/// the axes are not known: an arc, a cycle, a macro call, an unknown place. Every such fault has a
/// certificate that is not certified and says why. The result does not depend on the number of
/// threads; `monitor` advances once by every block.
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
    if settings.estimate.is_some() {
        return Err(VerifyError::Estimated { what: "certificates" });
    }
    let resolved = resolve(program, setup, settings);
    let scene = RunScene::new(setup, settings)?;
    let doubts = Doubts::new(program, &resolved.faults);
    let blocks: Vec<&[Move]> = resolved.moves.chunk_by(|a, b| a.block == b.block).collect();
    let of_blocks: Result<Vec<Certificate>, Cancelled> = blocks
        .par_iter()
        .map(|moves| {
            monitor.checkpoint()?;
            let block = &program.blocks[moves[0].block];
            let certificate = doubts.of_line(block.line).map_or_else(
                || Certificate::proven(block, &proof(&scene, moves), &scene),
                |doubt| Certificate::doubted(block.line, block.number, doubt),
            );
            monitor.advance(1);
            Ok(certificate)
        })
        .collect();
    let mut by_line: BTreeMap<u32, Certificate> = of_blocks?.into_iter().map(|c| (c.line, c)).collect();
    for doubt in doubts.iter() {
        let at = program.blocks.partition_point(|b| b.line < doubt.line);
        let block = program.blocks.get(at).filter(|b| b.line == doubt.line);
        let of_doubt = || Certificate::doubted(doubt.line, block.and_then(|b| b.number), doubt);
        by_line.entry(doubt.line).or_insert_with(of_doubt);
    }
    monitor.advance(program.blocks.len().saturating_sub(blocks.len()));
    Ok(Certificates::new(by_line.into_values().collect()))
}

/// Of the moves of one block.
fn proof(scene: &RunScene<'_>, moves: &[Move]) -> Proof {
    let of_move = |m| Prover::new(scene, m).map_or_else(Proof::unknown, |mut p| p.prove());
    moves.iter().map(of_move).reduce(Proof::and).unwrap_or_else(Proof::unknown)
}
