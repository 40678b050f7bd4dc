//! Slack between certified and sampled depths of a job's first setup: `certificate-slack JOB [TIMES
//! PER BLOCK] [THREADS]`.

use std::path::Path;
use std::process::ExitCode;

use facemill::inverse_kinematics::machine_file::CuttingLawFile;
use facemill::{Job, PlanSettings, SilentStages, plan_setup};
use facemill_tests::jobs::copy_of;
use facemill_tests::oracles::interpreter::run;
use facemill_tests::oracles::read_back::ReadBack;
use facemill_tests::oracles::slack::{Slacks, sample};

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let Some(path) = arguments.first() else {
        eprintln!("certificate-slack JOB [TIMES PER BLOCK] [THREADS]");
        return ExitCode::FAILURE;
    };
    let number = |k: usize, default: usize| {
        arguments.get(k).map_or(default, |a| a.parse().unwrap_or_else(|_| panic!("{a} is no number")))
    };
    let (times, threads) = (number(1, 50), number(2, 2));
    let path = Path::new(path);
    let job = Job::read(path).unwrap_or_else(|e| panic!("{e}"));
    let turned = job.machine.to_file().motion.cutting == CuttingLawFile::TipLinearVectorTurned;
    assert!(!turned, "places between two blocks are taken linear in the words: not the law of this machine");
    let planned = plan_setup(&job, 0, PlanSettings { verify: false, certificates: true }, &SilentStages)
        .unwrap_or_else(|e| panic!("{e}"));
    let text = |name: &str| {
        let file = planned.files.iter().find(|(n, _)| n == name);
        String::from_utf8(file.unwrap_or_else(|| panic!("no {name}")).1.clone()).expect("text")
    };
    let certificates = serde_json::from_str(&text("certificates.json")).expect("JSON");
    let back = ReadBack::of(&copy_of(path.parent().expect("a folder")), 0);
    let motions = run(&text("program.nc"));
    let blocks = sample(&back, job.tool.cutter(), &motions, &certificates, times as u32, threads);
    let slacks = Slacks::of(&blocks, &certificates);
    print!("{}", slacks.summary());
    if slacks.exceeded.is_empty() { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}
