//! Time of one chip area for each cutter, surface and orientation: `cargo run --release -p
//! facemill-chip-area --example chip_speed`.

use std::hint::black_box;
use std::time::Instant;

use facemill_chip_area::{
    Beside, CutterEnd, Engagement, Method, NeighbourAxis, Orientation, PassError, PassSection, SectionSurface,
    chip_of_pass,
};

use NeighbourAxis::{Parallel, Turned};

fn main() -> Result<(), PassError> {
    println!("{:12} {:8} {:10} {:18} {:>9}", "cutter", "surface", "axis", "method", "ns");
    for (cutter, corner_radius) in [("flat", 0.0), ("bull-nose", 2.0), ("ball", 6.0)] {
        for surface in
            [SectionSurface::Plane, SectionSurface::Convex { radius: 20.0 }, SectionSurface::Concave { radius: 20.0 }]
        {
            for (axis, lead, lean, neighbour_axis) in [
                ("across", 0.0, 0.5, Parallel),
                ("along", 0.5, 0.0, Parallel),
                ("both", 0.3, 0.5, Parallel),
                ("turned", 0.3, 0.5, Turned),
            ] {
                let section = PassSection {
                    cutter: CutterEnd { radius: 6.0, corner_radius },
                    surface,
                    engagement: Engagement {
                        depth_of_cut: 2.0,
                        left: Beside::Stock,
                        right: Beside::Cut { step_over: 1.0 },
                    },
                    orientation: Orientation { lead, lean },
                    neighbour_axis,
                };
                let chip = chip_of_pass(&section)?;
                // The fastest of many short runs: what else the machine does is in the others.
                let runs = if chip.method == Method::ClosedForm { 20 } else { 2 };
                let mut ns = u128::MAX;
                for _ in 0..if chip.method == Method::Quadrature { 50 } else { 2000 } {
                    let start = Instant::now();
                    for _ in 0..runs {
                        black_box(chip_of_pass(black_box(&section))?);
                    }
                    ns = ns.min(start.elapsed().as_nanos() / runs);
                }
                let surface = format!("{surface:?}").split(' ').next().unwrap_or_default().to_owned();
                println!("{cutter:12} {surface:8} {axis:10} {:18} {ns:>9}", format!("{:?}", chip.method));
            }
        }
    }
    Ok(())
}
