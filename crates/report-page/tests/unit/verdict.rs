use serde_json::json;

use super::*;

#[test]
fn a_fault_makes_a_program_faulty_and_a_near_miss_does_not() {
    let with = |kind: &str| verdict(&json!({ "verified": true, "findings": [{ "kind": kind }] })).state;
    assert_eq!(with("gouge"), VerdictState::Faulty);
    assert_eq!(with("holder_collision"), VerdictState::Faulty);
    assert_eq!(with("near_miss"), VerdictState::Good);
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
