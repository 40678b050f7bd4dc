use nalgebra::{Isometry3, Point3, Unit, Vector3};

use crate::import::joint_lines::walk;
use crate::machine_file::axis_lines::AxisLine;
use crate::machine_file::{DhRow, Joint, MachineFile};
use crate::measured::family::{MeasuredFamily, MeasuredLean};
use crate::measured::{MeasureError, ReportedValue};

/// Places of table and axes, all rotary axes at 0, in mm along the machine's X, Y, Z by ISO 841.
///
/// `table_at` has readings, in the sense in which each axis counts. The others are lengths along
/// ISO's X, Y, Z: on a reversed axis a difference of readings is one with its sign turned.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PlaceMeasurements {
    /// Readings of X, Y, Z at which the centre of the spindle nose (the gauge line) is on the
    /// table's origin, those of a reversed axis as it counts. The origin of a turning table is on
    /// its C axis.
    pub table_at: Option<[f64; 3]>,
    /// A point on the tilting axis of a trunnion, seen from the table's origin. The coordinate
    /// along the axis has no effect.
    pub table_tilt: Option<[f64; 3]>,
    /// Distance from the spindle nose up to the tilting axis of a head, along the spindle: above 0.
    /// To an axis at 45° it is that where the axis crosses the spindle.
    pub pivot_length: Option<f64>,
    /// Position of a head's tilting axis beside the spindle's centre line: toward +X of a B axis,
    /// toward +Y of an A axis.
    pub pivot_offset: Option<f64>,
    /// Position in X and Y of the C axis of a fork, seen from the spindle's centre line.
    pub c_offset: Option<[f64; 2]>,
    /// Direction toward which a tilting axis at 45° leans.
    pub lean: Option<MeasuredLean>,
}

/// Largest length, mm: that of machine files.
const LARGEST: f64 = 1e6;

/// Lines of a machine's axes and ends of its chains, all axes at 0, in the bed's frame.
pub(crate) struct Lines {
    family: MeasuredFamily,
    pub(crate) table: Vec<AxisLine>,
    pub(crate) head: Vec<AxisLine>,
    table_origin: Vector3<f64>,
    nose: Vector3<f64>,
}

impl Lines {
    /// Reads the lines of a family's preset. Table and nose have the bed's directions there.
    pub(crate) fn of(family: MeasuredFamily, preset: &MachineFile) -> Self {
        let (table, table_origin) = lines(&preset.workpiece_chain.rows);
        let (head, nose) = lines(&preset.tool_chains[0].rows);
        Self { family, table, head, table_origin, nose }
    }

    pub(crate) fn bed_from_table(&self) -> Isometry3<f64> {
        Isometry3::translation(self.table_origin.x, self.table_origin.y, self.table_origin.z)
    }

    pub(crate) fn bed_from_nose(&self) -> Isometry3<f64> {
        Isometry3::translation(self.nose.x, self.nose.y, self.nose.z)
    }

    pub(crate) fn joints(&mut self) -> impl Iterator<Item = &mut Joint> {
        self.table.iter_mut().chain(&mut self.head).map(|line| &mut line.joint)
    }

    fn point_of(&self, axis: &str) -> Vector3<f64> {
        let line = self.table.iter().chain(&self.head).find(|line| line.joint.axis() == axis);
        line.map_or_else(Vector3::zeros, |line| line.point.coords)
    }

    fn put(&mut self, axis: &str, point: Vector3<f64>) {
        let lines = self.table.iter_mut().chain(&mut self.head);
        lines.filter(|line| line.joint.axis() == axis).for_each(|line| line.point = Point3::from(point));
    }

    /// Leans an axis toward +y or −y, by the angle that it has. The letter's direction keeps its
    /// share of +y, so that a turn by +B takes the spindle toward +x for either lean, as ISO 841
    /// has it: the other lean points down.
    fn lean(&mut self, axis: &str, lean: MeasuredLean) {
        let sign = if lean == MeasuredLean::PlusY { 1.0 } else { -1.0 };
        for line in self.table.iter_mut().chain(&mut self.head).filter(|line| line.joint.axis() == axis) {
            let d = line.direction;
            line.direction = Unit::new_unchecked(Vector3::new(d.x, d.y.abs(), sign * d.z.abs()));
        }
    }

    /// Moves table, nose and axes to the measured places. `signs` has −1 for each of X, Y, Z whose
    /// readings grow against ISO 841, else 1. Returns all places of the family, and the
    /// axes whose places nobody measured.
    pub(crate) fn measure(
        &mut self,
        measured: &PlaceMeasurements,
        signs: Vector3<f64>,
    ) -> Result<(Vec<ReportedValue>, Vec<String>), MeasureError> {
        self.check(measured)?;
        let tilting = self.family.tilting_axis();
        let tilt = self.point_of(tilting);
        let turn = self.point_of("C");
        let places = self.family.places();
        let has = |key: &str| places.contains(&key);
        let mut values = Vec::new();
        let mut unmeasured: Vec<&str> = Vec::new();
        let mut resolve = |key: &'static str, given: Option<Vec<f64>>, preset: &[f64], axes: &[&'static str]| {
            let is_measured = given.is_some();
            let value = given.unwrap_or_else(|| preset.to_vec());
            let text = value.iter().map(|v| (v + 0.0).to_string()).collect::<Vec<_>>().join(",");
            values.push(ReportedValue { key, text, is_measured });
            if !is_measured {
                unmeasured.extend(axes);
            }
            value
        };

        let table_at = (self.table_origin - self.nose).component_mul(&signs);
        let at = resolve("table_at", measured.table_at.map(Vec::from), table_at.as_slice(), &["X", "Y", "Z"]);
        let nose = self.table_origin - Vector3::from_column_slice(&at).component_mul(&signs);
        if has("table_tilt") {
            let preset = tilt - self.table_origin;
            let from_table = resolve("table_tilt", measured.table_tilt.map(Vec::from), preset.as_slice(), &[tilting]);
            self.put(tilting, self.table_origin + Vector3::from_column_slice(&from_table));
        } else {
            let preset = tilt - self.nose;
            let beside = if tilting == "A" { 1 } else { 0 };
            let length = resolve("pivot_length", measured.pivot_length.map(|v| vec![v]), &[preset.z], &[tilting]);
            let offset = measured.pivot_offset.map(|v| vec![v]);
            let offset = resolve("pivot_offset", offset, &[preset[beside]], &[tilting]);
            let mut from_nose = Vector3::new(0.0, 0.0, length[0]);
            from_nose[beside] = offset[0];
            self.put(tilting, nose + from_nose);
        }
        if has("c_offset") {
            let preset = turn - self.nose;
            let offset = resolve("c_offset", measured.c_offset.map(Vec::from), &[preset.x, preset.y], &["C"]);
            self.put("C", nose + Vector3::new(offset[0], offset[1], 0.0));
        }
        if has("lean") {
            let lean = measured.lean.unwrap_or(MeasuredLean::PlusY);
            values.push(ReportedValue {
                key: "lean",
                text: lean.name().to_owned(),
                is_measured: measured.lean.is_some(),
            });
            if measured.lean.is_none() {
                unmeasured.push(tilting);
            }
            self.lean(tilting, lean);
        }
        unmeasured.dedup();
        let unmeasured = unmeasured.into_iter().map(str::to_owned).collect();
        self.nose = nose;
        Ok((values, unmeasured))
    }

    /// Refuses places that the family lacks, and lengths that no machine has.
    fn check(&self, measured: &PlaceMeasurements) -> Result<(), MeasureError> {
        let given: [(&'static str, Option<&[f64]>); 5] = [
            ("table_at", measured.table_at.as_ref().map(|v| &v[..])),
            ("table_tilt", measured.table_tilt.as_ref().map(|v| &v[..])),
            ("pivot_length", measured.pivot_length.as_ref().map(std::slice::from_ref)),
            ("pivot_offset", measured.pivot_offset.as_ref().map(std::slice::from_ref)),
            ("c_offset", measured.c_offset.as_ref().map(|v| &v[..])),
        ];
        for (key, value) in given {
            let Some(value) = value else { continue };
            if !self.family.places().contains(&key) {
                let known = self.family.places().join(", ");
                return Err(MeasureError::NotOfFamily { key, family: self.family, known });
            }
            if let Some(&value) = value.iter().find(|v| v.is_nan() || v.abs() > LARGEST) {
                return Err(MeasureError::Length { key, value, most: LARGEST });
            }
        }
        if measured.lean.is_some() && !self.family.places().contains(&"lean") {
            let known = self.family.places().join(", ");
            return Err(MeasureError::NotOfFamily { key: "lean", family: self.family, known });
        }
        match measured.pivot_length {
            Some(value) if value <= 0.0 => Err(MeasureError::PivotLength { value }),
            _ => Ok(()),
        }
    }
}

/// Returns the lines of a chain's joints and the origin at its end.
fn lines(rows: &[DhRow]) -> (Vec<AxisLine>, Vector3<f64>) {
    let (joints, end) = walk(rows);
    let line = |(joint, _, frame): (Joint, usize, Isometry3<f64>)| AxisLine {
        joint,
        direction: Unit::new_normalize((frame.rotation * Vector3::z()).map(short)),
        point: Point3::from(frame.translation.vector.map(short)),
        bodies: Vec::new(),
    };
    (joints.into_iter().map(line).collect(), end.translation.vector.map(short))
}

/// Removes the rounding of turns by 90° from a number of a preset, which has few digits.
fn short(value: f64) -> f64 {
    (value * 1e9).round() / 1e9 + 0.0
}
