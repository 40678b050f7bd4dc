//! Verdict on a program by its report or verification.

use facemill_job::format::verification_file::VERIFICATION_FORMAT;
use facemill_virtual_machine::FindingKind;
use serde_json::Value;

use crate::format::{Verdict, VerdictState};

/// Motions of a program, as far as they can be followed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Moves {
    /// It moves no axis.
    None,
    /// None can be followed.
    NotFollowed,
    /// It moves axes.
    Some,
}

/// Values that nobody measured.
#[derive(Clone, Debug, Default)]
pub(crate) struct AssumedValues {
    /// Number of those of the machine.
    pub(crate) n_machine: usize,
    /// Keys of those of the tools.
    pub(crate) tool_keys: Vec<String>,
}

/// Most keys of assumed values that a note names.
const MOST_KEYS: usize = 8;

/// Returns the verdict that a report or a verification gives, as its file says it, on a program
/// with these motions, for a machine and tools with assumed values.
pub(crate) fn verdict(result: &Value, moves: Moves, assumed: &AssumedValues) -> Verdict {
    let faults = finding_faults(result).into_iter().filter(|is_fault| *is_fault).count();
    let exceeds_gouge = result.pointer("/deviation/exceeds_gouge_limit") == Some(&Value::Bool(true));
    let mut because = Vec::new();
    if faults > 0 {
        let were = if faults == 1 { "fault was" } else { "faults were" };
        because.push(format!("{faults} {were} found in the program"));
    }
    if exceeds_gouge {
        because.push("the cut stock is deeper than the gouge limit permits".to_owned());
    }
    let (incomplete, untested) = (incomplete(result), untested(result));
    let has_findings = result.get("findings").is_some_and(Value::is_array);
    let is_verified = has_findings && result.get("verified") != Some(&Value::Bool(false));
    let state = match () {
        () if !because.is_empty() => VerdictState::Faulty,
        () if !is_verified || moves != Moves::Some => VerdictState::NotVerified,
        () if !incomplete.is_empty() => VerdictState::Incomplete,
        () if !untested.is_empty() => VerdictState::PartlyTested,
        () => VerdictState::Good,
    };
    if !is_verified {
        because.push("the program was not run on the virtual machine".to_owned());
    }
    match moves {
        Moves::None => because.push("the program moves no axis".to_owned()),
        Moves::NotFollowed => because.push("no motion of the program can be followed".to_owned()),
        Moves::Some => {}
    }
    because.extend(incomplete);
    because.extend(untested);
    Verdict { state, stamp: state.stamp(), because, notes: notes(result, assumed) }
}

/// Returns a verdict as one line for a terminal: stamp, reasons and notes.
#[must_use]
pub fn stamp_line(verdict: &Verdict) -> String {
    let all = [&verdict.because[..], &verdict.notes[..]].concat();
    std::iter::once(verdict.stamp.to_owned()).chain(all).collect::<Vec<_>>().join("; ")
}

/// Returns what is no fault and yet has to be looked at.
fn notes(result: &Value, assumed: &AssumedValues) -> Vec<String> {
    let is_near_miss = |f: &&Value| f.get("kind").and_then(Value::as_str) == Some("near_miss");
    let counted = |n: usize, one: &str, many: &str| {
        let text = if n == 1 { format!("1 {one}") } else { format!("{n} {many}") };
        (n > 0).then_some(text)
    };
    let near_misses = list(result, "/findings").filter(is_near_miss).count();
    let assumptions = list(result, "/assumptions").count();
    let all = [
        counted(near_misses, "near miss", "near misses"),
        counted(assumptions, "assumption to check", "assumptions to check"),
        counted(assumed.n_machine, "assumed value of the machine", "assumed values of the machine"),
        counted(assumed.tool_keys.len(), "assumed value of the tool", "assumed values of the tool").map(|text| {
            let more = if assumed.tool_keys.len() > MOST_KEYS { ", …" } else { "" };
            let named: Vec<&str> = assumed.tool_keys.iter().take(MOST_KEYS).map(String::as_str).collect();
            format!("{text} ({}{more})", named.join(", "))
        }),
    ];
    all.into_iter().flatten().collect()
}

/// Returns whether each finding of a report or a verification is a fault; one without a kind, or of
/// a kind that this version does not know, is one.
pub(crate) fn finding_faults(result: &Value) -> Vec<bool> {
    let kind = |f: &Value| serde_json::from_value::<FindingKind>(f.get("kind")?.clone()).ok();
    list(result, "/findings").map(|f| kind(f).is_none_or(FindingKind::is_fault)).collect()
}

/// Returns tests that were not made, and blocks that were requested to be proven and are not.
fn untested(result: &Value) -> Vec<String> {
    let mut missing = Vec::new();
    if result.get("estimate").is_some_and(|e| !e.is_null()) {
        missing.push("collisions are only estimated: nothing is proven between positions".to_owned());
    }
    let count = |key: &str| result.pointer(&format!("/certified/{key}")).and_then(Value::as_u64);
    if let (Some(blocks), Some(certified)) = (count("blocks"), count("certified"))
        && certified < blocks
    {
        missing.push(format!("{} of {blocks} blocks are not proven", blocks - certified));
    }
    let is_verification = result.get("format").and_then(Value::as_str) == Some(VERIFICATION_FORMAT);
    if is_verification && result.get("stock").is_none_or(Value::is_null) {
        missing.push("the stock was not cut: the program is tested against the initial stock alone".to_owned());
    }
    missing
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
