//! Memory of processes: its bound, and its largest use.

use facemill_job::failure::Failure;

/// Bounds the address space of this process, MiB, for the rest of its life: an allocation beyond it
/// aborts the process. Threads reserve address space that they do not use; a bound below 256 MiB
/// leaves little for the job.
///
/// # Errors
/// If the system refuses, or has no such bound.
#[cfg(all(unix, not(target_vendor = "apple")))]
pub fn bound_memory(mib: u64) -> Result<(), Failure> {
    use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};
    let bytes = mib.saturating_mul(1 << 20);
    let maximum = getrlimit(Resource::As).maximum;
    let bound = Rlimit { current: Some(maximum.map_or(bytes, |most| most.min(bytes))), maximum };
    setrlimit(Resource::As, bound).map_err(|e| Failure::Internal(format!("cannot bound the memory: {e}")))
}

/// Refuses: this system has no such bound, or does not keep to it.
///
/// # Errors
/// Always.
#[cfg(not(all(unix, not(target_vendor = "apple"))))]
pub fn bound_memory(_: u64) -> Result<(), Failure> {
    can_bound_memory()
}

/// Returns whether [`bound_memory`] bounds anything, for a scheduler whose processes call it.
///
/// # Errors
/// If this system has no such bound, or does not keep to it.
pub fn can_bound_memory() -> Result<(), Failure> {
    if cfg!(all(unix, not(target_vendor = "apple"))) {
        return Ok(());
    }
    Err(Failure::Internal("this system cannot bound the memory of a process; leave out --max-memory".to_owned()))
}

/// Returns the largest memory that a process has had so far, MiB; `None` where the system does not
/// report it, or the process is gone.
pub(crate) fn peak_mib(process: u32) -> Option<u64> {
    let status = std::fs::read_to_string(format!("/proc/{process}/status")).ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kib: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kib.div_ceil(1024))
}
