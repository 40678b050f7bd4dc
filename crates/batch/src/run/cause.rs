//! Causes for which a process ended without a result.

use std::process::ExitStatus;

use crate::format::result_file::FailureKind;

/// End of a process that left no result and no record of its failure.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Cause {
    /// Kind of the failure.
    pub kind: FailureKind,
    /// Cause, in words.
    pub text: String,
    /// Exit code of the process; `None` if a signal ended it.
    pub exit_code: Option<i32>,
    /// Signal that ended it.
    pub signal: Option<i32>,
}

/// Returns the cause by the exit code or signal and the end of standard error.
pub fn cause_of((exit_code, signal): (Option<i32>, Option<i32>), errors: &str, max_memory_mib: Option<u64>) -> Cause {
    let last = errors.lines().rev().find(|line| !line.trim().is_empty()).unwrap_or_default().trim();
    let (kind, text) = match (exit_code, signal) {
        _ if is_out_of_memory(errors, max_memory_mib) => {
            let bound = max_memory_mib.map_or(String::new(), |mib| format!(" within --max-memory {mib} MiB"));
            (FailureKind::Machine, format!("out of memory{bound}"))
        }
        (_, Some(signal)) => (kind_of_signal(signal), format!("ended by {}{}", signal_name(signal), behind(last))),
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

/// Returns the exit code and the signal of a process.
#[cfg(unix)]
pub(crate) fn code_and_signal(status: ExitStatus) -> (Option<i32>, Option<i32>) {
    let signal = std::os::unix::process::ExitStatusExt::signal(&status);
    (status.code(), signal)
}

/// Returns the exit code of a process, which knows no signals here.
#[cfg(not(unix))]
pub(crate) fn code_and_signal(status: ExitStatus) -> (Option<i32>, Option<i32>) {
    (status.code(), None)
}

/// Returns the kind of failure that a signal makes: those that others send are of the machine, and
/// those of the program's own faults come again with every try.
fn kind_of_signal(signal: i32) -> FailureKind {
    // Hang-up, interrupt, kill, termination request, limit of processor time.
    if matches!(signal, 1 | 2 | 9 | 15 | 24) { FailureKind::Machine } else { FailureKind::Internal }
}

/// Returns whether a signal is one by which users stop programs.
pub(crate) fn is_stop_request(signal: Option<i32>) -> bool {
    // Hang-up, interrupt, termination request.
    matches!(signal, Some(1 | 2 | 15))
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
