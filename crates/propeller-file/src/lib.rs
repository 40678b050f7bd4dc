//! Propeller tables as CSV, JSON (`facemill-propeller/1`) and OpenProp text.
//!
//! [`read_propeller`] recognises the form by its content and reads a [`PropellerFile`]: diameter,
//! and a [`facemill_sample_parts::PropellerTable`] with a row for each radius and the sections.
//! [`PropellerFile::spec`] is the propeller at a diameter. [`PropellerJson`] is the JSON file. A
//! [`PropellerFileError`] names file, row, column and remedy.
//!
//! The forms are described in `docs/formats.md`; all have the same columns.
//!
//! ```
//! use facemill_propeller_file::read_propeller;
//!
//! let csv = "# diameter_mm: 250\n# blades: 4\n# hand: right\n# hub_ratio: 0.2\n# section: naca66_a08\n\
//!            r_R,c_D,P_D,t_c,f_c\n0.2,0.2,1,0.2,0.02\n0.5,0.3,1,0.1,0.02\n0.8,0.3,1,0.05,0.02\n1,0.1,1,0.04,0.02\n";
//! let file = read_propeller("own.csv", csv.as_bytes()).unwrap();
//! assert_eq!((file.diameter_mm, file.table.n_blades), (250.0, 4));
//! assert_eq!(file.spec(None).unwrap().hub_radius(), 25.0);
//!
//! let wrong = read_propeller("own.csv", csv.replace("0.05", "thin").as_bytes()).unwrap_err();
//! assert!(wrong.to_string().starts_with("own.csv, line 9, column \"t_c\": "));
//! ```
//!
//! Guaranteed: numbers are finite; time and memory grow with the size of the file at most. It
//! opens no file.
//!
//! Modules; each imports only those above it:
//!
//! | module | holds |
//! |---|---|
//! | `fault` | faults with file, row and column |
//! | `text` | lines and numbers of text files |
//! | `columns` | columns of tables: their names, quantities and units |
//! | `raw_table` | tables as they are written: named columns, and rows of numbers with their places |
//! | `propeller` | propellers of files: tables and particulars together |
//! | `csv_file` | tables as CSV |
//! | `json_file` | tables as JSON |
//! | `openprop_file` | geometry tables that OpenProp writes |
//!
//! It must not know jobs and machines.

mod columns;
mod csv_file;
mod fault;
mod json_file;
mod openprop_file;
mod propeller;
mod raw_table;
mod text;

pub use fault::{PropellerFault, PropellerFileError, RowPlace};
pub use json_file::{PropellerFormat, PropellerHand, PropellerJson, PropellerSection, RadialRow, SectionRow};
pub use propeller::PropellerFile;
pub use raw_table::{MAX_OFFSETS, MAX_RADII};

/// Reads a propeller: JSON that begins with `{`, a geometry table of OpenProp, or CSV; `file` is
/// the name in errors.
///
/// # Errors
/// If the file describes no propeller; names row and column.
pub fn read_propeller(file: &str, bytes: &[u8]) -> Result<PropellerFile, PropellerFileError> {
    read_propeller_with(file, bytes, None)
}

/// Reads a propeller as [`read_propeller`] does. `diameter_mm` is the diameter of a file that gives
/// none; that of a file counts before it ([`PropellerFile::spec`] scales).
///
/// # Errors
/// As [`read_propeller`], and if the diameter is needed and out of range.
pub fn read_propeller_with(
    file: &str,
    bytes: &[u8],
    diameter_mm: Option<f64>,
) -> Result<PropellerFile, PropellerFileError> {
    let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes).trim_ascii_start();
    if text.starts_with(b"{") {
        json_file::read(file, bytes, diameter_mm)
    } else if text.starts_with(b"[") {
        // Lists in lists, as deep as they may be, are no header line.
        Err(PropellerFault::WrongTables("is no table: JSON of a propeller is an object, in { }").of(file))
    } else if openprop_file::is_openprop(bytes) {
        openprop_file::read(file, bytes)
    } else {
        csv_file::read(file, bytes, diameter_mm)
    }
}
