use crate::read::values::expression::*;

fn value(text: &str, syntax: Syntax) -> Option<f64> {
    let mut variables = Variables::default();
    for (name, value) in [("1", 7.0), ("A.B", 2.0), ("R1", 3.0), ("_HOME", -5.0), ("Q5", 30.0), ("7", 11.0)] {
        variables.set(name.as_bytes(), Some(value));
    }
    let parsed = parse(text.as_bytes(), 0, syntax, &variables).unwrap_or_else(|at| panic!("{text} at {at}"));
    assert_eq!(parsed.end, text.len(), "{text}");
    parsed.value
}

#[test]
fn operators_bind_as_controls_bind_them() {
    for (text, expected) in [
        ("[1+2*3]", 7.0),
        ("[[1+2]*3]", 9.0),
        ("2*3**2", 18.0),
        ("10-2-3", 5.0),
        ("-#1+#<A.B>", -5.0),
        ("##1", 11.0),
        ("#[3+4]", 11.0),
        ("7MOD4", 3.0),
        ("[#1GT6]", 1.0),
        ("ATAN[1]/[-1]", 135.0),
        ("[2*SIN[30]+0.5]", 1.5),
        ("SQRT[16]/2", 2.0),
    ] {
        let found = value(text, Syntax::Brackets).unwrap_or_else(|| panic!("{text}"));
        assert!((found - expected).abs() < 1e-12, "{text} {found}");
    }
    for (text, expected) in [
        ("(R1 + 2) * 2", 10.0),
        ("-_HOME / 2", 2.5),
        ("SIN(30) * POT(R1)", 4.5),
        ("ATAN2(1, -1)", 135.0),
        ("7 DIV 2 + 7 MOD 2", 4.0),
        ("SIN Q5 * 2", 1.0),
        ("R1 >= 3", 1.0),
        ("2 ^ 3", 8.0),
    ] {
        let found = value(text, Syntax::Parentheses).unwrap_or_else(|| panic!("{text}"));
        assert!((found - expected).abs() < 1e-12, "{text} {found}");
    }
}

#[test]
fn what_is_not_known_has_an_extent_and_no_value() {
    for text in ["#9", "#<_HAL[PIN.X-Y]>+1", "[#1/0]", "EXISTS[#<X>]", "[1AND1]", "SQRT[-1]"] {
        assert_eq!(value(text, Syntax::Brackets), None, "{text}");
    }
    for text in ["$P_TOOLL[1]-5", "R7", "7 % 2", "FUNC(1, , 2)", "\"text\"", "AXIS[R1, 2] * 0"] {
        assert_eq!(value(text, Syntax::Parentheses), None, "{text}");
    }
}

#[test]
fn what_is_no_expression_tells_where() {
    let none = Variables::default();
    for (text, at) in [("[1+]", 3), ("", 0), ("[1", 2), ("#", 1), ("1+*2", 2), ("#<AB", 1), ("SIN[1", 5)] {
        assert_eq!(parse(text.as_bytes(), 0, Syntax::Brackets, &none), Err(at), "{text}");
    }
    let deep = "[".repeat(100_000);
    assert!(parse(deep.as_bytes(), 0, Syntax::Brackets, &none).is_err());
    let deep = "#".repeat(100_000);
    assert!(parse(deep.as_bytes(), 0, Syntax::Brackets, &none).is_err());
    let deep = "SIN ".repeat(100_000);
    assert!(parse(deep.as_bytes(), 0, Syntax::Parentheses, &none).is_err());
}
