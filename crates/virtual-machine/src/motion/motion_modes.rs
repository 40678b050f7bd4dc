//! Words of a program that choose another motion between positions than the one that is simulated.

use facemill_cl_data::{CuttingLaw, MotionLaw, RapidLaw};
use facemill_nc_program::read::{ReadBlock, ReadCall, ReadCommand};
use facemill_nc_program::{Dialect, ReadProgram};

/// Laws that the machine file states, and the control whose words are read.
#[derive(Clone, Copy)]
pub(crate) struct MotionModes {
    law: MotionLaw,
    dialect: Dialect,
    /// mm of a length in the text: where any motion counts in inches, all do.
    unit: f64,
}

/// By how much a tolerance in the text may exceed the machine file's: its last decimal.
const ROUNDING: f64 = 1e-6;

/// Q of G64 up to which no blocks are joined, mm: what programs write that have to say one.
const NO_JOINING: f64 = 1e-4;

impl MotionModes {
    pub(crate) fn new(law: MotionLaw, program: &ReadProgram) -> Self {
        let is_inch = program.motions().any(|(_, m)| m.is_inch);
        Self { law, dialect: program.dialect, unit: if is_inch { 25.4 } else { 1.0 } }
    }

    /// Returns the modes that a block selects and that are not simulated.
    pub(crate) fn strange(&self, block: &ReadBlock) -> Vec<String> {
        let of_command = |command: &ReadCommand| match (self.dialect, command) {
            (Dialect::Siemens840d, ReadCommand::Mode(text)) => self.siemens(&text.to_uppercase()),
            (Dialect::Siemens840d, ReadCommand::Call(call)) if call.name == "CYCLE832" => self.cycle832(call),
            (Dialect::Heidenhain, ReadCommand::Mode(text)) => self.heidenhain(&text.to_uppercase()),
            (Dialect::Heidenhain, ReadCommand::Call(call)) if call.name == "32" => self.cycle32(call),
            (Dialect::LinuxCnc, ReadCommand::Mode(text)) => self.g64(text),
            (Dialect::Haas, ReadCommand::Mode(text)) => self.g187(text),
            _ => None,
        };
        block.commands.iter().filter_map(of_command).collect()
    }

    fn siemens(&self, word: &str) -> Option<String> {
        let is_turned = self.law.cutting == CuttingLaw::TipLinearVectorTurned;
        let name: String = word.chars().take_while(char::is_ascii_alphanumeric).collect();
        match name.as_str() {
            "ORIAXES" if is_turned => Some(other("rotary axes linear", "the tool's vector turned")),
            "ORIVECT" | "ORIPLANE" if !is_turned => Some(other("the tool's vector turned", "rotary axes linear")),
            "ORICURVE" | "ORICONCW" | "ORICONCCW" | "ORICONTO" | "ORICONIO" => {
                Some("the tool's axis turns in a way that is not simulated".to_owned())
            }
            "RTLIOF" if self.law.rapid == RapidLaw::Linear => Some(other("each axis on its own", "rapids on a line")),
            "COMPON" | "COMPCURV" | "COMPCAD" | "COMPSURF" => {
                Some("a compressor leaves the blocks within a tolerance of the control's own".to_owned())
            }
            "ADIS" | "ADISPOS" | "CTOL" => {
                beyond("rounds corners within", self.length(assigned(word)), self.law.control_tolerance.path, "mm")
            }
            "OTOL" => {
                beyond("smooths within", assigned(word), self.law.control_tolerance.orientation.to_degrees(), "deg")
            }
            "ATOL" => {
                // Of a linear axis in the program's unit, of a rotary one in deg: which it is, the
                // machine's names say.
                beyond(
                    "smooths an axis within",
                    self.length(assigned(word)),
                    self.law.control_tolerance.path,
                    "mm or deg",
                )
            }
            "STOLF" => beyond("lets rapids leave the path by times the tolerance:", assigned(word), 1.0, ""),
            _ => None,
        }
    }

    /// CYCLE832(path, kind, orientation).
    fn cycle832(&self, call: &ReadCall) -> Option<String> {
        let number = |k: usize| call.arguments.split(',').nth(k).map(str::trim).filter(|a| !a.is_empty());
        let [path, kind, orientation] = [0, 1, 2].map(number);
        if path.is_none() && orientation.is_none()
            || kind.is_some_and(|k| matches!(k.trim_start_matches('_'), "0" | "OFF" | "off"))
        {
            return None;
        }
        let value = |text: Option<&str>| text.map_or(Some(0.0), |t| t.parse::<f64>().ok());
        let allowed = self.law.control_tolerance;
        let path = self.length(value(path));
        beyond("smooths within", path, allowed.path, "mm")
            .or_else(|| beyond("smooths within", value(orientation), allowed.orientation.to_degrees(), "deg"))
    }

    /// `CYCL DEF 32.1 T0.05`, `CYCL DEF 32.2 HSC-MODE:1 TA0.5`. Without T the control's own
    /// tolerance is taken again.
    fn cycle32(&self, call: &ReadCall) -> Option<String> {
        let (step, words) = call.arguments.strip_prefix('.')?.split_once(' ')?;
        if step == "0" {
            return None;
        }
        let allowed = self.law.control_tolerance;
        words.split_whitespace().find_map(|word| match (word.strip_prefix("TA"), word.strip_prefix('T')) {
            (Some(angle), _) => beyond("smooths within", number(angle), allowed.orientation.to_degrees(), "deg"),
            (None, Some(path)) => beyond("smooths within", self.length(number(path)), allowed.path, "mm"),
            (None, None) => None,
        })
    }

    /// G64 P Q: blocks that are straight within Q (P where there is none) are joined first, and
    /// what is left is rounded within P; without P as far as the axes' accelerations want.
    fn g64(&self, text: &str) -> Option<String> {
        let text = text.to_uppercase();
        let words: Vec<&str> = text.split_whitespace().collect();
        if !words.contains(&"G64") {
            return None;
        }
        let of = |letter: char| words.iter().find_map(|w| w.strip_prefix(letter)).map(|v| self.length(number(v)));
        let Some(path) = of('P').filter(|p| p.is_none_or(|p| p > 0.0)) else {
            return Some("rounds corners without any bound (G64 without P); write G64 P".to_owned());
        };
        let joined = of('Q').unwrap_or(path);
        let both = path.zip(joined).map(|(p, q)| if q <= NO_JOINING + ROUNDING { p } else { p + q });
        let unit = "mm (P and Q, which is P where it is not said)";
        beyond("rounds corners and joins blocks within", both, self.law.control_tolerance.path, unit)
    }

    /// G187 E: how far corners are rounded; without E a setting says it.
    fn g187(&self, text: &str) -> Option<String> {
        let words = text.to_uppercase();
        let value = words.split_whitespace().find_map(|word| word.strip_prefix('E')).map(number)?;
        beyond("rounds corners within", self.length(value), self.law.control_tolerance.path, "mm")
    }

    /// mm of a length in the text.
    fn length(&self, value: Option<f64>) -> Option<f64> {
        value.map(|v| v * self.unit)
    }

    fn heidenhain(&self, text: &str) -> Option<String> {
        let is_turned = self.law.cutting == CuttingLaw::TipLinearVectorTurned;
        match text {
            t if t.contains("PATHCTRL AXIS") && is_turned => {
                Some(other("rotary axes linear", "the tool's vector turned"))
            }
            t if t.contains("PATHCTRL VECTOR") && !is_turned => {
                Some(other("the tool's vector turned", "rotary axes linear"))
            }
            _ => None,
        }
    }
}

/// The number behind a word's letters; `None` where it is not evaluated.
fn number(text: &str) -> Option<f64> {
    text.parse().ok().filter(|v: &f64| v.is_finite())
}

/// The number behind `=`.
fn assigned(word: &str) -> Option<f64> {
    word.split_once('=').and_then(|(_, value)| number(value.trim()))
}

fn other(chosen: &str, simulated: &str) -> String {
    format!("chooses {chosen}, where the machine file says and the run takes {simulated}")
}

/// `value` is what the text allows the control; `None` where it is not evaluated.
fn beyond(what: &str, value: Option<f64>, allowed: f64, unit: &str) -> Option<String> {
    match value {
        Some(value) if value <= allowed + ROUNDING => None,
        Some(value) => {
            Some(format!("{what} {value} {unit}; motion.control_tolerance of the machine file is {allowed}"))
        }
        None => Some(format!("{what} a tolerance that is not evaluated")),
    }
}
