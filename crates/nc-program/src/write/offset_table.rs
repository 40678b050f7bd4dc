//! Work offsets in the form that a control loads.

use crate::dialect::TableForm;
use crate::dialect::post_file::PostSettings;
use crate::program::WorkOffset;
use crate::program::spec::AxisSpec;
use crate::program::write_error::WriteError;
use crate::words::axis_words::AxisKind;
use crate::words::number_text;
use crate::write::text::{clean_comment, comment_pieces};

/// A table or a program that fills one.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct WrittenTable {
    /// Ending of its file, without the point.
    pub extension: String,
    /// The text, with `\n` line ends.
    pub text: String,
}

/// Writes the work offset that programs refer to as the control loads it: the machine value of each
/// axis where the program's words are 0, mm and deg, rounded as the program's header says it.
///
/// LinuxCNC and G10 controls: a program of G10 L2 (L20 for additional offsets), LinuxCNC's with R0.
/// Siemens: a subprogram that sets the whole frame `$P_UIFR[n]` in mm (G710), so that no rotation
/// or fine offset stays. Heidenhain: a row of PRESET.PR, columns NO, DOC, X, Y, Z, SPA, SPB, SPC,
/// and `…_OFFS` of each other axis.
///
/// # Errors
/// If the dialect has no such form or offset, or a value fits no word.
pub fn write_work_offset(
    name: &str,
    offset: WorkOffset,
    axes: &[AxisSpec],
    settings: &PostSettings,
) -> Result<WrittenTable, WriteError> {
    let absent = |what: &str| WriteError::NotInDialect {
        place: "work offset table".to_owned(),
        what: what.to_owned(),
        name: settings.rules.name.clone(),
    };
    let form = settings.rules.tables.ok_or_else(|| absent("form of tables"))?;
    let (word, _) = settings.rules.work_offset_words(offset).ok_or_else(|| absent(&offset.to_string()))?;
    let value = |axis: &AxisSpec| {
        let decimals = settings.decimals.of(axis.letter.kind());
        number_text::number(axis.work_offset, decimals, false).ok_or_else(|| WriteError::Number {
            place: format!("work offset of {}", axis.letter),
            what: "an offset",
            value: axis.work_offset,
        })
    };
    let values: Vec<(&AxisSpec, String)> =
        axes.iter().map(|axis| Ok((axis, value(axis)?))).collect::<Result<_, WriteError>>()?;
    let comments = &settings.rules.comments;
    let title = clean_comment(&format!("work offset {word} of {name}"), comments);
    let limit = settings.max_line_length.saturating_sub(comments.open.len() + comments.close.len() + 16);
    let title = comment_pieces(&title, limit).first().copied().unwrap_or_default();
    let axis_words = || -> String {
        let word = |(axis, value): &(&AxisSpec, String)| match axis.letter.number() {
            0 => format!(" {}{value}", axis.letter),
            _ => format!(" {}={value}", axis.letter),
        };
        values.iter().map(word).collect()
    };
    let extension = settings.extension().to_owned();
    Ok(match form {
        TableForm::G10 => {
            let register = match offset.number() {
                n @ 1..=6 => format!("L2 P{n}"),
                n => format!("L20 P{}", n - 6),
            };
            let (number, words) = (settings.program_number, axis_words());
            let digits = usize::from(settings.rules.program.digits);
            let text = format!("%\nO{number:0digits$} ({title})\nG21 G90\nG10 {register}{words}\nM30\n%\n");
            WrittenTable { extension, text }
        }
        TableForm::LinuxCnc => {
            let (number, words) = (offset.number(), axis_words());
            WrittenTable { extension, text: format!("({title})\nG21 G90\nG10 L2 P{number}{words} R0\nM2\n") }
        }
        TableForm::Siemens840d => {
            let pairs: Vec<String> = values.iter().map(|(axis, value)| format!("{},{value}", axis.letter)).collect();
            let (number, pairs) = (offset.number(), pairs.join(","));
            let text = format!("; {title}\nG710\n$P_UIFR[{number}]=CTRANS({pairs})\nM17\n");
            WrittenTable { extension: "spf".to_owned(), text }
        }
        TableForm::Heidenhain => {
            let doc: String = clean_comment(name, comments).chars().take(16).collect();
            WrittenTable { extension: "pr".to_owned(), text: preset_table(offset, doc.trim(), &values) }
        }
    })
}

/// Returns a preset table with one row.
fn preset_table(offset: WorkOffset, doc: &str, values: &[(&AxisSpec, String)]) -> String {
    let of = |name: &str| {
        let own = values.iter().find(|(axis, _)| axis.letter.to_string() == name);
        own.map_or_else(|| "0.".to_owned(), |(_, value)| value.clone())
    };
    let mut columns = vec![("NO".to_owned(), offset.number().to_string()), ("DOC".to_owned(), doc.to_owned())];
    columns.extend(["X", "Y", "Z"].map(|name| (name.to_owned(), of(name))));
    // Rotations of the frame: the program counts in axes of the machine.
    columns.extend(["SPA", "SPB", "SPC"].map(|name| (name.to_owned(), "0.".to_owned())));
    let is_other = |axis: &AxisSpec| {
        axis.letter.kind() == AxisKind::Rotary || !["X", "Y", "Z"].contains(&axis.letter.to_string().as_str())
    };
    let others = values.iter().filter(|(axis, _)| is_other(axis));
    columns.extend(others.map(|(axis, value)| (format!("{}_OFFS", axis.letter), value.clone())));
    let width = |(name, value): &(String, String)| name.len().max(value.len()).max(12);
    let row = |of: &dyn Fn(&(String, String)) -> String| -> String {
        let cells: Vec<String> = columns.iter().map(|column| format!("{:<1$}", of(column), width(column))).collect();
        cells.join(" ").trim_end().to_owned()
    };
    let (head, line) = (row(&|(name, _)| name.clone()), row(&|(_, value)| value.clone()));
    format!("BEGIN PRESET.PR MM\n{head}\n{line}\n[END]\n")
}
