use std::fmt::Write;

use facemill_cl_data::ClPoint;

use crate::apt_file::{AptMove, AptSpec};
use facemill_nc_program::Coolant;
use facemill_nc_program::SpindleSpec;
use facemill_nc_program::WriteError;
use facemill_nc_program::words::number_text;

/// Decimals of tip coordinates, mm: the written tip is at most 0.9e-9 mm from the given one. With
/// seven it is 0.09e-6 mm, which turns the last of six decimals of every tenth word.
const TIP_DECIMALS: u8 = 9;

/// Decimals of axis components: the written axis is at most 0.9e-12 rad from the given one, which
/// moves an axis of the machine 1 m away by 0.9e-9 mm, and by less than 0.9e-6 mm down to 0.06°
/// from the pole, where the axis nearest to the workpiece turns a thousand times as far. With ten
/// it is 0.9e-6 mm at 6° from the pole.
const AXIS_DECIMALS: u8 = 12;

/// Decimals of the measures of the cutter, mm.
const CUTTER_DECIMALS: u8 = 5;

/// Number of columns of a statement; longer ones are continued behind `$`.
const LINE_LENGTH: usize = 72;

/// Writes the APT file, with `\n` line ends: tip (1e-9 mm) and axis (1e-12) in the workpiece frame,
/// tip feeds in mm/min. Axis values of a machine from its points are within 1e-6 mm of those from
/// the given ones, with the tip up to 1 m from its rotary axes and 0.06° from its pole.
///
/// # Errors
/// When a number is not finite or too large, or a feed or speed is not positive.
pub fn write_apt(spec: &AptSpec) -> Result<String, WriteError> {
    let mut writer = AptWriter { text: String::with_capacity(256 + 110 * spec.moves.len()), feed: None };
    writer.header(spec)?;
    for (index, step) in spec.moves.iter().enumerate() {
        match step {
            AptMove::Comment(text) => writer.free_text("PPRINT/", text),
            AptMove::Spindle(spindle) => writer.spindle(*spindle)?,
            AptMove::Coolant(coolant) => writer.coolant(*coolant),
            AptMove::Rapid(cl) => {
                writer.line("RAPID");
                writer.goto(index, cl)?;
            }
            AptMove::Linear { cl, feed } => {
                writer.feed(index, *feed)?;
                writer.goto(index, cl)?;
            }
        }
    }
    writer.line("COOLNT/OFF");
    writer.line("SPINDL/OFF");
    writer.line("FINI");
    Ok(writer.text)
}

struct AptWriter {
    text: String,
    /// FEDRAT in force.
    feed: Option<String>,
}

impl AptWriter {
    fn header(&mut self, spec: &AptSpec) -> Result<(), WriteError> {
        self.free_text("PARTNO/", &spec.part_name);
        self.line("UNITS/MM");
        self.line("MULTAX/ON");
        // Diameter, corner radius, its centre's distance from the axis and height over the tip, two
        // angles, height.
        let (radius, corner) = (spec.cutter.radius, spec.cutter.corner_radius);
        let values = [2.0 * radius, corner, radius - corner, corner, 0.0, 0.0, spec.cutter.height];
        let fault = |value| WriteError::Number { place: "cutter".to_owned(), what: "a length", value };
        let values = values.map(|v| number_text::number(v, CUTTER_DECIMALS, false).ok_or_else(|| fault(v)));
        let values = values.into_iter().collect::<Result<Vec<_>, _>>()?;
        self.statement("CUTTER/", &values);
        self.line(&format!("LOADTL/{}", spec.tool_number));
        self.spindle(spec.spindle)?;
        self.coolant(spec.coolant);
        Ok(())
    }

    fn spindle(&mut self, spindle: SpindleSpec) -> Result<(), WriteError> {
        let rpm = number_text::number(spindle.rpm, 1, false).filter(|_| spindle.rpm >= 0.05);
        let rpm = rpm.ok_or_else(|| WriteError::Number {
            place: "spindle.rpm".to_owned(),
            what: "a spindle speed",
            value: spindle.rpm,
        })?;
        self.line(&format!("SPINDL/{rpm},RPM,{}", if spindle.clockwise { "CLW" } else { "CCLW" }));
        Ok(())
    }

    fn coolant(&mut self, coolant: Coolant) {
        self.line(match coolant {
            Coolant::Off => "COOLNT/OFF",
            Coolant::Flood => "COOLNT/FLOOD",
            Coolant::Mist => "COOLNT/MIST",
        });
    }

    fn feed(&mut self, index: usize, feed: f64) -> Result<(), WriteError> {
        let text = number_text::number(feed, 3, false).filter(|_| feed >= 0.0005);
        let text = text.ok_or_else(|| WriteError::Number {
            place: format!("move {index}"),
            what: "a feed in mm/min",
            value: feed,
        })?;
        if self.feed.as_ref() != Some(&text) {
            self.line(&format!("FEDRAT/{text},MMPM"));
            self.feed = Some(text);
        }
        Ok(())
    }

    fn goto(&mut self, index: usize, cl: &ClPoint) -> Result<(), WriteError> {
        let tip = cl.tip.coords.iter().map(|v| number_text::number(*v, TIP_DECIMALS, false));
        let axis = cl.axis.iter().map(|v| number_text::number(*v, AXIS_DECIMALS, false));
        let values: Option<Vec<String>> = tip.chain(axis).collect();
        self.statement("GOTO/", &values.ok_or(WriteError::Coordinate { index })?);
        Ok(())
    }

    fn statement(&mut self, word: &str, values: &[String]) {
        let mut length = word.len();
        self.text.push_str(word);
        for (k, value) in values.iter().enumerate() {
            if k > 0 {
                self.text.push(',');
                length += 1;
            }
            // Two columns are kept for the comma and the continuation mark behind it.
            let behind = if k + 1 < values.len() { 2 } else { 0 };
            if length + value.len() + behind > LINE_LENGTH {
                self.text.push_str("$\n");
                length = 0;
            }
            self.text.push_str(value);
            length += value.len();
        }
        self.text.push('\n');
    }

    fn free_text(&mut self, word: &str, text: &str) {
        // `$` would continue the line; characters outside ASCII may be unreadable.
        let clean = |c: char| match c {
            '$' => '?',
            c if c == ' ' || c.is_ascii_graphic() => c,
            c if c.is_whitespace() => ' ',
            _ => '?',
        };
        self.text.push_str(word);
        self.text.extend(text.chars().map(clean));
        self.text.push('\n');
    }

    fn line(&mut self, text: &str) {
        // Writing to a String cannot fail.
        let _ = writeln!(self.text, "{text}");
    }
}
