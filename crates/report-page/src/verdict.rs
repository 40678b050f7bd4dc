//! Verdict on a program by its report or verification.

use facemill_virtual_machine::FindingKind;
use serde_json::Value;

use crate::format::{Verdict, VerdictState};

/// Returns the verdict that a report or a verification gives, as its file says it.
pub(crate) fn verdict(result: &Value) -> Verdict {
    let kinds = list(result, "/findings").filter_map(|f| serde_json::from_value(f.get("kind")?.clone()).ok());
    let faults = kinds.filter(|kind: &FindingKind| kind.is_fault()).count();
    let exceeds_gouge = result.pointer("/deviation/exceeds_gouge_limit") == Some(&Value::Bool(true));
    let mut because = Vec::new();
    if faults > 0 {
        because.push(format!("{faults} faults were found in the program"));
    }
    if exceeds_gouge {
        because.push("the cut stock is deeper than the gouge limit permits".to_owned());
    }
    let incomplete = incomplete(result);
    let is_verified = result.get("verified") != Some(&Value::Bool(false));
    let state = match () {
        () if !because.is_empty() => VerdictState::Faulty,
        () if !is_verified => VerdictState::NotVerified,
        () if !incomplete.is_empty() => VerdictState::Incomplete,
        () => VerdictState::Good,
    };
    if !is_verified {
        because.push("the program was not run on the virtual machine".to_owned());
    }
    if result.get("estimate").is_some() {
        because.push("collisions are only estimated: nothing is proven between positions".to_owned());
    }
    because.extend(incomplete);
    Verdict { state, because }
}

/// Returns why a program without faults does less than its job requires.
fn incomplete(result: &Value) -> Vec<String> {
    let is = |pointer: &str| result.pointer(pointer) == Some(&Value::Bool(true));
    let left = list(result, "/remaining/operations").filter(|o| o.get("exceeded") == Some(&Value::Bool(true)));
    let named = |o: &Value| {
        let name = o.get("operation").and_then(Value::as_str).unwrap_or_default();
        format!("{name}: more material is left than the job permits")
    };
    let mut reasons: Vec<String> = left.map(named).collect();
    let others = [
        ("/totals/trims_too_much", "more points are left out than an operation permits"),
        ("/worst/cusp_exceeded", "a predicted cusp is higher than an operation permits"),
        ("/worst/linearisation_exceeded", "blocks are less straight than an operation requires"),
    ];
    reasons.extend(others.into_iter().filter(|(pointer, _)| is(pointer)).map(|(_, why)| why.to_owned()));
    reasons
}

fn list<'v>(result: &'v Value, pointer: &str) -> impl Iterator<Item = &'v Value> {
    result.pointer(pointer).and_then(Value::as_array).into_iter().flatten()
}

#[cfg(test)]
#[path = "../tests/unit/verdict.rs"]
mod tests;
