use std::collections::BTreeSet;

use super::*;

/// First numbers of the seed 0 as the reference code prints them (Vigna, splitmix64.c).
#[test]
fn numbers_of_the_seed_0_are_those_of_the_published_generator() {
    let mut random = SplitMix64(0);
    assert_eq!([0; 3].map(|_| random.bits()), [0xe220_a839_7b1d_cdaf, 0x6e78_9e6a_a1b9_65f4, 0x06c4_5d18_8009_454f]);
}

#[test]
fn mixed_bits_of_neighbours_differ_in_half_of_all_bits() {
    const N: u64 = 4096;
    let all: BTreeSet<u64> = (0..N).map(mixed_bits).collect();
    assert_eq!(all.len() as u64, N);
    let changed: u64 = (0..N).map(|k| u64::from((mixed_bits(k) ^ mixed_bits(k + 1)).count_ones())).sum();
    // A count of 64 fair coins has a deviation of 4.
    let mean = changed as f64 / N as f64;
    assert!((mean - 32.0).abs() < 5.0 * 4.0 / (N as f64).sqrt(), "{mean}");
}
