//! Causes for which a process ended without a result.

use std::process::ExitStatus;

use crate::format::result_file::FailureKind;

/// End of a process that left no result and no record of its failure.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Cause {
    pub kind: FailureKind,
    pub text: String,
    pub exit_code: Option<i32>,
    pub signal: Option<i32>,
}

/// Returns the cause by the exit status and the end of standard error.
pub(crate) fn cause_of(status: ExitStatus, errors: &str, max_memory_mib: Option<u64>) -> Cause {
    let (exit_code, signal) = (status.code(), signal_of(status));
    let last = errors.lines().rev().find(|line| !line.trim().is_empty()).unwrap_or_default().trim();
    let (kind, text) = match (exit_code, signal) {
        _ if is_out_of_memory(errors, max_memory_mib) => {
            let bound = max_memory_mib.map_or(String::new(), |mib| format!(" within --max-memory {mib} MiB"));
            (FailureKind::Machine, format!("out of memory{bound}"))
        }
        (_, Some(signal)) => (FailureKind::Machine, format!("ended by {}{}", signal_name(signal), behind(last))),
        (Some(2), _) => (FailureKind::Input, last.to_owned()),
        (Some(130), _) => (FailureKind::Interrupted, "interrupted".to_owned()),
        (Some(101), _) => (FailureKind::Internal, format!("panicked{}", behind(panic_message(errors)))),
        (Some(code), _) => (FailureKind::Internal, format!("ended with exit code {code}{}", behind(last))),
        (None, None) => (FailureKind::Machine, format!("ended without an exit code{}", behind(last))),
    };
    Cause { kind, text, exit_code, signal }
}

fn behind(text: &str) -> String {
    if text.is_empty() { String::new() } else { format!(": {text}") }
}

/// Returns whether an allocation failed: Rust's allocator aborts with the first text; threads that
/// get no stack fail with the others, which count only under a bound.
fn is_out_of_memory(errors: &str, max_memory_mib: Option<u64>) -> bool {
    let no_thread = ["Resource temporarily unavailable", "Cannot allocate memory"];
    let is_there = |text: &&str| errors.contains(*text);
    is_there(&"memory allocation of ") || (max_memory_mib.is_some() && no_thread.iter().any(is_there))
}

/// Returns the place and message of a panic.
fn panic_message(errors: &str) -> &str {
    let at = errors.find("panicked at ").map_or(0, |at| at + "panicked at ".len());
    errors[at..].trim().split("\nnote: ").next().unwrap_or_default()
}

#[cfg(unix)]
fn signal_of(status: ExitStatus) -> Option<i32> {
    std::os::unix::process::ExitStatusExt::signal(&status)
}

#[cfg(not(unix))]
fn signal_of(_: ExitStatus) -> Option<i32> {
    None
}

fn signal_name(signal: i32) -> String {
    let name = match signal {
        1 => "hang-up",
        2 => "interrupt",
        6 => "abort",
        7 => "bus error",
        8 => "arithmetic error",
        9 => "kill, by a user or by the system for want of memory",
        11 => "segmentation fault or stack overflow",
        15 => "termination request",
        24 => "limit of processor time",
        25 => "limit of file size",
        _ => return format!("signal {signal}"),
    };
    format!("signal {signal} ({name})")
}

#[cfg(test)]
#[path = "../../tests/unit/run/cause.rs"]
mod tests;
