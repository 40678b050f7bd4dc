//! Figures of lines from other files of a plan and from its measurements: certificates, chips,
//! heights that are left.

use std::collections::HashMap;

use facemill_verification::remaining::LeftByLine;
use serde_json::Value;

/// Proven figures of a line, mm.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct LineProof {
    pub(crate) depth: Option<f64>,
    /// With the control's tolerance.
    pub(crate) depth_with_control: Option<f64>,
    pub(crate) clearance: Option<f64>,
    /// Whether all of the block is proven.
    pub(crate) is_certified: bool,
}

impl LineProof {
    /// Returns the proof of two motions of a line: what is not proven of one is not of both.
    fn and(self, other: Self) -> Self {
        let both = |a: Option<f64>, b: Option<f64>, worse: fn(f64, f64) -> f64| Some(worse(a?, b?));
        Self {
            depth: both(self.depth, other.depth, f64::max),
            depth_with_control: both(self.depth_with_control, other.depth_with_control, f64::max),
            clearance: both(self.clearance, other.clearance, f64::min),
            is_certified: self.is_certified && other.is_certified,
        }
    }
}

/// Returns the proofs of lines in a file of certificates, or in a verification that has them.
pub(crate) fn proofs(file: &Value) -> HashMap<u32, LineProof> {
    let list = file.get("certificates").or_else(|| file.pointer("/certificates/certificates"));
    let list = list.and_then(|c| c.as_array().or_else(|| c.get("certificates")?.as_array()));
    let mut proofs: HashMap<u32, LineProof> = HashMap::new();
    for certificate in list.into_iter().flatten() {
        let Some(line) = certificate.get("line").and_then(Value::as_u64) else { continue };
        let number = |key: &str| certificate.get(key).and_then(Value::as_f64);
        let proof = LineProof {
            depth: number("depth_mm"),
            depth_with_control: number("depth_with_control_mm"),
            clearance: number("clearance_mm"),
            is_certified: certificate.get("certified") == Some(&Value::Bool(true)),
        };
        proofs.entry(line as u32).and_modify(|known| *known = known.and(proof)).or_insert(proof);
    }
    proofs
}

/// Chip of a line.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct LineChip {
    /// Section across the feed, mm².
    pub(crate) area: Option<f64>,
    /// Removal rate at the written feed, cm³/min.
    pub(crate) removal_rate: Option<f64>,
}

/// Returns the largest chip of each line in a table of chips (`chips.csv`).
pub(crate) fn chips(csv: &str) -> HashMap<u32, LineChip> {
    let mut chips: HashMap<u32, LineChip> = HashMap::new();
    // From the end: the first column, a name, may hold commas.
    for row in csv.lines().filter(|row| !row.starts_with(['#'])) {
        let cells: Vec<&str> = row.rsplitn(10, ',').collect();
        let [line, _, _, rate, _, _, _, _, area, _] = cells[..] else { continue };
        let Ok(line) = line.parse() else { continue };
        let larger = |known: Option<f64>, new: &str| match (known, new.parse::<f64>().ok()) {
            (Some(known), Some(new)) => Some(known.max(new)),
            (known, new) => known.or(new),
        };
        let chip = chips.entry(line).or_default();
        *chip = LineChip { area: larger(chip.area, area), removal_rate: larger(chip.removal_rate, rate) };
    }
    chips
}

/// Returns the height that is left beside each motion: the greatest of those of its own block and
/// of the cuts before and behind it, without another motion between, whose ends are at most
/// `left.spacing_mm` along the tip's path from its own. `ways` are the tip's ways in motions, mm,
/// `None` of motions that do not cut.
pub(crate) fn left_along(ways: &[Option<f64>], lines: &[u32], left: &LeftByLine) -> Vec<Option<f64>> {
    let height = |k: usize| left.heights_mm.get(&lines[k]).copied();
    let around = |k: usize| {
        ways[k]?;
        let mut most = height(k);
        let mut add = |other: usize| most = most.into_iter().chain(height(other)).reduce(f64::max);
        let mut way = 0.0;
        for other in (0..k).rev() {
            // From the end of one to the end of the other.
            way += ways[other + 1].unwrap_or(f64::INFINITY);
            if way > left.spacing_mm || ways[other].is_none() {
                break;
            }
            add(other);
        }
        way = 0.0;
        for (other, next) in ways.iter().enumerate().skip(k + 1) {
            way += next.unwrap_or(f64::INFINITY);
            if way > left.spacing_mm {
                break;
            }
            add(other);
        }
        most
    };
    (0..ways.len()).map(around).collect()
}

#[cfg(test)]
#[path = "../tests/unit/line_figures.rs"]
mod tests;
