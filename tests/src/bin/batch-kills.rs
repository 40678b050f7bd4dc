//! Kills a batch of small jobs at random times, and compares its results with those of tasks run
//! one by one: `batch-kills [TASKS] [KILLS] [SEED]`, 300, 20 and 1 without arguments.

use std::collections::BTreeMap;
use std::time::{Duration, Instant, SystemTime};

use facemill_test_kit::Random;
use facemill_tests::batches::{
    BatchAtWork, Victim, assert_clean, assert_whole, blink_batch, keys_in, one_by_one, results_in,
};

fn main() {
    let numbers: Vec<u64> = std::env::args().skip(1).map(|a| a.parse().expect("a number")).collect();
    let [tasks, kills, seed] =
        [(0, 300), (1, 20), (2, 1)].map(|(k, default)| numbers.get(k).copied().unwrap_or(default));
    let job = blink_batch(tasks as usize);
    let began = Instant::now();
    let expected = one_by_one(&job, tasks as usize);
    let alone = began.elapsed().as_secs_f64();
    println!("{tasks} tasks one by one in {alone:.1} s");
    let out = job.path("out");
    let mut random = Random(seed);
    let mut finished: BTreeMap<String, SystemTime> = BTreeMap::new();
    let mut done = 0;
    let began = Instant::now();
    // On average the kills leave room for the work between them.
    let between = 1.6 * alone / 2.0 / kills as f64;
    while done < kills {
        let victim = [Victim::Group, Victim::Scheduler, Victim::Worker][done as usize % 3];
        let mut run = BatchAtWork::start(&job, &["--quiet", "--retries", "2"]);
        std::thread::sleep(Duration::from_secs_f64(random.between(0.1, between.max(0.2))));
        let killed = run.kill(victim);
        if let Victim::Worker = victim {
            run.kill(Victim::Group);
        }
        done += u64::from(killed);
        assert_whole(&out);
        for key in keys_in(&out) {
            let written =
                std::fs::metadata(out.join("tasks").join(&key).join("result.json")).and_then(|m| m.modified());
            let written = written.expect("a time");
            let before = *finished.entry(key.clone()).or_insert(written);
            assert!(before == written, "{key} was run again");
        }
        println!("kill {done} of {kills}: {victim:?}, {} of {tasks} results", finished.len());
        if finished.len() == tasks as usize {
            println!("all results are there before the last kill");
            break;
        }
    }
    let code = BatchAtWork::start(&job, &["--quiet"]).code();
    assert_eq!(code, 0);
    assert_whole(&out);
    assert_clean(&out);
    assert!(results_in(&out) == expected, "the results differ from those of tasks run one by one");
    println!(
        "{done} kills in {:.1} s: every result once, equal to those of tasks run one by one",
        began.elapsed().as_secs_f64()
    );
}
