use nalgebra::Point3;

use super::RawMesh;
use crate::import::settings::ImportFault;

/// Reads an ASCII STL: keywords in any case, solids with or without a name, several solids in a
/// file.
pub(super) fn read(bytes: &[u8]) -> Result<RawMesh, ImportFault> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let mut words = Words { rest: bytes, line: 1 };
    let mut mesh = RawMesh::default();
    while let Some(word) = words.next() {
        words.demand(word, "solid")?;
        let name = words.rest_of_line();
        mesh.begin_group(String::from_utf8_lossy(name).trim());
        solid(&mut words, &mut mesh)?;
    }
    Ok(mesh)
}

/// Reads facets up to and including `endsolid`, whose name is not compared.
fn solid(words: &mut Words<'_>, mesh: &mut RawMesh) -> Result<(), ImportFault> {
    loop {
        let word = words.some("facet")?;
        if word.eq_ignore_ascii_case(b"endsolid") {
            words.rest_of_line();
            return Ok(());
        }
        if !word.eq_ignore_ascii_case(b"facet") {
            return Err(words.unexpected(word, "\"facet\" or \"endsolid\""));
        }
        words.keyword("normal")?;
        // The normal follows from the corners; writers put anything here, such as NaN for triangles
        // without area.
        for _ in 0..3 {
            words.some("a number")?;
        }
        words.keyword("outer")?;
        words.keyword("loop")?;
        let mut corners = [Point3::origin(); 3];
        for corner in &mut corners {
            words.keyword("vertex")?;
            for k in 0..3 {
                corner[k] = words.coordinate()?;
            }
        }
        words.keyword("endloop")?;
        words.keyword("endfacet")?;
        mesh.push_corners(corners)?;
    }
}

/// Words between blanks, with the line of the last one.
struct Words<'a> {
    rest: &'a [u8],
    line: usize,
}

impl<'a> Words<'a> {
    fn next(&mut self) -> Option<&'a [u8]> {
        let start = self.rest.iter().position(|b| !b.is_ascii_whitespace())?;
        self.line += self.rest[..start].iter().filter(|&&b| b == b'\n').count();
        let word = &self.rest[start..];
        let end = word.iter().position(u8::is_ascii_whitespace).unwrap_or(word.len());
        self.rest = &word[end..];
        Some(&word[..end])
    }

    fn rest_of_line(&mut self) -> &'a [u8] {
        let end = self.rest.iter().position(|&b| b == b'\n').unwrap_or(self.rest.len());
        let (line, rest) = self.rest.split_at(end);
        self.rest = rest;
        line
    }

    fn some(&mut self, expected: &str) -> Result<&'a [u8], ImportFault> {
        self.next().ok_or_else(|| ImportFault::Line {
            line: self.line,
            message: format!("the file ends here, where {expected} is expected: it is truncated"),
        })
    }

    fn keyword(&mut self, expected: &str) -> Result<(), ImportFault> {
        let word = self.some(&format!("\"{expected}\""))?;
        self.demand(word, expected)
    }

    fn demand(&self, word: &[u8], expected: &str) -> Result<(), ImportFault> {
        if word.eq_ignore_ascii_case(expected.as_bytes()) {
            return Ok(());
        }
        Err(self.unexpected(word, &format!("\"{expected}\"")))
    }

    fn coordinate(&mut self) -> Result<f64, ImportFault> {
        let word = self.some("a coordinate")?;
        let number: Option<f64> = std::str::from_utf8(word).ok().and_then(|w| w.parse().ok());
        match number {
            Some(x) if x.is_finite() => Ok(x),
            Some(_) => Err(ImportFault::NotFinite { place: format!("the vertex in line {}", self.line) }),
            None => Err(self.unexpected(word, "a number")),
        }
    }

    fn unexpected(&self, word: &[u8], expected: &str) -> ImportFault {
        // A binary file taken for text would fill the screen.
        let shown: String = String::from_utf8_lossy(word).chars().take(40).collect();
        ImportFault::Line {
            line: self.line,
            message: format!("{expected} expected, \"{}\" found", shown.escape_debug()),
        }
    }
}
