use std::collections::BTreeMap;

use facemill_cl_data::ClPoint;
use facemill_inverse_kinematics::AxisValues;
use nalgebra::Point3;

use crate::finding::{FindingKind, Measure};

/// Identity of a contact: contacts with equal keys are the same thing.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Key {
    pub(crate) kind: FindingKind,
    pub(crate) body: Option<usize>,
    pub(crate) obstacle: Option<usize>,
    pub(crate) axis: Option<usize>,
    /// Whether bodies meet, not only what is around one of them.
    pub(crate) is_contact: bool,
}

/// One fault at one position.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Contact {
    pub(crate) key: Key,
    pub(crate) measure: Option<Measure>,
    /// Workpiece frame.
    pub(crate) place: Option<Point3<f64>>,
    pub(crate) axes: AxisValues,
    /// Workpiece frame.
    pub(crate) cl: ClPoint,
    /// Fraction of the move's time.
    pub(crate) at: f64,
}

/// The same thing on moves that follow each other.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Episode {
    pub(crate) first_move: usize,
    pub(crate) last_move: usize,
    pub(crate) worst_move: usize,
    pub(crate) worst: Contact,
}

/// Episodes in the order in which they began.
#[derive(Clone, Debug, Default)]
pub(crate) struct Episodes {
    pub(crate) all: Vec<Episode>,
    /// The last one of each key.
    latest: BTreeMap<Key, usize>,
}

impl Key {
    pub(crate) fn of_body(kind: FindingKind, body: usize, obstacle: usize) -> Self {
        Self { kind, body: Some(body), obstacle: Some(obstacle), axis: None, is_contact: true }
    }

    pub(crate) fn of_cutter(kind: FindingKind, obstacle: usize) -> Self {
        Self { kind, body: None, obstacle: Some(obstacle), axis: None, is_contact: true }
    }

    pub(crate) fn of_axis(kind: FindingKind, axis: Option<usize>) -> Self {
        Self { kind, body: None, obstacle: None, axis, is_contact: true }
    }
}

impl Key {
    /// The same of what is around a body alone.
    pub(crate) fn without_contact(self) -> Self {
        Self { is_contact: false, ..self }
    }
}

impl Episode {
    /// Whether a body only comes near to the other one.
    fn is_near(&self) -> bool {
        self.worst.key.kind == FindingKind::NearMiss || !self.worst.key.is_contact
    }

    /// Whether a body, or the cutter in rapid, meets what it must not.
    fn is_collision(&self) -> bool {
        let kinds = [FindingKind::Collision, FindingKind::HolderCollision, FindingKind::RapidCollision];
        self.worst.key.is_contact && kinds.contains(&self.worst.key.kind)
    }
}

/// Returns the episodes worth reporting: all but near misses of bodies that collide on some of the
/// same moves.
pub(crate) fn worth_telling(all: &[Episode]) -> impl Iterator<Item = &Episode> {
    let pair = |e: &Episode| (e.worst.key.body, e.worst.key.obstacle);
    let mut met: BTreeMap<_, Vec<[usize; 2]>> = BTreeMap::new();
    for e in all.iter().filter(|e| e.is_collision()) {
        met.entry(pair(e)).or_default().push([e.first_move, e.last_move]);
    }
    let is_met = move |e: &Episode| {
        let mut of_pair = met.get(&pair(e)).into_iter().flatten();
        of_pair.any(|[first, last]| *first <= e.last_move && e.first_move <= *last)
    };
    all.iter().filter(move |e| !(e.is_near() && is_met(e)))
}

impl Episodes {
    /// Adds what happens on a move. Moves come in order.
    pub(crate) fn record(&mut self, move_index: usize, contact: Contact) {
        let (first_move, last_move, worst_move) = (move_index, move_index, move_index);
        self.add(Episode { first_move, last_move, worst_move, worst: contact });
    }

    /// Adds an episode of the following moves, as part of the one it continues where there is one.
    pub(crate) fn add(&mut self, episode: Episode) {
        let key = episode.worst.key;
        let open = self.latest.get(&key).map(|&k| &mut self.all[k]);
        if let Some(open) = open.filter(|e| episode.first_move <= e.last_move + 1) {
            open.last_move = open.last_move.max(episode.last_move);
            let worse = match (&episode.worst.measure, &open.worst.measure) {
                (Some(new), Some(old)) => new.is_worse_than(old),
                _ => false,
            };
            if worse {
                (open.worst, open.worst_move) = (episode.worst, episode.worst_move);
            }
            return;
        }
        self.latest.insert(key, self.all.len());
        self.all.push(episode);
    }
}
