//! Cutting data of a tool (presets) as feeds of a job.

use crate::fault::ToolFault;
use crate::fields::{Fields, LengthUnit};

/// Cutting data that a library gives for a tool, as far as a job's `feeds` can hold them.
#[derive(Clone, Debug, PartialEq)]
pub struct CuttingPreset {
    /// Name in the library.
    pub name: String,
    /// Speed of the tip along the passes, mm/min.
    pub cutting_mm_min: Option<f64>,
    /// Speed of the tip in entries and exits, mm/min: the smallest of lead-in, ramp and plunge.
    pub approach_mm_min: Option<f64>,
    /// Spindle speed, 1/min.
    pub spindle_rpm: Option<f64>,
    /// Coolant, as a job names it.
    pub coolant: Option<&'static str>,
    /// Steepest ramp, deg.
    pub(crate) ramp_deg: Option<f64>,
}

impl CuttingPreset {
    /// Returns the preset as the key `feeds` of a job's operation. What the library does not give
    /// is left out: the job asks for it.
    #[must_use]
    pub fn job_feeds(&self) -> String {
        let numbers = [
            ("cutting_mm_min", self.cutting_mm_min),
            ("approach_mm_min", self.approach_mm_min),
            ("spindle_rpm", self.spindle_rpm),
        ];
        let numbers = numbers.into_iter().filter_map(|(key, value)| Some(format!("\"{key}\": {}", value?)));
        let coolant = self.coolant.map(|word| format!("\"coolant\": \"{word}\""));
        format!("\"feeds\": {{ {} }}", numbers.chain(coolant).collect::<Vec<_>>().join(", "))
    }
}

/// Most presets of a tool. A tool has some for each material.
const MAX_PRESETS: usize = 1_000;

/// Longest name of a preset, in letters, as of a tool's description.
const LONGEST_NAME: usize = 120;

/// Reads the presets of a tool with this number of teeth.
pub(crate) fn presets(
    tool: &Fields<'_>,
    unit: LengthUnit,
    teeth: Option<u32>,
    faults: &mut Vec<ToolFault>,
) -> Vec<CuttingPreset> {
    let values = tool.part("start-values", faults);
    let all = values.parts("presets", faults);
    if all.len() > MAX_PRESETS {
        let fault = format!("has {} presets, more than {MAX_PRESETS}; delete some in Fusion", all.len());
        faults.push(ToolFault::new(values.path_of("presets"), fault));
        return Vec::new();
    }
    all.iter().map(|preset| of_preset(preset, unit, teeth, faults)).collect()
}

fn of_preset(preset: &Fields<'_>, unit: LengthUnit, teeth: Option<u32>, faults: &mut Vec<ToolFault>) -> CuttingPreset {
    let mut amount = |key: &str| preset.amount(key, faults).filter(|value| *value > 0.0);
    let spindle_rpm = amount("n");
    let per_tooth = amount("f_z").zip(spindle_rpm).zip(teeth).map(|((f, n), z)| f * n * f64::from(z));
    let cutting = amount("v_f").or(per_tooth);
    let slow = [amount("v_f_leadIn"), amount("v_f_ramp"), amount("v_f_plunge")].into_iter().flatten();
    // Feeds in the file are rounded to what a control would take, and so are these.
    let feed = |value: f64| (unit.to_mm(value) * 1e3).round() / 1e3;
    CuttingPreset {
        name: preset
            .text("name")
            .map_or_else(|| preset.path().to_owned(), |name| name.chars().take(LONGEST_NAME).collect()),
        cutting_mm_min: cutting.map(feed),
        approach_mm_min: slow.reduce(f64::min).map(feed),
        spindle_rpm: spindle_rpm.map(|n| (n * 1e3).round() / 1e3),
        coolant: preset.text("tool-coolant").as_deref().and_then(coolant),
        ramp_deg: amount("ramp-angle"),
    }
}

/// Coolant of a job. Coolant through the tool has no word there; flood beside it has.
fn coolant(word: &str) -> Option<&'static str> {
    match word {
        "disabled" => Some("off"),
        "flood" | "flood tool" => Some("flood"),
        "mist" => Some("mist"),
        "air" => Some("air"),
        _ => None,
    }
}
