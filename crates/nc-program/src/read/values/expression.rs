//! Expressions of all dialects: their extent always, their value where it is known.

use crate::read::values::variables::Variables;
use crate::read::values::{functions, number};

/// How a dialect writes expressions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Syntax {
    /// `#1`, `#<name>`, `[…]`: FANUC and its relatives.
    Brackets,
    /// Names, `(…)`, `NAME[…]`: Siemens and Heidenhain.
    Parentheses,
}

/// An expression that ends before `end`; its value is `None` where it depends on what is not known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Parsed {
    pub(crate) value: Option<f64>,
    pub(crate) end: usize,
}

/// Deepest nesting, in calls of the parser, six for a pair of brackets: beyond what any control
/// takes, and short of what fills the stack.
const DEEPEST: u32 = 240;

/// Reads the expression that begins at byte `start` of upper-case text, blanks allowed; `Err` is
/// the byte at which it cannot be one.
pub(crate) fn parse(text: &[u8], start: usize, syntax: Syntax, variables: &Variables) -> Result<Parsed, usize> {
    let mut parser = Parser { text, at: start, syntax, variables, depth: 0 };
    let value = parser.binary(0)?;
    Ok(Parsed { value, end: parser.at })
}

/// Reads one value without operators (`-#1`, `[…]`, `SIN(…)`, `Q5`), as it stands behind an address
/// letter.
pub(crate) fn parse_value(text: &[u8], start: usize, syntax: Syntax, variables: &Variables) -> Result<Parsed, usize> {
    let mut parser = Parser { text, at: start, syntax, variables, depth: 0 };
    let value = parser.unary()?;
    Ok(Parsed { value, end: parser.at })
}

/// Reads `name =` of an assignment at `start` in the bracket syntax (`#1=`, `#<name>=`, `#[…]=`):
/// the name, `None` where it is not known which, and the byte behind the `=`.
pub(crate) fn parse_target(
    text: &[u8],
    start: usize,
    variables: &Variables,
) -> Result<(Option<Vec<u8>>, usize), usize> {
    let mut parser = Parser { text, at: start, syntax: Syntax::Brackets, variables, depth: 0 };
    let name = parser.parameter_name()?;
    if parser.peek() != Some(b'=') {
        return Err(parser.at);
    }
    Ok((name, parser.at + 1))
}

struct Parser<'a> {
    text: &'a [u8],
    at: usize,
    syntax: Syntax,
    variables: &'a Variables,
    depth: u32,
}

/// The first two arguments of a function, where they are known, and how many there are.
#[derive(Default)]
struct Arguments {
    first: Option<f64>,
    second: Option<f64>,
    count: usize,
}

/// Operators by level, the weakest first; within a level the longer ones first.
const LEVELS: [&[&[u8]]; 5] = [
    &[b"AND", b"XOR", b"OR"],
    &[b"==", b"<>", b"<=", b">=", b"<", b">", b"EQ", b"NE", b"GT", b"GE", b"LT", b"LE"],
    &[b"+", b"-"],
    &[b"*", b"/", b"%", b"MOD", b"DIV"],
    &[b"**", b"^"],
];

impl Parser<'_> {
    fn binary(&mut self, level: usize) -> Result<Option<f64>, usize> {
        let Some(operators) = LEVELS.get(level) else { return self.unary() };
        self.go_deeper()?;
        let mut left = self.binary(level + 1)?;
        while let Some(operator) = self.operator(operators) {
            let right = self.binary(level + 1)?;
            left = left.zip(right).and_then(|(a, b)| apply(operator, a, b)).filter(|v| v.is_finite());
        }
        self.depth -= 1;
        Ok(left)
    }

    fn operator(&mut self, operators: &[&'static [u8]]) -> Option<&'static [u8]> {
        self.skip_blanks();
        let rest = &self.text[self.at..];
        let operator = operators.iter().copied().find(|o| rest.starts_with(o))?;
        // A power is no product.
        let is_other = operator == b"*" && rest.starts_with(b"**");
        let is_word = operator[0].is_ascii_alphabetic() && self.syntax == Syntax::Parentheses;
        let goes_on = is_word && rest.get(operator.len()).is_some_and(|b| is_name_byte(*b));
        if is_other || goes_on {
            return None;
        }
        self.at += operator.len();
        Some(operator)
    }

    fn unary(&mut self) -> Result<Option<f64>, usize> {
        self.skip_blanks();
        let mut is_negative = false;
        while let Some(sign @ (b'-' | b'+')) = self.peek() {
            is_negative ^= sign == b'-';
            self.at += 1;
        }
        let value = self.primary()?.filter(|v| v.is_finite());
        Ok(if is_negative { value.map(|v| -v) } else { value })
    }

    fn primary(&mut self) -> Result<Option<f64>, usize> {
        let (open, close) = self.marks();
        match self.peek().ok_or(self.at)? {
            b'0'..=b'9' | b'.' => self.number(),
            byte if byte == open => self.enclosed(close),
            b'#' if self.syntax == Syntax::Brackets => {
                let name = self.parameter_name()?;
                Ok(name.and_then(|name| self.variables.get(&name)))
            }
            b'"' | b'\'' if self.syntax == Syntax::Parentheses => self.string(),
            byte if byte.is_ascii_alphabetic() || matches!(byte, b'_' | b'$') => self.named(),
            _ => Err(self.at),
        }
    }

    fn marks(&self) -> (u8, u8) {
        if self.syntax == Syntax::Brackets { (b'[', b']') } else { (b'(', b')') }
    }

    fn number(&mut self) -> Result<Option<f64>, usize> {
        let length = self.text[self.at..].iter().take_while(|b| b.is_ascii_digit() || **b == b'.').count();
        let value = number::parse(&self.text[self.at..self.at + length]).ok_or(self.at)?;
        self.at += length;
        // `1.5EX-1`: the power of ten of a Siemens control.
        let Some(digits) = self.text[self.at..].strip_prefix(b"EX").filter(|_| self.syntax == Syntax::Parentheses)
        else {
            return Ok(Some(value));
        };
        let signed = usize::from(matches!(digits.first(), Some(b'+' | b'-')));
        let length = signed + digits[signed..].iter().take_while(|b| b.is_ascii_digit()).count();
        let power = std::str::from_utf8(&digits[..length]).ok().and_then(|text| text.parse::<i32>().ok());
        let power = power.filter(|power| power.abs() <= 38).ok_or(self.at)?;
        self.at += 2 + length;
        Ok(Some(format!("{value}e{power}").parse().unwrap_or(f64::NAN)))
    }

    /// `[…]`, the opening mark included.
    fn enclosed(&mut self, close: u8) -> Result<Option<f64>, usize> {
        self.at += 1;
        let value = self.binary(0)?;
        self.expect(close)?;
        Ok(value)
    }

    fn expect(&mut self, byte: u8) -> Result<(), usize> {
        if self.peek() != Some(byte) {
            return Err(self.at);
        }
        self.at += 1;
        Ok(())
    }

    fn string(&mut self) -> Result<Option<f64>, usize> {
        let mark = self.text[self.at];
        let length = self.text[self.at + 1..].iter().position(|b| *b == mark).ok_or(self.at)?;
        self.at += length + 2;
        Ok(None)
    }

    /// `#1`, `#<name>`, `##1`, `#[…]` without the value: the name, `None` where it depends on what
    /// is not known.
    fn parameter_name(&mut self) -> Result<Option<Vec<u8>>, usize> {
        if self.peek() != Some(b'#') {
            return Err(self.at);
        }
        self.at += 1;
        if self.peek() == Some(b'<') {
            let rest = &self.text[self.at + 1..];
            let length = rest.iter().position(|b| *b == b'>').filter(|n| *n > 0).ok_or(self.at)?;
            self.at += length + 2;
            return Ok(Some(rest[..length].to_vec()));
        }
        self.go_deeper()?;
        let value = self.primary()?;
        self.depth -= 1;
        let is_number = |v: &f64| v.fract() == 0.0 && (0.0..1e9).contains(v);
        Ok(value.filter(is_number).map(|v| (v as u64).to_string().into_bytes()))
    }

    /// A function with its arguments, or a variable.
    fn named(&mut self) -> Result<Option<f64>, usize> {
        let start = self.at;
        let is_part = |b: &u8| {
            if self.syntax == Syntax::Brackets { b.is_ascii_alphabetic() } else { is_name_byte(*b) }
        };
        let length = self.text[start..].iter().take_while(|b| is_part(b)).count();
        let name = &self.text[start..start + length];
        self.at += length;
        let (open, close) = self.marks();
        if self.peek() == Some(open) {
            return self.function(name, close);
        }
        if self.syntax == Syntax::Brackets {
            return Err(start);
        }
        if self.peek() == Some(b'[') {
            // An element of a field or a system variable: its index is read and its value is not
            // known.
            self.arguments(b']')?;
            return Ok(None);
        }
        if functions::of_one(name, 0.5).is_some() && self.peek().is_some_and(|b| b.is_ascii_alphanumeric() || b == b'-')
        {
            // Heidenhain: `SIN Q1`.
            self.go_deeper()?;
            let argument = self.unary()?;
            self.depth -= 1;
            return Ok(argument.and_then(|x| functions::of_one(name, x)));
        }
        Ok(if name == b"PI" { Some(std::f64::consts::PI) } else { self.variables.get(name) })
    }

    fn function(&mut self, name: &[u8], close: u8) -> Result<Option<f64>, usize> {
        let arguments = self.arguments(close)?;
        // `ATAN[a]/[b]`.
        if name == b"ATAN" && self.syntax == Syntax::Brackets && self.text[self.at..].starts_with(b"/[") {
            self.at += 1;
            let divisor = self.enclosed(b']')?;
            return Ok(arguments.first.zip(divisor).and_then(|(a, b)| functions::of_two(name, a, b)));
        }
        Ok(match (arguments.count, arguments.first, arguments.second) {
            (2, Some(a), Some(b)) => functions::of_two(name, a, b),
            (1, Some(a), _) => functions::of_one(name, a),
            _ => None,
        })
    }

    /// The first two arguments of a function, the opening mark and the closing one included, and
    /// how many there are.
    fn arguments(&mut self, close: u8) -> Result<Arguments, usize> {
        self.at += 1;
        let mut arguments = Arguments::default();
        loop {
            // An argument may be left out.
            let value = if matches!(self.peek(), Some(b) if b == b',' || b == close) { None } else { self.binary(0)? };
            match arguments.count {
                0 => arguments.first = value,
                1 => arguments.second = value,
                _ => {}
            }
            arguments.count += 1;
            match self.peek() {
                Some(b',') => self.at += 1,
                Some(byte) if byte == close => break,
                _ => return Err(self.at),
            }
        }
        self.at += 1;
        Ok(arguments)
    }

    fn go_deeper(&mut self) -> Result<(), usize> {
        self.depth += 1;
        if self.depth > DEEPEST { Err(self.at) } else { Ok(()) }
    }

    /// The next byte that is no blank.
    fn peek(&mut self) -> Option<u8> {
        self.skip_blanks();
        self.text.get(self.at).copied()
    }

    fn skip_blanks(&mut self) {
        while matches!(self.text.get(self.at), Some(b' ' | b'\t')) {
            self.at += 1;
        }
    }
}

/// Whether a byte may stand in a name.
pub(crate) fn is_name_byte(byte: u8) -> bool {
    byte.is_ascii_alphanumeric() || matches!(byte, b'_' | b'$')
}

/// An operation that differs between controls has no value: AND, OR and XOR take bits on some, and
/// `%` may have either sign.
fn apply(operator: &[u8], a: f64, b: f64) -> Option<f64> {
    let truth = |is_true: bool| if is_true { 1.0 } else { 0.0 };
    Some(match operator {
        b"+" => a + b,
        b"-" => a - b,
        b"*" => a * b,
        b"/" => a / b,
        b"MOD" => a.rem_euclid(b),
        b"DIV" => (a / b).trunc(),
        b"**" | b"^" => a.powf(b),
        b"EQ" | b"==" => truth(a == b),
        b"NE" | b"<>" => truth(a != b),
        b"GT" | b">" => truth(a > b),
        b"GE" | b">=" => truth(a >= b),
        b"LT" | b"<" => truth(a < b),
        b"LE" | b"<=" => truth(a <= b),
        _ => return None,
    })
}

#[cfg(test)]
#[path = "../../../tests/unit/read/values/expression.rs"]
mod tests;
