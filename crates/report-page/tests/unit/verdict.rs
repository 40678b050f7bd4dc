use serde_json::json;

use super::*;

/// The verdict on a program that moves, for a machine without assumed values.
fn verdict(result: &Value) -> Verdict {
    super::verdict(result, Moves::Some, &AssumedValues::default())
}

#[test]
fn a_fault_makes_a_program_faulty_and_a_near_miss_does_not() {
    let with = |kind: &str| verdict(&json!({ "verified": true, "findings": [{ "kind": kind }] })).state;
    assert_eq!(with("gouge"), VerdictState::Faulty);
    assert_eq!(with("holder_collision"), VerdictState::Faulty);
    assert_eq!(with("near_miss"), VerdictState::Good);
}

#[test]
fn a_finding_without_a_kind_or_of_an_unknown_one_is_a_fault() {
    let result = json!({ "findings": [{ "kind": "near_miss" }, { "kind": "of_a_later_version" }, {}, { "kind": 3 }] });
    assert_eq!(finding_faults(&result), [false, true, true, true]);
    assert_eq!(verdict(&result).because, ["3 faults were found in the program"]);
    let one = verdict(&json!({ "findings": [{}] }));
    assert_eq!(
        (one.state, &one.because[..]),
        (VerdictState::Faulty, &["1 fault was found in the program".to_owned()][..])
    );
    assert_eq!(verdict(&json!({ "verified": true })).state, VerdictState::NotVerified);
}

#[test]
fn a_program_with_less_than_all_tests_is_partly_tested_and_says_which_are_missing() {
    let of = |result: Value| {
        let verdict = verdict(&result);
        (verdict.state, verdict.because.join("; "))
    };
    let (state, because) = of(json!({ "findings": [], "certified": { "blocks": 9, "certified": 7 } }));
    assert_eq!((state, because.as_str()), (VerdictState::PartlyTested, "2 of 9 blocks are not proven"));
    assert_eq!(of(json!({ "findings": [], "certified": { "blocks": 9, "certified": 9 } })).0, VerdictState::Good);
    let (state, because) = of(json!({ "findings": [], "estimate": { "positions": 3 } }));
    assert!(state == VerdictState::PartlyTested && because.contains("only estimated"), "{because}");
    let verification = |stock: Value| json!({ "format": VERIFICATION_FORMAT, "findings": [], "stock": stock });
    let (state, because) = of(verification(Value::Null));
    assert!(state == VerdictState::PartlyTested && because.contains("stock was not cut"), "{because}");
    assert_eq!(of(verification(json!({}))).0, VerdictState::Good);
}

#[test]
fn a_program_that_was_not_run_is_not_good_and_one_that_misses_the_job_is_incomplete() {
    let state = |result: Value| verdict(&result).state;
    assert_eq!(state(json!({ "verified": false, "findings": [] })), VerdictState::NotVerified);
    assert_eq!(state(json!({ "findings": [], "totals": { "trims_too_much": true } })), VerdictState::Incomplete);
    let left = json!({ "findings": [], "remaining": { "operations": [{ "operation": "side", "exceeded": true }] } });
    assert_eq!(verdict(&left).because, ["side: more material is left than the job permits"]);
    assert_eq!(state(json!({ "findings": [], "deviation": { "exceeds_gouge_limit": true } })), VerdictState::Faulty);
    assert_eq!(state(json!({ "findings": [] })), VerdictState::Good);
}

#[test]
fn a_program_without_motion_is_not_verified_and_has_no_good_stamp() {
    let result = json!({ "verified": true, "findings": [] });
    for (moves, why) in [(Moves::None, "moves no axis"), (Moves::NotFollowed, "can be followed")] {
        let found = super::verdict(&result, moves, &AssumedValues::default());
        assert_eq!(found.state, VerdictState::NotVerified);
        assert!(found.because.iter().any(|b| b.contains(why)), "{:?}", found.because);
    }
    let faulty = json!({ "findings": [{ "kind": "gouge" }] });
    assert_eq!(super::verdict(&faulty, Moves::None, &AssumedValues::default()).state, VerdictState::Faulty);
}

#[test]
fn a_stamp_names_near_misses_assumptions_and_assumed_values() {
    let near = json!({ "kind": "near_miss" });
    let result = json!({ "findings": [near, near, near], "assumptions": [{ "text": "a" }] });
    let keys = |n: usize| (0..n).map(|k| format!("key_{k}")).collect();
    let of_tool = |n: usize| super::verdict(&result, Moves::Some, &AssumedValues { n_machine: 2, tool_keys: keys(n) });
    let found = of_tool(0);
    assert_eq!(found.state, VerdictState::Good);
    assert_eq!(found.notes, ["3 near misses", "1 assumption to check", "2 assumed values of the machine"]);
    let line = "VERIFIED: NO FAULT FOUND; 3 near misses; 1 assumption to check; 2 assumed values of the machine";
    assert_eq!(stamp_line(&found), line);
    let note = |n: usize| of_tool(n).notes.pop();
    assert_eq!(note(1).as_deref(), Some("1 assumed value of the tool (key_0)"));
    assert_eq!(note(2).as_deref(), Some("2 assumed values of the tool (key_0, key_1)"));
    assert!(note(9).is_some_and(|text| text.starts_with("9 ") && text.ends_with("key_7, …)")));
}
