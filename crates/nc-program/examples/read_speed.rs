//! How long the readers take for a program of a million blocks, and how much memory.
//!
//! `cargo run --release -p facemill-nc-program --example read_speed [BLOCKS] [DIALECT] [lean
//! [keep]]`
//!
//! `lean` reads line by line without texts, and keeps the blocks with `keep` alone. Seconds are
//! those on the core.
#![expect(clippy::print_stdout, reason = "an example for the terminal")]

use std::fmt::Write;

use facemill_nc_program::read::{
    FanucReader, HeidenhainReader, ReadBlock, ReadMotion, SiemensReader, read_fanuc, read_heidenhain, read_linuxcnc,
    read_siemens,
};

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let n: usize = arguments.iter().find_map(|n| n.parse().ok()).unwrap_or(1_000_000);
    let dialect = arguments.iter().find(|a| ["linuxcnc", "siemens", "heidenhain"].contains(&a.as_str()));
    let dialect = dialect.map_or("fanuc", String::as_str);
    let text = five_axes(n, dialect);
    let mb = text.len() as f64 / 1e6;
    println!("{dialect}: {n} blocks, {mb:.1} MB, memory {} MB", memory_mb("VmRSS"));
    let start = seconds_on_core();
    let (blocks, feeds) = if arguments.iter().any(|a| a == "lean") {
        let blocks = lean(&text, dialect, arguments.iter().any(|a| a == "keep"));
        println!("memory {} MB", memory_mb("VmRSS"));
        (blocks.len(), blocks.iter().filter(|b| b.feed_span().is_some()).count())
    } else {
        let read = match dialect {
            "linuxcnc" => read_linuxcnc(&text),
            "siemens" => read_siemens(&text),
            "heidenhain" => read_heidenhain(&text),
            _ => read_fanuc(&text),
        };
        let read = read.expect("it is a program");
        println!("memory with all blocks {} MB", memory_mb("VmRSS"));
        (read.blocks.len(), read.blocks.iter().filter(|b| b.feed_span().is_some()).count())
    };
    let seconds = seconds_on_core() - start;
    println!("block {} B, motion {} B", size_of::<ReadBlock>(), size_of::<ReadMotion>());
    println!("{seconds:.2} s, {blocks} blocks kept, {feeds} feeds, at most {} MB", memory_mb("VmHWM"));
}

/// Line by line without texts; the blocks, where they are kept.
fn lean(text: &str, dialect: &str, keeps: bool) -> Vec<ReadBlock> {
    let (mut gcode, mut siemens) = (FanucReader::new().without_text(), SiemensReader::new().without_text());
    let mut heidenhain = HeidenhainReader::new().without_text();
    if dialect == "linuxcnc" {
        gcode = FanucReader::linuxcnc().without_text();
    }
    let read = |line: &str| match dialect {
        "siemens" => siemens.read_line(line.as_bytes()),
        "heidenhain" => heidenhain.read_line(line.as_bytes()),
        _ => gcode.read_line(line.as_bytes()),
    };
    let blocks = text.lines().map(read).filter_map(|block| block.expect("it is a program"));
    blocks.filter(|_| keeps).collect()
}

/// Returns the running time of this thread so far; 0 if the system does not report it.
fn seconds_on_core() -> f64 {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    text.split_whitespace().next().and_then(|ns| ns.parse::<f64>().ok()).unwrap_or(0.0) * 1e-9
}

fn five_axes(n: usize, dialect: &str) -> String {
    let mut text = String::with_capacity(70 * n);
    text.push_str(match dialect {
        "heidenhain" => "0 BEGIN PGM SPEED MM\n1 TOOL CALL 1 Z S5000\n2 L X+0 Y+0 Z+100 B+0 C+0 R0 FMAX M3\n",
        "siemens" => "G710 G90 G94 G54\nG0 X0 Y0 Z100 B0 C0\nTRAORI\n",
        _ => "G21 G90 G94 G54\nG0 X0. Y0. Z100. B0. C0.\n",
    });
    for k in 0..n {
        let t = k as f64 * 1e-3;
        let (x, y, z) = (300.0 * t.sin(), 250.0 * (1.3 * t).cos(), 20.0 * (2.1 * t).sin());
        let (b, c, f) = (30.0 + 10.0 * t.cos(), 57.3 * t % 360.0, 800 + k % 700);
        let _ = match dialect {
            "heidenhain" => writeln!(text, "{} L X{x:+.3} Y{y:+.3} Z{z:+.3} B{b:+.3} C{c:+.3} F{f}", k + 3),
            _ => writeln!(text, "N{} G1 X{x:.3} Y{y:.3} Z{z:.3} B{b:.3} C{c:.3} F{f}.", k % 99_999),
        };
    }
    text.push_str(if dialect == "heidenhain" { "9 END PGM SPEED MM\n" } else { "M30\n" });
    text
}

/// A figure of this process, 0 where the system does not tell.
fn memory_mb(name: &str) -> usize {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|l| l.strip_prefix(name)).unwrap_or_default();
    let kb: String = line.chars().filter(char::is_ascii_digit).collect();
    kb.parse::<usize>().unwrap_or(0) / 1024
}
