use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};

use crate::dexel::grid::{DexelGrid, GridError};
use crate::dexel::map::{Broken, DexelMap};
use crate::dexel::tile::Interval;

/// First bytes of a stock file.
const MAGIC: &[u8; 8] = b"FMDEXEL\n";
/// Version of the format.
const VERSION: u32 = 2;
/// Bytes before the origin: magic, version, lines along x and y, ten numbers, number of intervals,
/// bytes of the origin.
const HEADER: usize = 8 + 4 + 2 * 4 + 10 * 8 + 8 + 8;
/// Bytes of the checksum at the end.
const CHECKSUM: usize = 32;

/// Why bytes are not a stock.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum StockFileError {
    /// The file does not begin like a stock.
    #[error("not a stock file: it does not begin with \"FMDEXEL\"")]
    NotStock,
    /// The file is of another version.
    #[error(
        "stock file of version {found}; this program reads version {VERSION}: write it again with this program (verify --rest-out)"
    )]
    Version {
        /// Version of the file.
        found: u32,
    },
    /// The file is shorter or longer than it says.
    #[error("stock file of {found} bytes, but what it begins with asks for {expected}: it is cut off or damaged")]
    Length {
        /// Bytes there are.
        found: usize,
        /// Bytes there should be; `u64::MAX` when that is not known.
        expected: u64,
    },
    /// The checksum is another.
    #[error("stock file is damaged: its checksum is not that of its content")]
    Checksum,
    /// The frame's rotation is none.
    #[error("stock file: the rotation of the frame is not a unit quaternion")]
    Rotation,
    /// The lattice is none.
    #[error("stock file: {0}")]
    Grid(#[from] GridError),
    /// The counts of the lines do not make the number of intervals.
    #[error("stock file: the lines have {found} intervals, the head of the file says {expected}")]
    Count {
        /// Sum over the lines.
        found: u64,
        /// Size by the head.
        expected: u64,
    },
    /// A line is not sound.
    #[error("stock file: {0}")]
    Broken(#[from] Broken),
}

impl DexelMap {
    /// The map as bytes: the same bytes for the same map on every machine.
    ///
    /// Little-endian: magic, version, number of lines along x and y (u32), cell, origin (2),
    /// translation (3) and rotation (i, j, k, w) of `work_from_map` (f64), number of intervals
    /// (u64), number of bytes of the [origin](Self::origin) (u64); the origin; the number of
    /// intervals of each line, row by row (u32); bottom and top of each (f64); the BLAKE3 checksum
    /// of all that.
    pub fn to_bytes(&self) -> Vec<u8> {
        let grid = &self.grid;
        let [nx, ny] = grid.n_lines();
        let lines = || (0..ny).flat_map(|j| (0..nx).map(move |i| (i, j)));
        let mut n_intervals = 0_u64;
        let mut counts = Vec::with_capacity(4 * nx * ny);
        let mut heights = Vec::new();
        for (i, j) in lines() {
            let mut of_line = 0_u32;
            for Interval { bottom, top } in self.intervals(i, j) {
                heights.extend(bottom.to_le_bytes().into_iter().chain(top.to_le_bytes()));
                of_line += 1;
            }
            counts.extend(of_line.to_le_bytes());
            n_intervals += u64::from(of_line);
        }
        let mut bytes = Vec::with_capacity(HEADER + self.origin.len() + counts.len() + heights.len() + CHECKSUM);
        bytes.extend(MAGIC);
        bytes.extend(VERSION.to_le_bytes());
        // At most 2²⁶ lines.
        [nx, ny].iter().for_each(|&n| bytes.extend((n as u32).to_le_bytes()));
        let frame = grid.work_from_map();
        let numbers = [grid.cell(), grid.origin()[0], grid.origin()[1]];
        let numbers = numbers.iter().chain(frame.translation.vector.iter()).chain(frame.rotation.coords.iter());
        numbers.for_each(|number| bytes.extend(number.to_le_bytes()));
        bytes.extend(n_intervals.to_le_bytes());
        bytes.extend((self.origin.len() as u64).to_le_bytes());
        bytes.extend(&self.origin);
        bytes.extend(counts);
        bytes.extend(heights);
        let checksum = blake3::hash(&bytes);
        bytes.extend(checksum.as_bytes());
        bytes
    }

    /// The map that [`DexelMap::to_bytes`] made these bytes of.
    ///
    /// # Errors
    /// When anything is not as it should be; there is no map then.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, StockFileError> {
        let mut reader = Reader(bytes);
        if reader.take::<8>().as_ref() != Some(MAGIC) {
            return Err(StockFileError::NotStock);
        }
        let found = bytes.len();
        let cut_off = || StockFileError::Length { found, expected: (HEADER + CHECKSUM) as u64 };
        let version = reader.u32().ok_or_else(cut_off)?;
        if version != VERSION {
            return Err(StockFileError::Version { found: version });
        }
        if found < HEADER + CHECKSUM {
            return Err(cut_off());
        }
        let mut word = || reader.u32().ok_or_else(cut_off);
        let n_lines = [word()? as usize, word()? as usize];
        let mut numbers = [0.0; 10];
        for number in &mut numbers {
            *number = reader.f64().ok_or_else(cut_off)?;
        }
        let n_intervals = reader.u64().ok_or_else(cut_off)?;
        let n_origin = reader.u64().ok_or_else(cut_off)?;
        check_length(found, n_lines, n_intervals, n_origin)?;
        let (content, checksum) = bytes.split_at(found - CHECKSUM);
        if blake3::hash(content).as_bytes() != checksum {
            return Err(StockFileError::Checksum);
        }
        let grid = grid(n_lines, &numbers)?;
        // The length has been checked.
        let origin = reader.bytes(n_origin as usize).ok_or_else(cut_off)?;
        Ok(read_lines(grid, reader, n_intervals)?.with_origin(origin))
    }
}

fn check_length(found: usize, [nx, ny]: [usize; 2], n_intervals: u64, n_origin: u64) -> Result<(), StockFileError> {
    let lines = (nx as u64).checked_mul(ny as u64).and_then(|n| n.checked_mul(4));
    let expected = lines
        .and_then(|lines| {
            n_intervals
                .checked_mul(16)?
                .checked_add(lines)?
                .checked_add(n_origin)?
                .checked_add((HEADER + CHECKSUM) as u64)
        })
        .unwrap_or(u64::MAX);
    if found as u64 == expected { Ok(()) } else { Err(StockFileError::Length { found, expected }) }
}

fn grid(n_lines: [usize; 2], numbers: &[f64; 10]) -> Result<DexelGrid, StockFileError> {
    let [cell, x, y, tx, ty, tz, i, j, k, w] = *numbers;
    let rotation = Quaternion::new(w, i, j, k);
    let off = (rotation.norm() - 1.0).abs();
    if off.is_nan() || off > 1e-9 {
        return Err(StockFileError::Rotation);
    }
    let rotation = UnitQuaternion::new_unchecked(rotation);
    let frame = Isometry3::from_parts(Translation3::new(tx, ty, tz), rotation);
    Ok(DexelGrid::from_parts(frame, [x, y], cell, n_lines)?)
}

fn read_lines(grid: DexelGrid, mut reader: Reader, n_intervals: u64) -> Result<DexelMap, StockFileError> {
    let [nx, ny] = grid.n_lines();
    // Lengths have been checked: a number that is not there cannot be.
    let counts: Vec<u32> = (0..nx * ny).map_while(|_| reader.u32()).collect();
    let found = counts.iter().map(|&n| u64::from(n)).sum();
    if found != n_intervals {
        return Err(StockFileError::Count { found, expected: n_intervals });
    }
    let mut starts = Vec::with_capacity(counts.len() + 1);
    starts.push(0);
    for &n in &counts {
        starts.push(starts[starts.len() - 1] + n as usize);
    }
    let next = || Some(Interval { bottom: reader.f64()?, top: reader.f64()? });
    let intervals: Vec<Interval> = std::iter::from_fn(next).take(n_intervals as usize).collect();
    let of_line = |i: usize, j: usize| &intervals[starts[j * nx + i]..starts[j * nx + i + 1]];
    for (i, j) in (0..ny).flat_map(|j| (0..nx).map(move |i| (i, j))) {
        let mut last = f64::NEG_INFINITY;
        for &Interval { bottom, top } in of_line(i, j) {
            if !(bottom.is_finite() && top.is_finite() && last < bottom && bottom < top) {
                let what = format!("interval [{bottom}, {top}] after {last} is empty or out of order");
                return Err(Broken { i, j, what }.into());
            }
            last = top;
        }
    }
    let mut map = DexelMap::empty(grid);
    map.fill(|i, j| of_line(i, j).to_vec());
    Ok(map)
}

struct Reader<'a>(&'a [u8]);

impl Reader<'_> {
    fn take<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (first, rest) = self.0.split_first_chunk::<N>()?;
        self.0 = rest;
        Some(*first)
    }

    fn bytes(&mut self, n: usize) -> Option<Vec<u8>> {
        let (first, rest) = self.0.split_at_checked(n)?;
        self.0 = rest;
        Some(first.to_vec())
    }

    fn u32(&mut self) -> Option<u32> {
        self.take().map(u32::from_le_bytes)
    }

    fn u64(&mut self) -> Option<u64> {
        self.take().map(u64::from_le_bytes)
    }

    fn f64(&mut self) -> Option<f64> {
        self.take().map(f64::from_le_bytes)
    }
}
