//! Words of a program that choose another motion between positions than the one that is simulated.

use facemill_cl_data::{CuttingLaw, MotionLaw, RapidLaw};
use facemill_nc_program::{Dialect, ReadBlock, ReadCall, ReadCommand};

/// Laws that the machine file states, and the control whose words are read.
#[derive(Clone, Copy)]
pub(crate) struct MotionModes {
    law: MotionLaw,
    dialect: Dialect,
}

/// By how much a tolerance in the text may exceed the machine file's: its last decimal.
const ROUNDING: f64 = 1e-6;

impl MotionModes {
    pub(crate) fn new(law: MotionLaw, dialect: Dialect) -> Self {
        Self { law, dialect }
    }

    /// What a block chooses that is not simulated.
    pub(crate) fn strange(&self, block: &ReadBlock) -> Vec<String> {
        let of_command = |command: &ReadCommand| match (self.dialect, command) {
            (Dialect::Siemens840d, ReadCommand::Mode(text)) => self.siemens(&text.to_uppercase()),
            (Dialect::Siemens840d, ReadCommand::Call(call)) if call.name == "CYCLE832" => self.cycle832(call),
            (Dialect::Heidenhain, ReadCommand::Mode(text)) => self.heidenhain(&text.to_uppercase()),
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
            "ADIS" | "ADISPOS" => {
                let way = word.split_once('=').and_then(|(_, value)| value.trim().parse::<f64>().ok());
                beyond("rounds corners within", way, self.law.control_tolerance.path, "mm")
            }
            _ => None,
        }
    }

    /// CYCLE832(path, kind, orientation).
    fn cycle832(&self, call: &ReadCall) -> Option<String> {
        let number = |k: usize| call.arguments.split(',').nth(k).map(str::trim).filter(|a| !a.is_empty());
        let [path, kind, orientation] = [0, 1, 2].map(number);
        if path.is_none() && orientation.is_none() || kind.is_some_and(|k| k.trim_start_matches('_') == "0") {
            return None;
        }
        let value = |text: Option<&str>| text.map_or(Some(0.0), |t| t.parse::<f64>().ok());
        let allowed = self.law.control_tolerance;
        let path = value(path);
        beyond("smooths within", path, allowed.path, "mm")
            .or_else(|| beyond("smooths within", value(orientation), allowed.orientation.to_degrees(), "deg"))
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
