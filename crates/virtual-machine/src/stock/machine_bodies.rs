//! Bodies of the machine against what may be left of the stock when they come near it.

use facemill_cl_data::{Cancelled, Monitor};
use facemill_interference::Interference;
use facemill_z_map::{DexelGrid, DexelMap};
use rayon::prelude::*;

use crate::finding::FindingKind;
use crate::finding::episodes::{Contact, Episode, Key};
use crate::motion::moves::Move;
use crate::motion::setup::{VerifySettings, VirtualSetup};
use crate::run::between::BodyFollower;
use crate::run::chunk_result::ChunkResult;
use crate::run::edges::RunQueries;
use crate::run::scene::{Mount, RunScene, SceneBody};
use crate::run::walker::Walker;
use crate::stock::now::{FirstStock, StockNow};

/// The bodies of the machine of one head.
pub(crate) struct MachineBodies<'a> {
    setup: &'a VirtualSetup<'a>,
    settings: &'a VerifySettings,
    /// Each with its index among the bodies of the run's scene.
    bodies: Vec<(usize, SceneBody)>,
    /// Index of the stock that is cut, behind those of the run's obstacles.
    stock: usize,
    first: Vec<FirstStock<'a>>,
}

/// A move on which bodies of a head's machine are in question.
pub(crate) struct InQuestion {
    pub(crate) head: usize,
    /// Index of the move in its batch.
    pub(crate) index: usize,
    /// The bodies, by their indices among those of the run's scene.
    pub(crate) bodies: Vec<usize>,
}

/// Moves that are still to be tested, in order.
pub(crate) struct Waiting {
    moves: Vec<InQuestion>,
    /// Number of moves tested at once.
    at_once: usize,
}

/// Largest number of moves tested at once. More are tested in vain where the first of them cuts
/// stock that the others come near.
const MOST_AT_ONCE: usize = 64;

impl<'a> MachineBodies<'a> {
    /// `scene` is that of the run, `grid` that of the lines that are outside of all stock.
    pub(crate) fn new(scene: &RunScene<'a>, grid: &DexelGrid) -> Self {
        let on_machine = |(_, body): &(usize, &SceneBody)| matches!(body.mount, Mount::Machine(_));
        let bodies = scene.bodies.iter().enumerate().filter(on_machine);
        Self {
            setup: scene.setup,
            settings: scene.settings,
            bodies: bodies.map(|(k, body)| (k, body.clone())).collect(),
            stock: scene.obstacles.len(),
            first: scene.setup.obstacles.iter().filter_map(|o| FirstStock::of(o, grid)).collect(),
        }
    }

    /// Index of each among the bodies of the run's scene, and its name.
    pub(crate) fn names(&self) -> impl Iterator<Item = (usize, &str)> {
        self.bodies.iter().map(|(k, body)| (*k, &*body.name))
    }

    /// Returns the contacts of bodies on a move near the current stock on these lines: at the
    /// positions of [`verify`](crate::run::verify::verify), and followed from one to the next as
    /// there. A body that is not known to be free at every time has an episode, if need be without
    /// a measure.
    fn contacts(
        &self,
        queried: &[usize],
        (index, m): (usize, &Move),
        lines: &DexelMap,
        monitor: &dyn Monitor,
    ) -> Result<Vec<Episode>, Cancelled> {
        let bodies: Vec<&(usize, SceneBody)> = self.bodies.iter().filter(|(k, _)| queried.contains(k)).collect();
        let stock: Vec<StockNow<'_>> = self.first.iter().map(|first| first.at(lines)).collect();
        let own: Vec<&SceneBody> = bodies.iter().map(|(_, body)| body).collect();
        let meshes = stock.iter().map(|now| now as &dyn Interference);
        let scene = RunScene::of_bodies(self.setup, self.settings, &own, meshes);
        let shapes = RunQueries::new(&scene);
        let mut walker = Walker::new(&scene, &shapes, None, None);
        walker.run_bodies(index, m, monitor)?;
        let mut follower = BodyFollower::new(&scene);
        follower.run(index, m, &mut walker.result);
        let ChunkResult { mut episodes, open, .. } = walker.result;
        if !open.is_empty() {
            for k in 0..bodies.len() {
                let key = Key::of_body(FindingKind::Collision, k, 0);
                let cl = scene.cl_at(&m.end);
                episodes.record(index, Contact { key, measure: None, place: None, axes: m.end, cl, at: 1.0 });
            }
        }
        let of_run = |episode: Episode| {
            let key = episode.worst.key;
            let key = Key { body: key.body.map(|k| bodies[k].0), obstacle: Some(self.stock), ..key };
            Episode { worst: Contact { key, ..episode.worst }, ..episode }
        };
        Ok(episodes.all.into_iter().map(of_run).collect())
    }
}

impl Waiting {
    pub(crate) fn new(moves: Vec<InQuestion>) -> Self {
        Self { moves, at_once: 1 }
    }

    /// Index of the next move in its batch.
    pub(crate) fn next(&self) -> Option<usize> {
        self.moves.first().map(|queried| queried.index)
    }

    /// Returns the contacts of each head's bodies on the first of the moves, with the lines before
    /// it: its head, and the episodes. `first` is the index of the batch's first move in the
    /// program. The move then leaves the queue, and so do later moves that are free of the current
    /// lines: later cuts only remove material.
    pub(crate) fn ask_first(
        &mut self,
        heads: &[&MachineBodies<'_>],
        (first, moves): (usize, &[&[Move]]),
        lines: &DexelMap,
        monitor: &dyn Monitor,
    ) -> Result<Option<(usize, Vec<Episode>)>, Cancelled> {
        let queried: Vec<InQuestion> = self.moves.drain(..self.at_once.min(self.moves.len())).collect();
        let contacts = |InQuestion { head, index, bodies }: &InQuestion| {
            heads[*head].contacts(bodies, (first + index, &moves[*head][*index]), lines, monitor)
        };
        let found: Result<Vec<Vec<Episode>>, Cancelled> = queried.par_iter().map(contacts).collect();
        let mut all = queried.into_iter().zip(found?);
        let of_first = all.next().map(|(queried, episodes)| (queried.head, episodes));
        let again: Vec<InQuestion> =
            all.filter(|(_, episodes)| !episodes.is_empty()).map(|(queried, _)| queried).collect();
        self.at_once = if again.is_empty() { (2 * self.at_once).min(MOST_AT_ONCE) } else { 1 };
        self.moves.splice(0..0, again);
        Ok(of_first)
    }
}
