//! Statements of a file as steps of each tool, in the frame of the part.

use facemill_cl_data::{ClPoint, Monitor};
use facemill_cl_file::{
    AptCoolant, AptFile, AptMeaning, AptPoint, AptPointKind, AptStatement, ClSystems, ClUnit, CutterInForce,
    FileCutter, arc_chords, check_units, check_word, csys_frame, csys_note, free_text, major_word, unit_note,
};
use facemill_nc_program::{Coolant, SpindleSpec};
use nalgebra::Isometry3;

use crate::fault::PostFault;
use crate::report::{PostNote, PostedWord, Treatment};
use crate::scene::{ARC_SHARE, PostOptions};
use crate::statements::{Cycle, WordCounts, is_operation, is_text};

/// Content of a file, tool by tool.
#[derive(Debug, Default)]
pub(crate) struct FileSteps {
    /// PARTNO.
    pub(crate) name: Option<String>,
    /// Parts with one tool each, in order; every one moves.
    pub(crate) parts: Vec<ToolPart>,
    /// Every word with its treatment.
    pub(crate) words: Vec<PostedWord>,
    /// Parts of the file that the program lacks.
    pub(crate) faults: Vec<PostNote>,
    /// Remarks.
    pub(crate) notes: Vec<PostNote>,
}

/// Steps with one tool.
#[derive(Debug)]
pub(crate) struct ToolPart {
    /// Number of LOADTL; `None` in a file without.
    pub(crate) tool: Option<u32>,
    /// Line at which it begins.
    pub(crate) line: u32,
    /// Cutters of the file for its points, with their lines.
    pub(crate) cutters: Vec<(u32, FileCutter)>,
    /// Registers of the tool's length that the file calls, with their lines.
    pub(crate) registers: Vec<(u32, u32)>,
    /// Speed and sense before the first step.
    pub(crate) spindle: SpindleSpec,
    /// Coolant before the first step.
    pub(crate) coolant: Coolant,
    /// In order.
    pub(crate) steps: Vec<Step>,
    /// Points of the file.
    pub(crate) points: usize,
    /// Arcs of the file.
    pub(crate) arcs: usize,
}

/// One thing that happens.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Step {
    Comment(String),
    SpindleOn(SpindleSpec),
    SpindleOff,
    Coolant(Coolant),
    /// s.
    Dwell(f64),
    Stop,
    Move(PathMove),
}

/// A move of the tool.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PathMove {
    /// Line of its statement.
    pub(crate) line: u32,
    /// Its end, frame of the part.
    pub(crate) cl: ClPoint,
    /// Speed of the tip, mm/min; `None` of a rapid.
    pub(crate) feed: Option<f64>,
    /// Whether the file names its end.
    pub(crate) is_point: bool,
    /// Whether it is a chord of an arc.
    pub(crate) is_chord: bool,
}

/// Returns the steps of a file.
///
/// # Errors
/// With the line: a frame, arc or feed that is none, a cut with the spindle off, a word that moves
/// tool or part in a way that is not followed, more than [`MAX_MOVES`] moves or [`MAX_PARTS`]
/// tools. Cancellation.
pub(crate) fn steps(file: &AptFile, options: &PostOptions, monitor: &dyn Monitor) -> Result<FileSteps, PostFault> {
    check_units(file)?;
    let mut reader = StepReader::new(file, options);
    for (index, statement) in file.statements.iter().enumerate() {
        if index % STATEMENTS_BETWEEN == 0 {
            monitor.checkpoint()?;
        }
        reader.counts.count(statement);
        reader.statement(index, statement)?;
    }
    reader.finish()
}

struct StepReader<'a> {
    file: &'a AptFile,
    options: &'a PostOptions,
    counts: WordCounts,
    out: FileSteps,
    /// The part being read.
    part: OpenPart,
    /// mm per unit.
    unit: f64,
    frame: Isometry3<f64>,
    /// Pose of the tool, frame of the part.
    at: Option<ClPoint>,
    spindle: Option<SpindleSpec>,
    spindle_is_on: bool,
    /// Whether the file switched it off: no tool change does away with that.
    is_said_off: bool,
    coolant: Coolant,
    cycle: Option<Cycle>,
    cutter: CutterInForce,
    systems: ClSystems,
    /// Moves of all parts.
    n_moves: usize,
    /// Whether a length was read.
    has_lengths: bool,
    is_ended: bool,
}

/// A part whose speeds are not all known yet.
#[derive(Debug, Default)]
struct OpenPart {
    tool: Option<u32>,
    line: u32,
    spindle: Option<SpindleSpec>,
    coolant: Option<Coolant>,
    steps: Vec<Step>,
    points: usize,
    arcs: usize,
    has_moved: bool,
    /// Line and pose of FROM before every other point.
    starts: Vec<(u32, ClPoint)>,
    /// Whether the tool is called behind them.
    is_called_behind_start: bool,
    /// Line of GOHOME behind its moves.
    home: Option<u32>,
    cutters: Vec<(u32, FileCutter)>,
    registers: Vec<(u32, u32)>,
}

impl<'a> StepReader<'a> {
    fn new(file: &'a AptFile, options: &'a PostOptions) -> Self {
        Self {
            file,
            options,
            counts: WordCounts::default(),
            out: FileSteps::default(),
            part: OpenPart { line: 1, ..OpenPart::default() },
            unit: file.given_unit.map_or(1.0, ClUnit::mm),
            frame: Isometry3::identity(),
            at: None,
            spindle: None,
            spindle_is_on: false,
            is_said_off: false,
            coolant: Coolant::Off,
            cycle: None,
            cutter: CutterInForce::default(),
            systems: ClSystems::default(),
            n_moves: 0,
            has_lengths: false,
            is_ended: false,
        }
    }

    fn statement(&mut self, index: usize, statement: &AptStatement) -> Result<(), PostFault> {
        let line = statement.line;
        match &statement.meaning {
            AptMeaning::PartName(name) if !name.is_empty() => self.out.name = Some(name.clone()),
            AptMeaning::Comment | AptMeaning::Auxiliary => self.comment(statement)?,
            AptMeaning::Cutter(cutter) => self.cutter.describe(line, cutter),
            AptMeaning::Feed(_) | AptMeaning::FeedPerRevolution(_) => self.has_lengths = true,
            AptMeaning::Unit(unit) => self.unit(*unit, line)?,
            AptMeaning::Tool { number, length_register } => {
                self.tool(*number, line)?;
                if let Some(register) = length_register
                    && self.part.registers.iter().all(|(_, before)| before != register)
                    && self.part.registers.len() < MAX_REGISTERS
                {
                    self.part.registers.push((line, *register));
                }
            }
            AptMeaning::Spindle { rpm, clockwise } => {
                self.spindle_on(SpindleSpec { rpm: *rpm, clockwise: *clockwise });
            }
            AptMeaning::SpindleOn => match self.spindle {
                Some(spindle) => self.spindle_on(spindle),
                None => return Err(PostFault::at(line, "SPINDL/ON: no speed was given before")),
            },
            AptMeaning::SpindleOff => {
                (self.spindle_is_on, self.is_said_off) = (false, true);
                self.part.push_behind_a_move(Step::SpindleOff);
            }
            AptMeaning::Coolant(coolant) => self.coolant(*coolant, line),
            AptMeaning::Dwell(Some(seconds)) => {
                if !(0.0..=MAX_DWELL).contains(seconds) {
                    return Err(PostFault::at(line, format!("DELAY of {seconds} s: it must be from 0 to {MAX_DWELL}")));
                }
                self.part.steps.push(Step::Dwell(*seconds));
            }
            AptMeaning::Home => {
                self.part.home = self.part.has_moved.then_some(line);
                self.note(line, "GOHOME: the tool goes home as the program does at the end of each tool");
            }
            AptMeaning::Dwell(None) => self.note(line, "DELAY in revolutions, or without a time, is not written"),
            AptMeaning::Stop { optional: false } => self.stop(line),
            AptMeaning::Stop { optional: true } => self.note(line, "OPSTOP is not written"),
            AptMeaning::Frame(Some(rows)) => {
                self.has_lengths = true;
                self.frame = csys_frame(rows, line)?;
                if let Some(note) = csys_note(rows) {
                    self.note(line, note);
                }
            }
            AptMeaning::RadiusCompensation(true) => {
                self.systems.check_offset(line)?;
                let text =
                    "CUTCOM is not written: points are programmed as given, and the control does not offset the tool";
                if !self.out.faults.iter().any(|fault| fault.text == text) {
                    self.out.faults.push(PostNote::at(line, text));
                }
            }
            AptMeaning::Setup(true) => {
                self.note(line, "SETUP begins: no stop is written, and the part stays as it is mounted");
            }
            AptMeaning::Cycle(is_on) => self.cycle(*is_on, statement),
            AptMeaning::Point(point) => self.point(index, &self.file.points[*point])?,
            AptMeaning::End => self.is_ended = true,
            AptMeaning::Unknown => self.unknown(statement)?,
            _ => {}
        }
        Ok(())
    }

    /// A unit is for the whole file: what was read before it would have another one.
    fn unit(&mut self, unit: f64, line: u32) -> Result<(), PostFault> {
        if unit != self.unit && self.has_lengths {
            let why = "UNITS changes the unit behind points, frames or feeds: put it before them";
            return Err(PostFault::at(line, why));
        }
        self.unit = unit;
        Ok(())
    }

    fn comment(&mut self, statement: &AptStatement) -> Result<(), PostFault> {
        if statement.text.starts_with("$$") {
            let note = self.systems.comment(statement)?;
            self.out.notes.extend(note.map(|text| PostNote::at(statement.line, text)));
            return Ok(());
        }
        let word = major_word(&statement.text);
        let text = free_text(&statement.text);
        // NX begins an operation with TOOL PATH/NAME.
        if (is_text(&word) || is_operation(&word, text)) && !text.is_empty() {
            self.part.steps.push(Step::Comment(text.to_owned()));
        }
        Ok(())
    }

    fn tool(&mut self, number: u32, line: u32) -> Result<(), PostFault> {
        if self.part.tool == Some(number) {
            return Ok(());
        }
        self.part.is_called_behind_start = !self.part.starts.is_empty();
        if self.part.has_moved {
            let comments = self.part.comments_at_end();
            self.end_part()?;
            self.part = OpenPart { steps: comments, ..OpenPart::default() };
            // The tool comes from the changer.
            self.at = None;
            self.spindle_is_on = false;
        }
        self.cutter.change_tool();
        self.part.registers.clear();
        (self.part.tool, self.part.line) = (Some(number), line);
        Ok(())
    }

    fn spindle_on(&mut self, spindle: SpindleSpec) {
        let is_new = self.spindle != Some(spindle) || !self.spindle_is_on;
        let has_moved = self.part.has_moved;
        (self.spindle, self.spindle_is_on, self.is_said_off) = (Some(spindle), true, false);
        if self.part.spindle.is_none() {
            self.part.spindle = Some(spindle);
            // The header starts it, but a stop or SPINDL/OFF may lie between.
            if has_moved {
                self.part.steps.push(Step::SpindleOn(spindle));
            }
        } else if is_new {
            if has_moved {
                self.part.steps.push(Step::SpindleOn(spindle));
            } else {
                self.part.spindle = Some(spindle);
            }
        }
    }

    /// Writes a stop where the file has it. The header of a tool goes to its first point, so that a
    /// stop before it is at the end of the tool before. The program goes on with spindle and
    /// coolant as they were, which some controls switch off at a stop.
    fn stop(&mut self, line: u32) {
        if !self.part.has_moved {
            if let Some(before) = self.out.parts.last_mut() {
                if before.steps.last() != Some(&Step::Stop) {
                    before.steps.extend([Step::SpindleOff, Step::Coolant(Coolant::Off)]);
                }
                before.steps.push(Step::Stop);
                self.note(line, "STOP behind a tool change and before a point is written before the tool change");
                return;
            }
            self.note(line, "STOP before the first point: the tool comes to that point before it, by the template");
        }
        self.part.steps.push(Step::Stop);
        if !self.part.has_moved {
            return;
        }
        if let Some(spindle) = self.spindle.filter(|_| self.spindle_is_on) {
            self.part.steps.push(Step::SpindleOn(spindle));
        }
        if self.coolant != Coolant::Off {
            self.part.steps.push(Step::Coolant(self.coolant));
        }
    }

    fn coolant(&mut self, coolant: AptCoolant, line: u32) {
        let coolant = match coolant {
            AptCoolant::Off => Coolant::Off,
            AptCoolant::Mist => Coolant::Mist,
            AptCoolant::Flood => Coolant::Flood,
            _ => {
                self.note(line, "this kind of coolant is written as flood");
                Coolant::Flood
            }
        };
        if coolant != self.coolant {
            self.coolant = coolant;
            self.part.push_behind_a_move(Step::Coolant(coolant));
        }
    }

    fn cycle(&mut self, is_on: bool, statement: &AptStatement) {
        self.end_cycle();
        if is_on && !free_text(&statement.text).to_ascii_uppercase().starts_with("INIT") {
            self.cycle = Some(Cycle::new(statement, self.unit));
        }
    }

    fn end_cycle(&mut self) {
        let Some(cycle) = self.cycle.take().filter(|cycle| cycle.places > 0) else { return };
        let text = format!("{} is not written: {} places are passed {} mm above", cycle.text, cycle.places, cycle.lift);
        self.out.faults.push(PostNote::at(cycle.line, text));
    }

    fn unknown(&mut self, statement: &AptStatement) -> Result<(), PostFault> {
        check_word(statement)?;
        if major_word(&statement.text) == "MSYS" {
            self.systems.nx(statement)?;
        }
        Ok(())
    }

    fn point(&mut self, index: usize, point: &AptPoint) -> Result<(), PostFault> {
        if self.is_ended {
            return Err(PostFault::at(point.line, "the tool moves behind FINI"));
        }
        let cl = point.cl.transformed(&self.frame);
        if cl.tip.coords.amax() > FARTHEST {
            return Err(PostFault::at(point.line, format!("a coordinate is beyond {FARTHEST} mm")));
        }
        // Operations of NX with one tool each begin with the same cutter.
        if matches!(point.kind, AptPointKind::Linear | AptPointKind::Arc | AptPointKind::Cycle)
            && let Some((line, cutter)) = self.cutter.cut()
            && self.part.cutters.len() < MAX_CUTTERS
            && self.part.cutters.iter().all(|(_, before)| before != cutter)
        {
            self.part.cutters.push((line, cutter.clone()));
        }
        self.has_lengths = true;
        self.count_moves(1, point.line)?;
        if let Some(line) = self.part.home {
            let why = "GOHOME, and the tool moves again: the program goes home at the end of a tool alone; leave it out, \
                       or write the way as points behind RAPID";
            return Err(PostFault::at(line, why));
        }
        if point.kind == AptPointKind::Start && !self.part.has_moved && !self.part.is_called_behind_start {
            self.part.starts.push((point.line, cl));
            self.at = Some(cl);
            return Ok(());
        }
        self.part.points += 1;
        self.begin_part(point.kind);
        let to = |cl: ClPoint, feed: Option<f64>, is_point: bool| {
            Step::Move(PathMove { line: point.line, cl, feed, is_point, is_chord: false })
        };
        match point.kind {
            AptPointKind::Start => {
                if self.at.is_some() {
                    self.note(point.line, "FROM behind other moves is written as a move at rapid rate");
                }
                self.part.steps.push(to(cl, None, true));
            }
            AptPointKind::Rapid if self.cycle.is_none() => self.part.steps.push(to(cl, None, true)),
            // Some systems write RAPID before each place.
            AptPointKind::Cycle | AptPointKind::Rapid => {
                let Some(cycle) = &mut self.cycle else {
                    return Err(PostFault::at(point.line, "a place of a cycle that was not described"));
                };
                if cycle.lift > FARTHEST {
                    return Err(PostFault::at(cycle.line, format!("the cycle's height is beyond {FARTHEST} mm")));
                }
                if cycle.lift <= 0.0 {
                    let why = "the cycle says no height above its places (RAPTO, RTRCTO or CLEAR), and is not written: \
                               the tool cannot pass there";
                    return Err(PostFault::at(cycle.line, why));
                }
                if cycle.places == 0 {
                    self.part.steps.push(Step::Comment(format!("NOT WRITTEN: {}", cycle.text)));
                }
                cycle.places += 1;
                let lifted = cl.translated(cl.axis.into_inner() * cycle.lift);
                self.part.steps.push(to(lifted, None, false));
                self.at = Some(lifted);
                return Ok(());
            }
            AptPointKind::Linear | AptPointKind::Arc => {
                let feed = self.feed(point)?;
                if point.kind == AptPointKind::Arc {
                    self.arc(index, point, (cl, feed))?;
                } else {
                    self.part.steps.push(to(cl, Some(feed), true));
                }
            }
            _ => return Err(PostFault::at(point.line, "this kind of move is not known")),
        }
        self.at = Some(cl);
        Ok(())
    }

    /// Begins the moves of a part with those to the points of FROM before its first point of
    /// another kind; does nothing behind a move. They are left out where the tool is called behind
    /// them and then moves at rapid rate: it comes from home by the template.
    fn begin_part(&mut self, first: AptPointKind) {
        if self.part.has_moved {
            return;
        }
        self.part.coolant = Some(self.coolant);
        self.part.has_moved = true;
        // The header starts the spindle.
        if self.is_said_off {
            self.part.steps.push(Step::SpindleOff);
        }
        let starts = std::mem::take(&mut self.part.starts);
        let is_cut = matches!(first, AptPointKind::Linear | AptPointKind::Arc);
        if self.part.is_called_behind_start && !is_cut {
            if let Some((line, _)) = starts.first() {
                self.note(*line, "FROM before the tool is called is left out: the program begins at home");
            }
            return;
        }
        for (line, cl) in starts {
            self.part.points += 1;
            self.part.steps.push(Step::Move(PathMove { line, cl, feed: None, is_point: true, is_chord: false }));
        }
    }

    /// Feed of a cut; the spindle has to turn, as with the tool before if nothing else is said.
    fn feed(&mut self, point: &AptPoint) -> Result<f64, PostFault> {
        match (self.part.spindle, self.spindle) {
            _ if self.is_said_off => return Err(PostFault::at(point.line, SPINDLE_OFF)),
            (None, None) => {
                let why = "the tool cuts, and no SPINDL gives the speed of the spindle";
                return Err(PostFault::at(point.line, why));
            }
            (None, Some(before)) => {
                let text = "the tool cuts without a SPINDL of its own: the spindle turns as with the tool before";
                self.note(point.line, text);
                self.spindle_on(before);
            }
            (Some(_), _) if !self.spindle_is_on => return Err(PostFault::at(point.line, SPINDLE_OFF)),
            (Some(_), _) => {}
        }
        match point.feed {
            None => Err(PostFault::at(point.line, "the tool cuts, and no FEDRAT was given before")),
            Some(feed) if feed > 0.0 && feed.is_finite() => Ok(feed),
            Some(feed) => Err(PostFault::at(point.line, format!("its feed is {feed} mm/min; it must be above 0"))),
        }
    }

    fn arc(&mut self, index: usize, point: &AptPoint, (cl, feed): (ClPoint, f64)) -> Result<(), PostFault> {
        let arc = point.arc.and_then(|k| self.file.arcs.get(k as usize));
        let Some((arc, from)) = arc.zip(self.at) else {
            let before = index.checked_sub(1).and_then(|k| self.file.statements.get(k));
            let why = "the arc needs a point before it, and its centre and axis as six numbers";
            return Err(PostFault::at(before.map_or(point.line, |s| s.line), why));
        };
        let arc = arc.transformed(&self.frame);
        let chords = arc_chords(&from, &cl, &arc, ARC_SHARE * self.options.tolerance);
        let chords = chords.map_err(|why| PostFault::at(point.line, why))?;
        self.part.arcs += 1;
        self.count_moves(chords.len() - 1, point.line)?;
        let last = chords.len() - 1;
        let moves = chords.into_iter().enumerate().map(|(k, cl)| {
            Step::Move(PathMove { line: point.line, cl, feed: Some(feed), is_point: k == last, is_chord: true })
        });
        self.part.steps.extend(moves);
        Ok(())
    }

    fn count_moves(&mut self, n: usize, line: u32) -> Result<(), PostFault> {
        self.n_moves += n;
        if self.n_moves > MAX_MOVES {
            let why = format!("the file has more than {MAX_MOVES} moves, with the chords of arcs: split it here");
            return Err(PostFault::at(line, why));
        }
        Ok(())
    }

    fn note(&mut self, line: u32, text: &str) {
        // One note for each kind, with its first line.
        match self.out.notes.iter().any(|note| note.text == text) {
            true => {}
            false => self.out.notes.push(PostNote::at(line, text)),
        }
    }

    fn end_part(&mut self) -> Result<(), PostFault> {
        self.end_cycle();
        let mut part = std::mem::take(&mut self.part);
        if self.out.parts.len() >= MAX_PARTS {
            let why = format!("the file has more than {MAX_PARTS} parts with a tool each: split it here");
            return Err(PostFault::at(part.line, why));
        }
        // The template ends with both off.
        let is_for_moves = |step: &Step| matches!(step, Step::SpindleOn(_) | Step::SpindleOff | Step::Coolant(_));
        while part.steps.last().is_some_and(is_for_moves) {
            part.steps.pop();
        }
        let first = part.steps.iter().find_map(|s| if let Step::Move(m) = s { Some(m.line) } else { None });
        let line = first.unwrap_or(part.line);
        if part.spindle.is_none() && self.is_said_off {
            let why = "the tool moves behind SPINDL/OFF without a SPINDL of its own: the tool change would start the \
                       spindle; give a speed, or leave these moves out";
            return Err(PostFault::at(line, why));
        }
        let spindle = part
            .spindle
            .or(self.spindle)
            .ok_or_else(|| PostFault::at(line, "the tool moves, and no SPINDL gives the speed of the spindle"))?;
        let coolant = part.coolant.unwrap_or(self.coolant);
        rest_at_stops(&mut part.steps, spindle, coolant);
        self.out.parts.push(ToolPart {
            tool: part.tool,
            line: part.line,
            cutters: part.cutters,
            registers: part.registers,
            spindle,
            coolant,
            steps: part.steps,
            points: part.points,
            arcs: part.arcs,
        });
        Ok(())
    }

    fn finish(mut self) -> Result<FileSteps, PostFault> {
        // FROM alone is a move, too.
        if !self.part.starts.is_empty() {
            self.begin_part(AptPointKind::Linear);
        }
        if self.part.has_moved {
            self.end_part()?;
        }
        if self.out.parts.is_empty() {
            return Err(PostFault::Whole("no statement moves the tool (GOTO, FROM, GODLTA)".to_owned()));
        }
        self.out.notes.extend(unit_note(self.file).map(PostNote::whole));
        self.out.notes.extend(self.file.remarks.iter().map(|(line, text)| PostNote::at(*line, *text)));
        if !self.is_ended {
            self.out.notes.push(PostNote::whole("FINI is missing: the file may be cut off"));
        }
        self.out.faults.extend(unknown_words(&self.counts.words));
        self.out.words = self.counts.words;
        Ok(self.out)
    }
}

/// Fault of a cut behind SPINDL/OFF.
const SPINDLE_OFF: &str = "the tool cuts with the spindle off";

/// Statements between two questions whether to go on.
const STATEMENTS_BETWEEN: usize = 1024;

/// Most moves of a file, with the chords of its arcs: some gigabytes of memory.
const MAX_MOVES: usize = 20_000_000;

/// Most parts of a file with one tool each.
const MAX_PARTS: usize = 999;

/// Most different cutters of a part that are compared with its tool: two are a fault.
const MAX_CUTTERS: usize = 20;

/// Most different length registers of a part that are compared with that of its tool.
const MAX_REGISTERS: usize = 20;

/// Unknown words that are listed as faults; the table of words has them all.
const LISTED_WORDS: usize = 20;

/// Faults of words that are not understood.
fn unknown_words(words: &[PostedWord]) -> Vec<PostNote> {
    let unknown = || words.iter().filter(|w| w.treatment == Treatment::Unknown);
    let fault = |w: &PostedWord| {
        let text = format!("{} is not understood: its {} statement(s) are not written", w.word, w.count);
        PostNote::at(w.first_line, text)
    };
    let mut faults: Vec<PostNote> = unknown().take(LISTED_WORDS).map(fault).collect();
    let more = unknown().count().saturating_sub(LISTED_WORDS);
    if more > 0 {
        faults.push(PostNote::whole(format!("{more} more words are not understood; the list of words has them")));
    }
    faults
}

/// Longest dwell, s: an hour.
const MAX_DWELL: f64 = 3600.0;

/// Largest coordinate of a tip, mm: as for all lengths in jobs.
const FARTHEST: f64 = facemill_job::validate::FARTHEST;

impl OpenPart {
    /// Appends a step that does not matter before the first move, where the header says it.
    fn push_behind_a_move(&mut self, step: Step) {
        if self.has_moved {
            self.steps.push(step);
        }
    }

    /// Takes the comments behind the last move: they are of the next tool.
    fn comments_at_end(&mut self) -> Vec<Step> {
        let is_comment = |step: &Step| matches!(step, Step::Comment(_));
        let keep = self.steps.iter().rposition(|s| !is_comment(s)).map_or(0, |k| k + 1);
        self.steps.split_off(keep)
    }
}

/// Switches spindle and coolant, which the header starts, off for the stops before the first move.
fn rest_at_stops(steps: &mut Vec<Step>, spindle: SpindleSpec, coolant: Coolant) {
    let first_move = steps.iter().position(|s| matches!(s, Step::Move(_))).unwrap_or(steps.len());
    let is_stop = |step: &Step| *step == Step::Stop;
    let Some(first) = steps[..first_move].iter().position(is_stop) else { return };
    let last = steps[..first_move].iter().rposition(is_stop).unwrap_or(first);
    let stays_off = steps[last..first_move].contains(&Step::SpindleOff);
    let mut again = Vec::new();
    if !stays_off {
        again.push(Step::SpindleOn(spindle));
    }
    let mut off = vec![Step::SpindleOff];
    if coolant != Coolant::Off {
        off.push(Step::Coolant(Coolant::Off));
        again.push(Step::Coolant(coolant));
    }
    steps.splice(last + 1..last + 1, again);
    steps.splice(first..first, off);
}
