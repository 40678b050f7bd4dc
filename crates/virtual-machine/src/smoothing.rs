//! Whether a program says how far the control may leave the path where it cuts.

use facemill_nc_program::{Dialect, ReadBlock, ReadCommand};

/// What the text has said of it so far.
#[derive(Clone, Debug, Default)]
pub(crate) struct Smoothing {
    /// A tolerance, or exact stop, is in force: CYCLE832, G60, cycle 32, G61, G64, G187 E.
    is_said: bool,
    /// G641 to G645, which round corners as ADIS or machine data say.
    rounding: Option<String>,
    has_way: bool,
    /// TA of cycle 32.
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
                    let first = call.arguments.split(',').next().unwrap_or_default().trim();
                    // Without a tolerance the cycle switches back to the control's own.
                    self.is_said = first.parse::<f64>().map_or(!first.is_empty(), |tolerance| tolerance > 0.0);
                    self.rounding = None;
                }
                (Dialect::Heidenhain, ReadCommand::Call(call)) if call.name == "32" => self.cycle32(&call.arguments),
                (_, ReadCommand::Mode(text)) => self.fanuc(dialect, &text.to_uppercase()),
                _ => {}
            }
        }
    }

    fn siemens(&mut self, word: &str) {
        match word {
            "G60" => (self.is_said, self.rounding) = (true, None),
            "G64" => (self.is_said, self.rounding) = (false, None),
            "G9" => self.stops_here = true,
            "G641" | "G642" | "G643" | "G644" | "G645" => {
                (self.is_said, self.rounding) = (false, Some(word.to_owned()));
            }
            _ if word.starts_with("ADIS") && !word.starts_with("ADISPOS") => self.has_way = true,
            _ => {}
        }
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
                (_, "G61") | (Dialect::LinuxCnc, "G61.1" | "G64") => self.is_said = true,
                (Dialect::Fanuc | Dialect::Haas | Dialect::Mazak, "G61.1" | "G62" | "G64") => self.is_said = false,
                (Dialect::Haas, "G187") => self.is_said = text.contains(" E"),
                _ => {}
            }
        }
    }

    /// What a cut in this state is left to; `None` where the text says it.
    pub(crate) fn left_open(&self, dialect: Dialect) -> Option<String> {
        if dialect == Dialect::Heidenhain && self.is_said && !self.has_angle {
            return Some("cycle 32 without TA does not say how far rotary axes may leave the path".to_owned());
        }
        if self.is_said || self.stops_here || self.rounding.is_some() && self.has_way {
            return None;
        }
        Some(match (dialect, &self.rounding) {
            (_, Some(code)) => format!("{code} without ADIS rounds corners as machine data say"),
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
}
