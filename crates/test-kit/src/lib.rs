//! Kit of the tests: random numbers with a seed, meshes of plain shapes, and where data beside the
//! workspace is.
//!
//! Nothing here shares code with what it tests, and no product crate depends on it.
//!
//! Modules, each of which imports those above it alone:
//!
//! | module | holds |
//! |---|---|
//! | `meshes` | boxes and grids as vertices and triangles |

mod meshes;

pub use meshes::{Mesh, box_mesh, grid_around, grid_by_columns, grid_by_rows};

/// Folder of NC programs from public sources, beside the workspace; tests that read them say that
/// they are skipped where it is absent.
pub const SHARED_NC: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/data/nc");

/// Generator of seeded numbers: SplitMix64 (Steele, Lea, Flood 2014). The field is the seed.
#[derive(Clone, Debug)]
pub struct Random(pub u64);

impl Random {
    /// Next 64 bits.
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Whole number below `n`.
    ///
    /// # Panics
    /// When `n` is 0.
    pub fn below(&mut self, n: usize) -> usize {
        (self.bits() % n as u64) as usize
    }

    /// Number in [0, 1).
    pub fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Number in [low, high).
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// Coordinate in ±2500 mm: mostly anywhere, often 0, tiny, or half a unit of the third decimal.
    pub fn coordinate(&mut self) -> f64 {
        match self.below(8) {
            0 => 0.0,
            1 => -0.0,
            2 => (self.unit() - 0.5) * 0.002,
            3 => (self.below(2001) as f64 - 1000.0) * 0.0005,
            4 => self.below(3) as f64,
            _ => (self.unit() - 0.5) * 5000.0,
        }
    }
}

/// Linear congruential generator with the constants of Knuth's MMIX, whose upper bits count. The
/// field is the seed. Scenes of older laws are drawn by it; new ones take [`Random`].
#[derive(Clone, Debug)]
pub struct Lcg(pub u64);

impl Lcg {
    /// Next 64 bits, the lower ones of short period.
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        self.0
    }

    /// Number in [0, 1).
    pub fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Number in [low, high).
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }
}
