//! Stock files: the same bytes back, and every fault found.

use facemill_z_map::{DexelMap, StockFileError};

use crate::dexel_kit::{body, cut, pose};
use crate::kit::Random;

fn stock() -> DexelMap {
    let mut map = DexelMap::of_box(&Random(1).pose(10.0), [0.0; 3], [14.0, 9.0, 5.0], 0.8).unwrap();
    let middle = map.grid().in_work(8, 5, 2.5);
    cut(
        &mut map,
        &body(1.5, 1.5, 2.0),
        pose(middle.into(), [0.3, 1.0, 0.2]),
        pose(middle.into(), [0.3, 1.0, 0.2]),
        0.01,
    );
    map
}

/// The checksum put right after a change.
fn resealed(mut bytes: Vec<u8>) -> Vec<u8> {
    let end = bytes.len() - 32;
    let checksum = blake3::hash(&bytes[..end]);
    bytes[end..].copy_from_slice(checksum.as_bytes());
    bytes
}

#[test]
fn a_stock_comes_back_from_its_bytes() {
    let map = stock();
    let bytes = map.to_bytes();
    let back = DexelMap::from_bytes(&bytes).unwrap();
    back.check_invariants().unwrap();
    assert!(back == map && back.to_bytes() == bytes);
}

#[test]
fn what_a_stock_was_at_first_stays_with_it_through_cuts_and_files() {
    for n in [0, 1, 7, 32, 300] {
        let origin: Vec<u8> = (0..n).map(|k| (31 * k + 5) as u8).collect();
        let mut map = stock().with_origin(origin.clone());
        let middle = map.grid().in_work(8, 5, 2.5);
        let at = |turn: [f64; 3]| pose(middle.into(), turn);
        cut(&mut map, &body(2.0, 1.0, 3.0), at([0.0, 1.0, 0.2]), at([0.3, 1.0, 0.0]), 0.01);
        assert_eq!(map.origin(), origin);
        let back = DexelMap::from_bytes(&map.to_bytes()).unwrap();
        assert!(back == map && back.origin() == origin, "{n} bytes");
        assert_eq!(back == map.clone().with_origin(Vec::new()), n == 0, "it is part of the map");
    }
}

#[test]
fn every_changed_or_missing_byte_is_found() {
    let bytes = stock().to_bytes();
    for at in (0..bytes.len()).step_by(7) {
        let mut changed = bytes.clone();
        changed[at] ^= 0x10;
        assert!(DexelMap::from_bytes(&changed).is_err(), "byte {at}");
        assert!(DexelMap::from_bytes(&bytes[..at]).is_err(), "cut off at {at}");
    }
    assert!(DexelMap::from_bytes(&[&bytes[..], &[0]].concat()).is_err());
}

#[test]
fn faults_are_distinguished() {
    let bytes = stock().to_bytes();
    let fault = |change: &dyn Fn(&mut Vec<u8>)| {
        let mut changed = bytes.clone();
        change(&mut changed);
        DexelMap::from_bytes(&resealed(changed)).unwrap_err()
    };
    let put = |at: usize, number: f64| move |b: &mut Vec<u8>| b[at..at + 8].copy_from_slice(&number.to_le_bytes());
    assert!(matches!(DexelMap::from_bytes(b"solid"), Err(StockFileError::NotStock)));
    for version in [1, 3] {
        let fault = fault(&|b| b[8] = version);
        assert_eq!(fault, StockFileError::Version { found: version.into() });
        assert!(fault.to_string().contains("--rest-out"), "{fault}");
    }
    assert!(matches!(fault(&|b| b[12] += 1), StockFileError::Length { .. }));
    assert!(matches!(fault(&|b| b[19] = 0xff), StockFileError::Length { .. }));
    assert!(matches!(fault(&put(20, -1.0)), StockFileError::Grid(_)));
    assert!(matches!(fault(&put(20, f64::NAN)), StockFileError::Grid(_)));
    assert!(matches!(fault(&put(68, 3.0)), StockFileError::Rotation));
    assert!(matches!(fault(&|b| b[108] += 1), StockFileError::Length { .. }), "bytes of the origin");
    assert!(matches!(fault(&|b| b[115] = 0xff), StockFileError::Length { .. }), "more of them than can be");
    assert!(matches!(fault(&|b| b[116] += 1), StockFileError::Count { .. }));
    let heights = bytes.len() - 32 - 16;
    assert!(matches!(fault(&put(heights, 1e9)), StockFileError::Broken(_)));
    assert!(matches!(fault(&put(heights, f64::NAN)), StockFileError::Broken(_)));
    let mut changed = bytes.clone();
    changed[heights] ^= 1;
    assert_eq!(DexelMap::from_bytes(&changed), Err(StockFileError::Checksum));
}
