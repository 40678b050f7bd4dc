use super::*;

#[cfg(unix)]
fn status(raw: i32) -> ExitStatus {
    std::os::unix::process::ExitStatusExt::from_raw(raw)
}

#[cfg(unix)]
#[test]
fn causes_are_those_of_signals_exit_codes_and_texts() {
    let exit = |code: i32| status(code << 8);
    for (status, errors, bound, kind, words) in [
        (status(9), "", None, FailureKind::Machine, "signal 9 (kill"),
        (
            status(6),
            "memory allocation of 64 bytes failed\n",
            Some(128),
            FailureKind::Machine,
            "out of memory within --max-memory 128 MiB",
        ),
        (status(6), "assertion\n", None, FailureKind::Internal, "signal 6 (abort): assertion"),
        (status(11), "", None, FailureKind::Internal, "signal 11"),
        (status(15), "", None, FailureKind::Machine, "signal 15 (termination request)"),
        (
            exit(101),
            "thread 'main' panicked at a.rs:1:2:\nplanted\nnote: run with\n",
            None,
            FailureKind::Internal,
            "panicked: a.rs:1:2:\nplanted",
        ),
        (exit(101), "Resource temporarily unavailable", Some(64), FailureKind::Machine, "out of memory"),
        (exit(101), "panicked at a: Resource temporarily unavailable", None, FailureKind::Internal, "panicked"),
        (exit(2), "facemill: job.json: wrong\n", None, FailureKind::Input, "facemill: job.json: wrong"),
        (exit(3), "cannot write\n\n", None, FailureKind::Internal, "exit code 3: cannot write"),
        (exit(130), "", None, FailureKind::Interrupted, "interrupted"),
    ] {
        let cause = cause_of(code_and_signal(status), errors, bound);
        assert_eq!(cause.kind, kind, "{cause:?}");
        assert!(cause.text.contains(words), "{cause:?}");
        assert_eq!((cause.exit_code, cause.signal.is_some()), (status.code(), status.code().is_none()));
    }
}
