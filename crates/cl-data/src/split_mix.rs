//! Numbers that only look random: the same on every machine.

/// Generator of seeded numbers: SplitMix64 (Steele, Lea and Flood, 2014). The field is the state,
/// at first the seed.
///
/// ```
/// use facemill_cl_data::SplitMix64;
///
/// let mut random = SplitMix64(0);
/// // The first number of the published generator with this seed.
/// assert_eq!(random.bits(), 0xe220_a839_7b1d_cdaf);
/// assert!((0.0..1.0).contains(&random.unit()));
/// ```
#[derive(Clone, Debug)]
pub struct SplitMix64(pub u64);

impl SplitMix64 {
    /// Returns the next 64 bits.
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Returns the next number in [0, 1), a multiple of 2⁻⁵³.
    pub fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1_u64 << 53) as f64
    }
}

/// Returns bits that all depend on all bits of a number, so that neighbouring numbers give
/// unrelated ones: those of [`SplitMix64`] with the number as its seed. Different numbers stay
/// different.
pub fn mixed_bits(number: u64) -> u64 {
    SplitMix64(number).bits()
}

#[cfg(test)]
#[path = "../tests/unit/split_mix.rs"]
mod tests;
