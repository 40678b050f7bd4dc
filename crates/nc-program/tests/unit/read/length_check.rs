use crate::read::length_check::*;

#[test]
fn lengths_of_checks_are_those_that_they_compare_with() {
    use LengthVariables::{Parameter, QParameter, Registers, SystemVariable};
    let found = |text: &str, variables| length_check(text.as_bytes(), variables).map(|c| (c.length, c.register));
    for (text, variables, expected) in [
        ("IF[ABS[#11002+#10002-142.000]LE0.01]GOTO9001", Registers, Some((142.0, Some(2)))),
        ("IF [ABS[142.5-#2007-#2207] LT .1] GOTO 5", Registers, Some((142.5, Some(7)))),
        ("IF[#11002 NE 142.]GOTO 5", Registers, Some((142.0, Some(2)))),
        ("IF[142. EQ #2002]GOTO 5", Registers, Some((142.0, Some(2)))),
        ("O100IF[ABS[#5403-103.2]GT0.01]", Parameter, Some((103.2, None))),
        ("IF ABS($P_TOOLL[1]-103.2)<=0.01 GOTOF OK", SystemVariable, Some((103.2, None))),
        ("IF $P_TOOLL[1]==103.2 GOTOF OK", SystemVariable, Some((103.2, None))),
        ("FN 2: Q99 = +Q114 - +142.000", QParameter, Some((142.0, None))),
        ("Q99 = 142 - Q114", QParameter, Some((142.0, None))),
        ("FN 9: IF +Q114 EQU +142 GOTO LBL 99", QParameter, Some((142.0, None))),
        // Other variables and other registers say no length.
        ("IF[ABS[#11002-#100]LE0.01]GOTO 5", Registers, None),
        ("IF[ABS[#11002+#10003-142.]LE0.01]GOTO 5", Registers, None),
        ("IF[ABS[#11002+142.]LE0.01]GOTO 5", Registers, None),
        ("IF[ABS[#11002*2.-142.]LE0.01]GOTO 5", Registers, None),
        ("IF[[#11002 LT 142.]AND[#1 EQ 1.]]GOTO 5", Registers, None),
        ("IF[#11002 LT 142. LT 3]GOTO 5", Registers, None),
        ("WHILE[#11002 LT 142.]DO1", Registers, None),
        ("#100=5.", Registers, None),
        ("FN 2: Q99 = +Q1140 - +142", QParameter, None),
        ("IF[", Registers, None),
        ("#2001", Registers, None),
    ] {
        assert_eq!(found(text, variables), expected, "{text}");
    }
}
#[test]
fn bounds_are_those_that_the_length_is_compared_with() {
    use LengthRelation::{AtLeast, AtMost, Less, More};
    use LengthVariables::{Parameter, QParameter, Registers, SystemVariable};
    for (text, variables, length, relation) in [
        ("IF[#11002 LT 142.]GOTO 5", Registers, 142.0, Less),
        ("IF [142. LE #2002] GOTO 5", Registers, 142.0, AtLeast),
        ("N10 IF[#11002+#10002 GE 142.]GOTO 5", Registers, 142.0, AtLeast),
        ("IF[#11002-142. LT 0]GOTO 5", Registers, f64::NAN, Less),
        ("O100IF[#5403 GT 142]", Parameter, 142.0, More),
        ("IF $P_TOOLL[1]<=142 GOTOF OK", SystemVariable, 142.0, AtMost),
        ("IF ($P_TOOLL[1] > 142) GOTOF OK", SystemVariable, 142.0, More),
        ("FN 12: IF +Q114 LT +142 GOTO LBL 99", QParameter, 142.0, Less),
    ] {
        let found = length_check(text.as_bytes(), variables).map(|c| (c.length, c.relation));
        assert_eq!(found, (!length.is_nan()).then_some((length, relation)), "{text}");
    }
}
