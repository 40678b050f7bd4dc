//! Checks of a program that compare the tool's length with a number: the length that the program
//! was made for.

/// Comparison of a program with the tool's length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LengthCheck {
    /// mm, or inches of an inch program.
    pub(crate) length: f64,
    /// Register of the length; `None` for the length in force.
    pub(crate) register: Option<u32>,
    /// How it compares them: the condition is met by lengths that are so.
    pub(crate) relation: LengthRelation,
}

/// How the tool's length is to that of a program.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LengthRelation {
    /// It is the same.
    #[default]
    Same,
    /// It is less.
    Less,
    /// It is not more.
    AtMost,
    /// It is more.
    More,
    /// It is not less.
    AtLeast,
}

impl LengthRelation {
    /// Whether a length is so to that of the program; two lengths are the same that are apart by no
    /// more than `same`.
    #[must_use]
    pub fn holds(self, length: f64, of_program: f64, same: f64) -> bool {
        match self {
            Self::Same => (length - of_program).abs() <= same,
            Self::Less => length < of_program,
            Self::AtMost => length <= of_program,
            Self::More => length > of_program,
            Self::AtLeast => length >= of_program,
        }
    }

    /// Returns the relation that is true where this one is false; of equality it is the same, as
    /// programs write both senses of it.
    pub(crate) fn opposite(self) -> Self {
        match self {
            Self::Same => Self::Same,
            Self::Less => Self::AtLeast,
            Self::AtMost => Self::More,
            Self::More => Self::AtMost,
            Self::AtLeast => Self::Less,
        }
    }

    /// The same with both sides exchanged.
    fn exchanged(self) -> Self {
        match self {
            Self::Same => Self::Same,
            Self::Less => Self::More,
            Self::AtMost => Self::AtLeast,
            Self::More => Self::Less,
            Self::AtLeast => Self::AtMost,
        }
    }
}

/// Where a control shows the length of the tool.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum LengthVariables {
    /// `#11001..` with the wear `#10001..`, and `#2001..` with `#2201..`: FANUC and its closer
    /// relatives.
    Registers,
    /// `#5403`: LinuxCNC.
    Parameter,
    /// `$P_TOOLL[1]`: Siemens.
    SystemVariable,
    /// `Q114`: Heidenhain.
    QParameter,
}

/// One term of a sum.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Term {
    /// The length in a register, or its wear.
    Length(Option<u32>),
    Number(f64),
    /// Something else.
    Other,
}

/// The comparison of a line in upper case: a sum of the length, its wear and one number
/// (`ABS[#11002+#10002-142.]`), or the length beside a number with a sign of equality between; or,
/// as the whole condition of a line, with a sign of order. `None` where there is none, or more.
pub(crate) fn length_check(code: &[u8], variables: LengthVariables) -> Option<LengthCheck> {
    let code: Vec<u8> = code.iter().copied().filter(|b| !b.is_ascii_whitespace()).collect();
    let at = (0..code.len()).find(|&at| length_at(&code[at..], variables).is_some())?;
    let group = group_around(&code, at);
    let mut rest = &code[group.0..group.1];
    let (mut sum, mut registers, mut has_length) = (None, None, false);
    let (mut side, mut length_sign) = (1.0, None);
    let mut relation = LengthRelation::Same;
    while !rest.is_empty() {
        if let Some((found, n)) = comparison(rest) {
            if found != LengthRelation::Same && (side < 0.0 || !is_whole(&code, group)) {
                return None;
            }
            (relation, side) = (found, -side);
            rest = &rest[n..];
            continue;
        }
        let signs = rest.iter().take_while(|b| matches!(b, b'+' | b'-')).count();
        let negative = rest[..signs].iter().filter(|b| **b == b'-').count() % 2 == 1;
        let sign = if negative { -side } else { side };
        let (term, n) = term(&rest[signs..], variables);
        match term {
            Term::Length(register) => {
                let is_same = !has_length || registers == Some(register) && length_sign == Some(sign);
                (has_length, registers, length_sign) = (true, Some(register), Some(sign));
                if !is_same {
                    return None;
                }
            }
            Term::Number(value) if sum.is_none() => sum = Some(sign * value),
            Term::Number(_) | Term::Other => return None,
        }
        rest = &rest[signs + n..];
    }
    // The sum of both is compared with 0.
    let sign = length_sign?;
    let length = -sum? * sign;
    let relation = if sign < 0.0 { relation.exchanged() } else { relation };
    (length > 0.0).then_some(LengthCheck { length, register: registers.flatten(), relation })
}

/// The bytes between the brackets around `at`, or from the last `:`, `=` of an assignment or word
/// to the next word.
fn group_around(code: &[u8], at: usize) -> (usize, usize) {
    let mut depth = 0_i32;
    let start = (0..at).rev().find(|&k| {
        depth += i32::from(matches!(code[k], b')' | b']')) - i32::from(matches!(code[k], b'(' | b'['));
        depth < 0 || depth == 0 && code[k] == b':' || depth == 0 && is_assignment(code, k) || ends_if(code, k)
    });
    let start = start.map_or(0, |k| k + 1);
    depth = 0;
    let end = (at..code.len()).find(|&k| {
        depth += i32::from(matches!(code[k], b'(' | b'[')) - i32::from(matches!(code[k], b')' | b']'));
        depth < 0 || code[k..].starts_with(b"GOTO")
    });
    (start, end.unwrap_or(code.len()))
}

/// `=` that is no part of a comparison.
fn is_assignment(code: &[u8], at: usize) -> bool {
    let is = |k: usize, bytes: &[u8]| code.get(k).is_some_and(|b| bytes.contains(b));
    code[at] == b'=' && !is(at + 1, b"=") && !(at > 0 && is(at - 1, b"=<>"))
}

/// The last letter of `IF`.
fn ends_if(code: &[u8], at: usize) -> bool {
    at > 0 && &code[at - 1..=at] == b"IF"
}

/// The sign of a comparison at the start of the text, and its length.
fn comparison(text: &[u8]) -> Option<(LengthRelation, usize)> {
    use LengthRelation::{AtLeast, AtMost, Less, More, Same};
    let signs: [(&[u8], LengthRelation); 13] = [
        (b"==", Same),
        (b"<>", Same),
        (b"EQU", Same),
        (b"EQ", Same),
        (b"NE", Same),
        (b"<=", AtMost),
        (b">=", AtLeast),
        (b"<", Less),
        (b">", More),
        (b"LE", AtMost),
        (b"GE", AtLeast),
        (b"LT", Less),
        (b"GT", More),
    ];
    signs.iter().find(|(sign, _)| text.starts_with(sign)).map(|(sign, relation)| (*relation, sign.len()))
}

/// Whether these bytes are all of the condition of an IF.
fn is_whole(code: &[u8], (start, end): (usize, usize)) -> bool {
    let (before, behind) = (&code[..start], &code[end..]);
    let is_begun = [&b"IF"[..], b"IF[", b"IF("].iter().any(|begin| before.ends_with(begin));
    let behind = behind.strip_prefix(b"]").or_else(|| behind.strip_prefix(b")")).unwrap_or(behind);
    is_begun && (behind.is_empty() || behind.starts_with(b"GOTO"))
}

/// A term without its sign, and its length.
fn term(text: &[u8], variables: LengthVariables) -> (Term, usize) {
    if let Some((register, n)) = length_at(text, variables) {
        return (Term::Length(register), n);
    }
    let n = text.iter().take_while(|b| b.is_ascii_digit() || **b == b'.').count();
    match super::values::number::parse(&text[..n]) {
        Some(value) => (Term::Number(value), n),
        None => (Term::Other, text.len()),
    }
}

/// The length that the text begins with: its register, and how many bytes name it.
fn length_at(text: &[u8], variables: LengthVariables) -> Option<(Option<u32>, usize)> {
    let name: &[u8] = match variables {
        LengthVariables::Registers => b"#",
        LengthVariables::Parameter => b"#5403",
        LengthVariables::SystemVariable => b"$P_TOOLL[1]",
        LengthVariables::QParameter => b"Q114",
    };
    let rest = text.strip_prefix(name)?;
    let digits = rest.iter().take_while(|b| b.is_ascii_digit()).count();
    if variables != LengthVariables::Registers {
        return (digits == 0).then_some((None, name.len()));
    }
    let number: u32 = str::from_utf8(&rest[..digits]).ok()?.parse().ok()?;
    let register = match number {
        2001..=2400 => (number - 2001) % 200 + 1,
        10_001..=10_999 | 11_001..=11_999 => number % 1000,
        _ => return None,
    };
    Some((Some(register), 1 + digits))
}

#[cfg(test)]
#[path = "../../tests/unit/read/length_check.rs"]
mod tests;
