//! Writes the page of a program without running it on the virtual machine, and prints how long each
//! step takes: `cargo run --release -p facemill-report-page --example page_of_program -- JOB
//! PROGRAM OUT.html`.

use std::path::Path;
use std::time::Instant;

use facemill_job::load::job::Job;
use facemill_report_page::document::{PageSource, page_data};
use facemill_report_page::html::report_html;
use serde_json::json;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [job, program, out] = &arguments[..] else { return Err("give JOB PROGRAM OUT.html".into()) };
    let job = Job::read(Path::new(job))?;
    let text = std::fs::read(program)?;
    let began = Instant::now();
    let source = PageSource {
        job: &job,
        setup: 0,
        dialect: job.post.dialect(),
        program: Path::new(program),
        text: &text,
        written: Vec::new(),
        result: json!({ "verified": false, "findings": [] }),
        certificates: None,
        chips: None,
        postures: None,
        pictures: Vec::new(),
        read: None,
        left: None,
    };
    let data = page_data(source)?;
    let read = began.elapsed();
    let page = report_html(&data);
    println!(
        "data {:.2} s, file {:.2} s, {:.2} MB, {} motions",
        read.as_secs_f64(),
        (began.elapsed() - read).as_secs_f64(),
        page.len() as f64 / 1e6,
        data.document.motion.n
    );
    for line in data.document.thinned.iter().chain(&data.document.not_shown) {
        println!("  {line}");
    }
    std::fs::write(out, page)?;
    Ok(())
}
