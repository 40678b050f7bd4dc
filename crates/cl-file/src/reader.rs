use std::collections::BTreeMap;

use facemill_cl_data::ClPoint;
use nalgebra::{Point3, Unit, Vector3};

use crate::apt_file::{
    AptArc, AptCoolant, AptFile, AptMeaning, AptPoint, AptPointKind, AptStatement, AptUnknownWord, ClUnit,
};
use crate::arc::{along_circle, circle};
use crate::cutters;
use crate::statement::{RawStatement, Statements, parse};
use facemill_nc_program::read::{ReadError, ReadFault};

/// Reads an APT cutter-location file: its points with rapids and feeds, and every statement. Lines
/// continued by `$` are joined. Unknown major words are kept and listed; nothing is skipped
/// silently.
///
/// A point without an axis has the last one of a MULTAX file, or +z where none has been given or
/// MULTAX is off. A feed per revolution is that of the spindle speed in force at each point. Points
/// are as given, in the frame of the last CSYS before them where there is one
/// ([`AptPoint::frame`]); other words that move the frame (TRACUT, ORIGIN, …) are among the
/// unknown.
///
/// # Errors
/// When a known statement has invalid values, or an axis has length zero.
pub fn read_apt(text: impl AsRef<[u8]>) -> Result<AptFile, ReadError> {
    read_apt_in(text, None)
}

/// Reads a file as [`read_apt`] does; `unit` is that of a file without UNITS.
///
/// # Errors
/// As [`read_apt`], and where UNITS says another unit.
pub fn read_apt_in(text: impl AsRef<[u8]>, unit: Option<ClUnit>) -> Result<AptFile, ReadError> {
    let file = AptFile { given_unit: unit, ..AptFile::default() };
    let state = State { unit: unit.map_or(1.0, ClUnit::mm), ..State::default() };
    let mut reader = AptReader { file, unknown: BTreeMap::new(), state };
    for statement in Statements::new(text.as_ref()) {
        if statement.is_too_long {
            let why =
                "it has more than 100,000 characters: this is no CL file, or `$` at the ends of lines joins them all";
            let word = statement.text.split(['/', ' ']).next().filter(|word| !word.is_empty());
            let word = word.unwrap_or("statement").to_owned();
            return Err(statement.error(0, ReadFault::Statement { word, why }));
        }
        let meaning = reader.statement(&statement)?;
        reader.file.statements.push(AptStatement { line: statement.line, text: statement.text.into(), meaning });
    }
    Ok(reader.file)
}

/// Largest distance of the length of a tool axis from 1: a few digits are enough for that.
const UNIT_LENGTH: f64 = 1e-2;

struct AptReader {
    file: AptFile,
    /// Index of every unknown word.
    unknown: BTreeMap<String, usize>,
    state: State,
}

struct State {
    unit: f64,
    /// Whether UNITS was read.
    unit_is_known: bool,
    axis: Unit<Vector3<f64>>,
    tip: Option<Point3<f64>>,
    feed: Option<FeedInForce>,
    /// mm per unit of the last feed whose unit was given.
    feed_unit: Option<f64>,
    /// Spindle speed of the last SPINDL with one, 1/min.
    rpm: Option<f64>,
    is_rapid: bool,
    is_arc: bool,
    is_cycle: bool,
    /// Whether MULTAX/OFF holds.
    is_multax_off: bool,
    frame: Option<u32>,
    /// Index of the arc that the next point ends.
    arc: Option<u32>,
    /// Direction of INDIRV.
    direction: Option<Vector3<f64>>,
}

/// Last FEDRAT.
#[derive(Clone, Copy)]
enum FeedInForce {
    /// mm/min.
    PerMinute(f64),
    /// mm per revolution.
    PerRevolution(f64),
}

impl Default for State {
    fn default() -> Self {
        Self {
            unit: 1.0,
            unit_is_known: false,
            axis: Vector3::z_axis(),
            tip: None,
            feed: None,
            feed_unit: None,
            rpm: None,
            is_rapid: false,
            is_arc: false,
            is_cycle: false,
            is_multax_off: false,
            frame: None,
            arc: None,
            direction: None,
        }
    }
}

impl AptReader {
    fn statement(&mut self, raw: &RawStatement) -> Result<AptMeaning, ReadError> {
        if raw.text.starts_with("$$") {
            let cutter = cutters::of_creo(raw, self.state.unit);
            return Ok(cutter.map_or(AptMeaning::Comment, AptMeaning::Cutter));
        }
        let (word, start) = raw.major_word();
        let values = raw.values(start);
        Ok(match word.as_str() {
            "PARTNO" => AptMeaning::PartName(raw.text[start..].trim().to_owned()),
            "PPRINT" | "INSERT" | "REMARK" | "TPRINT" => AptMeaning::Comment,
            "UNITS" | "UNIT" => self.unit(raw, &values)?,
            "CUTTER" => AptMeaning::Cutter(cutters::of_cutter(raw, &values, self.state.unit)?),
            "TLDATA" => {
                let cutter = cutters::of_tldata(raw, &values, self.state.unit)?;
                cutter.map_or(AptMeaning::Auxiliary, AptMeaning::Cutter)
            }
            "LOADTL" | "LOAD" => tool(raw, &word, &values)?,
            "SPINDL" => self.spindle(raw, &values)?,
            "FEDRAT" => self.feed(raw, &values)?,
            "RAPID" => {
                self.state.is_rapid = true;
                AptMeaning::Rapid
            }
            "GOTO" | "FROM" | "GODLTA" => self.point(raw, &word, &values)?,
            "TLON" => match along_circle(raw, self.state.unit, self.state.tip, self.state.direction.take())? {
                Some((arc, end)) => {
                    self.start_arc(Some(arc));
                    self.push_point(raw, &word, end)?
                }
                None => self.keep_unknown(word, raw.line),
            },
            "TLAXIS" => {
                self.state.axis = direction(raw, &word, &values)?;
                AptMeaning::ToolAxis
            }
            "INDIRV" => {
                self.state.direction = Some(direction(raw, &word, &values)?.into_inner());
                AptMeaning::Auxiliary
            }
            "MULTAX" => {
                let is_on = !has(&values, "OFF");
                self.state.is_multax_off = !is_on;
                if !is_on {
                    self.state.axis = Vector3::z_axis();
                }
                AptMeaning::MultiAxis(is_on)
            }
            "CYCLE" => {
                self.state.is_cycle = !has(&values, "OFF");
                AptMeaning::Cycle(self.state.is_cycle)
            }
            "CIRCLE" | "MOVARC" => {
                let arc = circle(raw, &values, self.state.unit)?;
                self.start_arc(arc);
                AptMeaning::Circle
            }
            "CSYS" => match self.frame(raw, &values)? {
                Some(frame) => frame,
                None => self.keep_unknown(word, raw.line),
            },
            "TRNTYP" => AptMeaning::Frame(None),
            "CUTCOM" => AptMeaning::RadiusCompensation(!has(&values, "OFF")),
            "SETUP" => AptMeaning::Setup(!has(&values, "END")),
            "FINI" | "END" => AptMeaning::End,
            "GOHOME" => AptMeaning::Home,
            "COOLNT" => AptMeaning::Coolant(coolant(&values)),
            "DELAY" => AptMeaning::Dwell(if has(&values, "REV") { None } else { first_number(&values) }),
            "STOP" | "OPSTOP" => AptMeaning::Stop { optional: word == "OPSTOP" },
            "SELECT" | "TOOLNO" | "MACHIN" | "INTOL" | "OUTTOL" | "TOLER" | "AUTOPS" | "PAINT" | "TOOL"
            | "TOOLPATH" | "END-OF-PATH" | "PARTID" => AptMeaning::Auxiliary,
            _ if word.starts_with("CSI_SET_") => AptMeaning::Auxiliary,
            _ => self.keep_unknown(word, raw.line),
        })
    }

    /// Returns the frame of a CSYS with twelve numbers; others give its name.
    fn frame(&mut self, raw: &RawStatement, values: &[(usize, &str)]) -> Result<Option<AptMeaning>, ReadError> {
        if values.len() != 12 {
            return Ok(None);
        }
        let mut frame = Box::new([0.0; 12]);
        for (k, value) in values.iter().enumerate() {
            let unit = if k % 4 == 3 { self.state.unit } else { 1.0 };
            frame[k] = raw.number(*value)? * unit;
        }
        self.state.frame = u32::try_from(self.file.statements.len()).ok();
        Ok(Some(AptMeaning::Frame(Some(frame))))
    }

    fn unit(&mut self, raw: &RawStatement, values: &[(usize, &str)]) -> Result<AptMeaning, ReadError> {
        let unit = if has(values, "MM") {
            ClUnit::Millimetre
        } else if has(values, "INCH") || has(values, "INCHES") || has(values, "IN") {
            ClUnit::Inch
        } else if has(values, "CM") {
            ClUnit::Centimetre
        } else {
            return Err(fault(raw, "UNITS", "expected MM, CM or INCHES"));
        };
        if self.file.given_unit.is_some_and(|given| given != unit) {
            return Err(fault(raw, "UNITS", "it is not the unit that was given beside the file; leave that out"));
        }
        if !std::mem::replace(&mut self.state.unit_is_known, true) {
            // Some systems describe the cutter first.
            let times = unit.mm() / self.state.unit;
            for statement in &mut self.file.statements {
                if let AptMeaning::Cutter(cutter) = &mut statement.meaning {
                    cutter.scale(times);
                }
            }
        }
        self.state.unit = unit.mm();
        Ok(AptMeaning::Unit(self.state.unit))
    }

    fn feed(&mut self, raw: &RawStatement, values: &[(usize, &str)]) -> Result<AptMeaning, ReadError> {
        let mut unit = None;
        let mut number = None;
        for &(at, value) in values.iter().filter(|(_, value)| !value.is_empty()) {
            if value.starts_with(|c: char| c.is_ascii_alphabetic()) {
                unit = Some(self.feed_unit(raw, value)?);
            } else if number.is_none() {
                number = Some(raw.number((at, value))?);
            }
        }
        let value = number.ok_or_else(|| fault(raw, "FEDRAT", "expected a number"))?;
        let (is_per_minute, unit) = match (unit, self.state.feed) {
            (Some(unit), _) => {
                self.state.feed_unit = Some(unit.1);
                unit
            }
            (None, Some(FeedInForce::PerRevolution(_))) => {
                return Err(fault(raw, "FEDRAT", "behind a feed per revolution the unit must be given: MMPM or MMPR"));
            }
            (None, _) if self.state.feed_unit.is_some_and(|unit| unit != self.state.unit) => {
                let why =
                    "behind a feed in another unit than that of UNITS the unit must be given: MMPM, IPM or PERMIN";
                return Err(fault(raw, "FEDRAT", why));
            }
            (None, _) => (true, self.state.unit),
        };
        let value = value * unit;
        self.state.is_rapid = false;
        self.state.feed =
            Some(if is_per_minute { FeedInForce::PerMinute(value) } else { FeedInForce::PerRevolution(value) });
        Ok(if is_per_minute { AptMeaning::Feed(value) } else { AptMeaning::FeedPerRevolution(value) })
    }

    /// Returns whether a unit of feed is per minute, and its length in mm.
    fn feed_unit(&self, raw: &RawStatement, word: &str) -> Result<(bool, f64), ReadError> {
        Ok(match word.to_ascii_uppercase().as_str() {
            "MMPM" => (true, 1.0),
            "IPM" => (true, ClUnit::Inch.mm()),
            "PERMIN" => (true, self.state.unit),
            "MMPR" => (false, 1.0),
            "IPR" => (false, ClUnit::Inch.mm()),
            "PERREV" => (false, self.state.unit),
            "INVERS" => return Err(fault(raw, "FEDRAT", "inverse time is not supported; give MMPM or MMPR")),
            _ => return Err(fault(raw, "FEDRAT", "expected MMPM, IPM, PERMIN, MMPR, IPR or PERREV for the unit")),
        })
    }

    /// Reads a spindle speed, or that the spindle is switched. A sense alone is the last speed in
    /// that sense.
    fn spindle(&mut self, raw: &RawStatement, values: &[(usize, &str)]) -> Result<AptMeaning, ReadError> {
        let said = said_of_spindle(raw, values)?;
        if let Some(rpm) = said.rpm.filter(|rpm| *rpm > 0.0) {
            self.state.rpm = Some(rpm);
        }
        if said.is_off || said.rpm == Some(0.0) {
            return Ok(AptMeaning::SpindleOff);
        }
        match (said.rpm, said.clockwise) {
            (Some(rpm), clockwise) => Ok(AptMeaning::Spindle { rpm, clockwise: clockwise.unwrap_or(true) }),
            (None, Some(clockwise)) => {
                let rpm = self.state.rpm.ok_or_else(|| fault(raw, "SPINDL", "no speed was given before"))?;
                Ok(AptMeaning::Spindle { rpm, clockwise })
            }
            (None, None) if said.is_on => Ok(AptMeaning::SpindleOn),
            (None, None) if said.has_range => Ok(AptMeaning::Auxiliary),
            (None, None) => Err(fault(raw, "SPINDL", "expected a speed, CLW, CCLW, ON or OFF")),
        }
    }

    fn start_arc(&mut self, arc: Option<AptArc>) {
        self.state.is_arc = true;
        self.state.arc = arc.and_then(|_| u32::try_from(self.file.arcs.len()).ok());
        self.file.arcs.extend(arc);
    }

    fn point(&mut self, raw: &RawStatement, word: &str, values: &[(usize, &str)]) -> Result<AptMeaning, ReadError> {
        let numbers = values.iter().map(|v| raw.number(*v)).collect::<Result<Vec<_>, _>>()?;
        let (&[x, y, z], axis) = numbers
            .split_first_chunk()
            .filter(|(_, rest)| matches!((word, rest.len()), ("GODLTA", 0) | ("GOTO" | "FROM", 0 | 3)))
            .ok_or_else(|| fault(raw, word, "expected x, y, z or x, y, z, i, j, k"))?;
        if let &[i, j, k] = axis {
            let axis = Unit::try_new_and_get(Vector3::new(i, j, k), 1e-9);
            let (axis, length) = axis.ok_or_else(|| fault(raw, word, "the axis has length zero"))?;
            self.state.axis = axis;
            if (length - 1.0).abs() > UNIT_LENGTH {
                self.remark(raw.line, "the tool axis of a point has not the length 1: only its direction is taken");
            }
            if self.state.is_multax_off {
                self.remark(raw.line, "a point behind MULTAX/OFF has a tool axis: it is taken");
            }
        }
        let given = Vector3::new(x, y, z) * self.state.unit;
        let tip = match (word, self.state.tip) {
            ("GODLTA", None) => return Err(fault(raw, word, "there is no point before it")),
            ("GODLTA", Some(from)) => from + given,
            _ => Point3::from(given),
        };
        if !tip.coords.iter().all(|v| v.is_finite()) {
            return Err(fault(raw, word, "a coordinate is too large"));
        }
        self.push_point(raw, word, tip)
    }

    /// Adds a remark, unless there is one of its kind.
    fn remark(&mut self, line: u32, text: &'static str) {
        if self.file.remarks.iter().all(|(_, before)| *before != text) {
            self.file.remarks.push((line, text));
        }
    }

    fn push_point(&mut self, raw: &RawStatement, word: &str, tip: Point3<f64>) -> Result<AptMeaning, ReadError> {
        let state = &mut self.state;
        let kind = match word {
            "FROM" => AptPointKind::Start,
            // An arc at rapid rate is followed at the feed in force: its chord is another way.
            _ if state.is_arc => AptPointKind::Arc,
            _ if state.is_rapid => AptPointKind::Rapid,
            _ if state.is_cycle => AptPointKind::Cycle,
            _ => AptPointKind::Linear,
        };
        let feed = match state.feed.filter(|_| !matches!(kind, AptPointKind::Rapid | AptPointKind::Start)) {
            Some(FeedInForce::PerRevolution(feed)) => {
                let rpm = state
                    .rpm
                    .ok_or_else(|| fault(raw, word, "its feed is per revolution, and no SPINDL says how many"));
                Some(feed * rpm?)
            }
            Some(FeedInForce::PerMinute(feed)) => Some(feed),
            None => None,
        };
        let arc = state.arc.take().filter(|_| kind == AptPointKind::Arc);
        state.tip = Some(tip);
        // RAPID and CIRCLE apply to one point.
        (state.is_rapid, state.is_arc) = (false, false);
        state.direction = None;
        let cl = ClPoint { tip, axis: state.axis };
        self.file.points.push(AptPoint { line: raw.line, kind, cl, feed, frame: state.frame, arc });
        Ok(AptMeaning::Point(self.file.points.len() - 1))
    }

    fn keep_unknown(&mut self, word: String, line: u32) -> AptMeaning {
        match self.unknown.get(&word) {
            Some(&index) => self.file.unknown[index].count += 1,
            None => {
                self.unknown.insert(word.clone(), self.file.unknown.len());
                self.file.unknown.push(AptUnknownWord { word, line, count: 1 });
            }
        }
        AptMeaning::Unknown
    }
}

/// Largest speed of a spindle, 1/min.
const MAX_RPM: f64 = 1e6;

/// Values of SPINDL.
#[derive(Default)]
struct SaidOfSpindle {
    /// 1/min, not below 0.
    rpm: Option<f64>,
    clockwise: Option<bool>,
    is_on: bool,
    is_off: bool,
    has_range: bool,
}

/// Returns what SPINDL says.
///
/// # Errors
/// If a word is not known, a number is none, or two values contradict each other.
fn said_of_spindle(raw: &RawStatement, values: &[(usize, &str)]) -> Result<SaidOfSpindle, ReadError> {
    let wrong = |why| Err(fault(raw, "SPINDL", why));
    let mut said = SaidOfSpindle::default();
    let mut largest = f64::INFINITY;
    let mut values = values.iter().filter(|(_, value)| !value.is_empty());
    while let Some(&(at, value)) = values.next() {
        match value.to_ascii_uppercase().as_str() {
            "RPM" => {}
            "ON" => said.is_on = true,
            "OFF" => said.is_off = true,
            sense @ ("CLW" | "CCLW") => {
                let clockwise = sense == "CLW";
                if said.clockwise.replace(clockwise).is_some_and(|before| before != clockwise) {
                    return wrong("it has two senses");
                }
            }
            "RANGE" => {
                said.has_range = true;
                if values.next().is_none() {
                    return wrong("expected a range behind RANGE");
                }
            }
            "MAXRPM" => match values.next() {
                Some(value) => largest = raw.number(*value)?,
                None => return wrong("expected a speed behind MAXRPM"),
            },
            "SFM" | "SMM" => return wrong("a cutting speed is not supported; give the speed as RPM"),
            word if word.starts_with(|c: char| c.is_ascii_alphabetic()) => {
                return wrong("expected RPM, CLW, CCLW, ON, OFF, RANGE or MAXRPM");
            }
            _ => {
                if said.rpm.replace(raw.number((at, value))?).is_some() {
                    return wrong("it has two speeds");
                }
            }
        }
    }
    match said.rpm {
        _ if said.is_on && said.is_off => wrong("it has ON and OFF"),
        Some(rpm) if rpm < 0.0 => wrong("the speed is below 0; give CLW or CCLW"),
        Some(rpm) if rpm > largest => wrong("the speed is above MAXRPM"),
        Some(rpm) if rpm > MAX_RPM => wrong("the speed is above 1000000 revolutions per minute"),
        _ => Ok(said),
    }
}

/// Words of LOADTL before the number of the register of the tool's length: ADJUST of NX
/// (`UF_PATH_tool_change_s::adjust_register`, "the register to use for tool length compensation"),
/// OSETNO of Creo (LOADTL / n, LENGTH, l, OSETNO, o in its "Supported CL Data Commands").
const REGISTER_WORDS: [&str; 2] = ["ADJUST", "OSETNO"];

/// Returns the tool of a call: the first whole number, and the register of its length. ON, NOTE and
/// other words in place of a register leave it to the control.
fn tool(raw: &RawStatement, word: &str, values: &[(usize, &str)]) -> Result<AptMeaning, ReadError> {
    let is_register = |value: &str| REGISTER_WORDS.iter().any(|word| value.eq_ignore_ascii_case(word));
    let at = values.iter().position(|(_, value)| is_register(value)).unwrap_or(values.len());
    // Some systems write whole numbers as decimals.
    let whole = |value: &str| value.trim_end_matches('0').strip_suffix('.').unwrap_or(value).parse().ok();
    let number = values[..at].iter().find_map(|(_, value)| whole(value));
    let number = number.ok_or_else(|| fault(raw, word, "expected a tool number"))?;
    let length_register = match values.get(at + 1) {
        Some((_, none)) if ["NONE", "OFF"].iter().any(|word| none.eq_ignore_ascii_case(word)) => Some(0),
        Some((_, value)) => whole(value),
        None => None,
    };
    Ok(AptMeaning::Tool { number, length_register })
}

/// Returns the kind of coolant; without a word it is on.
fn coolant(values: &[(usize, &str)]) -> AptCoolant {
    if has(values, "OFF") {
        AptCoolant::Off
    } else if has(values, "MIST") || has(values, "AIR") {
        AptCoolant::Mist
    } else if values.iter().all(|(_, v)| ["ON", "FLOOD", ""].iter().any(|word| v.eq_ignore_ascii_case(word))) {
        AptCoolant::Flood
    } else {
        AptCoolant::Other
    }
}

/// Returns the direction of three numbers.
fn direction(raw: &RawStatement, word: &str, values: &[(usize, &str)]) -> Result<Unit<Vector3<f64>>, ReadError> {
    let numbers = values.iter().map(|value| raw.number(*value)).collect::<Result<Vec<_>, _>>()?;
    let Some(&[i, j, k]) = numbers.as_array() else { return Err(fault(raw, word, "expected i, j, k")) };
    Unit::try_new(Vector3::new(i, j, k), 1e-9).ok_or_else(|| fault(raw, word, "the direction has length zero"))
}

/// Returns the first number of the values.
fn first_number(values: &[(usize, &str)]) -> Option<f64> {
    values.iter().find_map(|(_, value)| parse(value))
}

fn has(values: &[(usize, &str)], word: &str) -> bool {
    values.iter().any(|(_, value)| value.eq_ignore_ascii_case(word))
}

fn fault(raw: &RawStatement, word: &str, why: &'static str) -> ReadError {
    raw.error(0, ReadFault::Statement { word: word.to_owned(), why })
}
