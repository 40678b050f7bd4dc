//! Chip areas of many cases from a table of comma-separated values.
//!
//! The first line that is neither empty nor a comment (`#`) names the columns, in any order:
//!
//! | column | value |
//! |---|---|
//! | `radius_mm`, `corner_radius_mm` | of the cutter |
//! | `surface` | `plane`, `convex` or `concave` |
//! | `surface_radius_mm` | of the surface; empty for a plane |
//! | `depth_of_cut_mm` | thickness of the stock |
//! | `left`, `right` | neighbour, seen along the feed: `stock`, `cut` or `border` |
//! | `left_mm`, `right_mm` | step-over of `cut`, distance of `border`; empty for `stock` |
//! | `lead_deg`, `lean_deg` | axis along and across the feed (toward the left); 0 where empty or without the column |
//! | `neighbour_axis` | of the passes at `cut`: `parallel` to this one's, or `turned` with the surface; `parallel` where empty |
//! | `name` | a text of your own |
//!
//! `surface_radius_mm`, `left_mm` and `right_mm` may be left out where no line needs them. Cells
//! may be in quotation marks. Every line is one case.
//!
//! ```
//! let table = "radius_mm,corner_radius_mm,surface,depth_of_cut_mm,left,right,right_mm,lead_deg\n\
//!              40,6,plane,2,stock,cut,30,5\n\
//!              40,6,plane,2,stock,stock,,5\n";
//! let rows = facemill_chip_area::pass::table::chips_of_table(table)?;
//! assert_eq!(rows[1].line, 3);
//! assert!(rows[1].chip.area > rows[0].chip.area);
//! # Ok::<(), facemill_chip_area::pass::table::TableError>(())
//! ```

use crate::pass::error::PassError;
use crate::pass::{
    Beside, ChipArea, CutterEnd, Engagement, Method, NeighbourAxis, Orientation, PassSection, chip_of_pass,
};
use crate::section::SectionSurface;

pub use crate::pass::table_error::TableError;

/// A case of a table with its chip.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TableRow {
    /// Its line, from 1.
    pub line: usize,
    /// Section that the line describes.
    pub section: PassSection,
    /// The chip's area.
    pub chip: ChipArea,
}

const RADIUS: &str = "radius_mm";

const CORNER_RADIUS: &str = "corner_radius_mm";

const SURFACE: &str = "surface";

const SURFACE_RADIUS: &str = "surface_radius_mm";

const DEPTH_OF_CUT: &str = "depth_of_cut_mm";

const LEFT: &str = "left";

const LEFT_MM: &str = "left_mm";

const RIGHT: &str = "right";

const RIGHT_MM: &str = "right_mm";

const LEAD: &str = "lead_deg";

const LEAN: &str = "lean_deg";

const NEIGHBOUR_AXIS: &str = "neighbour_axis";

const NAME: &str = "name";

const COLUMNS: [&str; 12] = [
    RADIUS,
    CORNER_RADIUS,
    SURFACE,
    SURFACE_RADIUS,
    DEPTH_OF_CUT,
    LEFT,
    LEFT_MM,
    RIGHT,
    RIGHT_MM,
    LEAD,
    LEAN,
    NEIGHBOUR_AXIS,
];

const REQUIRED: [&str; 6] = [RADIUS, CORNER_RADIUS, SURFACE, DEPTH_OF_CUT, LEFT, RIGHT];

/// Returns the chip areas of all cases of a table, in its order.
///
/// # Errors
/// The first line that cannot be read or has no chip area: see [`TableError`].
pub fn chips_of_table(text: &str) -> Result<Vec<TableRow>, TableError> {
    let mut lines = content_lines(text);
    let Some((line, header)) = lines.next() else {
        return Err(TableError::NoHeader { known: REQUIRED.join(",") });
    };
    let columns = columns(line, header)?;
    let header_line = line;
    let rows: Vec<TableRow> = lines
        .map(|(line, text)| {
            let cells = cells(line, text)?;
            if cells.len() != columns.len() {
                return Err(TableError::CellCount { line, expected: columns.len(), found: cells.len() });
            }
            let row = Row { line, columns: &columns, cells: &cells };
            let section = row.section()?;
            let chip = chip_of_pass(&section).map_err(|source| TableError::Section {
                line,
                column: column_of(&source),
                source,
            })?;
            Ok(TableRow { line, section, chip })
        })
        .collect::<Result<_, TableError>>()?;
    if rows.is_empty() { Err(TableError::NoCase { line: header_line }) } else { Ok(rows) }
}

/// Returns the table with three more columns: `area_mm2`, `error_bound_mm2` and `method`
/// (`closed-form`, `iterated-crossings` or `quadrature`); comments and empty lines are kept.
///
/// # Errors
/// As [`chips_of_table`].
pub fn table_with_areas(text: &str) -> Result<String, TableError> {
    let rows = chips_of_table(text)?;
    let header = content_lines(text).next().map(|(line, _)| line);
    let mut rows = rows.iter().peekable();
    let mut out = String::with_capacity(2 * text.len());
    for (i, line) in text.lines().enumerate() {
        out.push_str(line.trim_end());
        if header == Some(i + 1) {
            out.push_str(",area_mm2,error_bound_mm2,method");
        } else if let Some(row) = rows.next_if(|row| row.line == i + 1) {
            let method = match row.chip.method {
                Method::ClosedForm => "closed-form",
                Method::IteratedCrossings => "iterated-crossings",
                Method::Quadrature => "quadrature",
            };
            let (area, bound) = (plain(row.chip.area), row.chip.error_bound);
            out.push_str(&format!(",{area},{bound:e},{method}"));
        }
        out.push('\n');
    }
    Ok(out)
}

/// Outside this range numbers have exponents: they would be rows of zeros.
const PLAIN: [f64; 2] = [1e-9, 1e12];

/// Returns all digits of a number, with an exponent where it is very large or very small, and 0
/// without a sign.
fn plain(value: f64) -> String {
    let size = value.abs();
    if size == 0.0 {
        return "0".to_owned();
    }
    if (PLAIN[0]..PLAIN[1]).contains(&size) { value.to_string() } else { format!("{value:e}") }
}

/// Returns lines with content and their numbers.
fn content_lines(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let lines = text.lines().enumerate().map(|(i, line)| (i + 1, line.trim()));
    lines.filter(|(_, line)| !line.is_empty() && !line.starts_with('#'))
}

/// Returns the names of the columns, checked.
fn columns(line: usize, header: &str) -> Result<Vec<&'static str>, TableError> {
    let mut columns = Vec::new();
    for cell in cells(line, header)? {
        let Some(column) = COLUMNS.into_iter().chain([NAME]).find(|column| *column == cell) else {
            return Err(TableError::UnknownColumn { line, column: cell, known: COLUMNS.join(", ") });
        };
        if columns.contains(&column) {
            return Err(TableError::RepeatedColumn { line, column });
        }
        columns.push(column);
    }
    match REQUIRED.into_iter().find(|column| !columns.contains(column)) {
        Some(column) => Err(TableError::MissingColumn { line, column }),
        None => Ok(columns),
    }
}

/// Returns the cells of a line, without blanks around them and without quotation marks.
fn cells(line: usize, text: &str) -> Result<Vec<String>, TableError> {
    let mut cells = Vec::new();
    let mut rest = text;
    loop {
        rest = rest.trim_start();
        if let Some(quoted) = rest.strip_prefix('"') {
            let end = closing_quote(quoted).ok_or(TableError::Quotes { line })?;
            cells.push(quoted[..end].replace("\"\"", "\""));
            rest = quoted[end + 1..].trim_start();
        } else {
            let end = rest.find(',').unwrap_or(rest.len());
            let cell = rest[..end].trim_end();
            if cell.contains('"') {
                return Err(TableError::Quotes { line });
            }
            cells.push(cell.to_owned());
            rest = &rest[end..];
        }
        match rest.strip_prefix(',') {
            Some(more) => rest = more,
            None if rest.is_empty() => return Ok(cells),
            None => return Err(TableError::Quotes { line }),
        }
    }
}

/// Returns the place of the mark that ends a quoted cell; two in a row represent one inside it.
fn closing_quote(quoted: &str) -> Option<usize> {
    let mut from = 0;
    loop {
        let at = from + quoted[from..].find('"')?;
        if !quoted[at + 1..].starts_with('"') {
            return Some(at);
        }
        from = at + 2;
    }
}

/// A line of the table.
struct Row<'a> {
    line: usize,
    columns: &'a [&'static str],
    cells: &'a [String],
}

impl Row<'_> {
    fn section(&self) -> Result<PassSection, TableError> {
        Ok(PassSection {
            cutter: CutterEnd {
                radius: self.number(RADIUS, "every cutter has one")?,
                corner_radius: self.number(CORNER_RADIUS, "a flat end has 0")?,
            },
            surface: self.surface()?,
            engagement: Engagement {
                depth_of_cut: self.number(DEPTH_OF_CUT, "there is stock of some thickness")?,
                left: self.beside(LEFT, LEFT_MM)?,
                right: self.beside(RIGHT, RIGHT_MM)?,
            },
            orientation: Orientation { lead: self.angle(LEAD)?, lean: self.angle(LEAN)? },
            neighbour_axis: match self.cell(NEIGHBOUR_AXIS) {
                "" | "parallel" => NeighbourAxis::Parallel,
                "turned" => NeighbourAxis::Turned,
                text => return Err(self.unknown(NEIGHBOUR_AXIS, text, "parallel, turned")),
            },
        })
    }

    /// Returns the cell of a column; empty without one.
    fn cell(&self, column: &str) -> &str {
        let place = self.columns.iter().position(|name| *name == column);
        place.map_or("", |i| &self.cells[i])
    }

    fn number(&self, column: &'static str, reason: &'static str) -> Result<f64, TableError> {
        let text = self.cell(column);
        if text.is_empty() {
            return Err(TableError::Empty { line: self.line, column, reason });
        }
        text.parse().map_err(|_| TableError::NotANumber { line: self.line, column, text: text.to_owned() })
    }

    /// Returns an angle, rad.
    fn angle(&self, column: &'static str) -> Result<f64, TableError> {
        if self.cell(column).is_empty() { Ok(0.0) } else { Ok(self.number(column, "")?.to_radians()) }
    }

    fn surface(&self) -> Result<SectionSurface, TableError> {
        let radius = || self.number(SURFACE_RADIUS, "a curved surface has a radius");
        match self.cell(SURFACE) {
            "plane" => {
                self.unused(SURFACE_RADIUS, "a plane has no radius")?;
                Ok(SectionSurface::Plane)
            }
            "convex" => Ok(SectionSurface::Convex { radius: radius()? }),
            "concave" => Ok(SectionSurface::Concave { radius: radius()? }),
            text => Err(self.unknown(SURFACE, text, "plane, convex, concave")),
        }
    }

    fn beside(&self, kind: &'static str, length: &'static str) -> Result<Beside, TableError> {
        match self.cell(kind) {
            "stock" => {
                self.unused(length, "stock has no end there")?;
                Ok(Beside::Stock)
            }
            "cut" => Ok(Beside::Cut { step_over: self.number(length, "the pass there has a step-over")? }),
            "border" => Ok(Beside::Border { distance: self.number(length, "the border is at a distance")? }),
            text => Err(self.unknown(kind, text, "stock, cut, border")),
        }
    }

    fn unused(&self, column: &'static str, reason: &'static str) -> Result<(), TableError> {
        match self.cell(column) {
            "" => Ok(()),
            text => Err(TableError::NotUsed { line: self.line, column, text: text.to_owned(), reason }),
        }
    }

    fn unknown(&self, column: &'static str, text: &str, known: &'static str) -> TableError {
        TableError::UnknownWord { line: self.line, column, text: text.to_owned(), known }
    }
}

/// Returns the column of an error, where there is one.
fn column_of(error: &PassError) -> Option<&'static str> {
    let field = match *error {
        PassError::NotFinite { field, .. }
        | PassError::NotPositive { field, .. }
        | PassError::Negative { field, .. }
        | PassError::OutOfRange { field, .. }
        | PassError::AxisNotAbove { field, .. }
        | PassError::TooFarAround { field, .. }
        | PassError::StepBeyondCutter { field, .. } => field,
        PassError::CornerTooLarge { .. } | PassError::CornerDoesNotFit { .. } => "cutter.corner_radius",
        PassError::DepthReachesCentre { .. } => "engagement.depth_of_cut",
        PassError::BelowSurface { .. } => return None,
    };
    match field {
        "cutter.radius" => Some(RADIUS),
        "cutter.corner_radius" => Some(CORNER_RADIUS),
        "surface.radius" => Some(SURFACE_RADIUS),
        "engagement.depth_of_cut" => Some(DEPTH_OF_CUT),
        "engagement.left.step_over" | "engagement.left.distance" => Some(LEFT_MM),
        "engagement.right.step_over" | "engagement.right.distance" => Some(RIGHT_MM),
        "orientation.lead" => Some(LEAD),
        "orientation.lean" => Some(LEAN),
        _ => None,
    }
}
