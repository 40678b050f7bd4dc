//! Propellers by radial tables: columns over the radius, and sections.

use crate::propeller::tables::{DTMB_4119, DTMB_4382, VP1304, VP1304_DIAMETER};
use crate::spec_error::{SpecError, TablePart, in_range, is_not_above};

/// Hand of a propeller.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Hand {
    /// Driving, it turns about +Z: clockwise seen from astern.
    #[default]
    Right,
    /// Driving, it turns about −Z: the mirror image in the plane y = 0 of the right-handed one.
    Left,
}

/// A propeller by a radial table: one row per radius, lengths over the diameter D.
///
/// All columns have a value for each of the radii.
#[derive(Clone, Debug, PartialEq)]
pub struct PropellerTable {
    /// Number of blades, 2 to 12.
    pub n_blades: usize,
    /// Hand.
    pub hand: Hand,
    /// Diameter of the hub over D, 0.05 to 0.5.
    pub hub_ratio: f64,
    /// Length of the hub with its rounded ends over D, its middle at the middle of the blades'
    /// roots; `None` for a hub a little longer than they are.
    pub hub_length_ratio: Option<f64>,
    /// Radii r/R, growing, from the hub's radius or below it to 1; at least four.
    pub radii: Vec<f64>,
    /// Chord c/D; may be 0 at the tip alone.
    pub chord: Vec<f64>,
    /// Pitch P/D.
    pub pitch: Vec<f64>,
    /// Skew angle of the middle of the chord, rad, positive against the rotation.
    pub skew: Vec<f64>,
    /// Rake of the generator line over D without what skew brings, negative aft.
    pub rake: Vec<f64>,
    /// Sections.
    pub sections: TableSections,
}

/// Sections of a [`PropellerTable`].
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum TableSections {
    /// NACA 66 (DTMB modified) thickness about a NACA a = 0.8 mean line.
    Naca66A08 {
        /// Largest thickness.
        thickness: TableThickness,
        /// Largest ordinate of the mean line over the chord, f/c.
        camber: Vec<f64>,
    },
    /// Sections of the Wageningen B series, which have their own camber.
    WageningenB {
        /// Largest thickness.
        thickness: TableThickness,
    },
    /// Ordinates at stations of the chord.
    Offsets(SectionOffsets),
}

/// Largest thickness of the sections by radius, in the ratio that is interpolated.
#[derive(Clone, Debug, PartialEq)]
pub enum TableThickness {
    /// t/c.
    OfChord(Vec<f64>),
    /// t/D.
    OfDiameter(Vec<f64>),
}

/// Ordinates of sections at stations that all of them share.
#[derive(Clone, Debug, PartialEq)]
pub struct SectionOffsets {
    /// Radii r/R of the sections, growing, from the hub's radius or below it to 0.9 at least; four
    /// or more.
    pub radii: Vec<f64>,
    /// Chord fractions from 0 at the leading edge to 1 at the trailing edge, growing; five or more.
    pub stations: Vec<f64>,
    /// Height of the suction side above the line through both edges, by section and station.
    pub suction: Vec<Vec<f64>>,
    /// Height of the pressure side above the same line.
    pub pressure: Vec<Vec<f64>>,
    /// Length that the heights are divided by.
    pub unit: OffsetUnit,
}

/// Length that ordinates are divided by, and in which they are interpolated over the radius.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OffsetUnit {
    /// Chord of the section.
    Chord,
    /// Diameter of the propeller.
    Diameter,
}

/// Least number of radii: what a spline without known ends takes.
const LEAST_RADII: usize = 4;

/// Most rows of a table, and sections or stations of offsets.
const MOST_ROWS: usize = 1000;

/// Most ordinates of one side: sections times stations.
const MOST_OFFSETS: usize = 20_000;

/// Least number of stations.
const LEAST_STATIONS: usize = 5;

/// Radius that the sections' offsets reach at least: beyond, they go on along straight lines.
const OFFSETS_REACH: f64 = 0.9;

/// Rounding of radii in files with four digits: a table may begin this much beyond the hub, or end
/// this much before the tip.
const ROUNDING: f64 = 1e-4;

pub(crate) fn dtmb_4119() -> PropellerTable {
    dtmb(3, &DTMB_4119)
}

pub(crate) fn dtmb_4382() -> PropellerTable {
    let skew = DTMB_4382.map(|row| row[5].to_radians());
    PropellerTable { skew: skew.to_vec(), ..dtmb(5, &DTMB_4382) }
}

/// The table of `[r/R, c/D, P/D, t/c, f/c, …]` without skew, on a hub of 0.2 D.
fn dtmb<const N: usize>(n_blades: usize, rows: &[[f64; N]]) -> PropellerTable {
    let column = |k: usize| rows.iter().map(|row| row[k]).collect();
    PropellerTable {
        n_blades,
        hand: Hand::Right,
        hub_ratio: 0.2,
        hub_length_ratio: None,
        radii: column(0),
        chord: column(1),
        pitch: column(2),
        skew: vec![0.0; rows.len()],
        rake: vec![0.0; rows.len()],
        sections: TableSections::Naca66A08 { thickness: TableThickness::OfChord(column(3)), camber: column(4) },
    }
}

pub(crate) fn vp1304() -> PropellerTable {
    let of = |value: fn(&[f64; 7]) -> f64| VP1304.iter().map(value).collect();
    PropellerTable {
        n_blades: 5,
        hand: Hand::Right,
        hub_ratio: 0.3,
        hub_length_ratio: None,
        radii: of(|row| 2.0 * row[0] / VP1304_DIAMETER),
        chord: of(|row| row[1] / VP1304_DIAMETER),
        pitch: of(|row| row[2] / VP1304_DIAMETER),
        skew: of(|&[radius, chord, pitch, leading, ..]| skew_of_leading_edge(radius, chord, pitch, leading)),
        rake: of(|row| row[6] / VP1304_DIAMETER),
        sections: TableSections::Naca66A08 {
            thickness: TableThickness::OfDiameter(of(|row| row[5] / VP1304_DIAMETER)),
            camber: of(|row| row[4] / row[1]),
        },
    }
}

/// Skew angle, rad, of a section whose leading edge is `leading` from the generator line along the
/// helix, positive with the rotation; all lengths in one unit.
pub fn skew_of_leading_edge(radius: f64, chord: f64, pitch: f64, leading: f64) -> f64 {
    let pitch_angle = pitch.atan2(std::f64::consts::TAU * radius);
    (0.5 * chord - leading) * pitch_angle.cos() / radius
}

impl PropellerTable {
    /// Refuses numbers that are out of range, each with its row.
    pub(crate) fn check(&self) -> Result<(), SpecError> {
        #[expect(clippy::cast_precision_loss, reason = "only for the message")]
        in_range("number of blades", self.n_blades as f64, 2.0, 12.0)?;
        in_range("hub diameter over propeller diameter", self.hub_ratio, 0.05, 0.5)?;
        if let Some(length) = self.hub_length_ratio {
            in_range("hub length over propeller diameter", length, 0.01, 5.0)?;
        }
        check_radii(TablePart::Radial, &self.radii, self.hub_ratio, 1.0)?;
        let last = self.radii.len() - 1;
        self.column("chord c/D", &self.chord, |row, c| (c > 0.0 || row == last && c == 0.0) && c <= 3.0)?;
        self.column("pitch P/D", &self.pitch, |_, p| (0.01..=20.0).contains(&p))?;
        self.column("skew angle (rad)", &self.skew, |_, s| s.abs() <= std::f64::consts::TAU)?;
        self.column("rake over D", &self.rake, |_, r| r.abs() <= 2.0)?;
        match &self.sections {
            TableSections::Naca66A08 { thickness, camber } => {
                self.check_thickness(thickness)?;
                self.column("camber f/c", camber, |_, f| f.abs() <= 0.5)
            }
            TableSections::WageningenB { thickness } => self.check_thickness(thickness),
            TableSections::Offsets(offsets) => offsets.check(self.hub_ratio),
        }
    }

    fn check_thickness(&self, thickness: &TableThickness) -> Result<(), SpecError> {
        match thickness {
            TableThickness::OfChord(of_chord) => self.column("thickness t/c", of_chord, |_, t| t > 0.0 && t <= 1.0),
            TableThickness::OfDiameter(of_d) => self.column("thickness t/D", of_d, |_, t| t > 0.0 && t <= 1.0),
        }
    }

    fn column(
        &self,
        field: &'static str,
        values: &[f64],
        is_good: impl Fn(usize, f64) -> bool,
    ) -> Result<(), SpecError> {
        let (n, radii) = (values.len(), self.radii.len());
        if n != radii {
            let message = format!("has {n} values for {radii} radii");
            return Err(SpecError::Table { part: TablePart::Radial, row: n.min(radii), field, message });
        }
        match values.iter().enumerate().find(|&(row, &value)| !is_good(row, value)) {
            Some((row, value)) => {
                let message = format!("is {value}, which is out of its range");
                Err(SpecError::Table { part: TablePart::Radial, row, field, message })
            }
            None => Ok(()),
        }
    }
}

/// Refuses radii that are too few or too many, do not grow, or do not reach from the hub outward.
fn check_radii(part: TablePart, radii: &[f64], hub_ratio: f64, reach: f64) -> Result<(), SpecError> {
    let wrong = |row: usize, message: String| Err(SpecError::Table { part, row, field: "radius r/R", message });
    let n = radii.len();
    if !(LEAST_RADII..=MOST_ROWS).contains(&n) {
        return wrong(n.min(MOST_ROWS), format!("is there {n} times; write {LEAST_RADII} to {MOST_ROWS} radii"));
    }
    if let Some(row) = radii.iter().position(|r| !(*r > 0.0 && *r <= 1.0 + ROUNDING)) {
        return wrong(row, format!("is {}; it lies between 0 and 1", radii[row]));
    }
    if let Some(row) = (1..n).find(|&row| radii[row] - radii[row - 1] < 1e-6) {
        return wrong(row, format!("is {} after {}; order the rows from hub to tip", radii[row], radii[row - 1]));
    }
    if radii[0] > hub_ratio + ROUNDING {
        return wrong(0, format!("is {}, outside the hub's {hub_ratio}; add a row at the hub or below", radii[0]));
    }
    if radii[n - 1] < reach - ROUNDING {
        return wrong(n - 1, format!("ends at {}; add rows up to {reach}", radii[n - 1]));
    }
    Ok(())
}

impl SectionOffsets {
    fn check(&self, hub_ratio: f64) -> Result<(), SpecError> {
        check_radii(TablePart::Sections, &self.radii, hub_ratio, OFFSETS_REACH)?;
        let (n, sections) = (self.stations.len(), self.radii.len());
        let wrong = |row: usize, field: &'static str, message: String| {
            Err(SpecError::Table { part: TablePart::Sections, row, field, message })
        };
        let field = "chord fraction x/c";
        if !(LEAST_STATIONS..=MOST_ROWS).contains(&n) {
            return wrong(0, field, format!("is there {n} times; write {LEAST_STATIONS} to {MOST_ROWS} stations"));
        }
        if self.stations[0] != 0.0 || self.stations[n - 1] != 1.0 {
            let [first, last] = [self.stations[0], self.stations[n - 1]];
            return wrong(0, field, format!("runs from {first} to {last}; give both edges, 0 and 1"));
        }
        if let Some(k) = (1..n).find(|&k| is_not_above(self.stations[k] - self.stations[k - 1], 1e-6)) {
            let [before, here] = [self.stations[k - 1], self.stations[k]];
            return wrong(k, field, format!("is {here} after {before}; order the stations by x/c"));
        }
        if n * sections > MOST_OFFSETS {
            return wrong(0, "ordinate", format!("is there {} times; write {MOST_OFFSETS} at most", n * sections));
        }
        let is_complete = |rows: &[Vec<f64>]| rows.len() == sections && rows.iter().all(|row| row.len() == n);
        if !is_complete(&self.suction) || !is_complete(&self.pressure) {
            return wrong(0, "ordinate", format!("is missing; each of {sections} sections has {n} stations"));
        }
        for (section, (suction, pressure)) in self.suction.iter().zip(&self.pressure).enumerate() {
            for (station, (high, low)) in suction.iter().zip(pressure).enumerate() {
                let row = section * n + station;
                if !(high.abs() <= 1.0 && low.abs() <= 1.0) {
                    return wrong(row, "ordinate", format!("is {high} and {low}; it lies between -1 and 1"));
                }
                let is_edge = station == 0 || station + 1 == n;
                if high < low || high == low && !is_edge {
                    let message = format!("is {high} on the suction and {low} on the pressure side, without thickness");
                    return wrong(row, "ordinate", message);
                }
            }
        }
        Ok(())
    }
}
