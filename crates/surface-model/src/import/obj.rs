use std::fmt::Write as _;

use nalgebra::Point3;

use super::RawMesh;
use crate::import::settings::ImportFault;

/// Reads an OBJ file by `tobj`.
///
/// tobj reports faults without their place, accepts NaN, refuses comments behind a face, and its
/// index arithmetic overflows on wild texture indices. So it gets a digest of the file: only
/// positions, faces by position index, and names, each of them checked here with its line.
pub(super) fn read(bytes: &[u8]) -> Result<RawMesh, ImportFault> {
    let digest = digest(bytes)?;
    let options = tobj::LoadOptions { triangulate: true, single_index: false, ..Default::default() };
    let (models, _) = tobj::load_obj_buf(&mut digest.as_bytes(), &options, |_| Ok(Default::default()))
        .map_err(|e| ImportFault::Line { line: 1, message: format!("the file cannot be read as OBJ: {e}") })?;
    let mut mesh = RawMesh::default();
    for model in models {
        // tobj gives each object vertices of its own, so the seams between them are open until they
        // are welded.
        let first = mesh.vertices.len() as u32;
        mesh.begin_group(model.name.strip_prefix(NAME_MARK).unwrap_or_default());
        for &[a, b, c] in model.mesh.indices.as_chunks::<3>().0 {
            mesh.push([first + a, first + b, first + c])?;
        }
        mesh.vertices.extend(model.mesh.positions.as_chunks::<3>().0.iter().map(|&p| Point3::from(p)));
    }
    Ok(mesh)
}

/// Prefix of each name of the digest, which distinguishes tobj's word for objects without a name
/// from names in the file.
const NAME_MARK: &str = "=";

fn digest(bytes: &[u8]) -> Result<String, ImportFault> {
    // All positions come first, because a face may use one that comes behind it in the file.
    let (mut positions, mut faces) = (String::new(), String::new());
    let n_vertices =
        logical_lines(bytes).filter(|(_, text)| text.split_whitespace().next() == Some("v")).count() as i64;
    let (mut n_before, mut n_corners) = (0, 0);
    for (line, text) in logical_lines(bytes) {
        let mut words = text.split_whitespace();
        match words.next() {
            Some("v") => {
                n_before += 1;
                position(&words.collect::<Vec<_>>(), line, &mut positions)?;
            }
            Some("f" | "fo") => {
                let face = face(words, n_before, n_vertices).map_err(|message| ImportFault::Line { line, message })?;
                n_corners += face.len();
                if n_corners > u32::MAX as usize {
                    return Err(ImportFault::TooLarge { limit: u32::MAX as usize / 3 });
                }
                faces.push('f');
                for v in face {
                    let _ = write!(faces, " {v}");
                }
                faces.push('\n');
            }
            Some("o" | "g") => {
                let name: Vec<&str> = words.collect();
                let _ = writeln!(faces, "g {NAME_MARK}{}", name.join(" "));
            }
            _ => {}
        }
    }
    Ok(positions + &faces)
}

/// Returns lines without comments, those that end in `\` joined with the next, with the number of
/// the first.
fn logical_lines(bytes: &[u8]) -> impl Iterator<Item = (usize, String)> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let mut lines = bytes.split(|&b| b == b'\n').enumerate();
    std::iter::from_fn(move || {
        let (first, line) = lines.next()?;
        let mut text = without_comment(line);
        while let Some(start) = text.strip_suffix('\\').map(str::len) {
            text.replace_range(start.., " ");
            match lines.next() {
                Some((_, line)) => text.push_str(&without_comment(line)),
                None => break,
            }
        }
        Some((first + 1, text))
    })
}

fn without_comment(line: &[u8]) -> String {
    let end = line.iter().position(|&b| b == b'#').unwrap_or(line.len());
    String::from_utf8_lossy(&line[..end]).trim_end().to_owned()
}

/// Copies x, y, z, and w where there is one; colours behind them are left out.
fn position(words: &[&str], line: usize, digest: &mut String) -> Result<(), ImportFault> {
    let fault = |message: String| ImportFault::Line { line, message };
    if words.len() < 3 {
        return Err(fault(format!("a vertex needs three coordinates, there are {}", words.len())));
    }
    let n_numbers = if words.len() == 4 { 4 } else { 3 };
    let mut numbers = [0.0, 0.0, 0.0, 1.0];
    for (number, word) in numbers.iter_mut().zip(&words[..n_numbers]) {
        *number = word.parse::<f64>().map_err(|_| fault(format!("\"{word}\" is not a number")))?;
    }
    let w = numbers[3];
    if !numbers[..3].iter().all(|x| (x / w).is_finite()) {
        return Err(ImportFault::NotFinite { place: format!("the vertex in line {line}") });
    }
    let _ = writeln!(digest, "v {}", words[..n_numbers].join(" "));
    Ok(())
}

/// Returns position indices of a face, from 1; negative ones count back from the vertices before
/// it.
fn face<'a>(words: impl Iterator<Item = &'a str>, n_before: i64, n_vertices: i64) -> Result<Vec<i64>, String> {
    let corners: Vec<i64> = words
        .map(|word| {
            let first = word.split('/').next().unwrap_or_default();
            let index: i64 = first.parse().map_err(|_| format!("\"{word}\" is not a face corner"))?;
            let from_one = if index < 0 { n_before.saturating_add(index).saturating_add(1) } else { index };
            if (1..=n_vertices).contains(&from_one) {
                Ok(from_one)
            } else {
                Err(format!("the face uses vertex {index}, but there are {n_vertices}, {n_before} of them before it"))
            }
        })
        .collect::<Result<_, String>>()?;
    if corners.len() < 3 {
        return Err(format!("a face needs three corners, there are {}", corners.len()));
    }
    Ok(corners)
}
