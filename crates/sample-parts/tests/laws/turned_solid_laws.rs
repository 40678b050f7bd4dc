//! Solids of revolution.

use facemill_sample_parts::turned_solid;

use crate::kit;

/// Pedestal, arbor and nut: radii and heights.
const OUTLINE: [[f64; 2]; 6] =
    [[80.0, -500.0], [80.0, -200.0], [35.0, -200.0], [35.0, 200.0], [55.0, 200.0], [55.0, 230.0]];

#[test]
fn a_turned_solid_is_closed_and_encloses_the_round_one() {
    let solid = turned_solid("arbor", &OUTLINE);
    assert!(kit::is_closed(&solid));
    assert_eq!(solid.groups().len(), 1);
    let frusta = OUTLINE.windows(2).map(|pair| {
        let ([r, z], [s, t]) = (pair[0], pair[1]);
        std::f64::consts::PI / 3.0 * (t - z) * (r * r + r * s + s * s)
    });
    let (volume, round) = (kit::volume(&solid), frusta.sum::<f64>());
    assert!(volume > round && volume < 1.0011 * round, "{volume} {round}");
    // No facet cuts into the round solid: the middle of every edge around is at its radius.
    for triangle in 0..solid.triangles().len() {
        let [a, b, c] = solid.corners(triangle);
        for (p, q) in [(a, b), (b, c), (c, a)].into_iter().filter(|(p, q)| p.z == q.z && p.xy() != q.xy()) {
            let (middle, end) =
                (nalgebra::center(&p, &q).xy().coords.norm(), p.xy().coords.norm().max(q.xy().coords.norm()));
            let on_ring = OUTLINE.iter().any(|[r, _]| (middle - r).abs() < 1e-9);
            assert!(on_ring || middle < end, "{middle}");
        }
    }
}
