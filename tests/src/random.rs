//! Seeded numbers, the same on every machine.

use nalgebra::{Isometry3, Translation3, Unit, UnitQuaternion, Vector3};

/// SplitMix64 (Steele, Lea, Flood 2014).
#[derive(Clone, Debug)]
pub struct Random(facemill_test_kit::Random);

impl Random {
    /// Numbers of a seed.
    pub fn new(seed: u64) -> Self {
        Self(facemill_test_kit::Random(seed))
    }

    /// 64 random bits.
    pub fn bits(&mut self) -> u64 {
        self.0.bits()
    }

    /// A number from `low` to `high`.
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        self.0.between(low, high)
    }

    /// An index below `n`, which is not 0.
    pub fn below(&mut self, n: usize) -> usize {
        (self.bits() % n as u64) as usize
    }

    /// A direction, all alike.
    pub fn direction(&mut self) -> Unit<Vector3<f64>> {
        let z = self.between(-1.0, 1.0);
        let (sin, cos) = self.between(0.0, std::f64::consts::TAU).sin_cos();
        let r = (1.0 - z * z).sqrt();
        Unit::new_normalize(Vector3::new(r * cos, r * sin, z))
    }

    /// A rigid motion with translations up to `reach`.
    pub fn motion(&mut self, reach: f64) -> Isometry3<f64> {
        let angle = self.between(-3.0, 3.0);
        let rotation = UnitQuaternion::from_axis_angle(&self.direction(), angle);
        let [x, y, z] = [0; 3].map(|_| self.between(-reach, reach));
        Isometry3::from_parts(Translation3::new(x, y, z), rotation)
    }
}
