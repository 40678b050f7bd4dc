//! Arrays of numbers as text: differences, gzip, base64.

use std::io::Write;

use flate2::Compression;
use flate2::write::GzEncoder;
use rayon::prelude::*;
use serde::Serialize;

/// Numbers in an array of the page: `offset + unit × q`, with whole numbers q.
///
/// The bytes of an array are the differences of its q, each from the one before (the first from 0),
/// zigzag-coded as LEB128, then compressed as gzip and written as base64. In an array with gaps q
/// is at least 1, and 0 is a number that is not known.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct NumberArray {
    /// Number of the element that holds the bytes (`array-0`).
    pub array: usize,
    /// Number of values.
    pub n: usize,
    /// Difference of two neighbouring values.
    pub unit: f64,
    /// Value of q = 0.
    pub offset: f64,
    /// Whether q = 0 is a number that is not known.
    pub gaps: bool,
}

/// Bytes in an array of the page, compressed as gzip and written as base64.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ByteArray {
    /// Number of the element that holds the bytes.
    pub array: usize,
    /// Number of bytes.
    pub n: usize,
}

/// Arrays of a page, in the order of their numbers.
#[derive(Clone, Debug, Default)]
pub struct Arrays {
    /// Bytes of each, before they are compressed.
    bytes: Vec<Vec<u8>>,
}

impl Arrays {
    /// Adds numbers, rounded to multiples of `unit` from `offset`.
    pub(crate) fn numbers(&mut self, values: impl IntoIterator<Item = f64>, (unit, offset): (f64, f64)) -> NumberArray {
        let whole = values.into_iter().map(|value| ((value - offset) / unit).round() as i64);
        let (array, n) = self.add_whole(whole);
        NumberArray { array, n, unit, offset, gaps: false }
    }

    /// Adds whole numbers as they are.
    pub(crate) fn integers(&mut self, values: impl IntoIterator<Item = i64>) -> NumberArray {
        let (array, n) = self.add_whole(values.into_iter());
        NumberArray { array, n, unit: 1.0, offset: 0.0, gaps: false }
    }

    /// Adds numbers of which some are not known, rounded to multiples of `unit`; `None` if none is
    /// known.
    pub(crate) fn numbers_with_gaps(&mut self, values: &[Option<f64>], unit: f64) -> Option<NumberArray> {
        let known = |v: &Option<f64>| v.filter(|v| v.is_finite());
        let least = values.iter().filter_map(known).reduce(f64::min)?;
        let offset = (least / unit).round() * unit - unit;
        let whole = values.iter().map(|v| known(v).map_or(0, |v| (((v - offset) / unit).round() as i64).max(1)));
        let (array, n) = self.add_whole(whole);
        Some(NumberArray { array, n, unit, offset, gaps: true })
    }

    /// Adds bytes as they are.
    pub(crate) fn bytes(&mut self, bytes: &[u8]) -> ByteArray {
        self.bytes.push(bytes.to_vec());
        ByteArray { array: self.bytes.len() - 1, n: bytes.len() }
    }

    /// Returns all of them as they are in the page: gzip, then base64.
    pub(crate) fn texts(&self) -> Vec<String> {
        self.bytes.par_iter().map(|bytes| base64(&gzip(bytes))).collect()
    }

    fn add_whole(&mut self, values: impl Iterator<Item = i64>) -> (usize, usize) {
        let (mut bytes, mut before, mut n) = (Vec::new(), 0_i64, 0);
        for value in values {
            put_difference(&mut bytes, value.wrapping_sub(before));
            before = value;
            n += 1;
        }
        self.bytes.push(bytes);
        (self.bytes.len() - 1, n)
    }
}

/// Appends a difference: zigzag, then seven bits a byte, the lowest first.
fn put_difference(bytes: &mut Vec<u8>, difference: i64) {
    let mut rest = ((difference << 1) ^ (difference >> 63)) as u64;
    while rest >= 0x80 {
        bytes.push(rest as u8 | 0x80);
        rest >>= 7;
    }
    bytes.push(rest as u8);
}

/// Returns the gzip of bytes, without name or time: the same bytes give the same gzip.
fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::new(6));
    // Writing to a vector does not fail.
    let _ = encoder.write_all(bytes);
    encoder.finish().unwrap_or_default()
}

/// Returns bytes as base64 (RFC 4648), with padding.
pub(crate) fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for chunk in bytes.chunks(3) {
        let group = [0, 1, 2].map(|k| u32::from(chunk.get(k).copied().unwrap_or(0)));
        let bits = group[0] << 16 | group[1] << 8 | group[2];
        for k in 0..4 {
            let digit = DIGITS[(bits >> (18 - 6 * k)) as usize & 63] as char;
            text.push(if k <= chunk.len() { digit } else { '=' });
        }
    }
    text
}

#[cfg(test)]
#[path = "../tests/unit/packed.rs"]
mod tests;
