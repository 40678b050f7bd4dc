//! Hub, shroud and profile curves.

use nalgebra::Point3;

use crate::fault::{BladeFault, BladeFileError};
use crate::headers::{BladeHeaders, SectionHeader};
use crate::info::{MOST_PER_SET, shown, text_of};

/// Most points of all curves of a blade together.
pub const MAX_POINTS: usize = 200_000;

/// Most points of a section: the search for crossings compares each with each at worst.
pub const MAX_SECTION_POINTS: usize = 10_000;

/// Least points of a section: fewer describe no two sides with two edges.
pub const MIN_SECTION_POINTS: usize = 8;

/// Farthest coordinate, mm.
const FARTHEST: f64 = 1e5;

/// One section of a blade.
#[derive(Clone, Debug, PartialEq)]
pub struct ProfileSection {
    /// Text of its comment, or its number.
    pub name: String,
    /// Points in their order around the section, mm, without the repeated first one.
    pub points: Vec<Point3<f64>>,
    /// Line of each point.
    pub lines: Vec<usize>,
    /// Whether the first point is repeated at the end; otherwise a straight line closes the
    /// section.
    pub is_closed: bool,
    /// Points of the marks `le` or `le1` and `le2`; equal for one mark.
    pub leading: Option<[usize; 2]>,
    /// Points of the marks `te` or `te1` and `te2`; equal for one mark.
    pub trailing: Option<[usize; 2]>,
}

/// Reads a file, in mm; counts its points.
pub(crate) struct CurveReader<'r> {
    pub(crate) file: &'r str,
    pub(crate) mm_per_unit: f64,
    /// Points of the blade read so far.
    pub(crate) n_points: &'r mut usize,
}

/// Mark of a point: an edge, and which of its corners.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct EdgeMark {
    is_leading: bool,
    corner: Option<usize>,
}

const MARKS: [(&str, EdgeMark); 6] = [
    ("le", EdgeMark { is_leading: true, corner: None }),
    ("le1", EdgeMark { is_leading: true, corner: Some(0) }),
    ("le2", EdgeMark { is_leading: true, corner: Some(1) }),
    ("te", EdgeMark { is_leading: false, corner: None }),
    ("te1", EdgeMark { is_leading: false, corner: Some(0) }),
    ("te2", EdgeMark { is_leading: false, corner: Some(1) }),
];

/// Point of a line, and its mark.
type MarkedPoint = (Point3<f64>, Option<EdgeMark>);

/// Points of a section as they are read.
struct RawSection {
    name: String,
    line: usize,
    points: Vec<Point3<f64>>,
    lines: Vec<usize>,
    marks: Vec<(usize, EdgeMark)>,
}

impl CurveReader<'_> {
    /// Reads a polyline; repeated points are left out.
    pub(crate) fn polyline(&mut self, bytes: &[u8]) -> Result<Vec<Point3<f64>>, BladeFileError> {
        let mut points: Vec<Point3<f64>> = Vec::new();
        for (k, line) in text_of(self.file, bytes)?.lines().enumerate() {
            if let Some((point, _)) = self.point(line, k + 1)?
                && points.last() != Some(&point)
            {
                points.push(point);
            }
        }
        if points.len() < 2 {
            let fault = BladeFault::TooFew { what: "the curve".to_owned(), given: points.len(), least: 2 };
            return Err(BladeFileError::of_file(self.file, fault));
        }
        Ok(points)
    }

    /// Reads the sections of each blade of a profile file.
    pub(crate) fn blades(&mut self, bytes: &[u8]) -> Result<Vec<Vec<ProfileSection>>, BladeFileError> {
        let mut blades: Vec<Vec<ProfileSection>> = vec![Vec::new()];
        let mut open: Option<RawSection> = None;
        let mut headers = BladeHeaders::default();
        for (k, text) in text_of(self.file, bytes)?.lines().enumerate() {
            let line = k + 1;
            if let Some(comment) = text.trim_start().strip_prefix('#') {
                // A comment right below another one is part of the same header.
                let is_below = open.as_ref().is_some_and(|open| open.points.is_empty() && open.line + 1 == line);
                if !is_below {
                    self.close(&mut open, &mut blades)?;
                }
                let header = headers.read(comment);
                if header != SectionHeader::SameBlade && blades.last().is_some_and(|blade| !blade.is_empty()) {
                    if blades.len() == MOST_PER_SET as usize {
                        return Err(BladeFileError::at(self.file, line, BladeFault::TooManyBlades(MOST_PER_SET)));
                    }
                    blades.push(Vec::new());
                }
                if header != SectionHeader::Title && !is_below {
                    open = Some(RawSection::named(shown(comment.trim_start_matches('#').trim()), line));
                }
            } else if let Some((point, mark)) = self.point(text, line)? {
                let n_sections = blades.last().map_or(0, Vec::len);
                let section =
                    open.get_or_insert_with(|| RawSection::named(format!("section {}", n_sections + 1), line));
                if section.points.last() == Some(&point) {
                    return Err(BladeFileError::at(self.file, line, BladeFault::DuplicatePoint));
                }
                if section.points.len() > MAX_SECTION_POINTS {
                    let fault = BladeFault::TooManyPoints { most: MAX_SECTION_POINTS, per: "in one section" };
                    return Err(BladeFileError::at(self.file, line, fault));
                }
                section.marks.extend(mark.map(|mark| (section.points.len(), mark)));
                section.points.push(point);
                section.lines.push(line);
            }
        }
        self.close(&mut open, &mut blades)?;
        Ok(blades)
    }

    /// Adds an open section to the last blade.
    fn close(&self, open: &mut Option<RawSection>, blades: &mut [Vec<ProfileSection>]) -> Result<(), BladeFileError> {
        if let (Some(section), Some(blade)) = (open.take(), blades.last_mut()) {
            blade.push(self.section(section)?);
        }
        Ok(())
    }

    /// Point and mark of a line, if it has any.
    fn point(&mut self, text: &str, line: usize) -> Result<Option<MarkedPoint>, BladeFileError> {
        let text = text.split(['!', '#']).next().unwrap_or_default();
        let words: Vec<&str> =
            text.split(|c: char| c.is_whitespace() || c == ',').filter(|w| !w.is_empty()).take(5).collect();
        let no_point = || BladeFileError::at(self.file, line, BladeFault::NoPoint(shown(text.trim())));
        let (numbers, mark) = match words[..] {
            [] => return Ok(None),
            [x, y, z] => ([x, y, z], None),
            [x, y, z, mark] => {
                let known = MARKS.iter().find(|(name, _)| name.eq_ignore_ascii_case(mark));
                ([x, y, z], Some(known.ok_or_else(no_point)?.1))
            }
            _ => return Err(no_point()),
        };
        let mut point = Point3::origin();
        for (axis, word) in numbers.into_iter().enumerate() {
            // Fortran writes D for the exponent of a double.
            let number: f64 = word.replace(['D', 'd'], "e").parse().map_err(|_| no_point())?;
            let value = self.mm_per_unit * number;
            if !value.is_finite() || value.abs() > FARTHEST {
                return Err(BladeFileError::at(self.file, line, BladeFault::WrongCoordinate(shown(word))));
            }
            point[axis] = value;
        }
        *self.n_points += 1;
        if *self.n_points > MAX_POINTS {
            let fault = BladeFault::TooManyPoints { most: MAX_POINTS, per: "in all curves" };
            return Err(BladeFileError::at(self.file, line, fault));
        }
        Ok(Some((point, mark)))
    }

    fn section(&self, raw: RawSection) -> Result<ProfileSection, BladeFileError> {
        let RawSection { name, line, mut points, mut lines, mut marks } = raw;
        let is_closed = points.len() > 1 && points.first() == points.last();
        if is_closed {
            points.pop();
            lines.pop();
            // A mark at the repeated point is one at the first.
            let last = points.len();
            marks.iter_mut().filter(|(at, _)| *at == last).for_each(|(at, _)| *at = 0);
            marks.sort_by_key(|(at, mark)| (*at, !mark.is_leading, mark.corner));
            marks.dedup();
        }
        if points.len() < MIN_SECTION_POINTS {
            let what = format!("\"{name}\" without repeated points");
            let fault = BladeFault::TooFew { what, given: points.len(), least: MIN_SECTION_POINTS };
            return Err(BladeFileError::at(self.file, line, fault));
        }
        let edge = |is_leading| edge_of(&marks, is_leading);
        let wrong = |what| BladeFileError::at(self.file, line, BladeFault::WrongMarks { name: name.clone(), what });
        let (leading, trailing) = (edge(true).map_err(wrong)?, edge(false).map_err(wrong)?);
        Ok(ProfileSection { name, points, lines, is_closed, leading, trailing })
    }
}

impl RawSection {
    fn named(name: String, line: usize) -> Self {
        Self { name, line, points: Vec::new(), lines: Vec::new(), marks: Vec::new() }
    }
}

/// Points of an edge's marks.
fn edge_of(marks: &[(usize, EdgeMark)], is_leading: bool) -> Result<Option<[usize; 2]>, &'static str> {
    let of_edge: Vec<_> = marks.iter().filter(|(_, mark)| mark.is_leading == is_leading).collect();
    match of_edge[..] {
        [] => Ok(None),
        [(at, _)] => Ok(Some([*at; 2])),
        [(first, a), (second, b)] if a.corner.is_some() && b.corner.is_some() && a.corner != b.corner => {
            Ok(Some(if a.corner < b.corner { [*first, *second] } else { [*second, *first] }))
        }
        _ => Err("an edge has one mark (le, te) or one at each corner (le1 and le2, te1 and te2); correct the marks"),
    }
}
