//! Whether a program says how far the control may leave the path where it cuts.

use facemill_nc_program::Dialect;
use facemill_nc_program::read::{ReadBlock, ReadCommand};

/// State of the smoothing that the text has set so far.
#[derive(Clone, Debug, Default)]
pub(crate) struct Smoothing {
    /// A tolerance, or exact stop, is in force: CYCLE832, G60, cycle 32, G61, G64, G187 E.
    is_said: bool,
    /// Whether CYCLE832 sets it; CTOL and OTOL change its tolerances.
    is_by_cycle: bool,
    /// CTOL and OTOL are in force: of the tip, and of rotary axes.
    tolerances: [bool; 2],
    /// G641 to G645, which round corners as ADIS or machine data say.
    rounding: Option<String>,
    has_way: bool,
    /// TA of cycle 32, the last number of CYCLE832.
    has_angle: bool,
    /// Exact stop of one block (G9).
    stops_here: bool,
}

impl Smoothing {
    /// Follows the next block.
    pub(crate) fn read(&mut self, dialect: Dialect, block: &ReadBlock) {
        self.stops_here = false;
        for command in &block.commands {
            match (dialect, command) {
                (Dialect::Siemens840d, ReadCommand::Mode(text)) => self.siemens(&text.to_uppercase()),
                (Dialect::Siemens840d, ReadCommand::Call(call)) if call.name == "CYCLE832" => {
                    self.cycle832(&call.arguments.to_uppercase());
                }
                (Dialect::Heidenhain, ReadCommand::Call(call)) if call.name == "32" => self.cycle32(&call.arguments),
                (_, ReadCommand::Mode(text)) => self.fanuc(dialect, &text.to_uppercase()),
                _ => {}
            }
        }
    }

    fn siemens(&mut self, word: &str) {
        match word {
            "G60" => (self.is_said, self.is_by_cycle, self.has_angle, self.rounding) = (true, false, true, None),
            "G64" => (self.is_said, self.rounding) = (false, None),
            "G9" => self.stops_here = true,
            "G641" | "G642" | "G643" | "G644" | "G645" => {
                (self.is_said, self.rounding) = (false, Some(word.to_owned()));
            }
            _ if word.starts_with("ADIS") && !word.starts_with("ADISPOS") => self.has_way = true,
            _ if word.starts_with("CTOL") => self.tolerance(0, word),
            _ if word.starts_with("OTOL") => self.tolerance(1, word),
            _ => {}
        }
    }

    /// `CTOL=0.01`, `OTOL=0.05`; one below 0 takes that of machine data again.
    fn tolerance(&mut self, which: usize, word: &str) {
        let value = word.split_once('=').map_or("", |(_, value)| value.trim());
        let is_given = is_given(value);
        self.tolerances[which] = is_given;
        if self.is_by_cycle {
            match which {
                0 => self.is_said = is_given,
                _ => self.has_angle = is_given,
            }
        }
    }

    /// Tolerance of the path, kind of machining, tolerance of the orientation.
    fn cycle832(&mut self, arguments: &str) {
        let mut given = arguments.split(',').map(str::trim);
        let [path, kind, orientation] = [0, 1, 2].map(|_| given.next().unwrap_or_default());
        // Kind 0 switches back to the control's own tolerance, as none does.
        let is_off = matches!(kind.trim_start_matches('_'), "0" | "OFF");
        self.is_said = !is_off && is_given(path);
        (self.is_by_cycle, self.tolerances) = (self.is_said, [false; 2]);
        self.has_angle = is_given(orientation);
        self.rounding = None;
    }

    fn cycle32(&mut self, arguments: &str) {
        let step = arguments.split_whitespace().next();
        let has = |word: fn(&str) -> bool| arguments.split_whitespace().skip(1).any(word);
        if step == Some(".1") {
            (self.is_said, self.has_angle) = (has(|w| w.starts_with('T') && !w.starts_with("TA")), false);
        }
        self.has_angle |= matches!(step, Some(".1" | ".2")) && has(|w| w.starts_with("TA"));
    }

    fn fanuc(&mut self, dialect: Dialect, text: &str) {
        for word in text.split_whitespace() {
            match (dialect, word) {
                (_, "G9") => self.stops_here = true,
                (_, "G61") | (Dialect::LinuxCnc, "G61.1" | "G64") => self.is_said = true,
                (Dialect::Fanuc | Dialect::Haas | Dialect::Mazak, "G61.1" | "G62" | "G64") => self.is_said = false,
                (Dialect::Haas, "G187") => self.is_said = text.contains(" E"),
                _ => {}
            }
        }
    }

    /// Returns the open question of a cut in this state; `None` if the text settles it.
    pub(crate) fn left_open(&self, dialect: Dialect) -> Option<String> {
        let without_angle = match dialect {
            Dialect::Heidenhain => Some("cycle 32 without TA"),
            Dialect::Siemens840d => Some("CYCLE832 without a tolerance of the orientation"),
            _ => None,
        };
        if let Some(what) = without_angle.filter(|_| self.is_said && !self.has_angle && !self.stops_here) {
            return Some(format!("{what} does not say how far rotary axes may leave the path"));
        }
        if self.is_said || self.stops_here {
            return None;
        }
        if dialect == Dialect::Siemens840d && self.tolerances != [false; 2] {
            return Some(self.left_open_by_tolerances());
        }
        Some(match (dialect, &self.rounding) {
            (_, Some(code)) if code == "G641" && self.has_way => {
                "G641 with ADIS does not say how far rotary axes may leave the path".to_owned()
            }
            (_, Some(code)) if code == "G641" => "G641 without ADIS rounds corners as machine data say".to_owned(),
            // Machine data say whether these heed ADIS at all.
            (_, Some(code)) => format!("{code} rounds corners as machine data say"),
            (Dialect::Siemens840d, None) => {
                "no CYCLE832, ADIS, G60 or G9 says how far a cut may leave the path".to_owned()
            }
            (Dialect::Heidenhain, None) => "no cycle 32 says how far a cut may leave the path".to_owned(),
            (Dialect::LinuxCnc, None) => "no G64 P or G61 says how far a cut may leave the path".to_owned(),
            (Dialect::Haas, None) => {
                "no G187 E or G61 says how far a cut may leave the path: a setting does".to_owned()
            }
            _ => "the control's settings say how far a cut may leave the path".to_owned(),
        })
    }

    /// CTOL and OTOL say what compressors and smoothing keep to; whether corners do, and which,
    /// machine data decide.
    fn left_open_by_tolerances(&self) -> String {
        let rounding = self.rounding.as_deref().unwrap_or("G64");
        match self.tolerances {
            [true, true] => {
                format!("CTOL and OTOL are said, and machine data decide whether corners of {rounding} keep to them")
            }
            [true, false] => format!(
                "CTOL without OTOL does not say how far rotary axes may leave the path, and machine data decide whether \
                 corners of {rounding} keep to it"
            ),
            _ => "OTOL without CTOL says of rotary axes alone how far a cut may leave the path".to_owned(),
        }
    }
}

/// Whether a text is a tolerance above 0, or one that is not evaluated.
fn is_given(text: &str) -> bool {
    text.parse::<f64>().map_or(!text.is_empty(), |tolerance| tolerance > 0.0)
}
