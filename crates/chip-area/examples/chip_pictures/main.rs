//! Figures of `docs/chip-area.md`: `cargo run --release -p facemill-chip-area --example
//! chip_pictures`.

mod figure;
mod pictures;
mod shapes;
mod thickness;

use std::fs;
use std::path::Path;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/pictures");
    for (name, svg) in [
        ("chip-section.svg", pictures::section()?),
        ("chip-seen.svg", pictures::seen_along_the_feed()?),
        ("chip-slabs.svg", pictures::slabs()?),
        ("chip-cases.svg", pictures::cases()?),
        ("chip-sides.svg", pictures::sides()?),
        ("chip-turned.svg", pictures::turned()?),
        ("chip-thickness.svg", thickness::thickness()),
    ] {
        fs::write(folder.join(name), svg)?;
    }
    Ok(())
}
