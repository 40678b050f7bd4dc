//! Passes laid on meshes of 500,000 and 2,000,000 triangles, 1,000 passes with about 1,000,000
//! points on the larger one: planes, a flow between two edges, and a spiral around a tube. The time
//! per triangle has to stay the same.

use std::f64::consts::TAU;
use std::time::Duration;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use facemill::cc_path::{
    Flow, FlowEnd, LaySettings, ParallelPlanes, Region, Sections, Spiral, SpiralLevels, Strategy, lay_passes,
};
use facemill_cl_data::Silent;
use facemill_sample_parts::{PatchSpec, patch};
use facemill_surface_model::{Surface, SurfaceSettings, TriMesh};
use nalgebra::{Point3, Unit, Vector3};

fn planes(normal: Unit<Vector3<f64>>) -> ParallelPlanes {
    ParallelPlanes { origin: Point3::origin(), normal, from: None, to: None }
}

/// A flow between the edges of a patch at y = −`half` and y = `half`.
fn flow(half: f64) -> Strategy {
    let end = |y: f64| FlowEnd::Plane { origin: Point3::new(0.0, y, 0.0), normal: Vector3::y_axis() };
    Strategy::Flow(Flow { from: end(-half), to: end(half), within: 1e-3 })
}

fn spiral() -> Strategy {
    Strategy::Spiral(Spiral { levels: SpiralLevels::Sections(Sections::ParallelPlanes(planes(Vector3::z_axis()))) })
}

/// A waisted tube of `rows` × `rows` quads, 1,000 mm high.
fn tube(rows: usize) -> TriMesh {
    let vertices = (0..=rows).flat_map(|j| {
        let share = j as f64 / rows as f64;
        let radius = 150.0 + 20.0 * (TAU * share).cos();
        (0..rows).map(move |k| {
            let (sin, cos) = (TAU * k as f64 / rows as f64).sin_cos();
            Point3::new(radius * cos, radius * sin, 1000.0 * share)
        })
    });
    let at = |j: usize, k: usize| (j * rows + k % rows) as u32;
    let quads = (0..rows).flat_map(|j| (0..rows).map(move |k| (j, k)));
    let triangles = quads.flat_map(|(j, k)| {
        let [a, b, c, d] = [at(j, k), at(j, k + 1), at(j + 1, k), at(j + 1, k + 1)];
        [[a, b, d], [a, d, c]]
    });
    TriMesh::new(vertices.collect(), triangles.collect()).expect("indices are in range")
}

fn lay(c: &mut Criterion) {
    for quads in [500, 1000] {
        let spec = PatchSpec::new([1000.0, 1000.0], 40.0, [3.1, 2.7]).expect("numbers are in range");
        let sheet = Surface::new(patch(&spec, quads, quads).expect("numbers are in range"), SurfaceSettings::default());
        let tube = Surface::new(tube(quads), SurfaceSettings::default());
        let mut group = c.benchmark_group(format!("lay_passes_{}k", 2 * quads * quads / 1000));
        group.sample_size(10).measurement_time(Duration::from_secs(2)).warm_up_time(Duration::from_millis(500));
        group.throughput(Throughput::Elements(2 * (quads * quads) as u64));
        // As many passes as rows of quads, as many points as quads.
        let step_over = 1000.0 / quads as f64;
        let settings = LaySettings {
            max_step_over: step_over,
            min_step_over: 0.05 * step_over,
            max_step: step_over,
            ..LaySettings::default()
        };
        let cases = [
            ("planes", &sheet, Strategy::ParallelPlanes(planes(Vector3::y_axis()))),
            ("flow", &sheet, flow(500.0)),
            ("spiral", &tube, spiral()),
        ];
        for (name, surface, strategy) in cases {
            group.bench_function(name, |b| {
                b.iter(|| {
                    lay_passes(surface, &Region::default(), &strategy, &settings, &|_| f64::INFINITY, &Silent)
                        .expect("passes on a sound mesh")
                        .passes
                        .len()
                });
            });
        }
        group.finish();
    }
}

criterion_group!(benches, lay);
criterion_main!(benches);
