//! How long the readers take for a program of a million blocks, and how much memory.
//!
//! `cargo run --release -p facemill-nc-program --example read_speed [BLOCKS]`
#![expect(clippy::print_stdout, reason = "an example for the terminal")]

use std::{fmt::Write, time::Instant};

use facemill_nc_program::read_fanuc;

fn main() {
    let n: usize = std::env::args().nth(1).and_then(|n| n.parse().ok()).unwrap_or(1_000_000);
    let text = five_axes(n);
    println!("{n} blocks, {:.1} MB, memory {} MB", text.len() as f64 / 1e6, memory_mb("VmRSS"));
    let start = Instant::now();
    let read = read_fanuc(&text).expect("it is a program");
    let seconds = start.elapsed().as_secs_f64();
    println!("fanuc: {seconds:.2} s, {} blocks, memory {} MB", read.blocks.len(), memory_mb("VmRSS"));
}

fn five_axes(n: usize) -> String {
    let mut text = String::with_capacity(64 * n);
    text.push_str("%\nO1001(SPEED)\nG21 G90 G94 G54\nG0 X0. Y0. Z100. B0. C0.\n");
    for k in 0..n {
        let t = k as f64 * 1e-3;
        let (x, y, z) = (300.0 * t.sin(), 250.0 * (1.3 * t).cos(), 20.0 * (2.1 * t).sin());
        let (b, c, f) = (30.0 + 10.0 * t.cos(), 57.3 * t % 360.0, 800 + k % 700);
        let _ = writeln!(text, "N{} G1 X{x:.3} Y{y:.3} Z{z:.3} B{b:.3} C{c:.3} F{f}.", k % 99_999);
    }
    text.push_str("M30\n%\n");
    text
}

/// A figure of this process, 0 where the system does not tell.
fn memory_mb(name: &str) -> usize {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|l| l.strip_prefix(name)).unwrap_or_default();
    let kb: String = line.chars().filter(char::is_ascii_digit).collect();
    kb.parse::<usize>().unwrap_or(0) / 1024
}
