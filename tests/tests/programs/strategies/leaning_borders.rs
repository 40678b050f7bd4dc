//! Passes that meet the border of their region aslant: the strips beside their ends are cut to the
//! border, over which entries and exits lead.

use facemill::new_job::NewJob;
use facemill_tests::jobs::JobFolder;
use serde_json::{Value, json};

/// Permitted cusp, mm.
const CUSP: f64 = 0.03;

/// A job of a face mill of 10 mm on a plate, with planes at 45° to its sides.
fn askew(entry: &Value, edge_fill: bool) -> JobFolder {
    let job = JobFolder::new(&NewJob::Patch { size_mm: 100.0 });
    let [nx, ny] = [12, 9];
    let vertices = (0..=ny).flat_map(|j| (0..=nx).map(move |i| format!("v {} {} 0\n", 2 * i - nx, 2 * j - ny)));
    let faces = (0..ny).flat_map(|j| {
        (0..nx).map(move |i| {
            let [a, b] = [j * (nx + 1) + i + 1, (j + 1) * (nx + 1) + i + 1];
            format!("f {a} {} {}\nf {a} {} {b}\n", a + 1, b + 1, b + 1)
        })
    });
    job.write("patch.obj", vertices.chain(faces).collect::<String>().as_bytes());
    let slanted = 0.5f64.sqrt();
    job.set(
        "job.json",
        &[
            ("/verification", json!({ "cut_stock": false })),
            ("/operations/0/path/strategy/strategy/parallel_planes/normal", json!([slanted, slanted, 0.0])),
            ("/operations/0/path/strategy/edge_fill", json!(edge_fill)),
            ("/operations/0/entry", entry.clone()),
            ("/operations/0/exit", entry.clone()),
            ("/operations/0/tolerances/cusp_mm", json!(CUSP)),
            ("/operations/0/tolerances/gouge_mm", json!(0.005)),
            ("/operations/0/tolerances/max_lift_mm", json!(0.01)),
            ("/operations/0/tolerances/max_step_mm", json!(1.0)),
            ("/operations/0/tolerances/max_step_over_mm", json!(8.0)),
        ],
    );
    job
}

#[test]
fn planes_at_45_degrees_to_the_sides_of_a_plate_keep_the_cusp_up_to_its_border() {
    let arc = json!({ "radius_mm": 62.5, "angle_deg": 8.0 });
    let shortest = json!({ "radius_mm": 62.5, "angle_deg": 8.0, "straight_mm": 5.0 });
    for entry in [json!({ "tangential_arc": arc }), json!({ "shortest": shortest })] {
        for edge_fill in [true, false] {
            let planned = askew(&entry, edge_fill).plan();
            let left = &planned.report.remaining.as_ref().expect("a plan").operations[0];
            let largest = left.largest.expect("samples");
            // Beside a leaning border, fronts may be a tenth farther than half a strip.
            let most = if edge_fill { 1.03 * 1.1 * 1.1 } else { 1.03 };
            assert!(largest.height_mm <= most * CUSP, "{entry}, edge fill {edge_fill}: {largest:?}");
        }
    }
}
