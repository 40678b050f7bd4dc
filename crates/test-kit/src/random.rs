//! Seeded random numbers.

use nalgebra::{Isometry3, Point3, Unit, UnitQuaternion, Vector3};

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
    /// Whether an event of the probability 1 / `n` happens.
    pub fn one_in(&mut self, n: f64) -> bool {
        self.unit() * n < 1.0
    }

    /// Vector in the cube from −`half` to `half` along each axis.
    pub fn vector(&mut self, half: f64) -> Vector3<f64> {
        Vector3::from_fn(|_, _| self.between(-half, half))
    }

    /// Point in the cube from −`half` to `half` along each axis.
    pub fn point(&mut self, half: f64) -> Point3<f64> {
        self.vector(half).into()
    }

    /// Direction, each with the same probability: z and the angle about z are uniform (Archimedes).
    pub fn direction(&mut self) -> Unit<Vector3<f64>> {
        let z = self.between(-1.0, 1.0);
        let (sin, cos) = self.between(0.0, std::f64::consts::TAU).sin_cos();
        let r = (1.0 - z * z).sqrt();
        Unit::new_normalize(Vector3::new(r * cos, r * sin, z))
    }

    /// Rigid motion: a turn by up to 3 rad about any direction, and a translation by
    /// [`Self::vector`] of `reach`.
    pub fn motion(&mut self, reach: f64) -> Isometry3<f64> {
        let angle = self.between(-3.0, 3.0);
        let turn = UnitQuaternion::from_axis_angle(&self.direction(), angle);
        Isometry3::from_parts(self.vector(reach).into(), turn)
    }

    /// Rigid motion as that of [`Self::motion`], but every fourth keeps axes parallel: it turns by
    /// nothing, or by 90° about x.
    pub fn pose(&mut self, reach: f64) -> Isometry3<f64> {
        let turn = match self.below(8) {
            0 => UnitQuaternion::identity(),
            1 => UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::FRAC_PI_2),
            _ => return self.motion(reach),
        };
        Isometry3::from_parts(self.vector(reach).into(), turn)
    }
}
