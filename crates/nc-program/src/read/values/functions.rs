//! Functions of expressions, angles in deg.

/// The value of a function of one number; `None` where there is no such function.
pub(crate) fn of_one(name: &[u8], x: f64) -> Option<f64> {
    Some(match name {
        b"SIN" => x.to_radians().sin(),
        b"COS" => x.to_radians().cos(),
        b"TAN" => x.to_radians().tan(),
        b"ASIN" => x.asin().to_degrees(),
        b"ACOS" => x.acos().to_degrees(),
        b"ATAN" => x.atan().to_degrees(),
        b"SQRT" | b"SQR" => x.sqrt(),
        b"ABS" => x.abs(),
        b"ROUND" => x.round(),
        b"FIX" | b"TRUNC" | b"INT" => x.trunc(),
        b"FUP" => {
            if x < 0.0 {
                x.floor()
            } else {
                x.ceil()
            }
        }
        b"LN" => x.ln(),
        b"LOG" => x.log10(),
        b"EXP" => x.exp(),
        b"POT" | b"SQ" => x * x,
        b"FRAC" => x.fract(),
        b"NEG" => -x,
        _ => return None,
    })
}

/// The value of a function of two numbers; `None` where there is no such function.
pub(crate) fn of_two(name: &[u8], a: f64, b: f64) -> Option<f64> {
    Some(match name {
        b"ATAN" | b"ATAN2" => a.atan2(b).to_degrees(),
        b"POW" => a.powf(b),
        b"MINVAL" => a.min(b),
        b"MAXVAL" => a.max(b),
        _ => return None,
    })
}
