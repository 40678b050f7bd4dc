use facemill_cl_data::{Aabb, ControlTolerance};
use facemill_file_format::from_json;
use facemill_inverse_kinematics::{preset, preset_names};
use facemill_test_kit::Random;
use nalgebra::{Point3, Vector3};

use super::*;
use crate::examples::new_job::{NewJob, new_job};

/// The patch on a machine preset.
fn on_preset(name: &str) -> Job {
    let files = new_job(&NewJob::Patch { size_mm: 60.0 }).unwrap();
    let held = files.iter().fold(JobFiles::default(), |held, (file, bytes)| held.with(file, bytes.clone()));
    let held = held.with("machine.json", preset(name).unwrap());
    let file: JobFile = from_json(&files.iter().find(|(file, _)| file == "job.json").unwrap().1).unwrap();
    Job::of_values(&file, held).unwrap()
}

fn corners(around: &Aabb) -> impl Iterator<Item = Point3<f64>> {
    let (low, high) = (around.min, around.max);
    (0..8).map(move |k| {
        let pick = |bit: usize, axis: usize| if k >> bit & 1 == 0 { low[axis] } else { high[axis] };
        Point3::new(pick(0, 0), pick(1, 1), pick(2, 2))
    })
}

#[test]
fn no_body_of_a_head_strays_beyond_what_is_planned_for() {
    let mut random = Random(19);
    let mut is_needed = 0;
    for name in preset_names().into_iter().filter(|name| !name.starts_with("dual")) {
        let job = on_preset(name);
        let (machine, length) = (&job.machine, job.tool.gauge_length());
        let ControlTolerance { path, orientation } = machine.motion_law().control_tolerance;
        let more: Vec<f64> =
            job.planned_machine.bodies().iter().zip(machine.bodies()).map(|(p, m)| p.clearance - m.clearance).collect();
        let linearisation = job.file.operations[0].tolerances.linearisation_mm;
        let slack = VerifySettings::default().clearance_slack;
        for _ in 0..50 {
            let mut meant = machine.home();
            let mut strayed = machine.home();
            for (k, _) in machine.axes().iter().enumerate().filter(|(_, a)| a.kind == AxisKind::Rotary) {
                meant[k] = random.between(-1.0, 1.0);
                strayed[k] = meant[k] + if random.below(2) == 0 { -orientation } else { orientation };
            }
            let off = Vector3::from_fn(|_, _| random.between(-1.0, 1.0));
            // The linear axes carry the tip to where it strays, and the head with it.
            let back =
                machine.cl_point(&meant, length).tip - machine.cl_point(&strayed, length).tip + off.normalize() * path;
            let poses = machine.body_poses(&meant).zip(machine.body_poses(&strayed)).zip(&more);
            for ((at, other), more) in poses.filter(|((at, _), _)| at.body.carrier() == Some(Carrier::Head)) {
                for corner in corners(&at.body.body.solid.aabb()) {
                    let strays = (other.table_from_solid * corner + back - at.table_from_solid * corner).norm();
                    let slack = slack.min(at.body.clearance);
                    is_needed += usize::from(strays + linearisation > slack);
                    assert!(strays + linearisation <= slack + more, "{name}: {strays} {more}");
                }
            }
        }
    }
    assert!(is_needed > 100, "{is_needed}");
}
