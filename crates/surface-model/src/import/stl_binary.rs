use nalgebra::Point3;

use super::RawMesh;
use crate::import::settings::ImportFault;

const HEADER: usize = 80;

const TRIANGLES: usize = HEADER + 4;

const TRIANGLE: usize = 50;

/// Returns whether an STL file is binary.
///
/// Binary headers may begin with `solid` like a text, so the file is binary where the count matches
/// the length. Else a file that begins with `solid` is text, unless there is a zero byte near its
/// start, which no text has.
pub(super) fn is_binary(bytes: &[u8]) -> bool {
    if count(bytes).is_some_and(|n| n.checked_mul(TRIANGLE).and_then(|l| l.checked_add(TRIANGLES)) == Some(bytes.len()))
    {
        return true;
    }
    let start = &bytes[..bytes.len().min(1024)];
    let text = start.strip_prefix(b"\xef\xbb\xbf").unwrap_or(start).trim_ascii_start();
    !text.get(..5).is_some_and(|w| w.eq_ignore_ascii_case(b"solid")) || start.contains(&0)
}

/// Reads a binary STL. Trailing bytes too few for a triangle are ignored: some writers pad.
pub(super) fn read(bytes: &[u8]) -> Result<RawMesh, ImportFault> {
    let fault = |offset: usize, message: String| ImportFault::Byte { offset, message };
    let Some(n) = count(bytes) else {
        let message = format!("the file ends within the header of a binary STL, which takes {TRIANGLES} bytes");
        return Err(fault(bytes.len(), message));
    };
    let data = &bytes[TRIANGLES..];
    let n_there = data.len() / TRIANGLE;
    if n_there != n {
        let message = format!("the header announces {n} triangles, but the file holds {n_there} after it");
        return Err(fault(if n_there < n { bytes.len() } else { HEADER }, message));
    }
    let mut mesh = RawMesh::default();
    for (t, record) in data.chunks_exact(TRIANGLE).enumerate() {
        // The normal in the first 12 bytes follows from the corners, and is wrong in many files.
        let corners = [12, 24, 36].map(|at| Point3::from([0, 4, 8].map(|k| f64::from(float(record, at + k)))));
        if !corners.iter().flat_map(|p| p.iter()).all(|x| x.is_finite()) {
            let place = format!("triangle {t} (byte {})", TRIANGLES + t * TRIANGLE);
            return Err(ImportFault::NotFinite { place });
        }
        mesh.push_corners(corners)?;
    }
    Ok(mesh)
}

fn count(bytes: &[u8]) -> Option<usize> {
    let n = bytes.get(HEADER..TRIANGLES)?.try_into().ok()?;
    usize::try_from(u32::from_le_bytes(n)).ok()
}

fn float(record: &[u8], at: usize) -> f32 {
    f32::from_le_bytes([record[at], record[at + 1], record[at + 2], record[at + 3]])
}
