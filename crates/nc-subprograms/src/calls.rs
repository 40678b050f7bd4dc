//! Calls, begins and ends of subprograms of each control, by the code of a line.

use facemill_nc_program::Dialect;

/// Place that a call names.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) enum Target {
    /// Program of this number, in the same file or in one of its own (M98 P).
    Number(u32),
    /// Block of this number in the same program (M97 P).
    Block(u32),
    /// O word of LinuxCNC, in the same file or in one of its own.
    Word(String),
    /// Label in the same program (CALL LBL).
    Label(String),
    /// File of this name without its ending.
    File(String),
}

/// A call, and how often it runs its subprogram.
pub(crate) struct Call {
    pub(crate) target: Target,
    pub(crate) times: u32,
}

/// Most repetitions of one call that are expanded.
const MOST_TIMES: u32 = 9999;

/// Returns the call that a line is; `None` for every line with anything else.
pub(crate) fn call(code: &str, dialect: Dialect) -> Option<Call> {
    let once = |target| Some(Call { target, times: 1 });
    match dialect {
        Dialect::Fanuc | Dialect::Mazak => numbered(code, "M98P", 4, Target::Number),
        Dialect::Haas => numbered(code, "M98P", 5, Target::Number).or_else(|| numbered(code, "M97P", 5, Target::Block)),
        Dialect::LinuxCnc => once(Target::Word(o_word(code)?.strip_suffix("CALL")?.to_owned())),
        Dialect::Siemens840d => {
            let first_is_letter = code.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_');
            let is_name = code.len() > 1 && code.bytes().all(|b| b.is_ascii_alphanumeric() || b == b'_');
            if first_is_letter && is_name { once(Target::File(code.to_owned())) } else { None }
        }
        Dialect::Heidenhain => {
            if let Some(label) = code.strip_prefix("CALL LBL ") {
                return if label.contains(' ') || label == "0" { None } else { once(Target::Label(label.to_owned())) };
            }
            let name = code.strip_prefix("CALL PGM ")?.trim_matches('"');
            let name = name.rsplit(['\\', '/']).next().unwrap_or(name);
            let name = name.strip_suffix(".H").unwrap_or(name);
            if name.is_empty() || name.contains(' ') { None } else { once(Target::File(name.to_owned())) }
        }
        _ => None,
    }
}

/// Returns `M98P12L3` as a call: number of at most so many digits, repetitions.
fn numbered(code: &str, word: &str, digits: usize, target: impl Fn(u32) -> Target) -> Option<Call> {
    let (number, times) = code
        .strip_prefix(word)?
        .split_once('L')
        .map_or_else(|| (code.strip_prefix(word).unwrap_or_default(), "1"), |(number, times)| (number, times));
    let is_whole =
        |text: &str, most: usize| (1..=most).contains(&text.len()) && text.bytes().all(|b| b.is_ascii_digit());
    if !is_whole(number, digits) || !is_whole(times, 4) {
        return None;
    }
    let times = times.parse().ok().filter(|times| *times <= MOST_TIMES)?;
    Some(Call { target: target(number.parse().ok()?), times })
}

/// Returns the code behind an O with a name or number, with both: `<PASS_1>CALL`, `100SUB`.
fn o_word(code: &str) -> Option<&str> {
    let rest = code.strip_prefix('O')?;
    rest.starts_with(|c: char| c == '<' || c.is_ascii_digit()).then_some(rest)
}

/// Returns the name of the subprogram of LinuxCNC that begins (`O<A>SUB`) or ends here.
pub(crate) fn sub_begin(code: &str) -> Option<&str> {
    o_word(code)?.strip_suffix("SUB").filter(|name| !name.ends_with("END"))
}

/// Returns whether a line ends the subprogram of LinuxCNC of this name.
pub(crate) fn is_sub_end(code: &str, name: &str) -> bool {
    o_word(code).is_some_and(|rest| rest.strip_suffix("ENDSUB") == Some(name))
}

/// Returns the number of the program that begins here (`O2001`, `:2001`).
pub(crate) fn program_begin(code: &str) -> Option<u32> {
    let digits = code.strip_prefix('O').or_else(|| code.strip_prefix(':'))?;
    if digits.bytes().all(|b| b.is_ascii_digit()) { digits.parse().ok() } else { None }
}

/// Returns the label that a line is (`LBL 12`).
pub(crate) fn label(code: &str) -> Option<&str> {
    code.strip_prefix("LBL ").filter(|label| !label.contains(' '))
}

/// Returns whether a line ends the main program.
pub(crate) fn is_program_end(code: &str, dialect: Dialect) -> bool {
    match dialect {
        Dialect::Heidenhain => matches!(code, "M30" | "M2" | "M02" | "STOP M2" | "STOP M30"),
        _ => matches!(code, "M30" | "M2" | "M02"),
    }
}

/// Returns whether a line ends a subprogram and goes back to its call, alone.
pub(crate) fn is_return(code: &str, dialect: Dialect) -> bool {
    match dialect {
        Dialect::Fanuc | Dialect::Haas | Dialect::Mazak => code == "M99",
        Dialect::Siemens840d => matches!(code, "M17" | "RET" | "M2" | "M30" | "M02"),
        _ => false,
    }
}

/// Returns whether a line of a subprogram does the same in place of its call: it has no branch, no
/// jump, no label, no local variable, and no end of the program.
pub(crate) fn is_plain(code: &str, dialect: Dialect) -> bool {
    let has = |words: &[&str]| words.iter().any(|word| code.contains(word));
    match dialect {
        Dialect::Fanuc | Dialect::Haas | Dialect::Mazak => {
            !has(&["GOTO", "IF[", "WHILE", "DO", "END", "M99", "M30", "M02", "G65", "G66", "G67"])
                && !matches!(code, "M2")
                && !code.starts_with('/')
        }
        Dialect::LinuxCnc => {
            let is_call = call(code, dialect).is_some();
            !code.contains('#') && (is_call || !code.starts_with('O')) && !has(&["M30", "M02", "M73"]) && code != "M2"
        }
        Dialect::Siemens840d => {
            !has(&[
                "IF", "GOTO", "LOOP", "FOR", "WHILE", "REPEAT", "UNTIL", "CASE", "DEF ", "DEFINT", "DEFREAL", "SAVE",
            ]) && !code.ends_with(':')
                && !code.starts_with('/')
        }
        Dialect::Heidenhain => {
            !has(&["GOTO", "LBL ", "QL", "FN 9", "FN 10", "FN 11", "FN 12", "M99", "M89"])
                && !is_program_end(code, dialect)
                && !code.starts_with('/')
                || code.starts_with("CALL LBL ") && !code.contains("REP")
        }
        _ => false,
    }
}
