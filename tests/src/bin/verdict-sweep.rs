//! Verdicts of the mesh tree against brute force on the full meshes: `verdict-sweep [POSTURES PER
//! KIND AND MESH] [THREADS]`.

use std::process::ExitCode;

use facemill_tests::tables::sweep::{Kind, parts, sweep};

fn main() -> ExitCode {
    let mut arguments = std::env::args().skip(1).map(|a| a.parse().unwrap_or_else(|_| panic!("{a} is no number")));
    let n = arguments.next().unwrap_or(10_000);
    let threads = arguments.next().unwrap_or(2);
    println!("| mesh | triangles | body | postures | hits | inside | grazing | in the band | undecided | wrong |");
    println!("|---|---|---|---|---|---|---|---|---|---|");
    let mut n_wrong = 0;
    for (name, mesh) in parts(true) {
        let triangles = mesh.triangles().len();
        for kind in Kind::ALL {
            let t = sweep(&mesh, kind, n, threads);
            let (hits, inside, wrong) = (t.hits, t.inside, t.wrong.len());
            println!(
                "| {name} | {triangles} | {kind:?} | {} | {hits} | {inside} | {} | {} | {} | {wrong} |",
                t.postures, t.grazing, t.in_band, t.undecided
            );
            t.wrong.iter().take(5).for_each(|w| eprintln!("{name}: {w}"));
            n_wrong += wrong;
        }
    }
    if n_wrong == 0 { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}
