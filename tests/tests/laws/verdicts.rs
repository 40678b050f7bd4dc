//! Verdicts of the mesh tree are those of brute force over all triangles.

use facemill_tests::tables::sweep::{Kind, parts, sweep};

/// Postures per kind of body and mesh.
const POSTURES: usize = 400;

#[test]
fn verdicts_are_those_of_brute_force_for_every_kind_of_body_on_every_mesh() {
    let (mut n, mut hits, mut grazing, mut inside, mut in_band, mut undecided) = (0, 0, 0, 0, 0, 0);
    for (name, mesh) in parts(false) {
        for kind in Kind::ALL {
            let tally = sweep(&mesh, kind, POSTURES, 2);
            assert!(tally.wrong.is_empty(), "{name}, {kind:?}: {:#?}", tally.wrong);
            n += tally.postures;
            hits += tally.hits;
            grazing += tally.grazing;
            inside += tally.inside;
            in_band += tally.in_band;
            undecided += tally.undecided;
        }
    }
    println!(
        "{n} postures, {hits} hits, {grazing} grazing, {inside} inside, {in_band} in the band, {undecided} undecided"
    );
    assert!(n >= 5 * 5 * POSTURES && 10 * hits > 3 * n && 10 * hits < 9 * n, "{hits} hits of {n}");
    assert!(
        10 * grazing > n && inside > 20 && 50 * in_band < n && 20 * undecided < n,
        "{grazing} grazing, {inside} inside, {in_band} in band, {undecided}"
    );
}
