//! Motion of one tool at feed, between rapids.

use std::collections::BTreeMap;

use facemill_cl_data::ClPoint;
use facemill_cl_file::{
    AptFile, AptMeaning, AptPoint, AptPointKind, AptStatement, ClSystems, ClUnit, CutterInForce, CutterWord,
    FileCutter, arc_chords, check_units, check_word, csys_frame, csys_note, major_word, unit_note,
};
use facemill_tool_model::Cutter;
use nalgebra::Isometry3;

use crate::fault::ClPathFault;

/// Settings for the cuts of a file.
#[derive(Clone, Copy, Debug)]
pub struct CutSettings<'c> {
    /// The cutter, to be compared with that of the file.
    pub cutter: &'c Cutter,
    /// Number of LOADTL; `None` for the only tool that cuts.
    pub tool: Option<u32>,
    /// Largest distance of an arc from its chords, mm. Larger: fewer points.
    pub chord: f64,
    /// Largest number of points, with those of arcs.
    pub max_points: usize,
}

/// The cuts of one tool.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ToolCuts {
    /// Number of LOADTL; `None` in a file without.
    pub tool: Option<u32>,
    /// Cuts in order: each begins where the tool is before it moves at feed.
    pub cuts: Vec<Vec<FilePoint>>,
    /// Remarks on the file, with lines.
    pub notes: Vec<String>,
}

/// A point of a cut.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FilePoint {
    /// Line of its statement, from 1.
    pub line: u32,
    /// Tip and axis, frame of the part.
    pub cl: ClPoint,
}

/// Largest coordinate of a tip, mm: as for all lengths of jobs.
const FARTHEST: f64 = 1e6;

/// Largest number of words that are listed in a remark.
const LISTED_WORDS: usize = 8;

/// Returns the cuts of one tool: motion at feed between rapids, with the point from which it
/// begins. Points are in the frame of the part; arcs are chords.
///
/// # Errors
/// With the line: no or several tools that cut, another cutter, an arc or frame that is none, a
/// word that moves tool, part or frame in a way that is not followed, too many points.
pub fn read_cuts(file: &AptFile, settings: &CutSettings<'_>) -> Result<ToolCuts, ClPathFault> {
    check_units(file)?;
    let tool = chosen_tool(file, settings.tool)?;
    let mut reader = CutReader::new(file, settings, tool);
    for (index, statement) in file.statements.iter().enumerate() {
        reader.statement(index, statement)?;
    }
    reader.finish()
}

/// Returns the tool whose cuts are read: the required one, or the only one that cuts.
fn chosen_tool(file: &AptFile, required: Option<u32>) -> Result<Option<u32>, ClPathFault> {
    let mut cutting: BTreeMap<Option<u32>, u32> = BTreeMap::new();
    let mut tool = None;
    for statement in &file.statements {
        match statement.meaning {
            AptMeaning::Tool { number, .. } => tool = Some(number),
            AptMeaning::Point(k) if is_cut(&file.points[k]) => {
                cutting.entry(tool).or_insert(statement.line);
            }
            _ => {}
        }
    }
    let name = |tool: &Option<u32>| tool.map_or("none".to_owned(), |number| number.to_string());
    let all = cutting.iter().map(|(tool, line)| format!("{} (line {line})", name(tool)));
    let all = all.collect::<Vec<_>>().join(", ");
    match required {
        _ if cutting.is_empty() => Err(ClPathFault::Whole(
            "no statement moves the tool at feed (GOTO behind FEDRAT, without RAPID)".to_owned(),
        )),
        Some(number) if cutting.contains_key(&Some(number)) => Ok(required),
        Some(number) => {
            let why = format!("no cut is made with tool {number} (LOADTL); the tools that cut are {all}");
            Err(ClPathFault::Whole(why))
        }
        None if cutting.len() == 1 => Ok(cutting.into_keys().next().flatten()),
        None => Err(ClPathFault::Whole(format!("several tools cut: {all}; name one of them (`tool`)"))),
    }
}

fn is_cut(point: &AptPoint) -> bool {
    matches!(point.kind, AptPointKind::Linear | AptPointKind::Arc)
}

struct CutReader<'a> {
    file: &'a AptFile,
    settings: &'a CutSettings<'a>,
    /// The tool whose cuts are read.
    wanted: Option<u32>,
    /// The tool in the spindle.
    tool: Option<u32>,
    frame: Isometry3<f64>,
    systems: ClSystems,
    /// mm per unit.
    unit: f64,
    has_lengths: bool,
    cutter: CutterInForce,
    /// Line of the cutter that was compared.
    compared: Option<u32>,
    /// Where the tool is.
    at: Option<FilePoint>,
    open: Vec<FilePoint>,
    n_points: usize,
    is_ended: bool,
    unknown: BTreeMap<String, u32>,
    out: ToolCuts,
}

impl<'a> CutReader<'a> {
    fn new(file: &'a AptFile, settings: &'a CutSettings<'a>, wanted: Option<u32>) -> Self {
        Self {
            file,
            settings,
            wanted,
            tool: None,
            frame: Isometry3::identity(),
            systems: ClSystems::default(),
            unit: file.given_unit.map_or(1.0, ClUnit::mm),
            has_lengths: false,
            cutter: CutterInForce::default(),
            compared: None,
            at: None,
            open: Vec::new(),
            n_points: 0,
            is_ended: false,
            unknown: BTreeMap::new(),
            out: ToolCuts { tool: wanted, ..ToolCuts::default() },
        }
    }

    fn statement(&mut self, index: usize, statement: &AptStatement) -> Result<(), ClPathFault> {
        let line = statement.line;
        match &statement.meaning {
            AptMeaning::Comment | AptMeaning::Auxiliary if statement.text.starts_with("$$") => {
                if let Some(note) = self.systems.comment(statement)? {
                    self.note(line, note);
                }
            }
            AptMeaning::Cutter(cutter) => self.cutter.describe(line, cutter),
            AptMeaning::Unit(unit) => {
                if *unit != self.unit && self.has_lengths {
                    let why = "UNITS changes the unit behind points, frames or feeds: put it before them";
                    return Err(ClPathFault::at(line, why));
                }
                self.unit = *unit;
            }
            AptMeaning::Feed(_) | AptMeaning::FeedPerRevolution(_) => self.has_lengths = true,
            AptMeaning::Tool { number, .. } if self.tool != Some(*number) => {
                self.close();
                self.at = None;
                self.tool = Some(*number);
                self.cutter.change_tool();
            }
            AptMeaning::Frame(Some(rows)) => {
                self.has_lengths = true;
                self.frame = csys_frame(rows, line)?;
                if let Some(note) = csys_note(rows) {
                    self.note(line, note);
                }
            }
            AptMeaning::Home => {
                self.close();
                self.at = None;
            }
            AptMeaning::RadiusCompensation(true) => {
                self.systems.check_offset(line)?;
                self.note(line, "CUTCOM: points are taken as given");
            }
            AptMeaning::Cycle(true) => self.note(line, "CYCLE: its places are no cuts, and are left out"),
            AptMeaning::Point(point) => self.point(index, &self.file.points[*point])?,
            AptMeaning::End => self.is_ended = true,
            AptMeaning::Unknown => {
                check_word(statement)?;
                let word = major_word(&statement.text);
                if word == "MSYS" {
                    self.systems.nx(statement)?;
                } else {
                    self.unknown.entry(word).or_insert(line);
                }
            }
            _ => {}
        }
        Ok(())
    }

    fn point(&mut self, index: usize, point: &AptPoint) -> Result<(), ClPathFault> {
        if self.is_ended {
            return Err(ClPathFault::at(point.line, "the tool moves behind FINI"));
        }
        self.has_lengths = true;
        let cl = point.cl.transformed(&self.frame);
        if cl.tip.coords.amax() > FARTHEST {
            return Err(ClPathFault::at(point.line, format!("a coordinate is beyond {FARTHEST} mm")));
        }
        let to = FilePoint { line: point.line, cl };
        if is_cut(point) || point.kind == AptPointKind::Cycle {
            self.cutter.cut();
        }
        if self.tool != self.wanted {
            return Ok(());
        }
        match point.kind {
            AptPointKind::Linear => self.cut_to(&[to])?,
            AptPointKind::Arc => {
                let arc = point.arc.and_then(|k| self.file.arcs.get(k as usize));
                let Some((arc, from)) = arc.zip(self.at) else {
                    let before = index.checked_sub(1).and_then(|k| self.file.statements.get(k));
                    let why = "the arc needs a point before it, and its centre and axis as six numbers";
                    return Err(ClPathFault::at(before.map_or(point.line, |s| s.line), why));
                };
                let chords = arc_chords(&from.cl, &cl, &arc.transformed(&self.frame), self.settings.chord);
                let chords = chords.map_err(|why| ClPathFault::at(point.line, why))?;
                let chords: Vec<FilePoint> = chords.into_iter().map(|cl| FilePoint { line: point.line, cl }).collect();
                self.cut_to(&chords)?;
            }
            _ => self.close(),
        }
        self.at = Some(to);
        Ok(())
    }

    /// Continues the open cut, or begins one where the tool is.
    fn cut_to(&mut self, points: &[FilePoint]) -> Result<(), ClPathFault> {
        self.compare_cutter()?;
        if self.open.is_empty() {
            self.open.extend(self.at);
        }
        self.n_points += points.len();
        if self.n_points > self.settings.max_points {
            let (line, most) = (points.first().map_or(1, |p| p.line), self.settings.max_points);
            let why = format!("the cuts have more than {most} points, with those of arcs: split the file here");
            return Err(ClPathFault::at(line, why));
        }
        self.open.extend_from_slice(points);
        Ok(())
    }

    fn compare_cutter(&mut self) -> Result<(), ClPathFault> {
        let Some((line, cutter)) = self.cutter.cut().filter(|(line, _)| self.compared != Some(*line)) else {
            return Ok(());
        };
        let own = [2.0 * self.settings.cutter.radius(), self.settings.cutter.corner_radius()];
        if let Some(why) = cutter.difference(own, "the operation's tool") {
            let why = format!(
                "{why}: the tip would not touch where the file's does; give the operation the file's tool, or post the \
                 path for this one, and see that UNITS is right"
            );
            return Err(ClPathFault::at(line, why));
        }
        let is_of_creo = matches!(cutter, FileCutter::Mill(mill) if mill.word == CutterWord::Creo);
        self.compared = Some(line);
        if is_of_creo {
            self.note(line, "CUTTER of Creo has no corner radius: that of the operation's tool is taken");
        }
        Ok(())
    }

    fn close(&mut self) {
        let cut = std::mem::take(&mut self.open);
        if cut.len() >= 2 {
            self.out.cuts.push(cut);
        }
    }

    /// Adds a remark of each kind once, with its first line.
    fn note(&mut self, line: u32, text: &str) {
        if !self.out.notes.iter().any(|note| note.ends_with(text)) {
            self.out.notes.push(format!("line {line}: {text}"));
        }
    }

    fn finish(mut self) -> Result<ToolCuts, ClPathFault> {
        self.close();
        if self.out.cuts.is_empty() {
            return Err(ClPathFault::Whole(
                "no cut has two points: the first move at feed needs a point before it (FROM, or GOTO behind RAPID)"
                    .to_owned(),
            ));
        }
        self.out.notes.extend(unit_note(self.file));
        self.out.notes.extend(self.file.remarks.iter().map(|(line, text)| format!("line {line}: {text}")));
        if !self.is_ended {
            self.out.notes.push("FINI is missing: the file may be cut off".to_owned());
        }
        if !self.unknown.is_empty() {
            let words = self.unknown.iter().take(LISTED_WORDS).map(|(word, line)| format!("{word} (line {line})"));
            let more = if self.unknown.len() > LISTED_WORDS { ", …" } else { "" };
            let words = words.collect::<Vec<_>>().join(", ");
            self.out.notes.push(format!("words that are not understood, and are left out: {words}{more}"));
        }
        Ok(self.out)
    }
}
