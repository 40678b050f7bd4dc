//! Calls, begins and ends of subprograms of each control, by the code of a line.

use facemill_nc_program::read::{CallKind, ReadCommand};
use facemill_nc_program::{Dialect, read_program};

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
#[derive(Clone, Debug)]
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
            if is_siemens_program(code) {
                once(Target::File(code.to_owned()))
            } else {
                None
            }
        }
        Dialect::Heidenhain => {
            if let Some(label) = code.strip_prefix("CALL LBL ") {
                return if label.contains(' ') || label == "0" { None } else { once(Target::Label(label.to_owned())) };
            }
            let name = code.strip_prefix("CALL PGM ")?.trim_matches('"');
            let name = name.strip_suffix(".H").unwrap_or(name);
            // A file in another folder is not the one beside the program.
            if name.is_empty() || name.contains([' ', '\\', '/', ':']) {
                None
            } else {
                once(Target::File(name.to_owned()))
            }
        }
        _ => None,
    }
}

/// Returns whether a code is the name of a subprogram: `L` with digits, or a name that begins with
/// two letters or an underscore and is no word of the control.
fn is_siemens_program(code: &str) -> bool {
    let letters = code.bytes().take(2).filter(|b| b.is_ascii_alphabetic() || *b == b'_').count();
    if code.len() < 2 || !code.bytes().all(|b| b.is_ascii_alphanumeric() || b == b'_') {
        return false;
    }
    if code.strip_prefix('L').is_some_and(|number| number.bytes().all(|b| b.is_ascii_digit())) {
        return true;
    }
    let is_call = |command: &ReadCommand| match command {
        ReadCommand::Call(call) => call.kind == CallKind::Subprogram && call.name == code,
        _ => false,
    };
    letters == 2
        && read_program(code, Dialect::Siemens840d)
            .is_ok_and(|program| program.blocks.iter().any(|block| block.commands.iter().any(is_call)))
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
    let times = times.parse().ok().filter(|times| (1..=MOST_TIMES).contains(times))?;
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

/// Returns the unit of the Heidenhain program that begins here (`BEGIN PGM A MM`).
pub(crate) fn program_unit(code: &str) -> Option<&str> {
    let (_, unit) = code.strip_prefix("BEGIN PGM ")?.rsplit_once(' ')?;
    matches!(unit, "MM" | "INCH").then_some(unit)
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

/// Returns whether a code has an M function with one of these numbers, also behind other words, or
/// one whose number is computed.
fn has_function(code: &str, numbers: &[u32]) -> bool {
    let is_one = |text: &str| -> bool {
        let digits = &text[..text.find(|c: char| !c.is_ascii_digit()).unwrap_or(text.len())];
        digits.parse().map_or(true, |number| numbers.contains(&number))
    };
    code.match_indices('M').any(|(at, _)| {
        let behind = code[at + 1..].trim_start();
        // `M2=3` is M3 of the second spindle.
        let value = behind.trim_start_matches(|c: char| c.is_ascii_digit()).trim_start().strip_prefix('=');
        match value {
            Some(value) => is_one(value.trim_start()),
            None if behind.starts_with(|c: char| c.is_ascii_digit()) => is_one(behind),
            None => behind.starts_with(['#', '[']),
        }
    })
}

/// Returns whether a line of a subprogram does the same in place of its call: it has no branch, no
/// jump, no label, no local variable, and no end of the program or the subprogram, which may be
/// behind other words.
pub(crate) fn is_plain(code: &str, dialect: Dialect) -> bool {
    let has = |words: &[&str]| words.iter().any(|word| code.contains(word));
    match dialect {
        Dialect::Fanuc | Dialect::Haas | Dialect::Mazak => {
            !has(&["GOTO", "IF[", "WHILE", "DO", "END", "G65", "G66", "G67"])
                && !has_function(code, &[2, 30, 99])
                && !code.starts_with('/')
        }
        Dialect::LinuxCnc => {
            let is_call = call(code, dialect).is_some();
            is_call || !code.contains('#') && !code.starts_with('O') && !has_function(code, &[2, 30, 73, 99])
        }
        Dialect::Siemens840d => {
            !has(&[
                "IF", "GOTO", "LOOP", "FOR", "WHILE", "REPEAT", "UNTIL", "CASE", "DEF ", "DEFINT", "DEFREAL", "SAVE",
                "RET",
            ]) && !has_function(code, &[2, 17, 30])
                && !code.ends_with(':')
                && !code.starts_with('/')
        }
        Dialect::Heidenhain => {
            !has(&["GOTO", "LBL ", "QL", "FN 9", "FN 10", "FN 11", "FN 12"])
                && !has_function(code, &[2, 30, 89, 99])
                && !code.starts_with('/')
                || code.starts_with("CALL LBL ") && !code.contains("REP")
        }
        _ => false,
    }
}
