//! Files of a CAM system, where they are.

use std::path::Path;

use facemill_cl_file::{AptMeaning, AptPointKind, csys_frame, read_apt};
use facemill_cl_post::PostOptions;
use facemill_nc_program::Dialect;
use facemill_test_kit::SHARED_NC;
use nalgebra::Isometry3;

use crate::kit::*;

/// A file in every dialect on three machines: read back, each tool in its order, each point but
/// those of cycles.
fn is_posted_everywhere(name: &str) {
    let path = Path::new(SHARED_NC).join(name);
    let Ok(text) = std::fs::read_to_string(&path) else {
        eprintln!("SKIPPED: {} is not there", path.display());
        return;
    };
    let file = read_apt(&text).unwrap();
    let (numbers, center) = (tool_numbers(&file), middle_of(&file));
    for machine in ["bridge-head-head-a-b", "head-b-table-c", "head-head-c-a"] {
        for dialect in Dialect::ALL {
            let mut stage = Stage::control(machine, dialect, None);
            stage.tools = numbers.iter().map(|number| tool(*number, LENGTH)).collect();
            stage.table_from_work *= Isometry3::from(-center);
            // The tools of the file are others.
            let options = PostOptions {
                retract: Some(5.0),
                law_feeds: false,
                tolerance: 0.05,
                other_cutters: numbers.clone(),
                ..PostOptions::new(name)
            };
            let posted = stage
                .post_with(&text, &options)
                .unwrap_or_else(|e| panic!("{name} on {machine} for {}: {e}", dialect.name()));
            assert!(posted.is_as_meant, "{name} on {machine}: {:?}", posted.report.faults);
            let points: usize = posted.report.tools.iter().map(|t| t.points).sum();
            assert_eq!(points, file.points.len(), "{name}");
            let arcs = file.points.iter().filter(|p| p.kind == AptPointKind::Arc).count();
            assert_eq!(posted.report.tools.iter().map(|t| t.arcs).sum::<usize>(), arcs, "{name}");
            let cycles = file.points.iter().any(|p| p.kind == AptPointKind::Cycle);
            assert_eq!(posted.report.is_clean(), !cycles, "{name}: {:?}", posted.report.faults);
        }
    }
}

#[test]
fn interface_glue_is_posted_in_all_dialects_on_three_machines() {
    is_posted_everywhere("aamorim_Interface-glue.apt");
}

#[test]
fn basemach_is_posted_in_all_dialects_on_three_machines() {
    is_posted_everywhere("aamorim_basemach.apt");
}

#[test]
fn manufacture_is_posted_in_all_dialects_on_three_machines() {
    is_posted_everywhere("aamorim_manufacture3-top.apt");
}

/// The file drills five holes in the frame of its line 76, and the same five in that of line 98,
/// which is turned by a right angle.
#[test]
fn holes_in_a_turned_frame_are_those_of_the_frame_without_a_turn() {
    let path = Path::new(SHARED_NC).join("aamorim_manufacture3-top.apt");
    let Ok(text) = std::fs::read_to_string(&path) else {
        eprintln!("SKIPPED: {} is not there", path.display());
        return;
    };
    let file = read_apt(&text).unwrap();
    let holes = |line: u32| -> Vec<nalgebra::Point3<f64>> {
        let frame = file.statements.iter().position(|s| s.line == line).unwrap();
        let AptMeaning::Frame(Some(rows)) = &file.statements[frame].meaning else { panic!("line {line} is no CSYS") };
        let to_part = csys_frame(rows, line).unwrap();
        file.points.iter().filter(|p| p.frame == Some(frame as u32)).map(|p| to_part * p.cl.tip).collect()
    };
    let (plain, turned) = (holes(76), holes(98));
    assert_eq!((plain.len(), turned.len()), (6, 6));
    for (a, b) in plain.iter().zip(&turned) {
        assert!((a - b).norm() < 2e-3, "{a} and {b}");
    }
}

/// Numbers of the tools of a file, each once.
pub(crate) fn tool_numbers(file: &facemill_cl_file::AptFile) -> Vec<u32> {
    let of_tool = |s: &facemill_cl_file::AptStatement| match s.meaning {
        AptMeaning::Tool { number, .. } => Some(number),
        _ => None,
    };
    let numbers: std::collections::BTreeSet<u32> = file.statements.iter().filter_map(of_tool).collect();
    numbers.into_iter().collect()
}

/// The middle of all points of the part, which is put in that of the machine.
pub(crate) fn middle_of(file: &facemill_cl_file::AptFile) -> nalgebra::Vector3<f64> {
    let of = |k: usize| {
        let values = file.points.iter().map(|p| frame_of(file, p.frame).transform_point(&p.cl.tip)[k]);
        let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
        0.5 * (low + high)
    };
    nalgebra::Vector3::new(of(0), of(1), of(2))
}

/// The frame in which a point is given, from the numbers of its CSYS.
pub(crate) fn frame_of(file: &facemill_cl_file::AptFile, frame: Option<u32>) -> nalgebra::Matrix4<f64> {
    let Some(AptMeaning::Frame(Some(rows))) = frame.map(|k| &file.statements[k as usize].meaning) else {
        return nalgebra::Matrix4::identity();
    };
    // A row for each axis; the origin has a coordinate in each.
    let mut frame = nalgebra::Matrix4::identity();
    for axis in 0..3 {
        for k in 0..3 {
            frame[(k, axis)] = rows[4 * axis + k];
        }
        frame[(axis, 3)] = rows[4 * axis + 3];
    }
    frame
}
