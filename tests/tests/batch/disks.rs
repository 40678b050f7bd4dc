//! Results on disks that take no more, or nothing.

use std::os::unix::fs::PermissionsExt;
use std::os::unix::process::CommandExt;
use std::path::Path;
use std::process::{Command, Output};

use facemill_tests::batches::{assert_clean, assert_whole, batch, batch_command, blink_batch, keys_in};
use facemill_tests::jobs::JobFolder;
use facemill_tests::program::{code_and_errors, facemill};

fn text(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr)
}

fn runs_to_the_end(job: &JobFolder, n: usize) {
    let output = batch(job, "run", "out", &[]);
    assert_eq!(code_and_errors(&output).0, 0, "{}", text(&output));
    assert_eq!(keys_in(&job.path("out")).len(), n);
    assert_whole(&job.path("out"));
    assert_clean(&job.path("out"));
}

/// The bound on the size of a file is a disk that takes the small ones alone.
#[test]
fn results_that_cannot_be_written_are_not_there_and_come_with_the_next_run() {
    let job = blink_batch(2);
    let mut command = Command::new("sh");
    // The signal of the bound is ignored, so that writing fails as on a full disk.
    command.args(["-c", "trap '' XFSZ; ulimit -f 8; exec \"$0\" batch run \"$1\" --out \"$2\""]);
    let output = command.arg(facemill()).arg(job.path("batch.json")).arg(job.path("out")).output().unwrap();
    assert_eq!(output.status.code(), Some(3), "{}", text(&output));
    assert!(
        text(&output).contains("cannot write") && text(&output).contains("2 failed otherwise"),
        "{}",
        text(&output)
    );
    assert_eq!(keys_in(&job.path("out")).len(), 0);
    assert_clean(&job.path("out"));
    runs_to_the_end(&job, 2);
}

/// A disk of this size at a place, for as long as this is there; `None` where none can be had.
struct SmallDisk<'a>(&'a Path);

impl<'a> SmallDisk<'a> {
    fn at(place: &'a Path, size: &str) -> Option<Self> {
        std::fs::create_dir_all(place).unwrap();
        let mounted =
            Command::new("mount").args(["-t", "tmpfs", "-o", &format!("size={size}"), "tmpfs"]).arg(place).output();
        mounted.is_ok_and(|output| output.status.success()).then_some(Self(place))
    }

    fn grow(&self, size: &str) {
        let status = Command::new("mount").args(["-o", &format!("remount,size={size}")]).arg(self.0).status();
        assert!(status.unwrap().success());
    }
}

impl Drop for SmallDisk<'_> {
    fn drop(&mut self) {
        let _ = Command::new("umount").arg(self.0).status();
    }
}

#[test]
fn a_full_disk_fails_tasks_and_the_next_run_on_a_larger_one_does_them() {
    let job = blink_batch(3);
    let place = job.path("out");
    let Some(disk) = SmallDisk::at(&place, "160k") else {
        println!("skipped: this user may not mount a small disk");
        return;
    };
    let output = batch(&job, "run", "out", &["--jobs", "1"]);
    assert_eq!(output.status.code(), Some(3), "{}", text(&output));
    assert!(text(&output).contains("No space left"), "{}", text(&output));
    assert_whole(&place);
    disk.grow("20m");
    runs_to_the_end(&job, 3);
}

/// Root may write everywhere, so the command runs as another user where the test is root's.
#[test]
fn a_folder_that_cannot_be_written_to_is_exit_3_before_anything_is_planned() {
    const NOBODY: u32 = 65534;
    let job = blink_batch(1);
    let open = |path: &Path, mode: u32| std::fs::set_permissions(path, std::fs::Permissions::from_mode(mode)).unwrap();
    open(&job.path(""), 0o555);
    let copy = tempfile::tempdir().unwrap();
    open(copy.path(), 0o755);
    let program = copy.path().join("facemill");
    std::fs::copy(facemill(), &program).unwrap();
    let mut command = Command::new(program);
    command.args(batch_command(&job, "run", "out", &[]).get_args());
    let is_root = std::os::unix::fs::MetadataExt::uid(&std::fs::metadata(job.path("")).unwrap()) == 0;
    if is_root {
        command.uid(NOBODY);
    }
    let output = match command.output() {
        Ok(output) => output,
        Err(e) => {
            println!("skipped: the command cannot run as another user: {e}");
            open(&job.path(""), 0o755);
            return;
        }
    };
    open(&job.path(""), 0o755);
    assert_eq!(output.status.code(), Some(3), "{}", text(&output));
    assert!(text(&output).contains("cannot write") && text(&output).contains("ermission denied"), "{}", text(&output));
    assert!(!job.path("out").exists());
}
