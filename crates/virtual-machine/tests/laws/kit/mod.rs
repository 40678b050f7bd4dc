//! A shop with a plate and a wall, and programs as text.
#![allow(dead_code, unreachable_pub, reason = "every test program uses a part of it")]

pub mod depth;
pub mod dual;
pub mod stock;

use std::fmt::Write;

use facemill_cl_data::{ClPoint, Silent};
use facemill_interference::MeshTree;
use facemill_inverse_kinematics::{AxisValues, BranchPreference, Machine};
use facemill_nc_program::read_program;
use facemill_nc_program::{Dialect, MappedAxis, WordMap, WorkOffset};
use facemill_surface_model::TriMesh;
use facemill_tool_model::ToolAssembly;
use facemill_virtual_machine::verify;
use facemill_virtual_machine::{Finding, ObstacleKind, Verification, VerifySettings, VirtualObstacle, VirtualSetup};
use nalgebra::{Isometry3, Point3, Translation3, Unit, UnitQuaternion, Vector3};

pub const RADIUS: f64 = 25.0;
pub const CORNER: f64 = 4.0;

/// The cutter of [`tool`] as a solid.
pub const CUTTER: depth::Cutter = depth::Cutter { radius: RADIUS, corner: CORNER, height: 12.0 };

pub fn tool() -> ToolAssembly {
    tool_turning("clockwise")
}

pub fn tool_turning(sense: &str) -> ToolAssembly {
    let file = r#"{
            "format": "facemill-tool/1", "name": "mill 50 r4", "number": 7, "radius_mm": 25, "corner_radius_mm": 4,
            "n_inserts": 4, "flute_length_mm": 12, "max_ramp_angle_deg": 3, "spindle_rotation": "SENSE",
            "stick_out_mm": 60, "gauge_length_mm": 120,
            "body": { "clearance_mm": 1, "sections": [
                { "length_mm": 48, "diameter_low_mm": 44, "diameter_high_mm": 44 } ] },
            "holder": { "clearance_mm": 2, "sections": [
                { "length_mm": 60, "diameter_low_mm": 80, "diameter_high_mm": 80 } ] }
        }"#;
    ToolAssembly::from_json(file.replace("SENSE", sense).as_bytes()).unwrap()
}

pub fn box_mesh(low: [f64; 3], high: [f64; 3]) -> TriMesh {
    let (vertices, triangles) = facemill_test_kit::box_mesh(low, high);
    TriMesh::new(vertices, triangles).unwrap()
}

/// Machine, mounting, offsets and meshes that setups borrow from.
pub struct Shop {
    pub machine: Machine,
    pub words: WordMap,
    pub tool: ToolAssembly,
    pub table_from_work: Isometry3<f64>,
    pub plate: MeshTree,
    /// A wall 60 mm high along x = 150.
    pub wall: MeshTree,
}

impl Shop {
    pub fn new() -> Self {
        Self::with_machine(Machine::head_b_table_c().unwrap())
    }

    pub fn with_machine(machine: Machine) -> Self {
        let offsets = [310.0, -120.0, 455.5, 0.0, 0.2];
        let axes = machine.axes().iter().zip(offsets).map(|(a, offset)| MappedAxis {
            letter: a.letter.as_str().parse().unwrap(),
            offset,
            along_spindle: if a.letter == "Z" { 1.0 } else { 0.0 },
        });
        let tool = tool();
        Self {
            words: WordMap::new(axes.collect(), WorkOffset::default(), tool.gauge_length()).unwrap(),
            machine,
            tool,
            table_from_work: Isometry3::from_parts(
                Translation3::new(320.0, -110.0, 450.0),
                UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 0.35),
            ),
            plate: MeshTree::new(&box_mesh([-200.0, -200.0, -80.0], [200.0, 200.0, 0.0])),
            wall: MeshTree::new(&box_mesh([150.0, -200.0, 0.0], [160.0, 200.0, 60.0])),
        }
    }

    pub fn setup(&self) -> VirtualSetup<'_> {
        let obstacle =
            |name: &str, mesh, kind| VirtualObstacle { name: name.into(), mesh, kind, allowance: 0.0, stock: 0.0 };
        VirtualSetup {
            machine: &self.machine,
            table_from_work: self.table_from_work,
            words: &self.words,
            table_from_rtcp_words: Some(self.table_from_work),
            tool: &self.tool,
            length_register: self.tool.number(),
            obstacles: vec![
                obstacle("plate", &self.plate, ObstacleKind::Part),
                obstacle("wall", &self.wall, ObstacleKind::Fixture),
            ],
        }
    }

    pub fn axes_at(&self, tip: [f64; 3], axis: [f64; 3]) -> AxisValues {
        self.axes_near(tip, axis, &AxisValues::from([0.0, 0.0, 0.0, 0.3, 0.0]))
    }

    /// The solution that is nearest to these.
    pub fn axes_near(&self, tip: [f64; 3], axis: [f64; 3], near: &AxisValues) -> AxisValues {
        let cl = ClPoint { tip: Point3::from(tip), axis: Unit::new_normalize(Vector3::from(axis)) };
        let cl = ClPoint {
            tip: self.table_from_work * cl.tip,
            axis: Unit::new_normalize(self.table_from_work.rotation * cl.axis.into_inner()),
        };
        self.machine.nearest_inverse(&cl, self.tool.gauge_length(), Some(near), BranchPreference::Positive).unwrap()
    }
}

/// A program text, one block for each call after the head.
pub struct Text<'a> {
    pub shop: &'a Shop,
    pub text: String,
}

/// Lines before the first block of [`Text::rapid`] or [`Text::cut`].
pub const HEAD: u32 = 5;

impl<'a> Text<'a> {
    pub fn new(shop: &'a Shop) -> Self {
        Self { shop, text: "%\nO1\nG21 G90 G94 G49\nT7 M6\nS2000 M3\n".into() }
    }

    pub fn words(&self, tip: [f64; 3], axis: [f64; 3]) -> String {
        let q = self.shop.axes_at(tip, axis);
        let words = self.shop.words.words(q.as_slice()).unwrap();
        words.iter().fold(String::new(), |mut line, w| {
            write!(line, " {}{:.4}", w.letter, w.value).unwrap();
            line
        })
    }

    pub fn rapid(self, tip: [f64; 3]) -> Self {
        self.rapid_tilted(tip, [0.0, 0.0, 1.0])
    }

    pub fn rapid_tilted(mut self, tip: [f64; 3], axis: [f64; 3]) -> Self {
        let words = self.words(tip, axis);
        writeln!(self.text, "G0 G43{words} H7").unwrap();
        self
    }

    pub fn cut(self, tip: [f64; 3]) -> Self {
        self.cut_tilted(tip, [0.0, 0.0, 1.0])
    }

    pub fn cut_tilted(mut self, tip: [f64; 3], axis: [f64; 3]) -> Self {
        let words = self.words(tip, axis);
        writeln!(self.text, "G1{words} F2000.").unwrap();
        self
    }

    pub fn line(mut self, line: &str) -> Self {
        writeln!(self.text, "{line}").unwrap();
        self
    }

    pub fn verify(&self) -> Verification {
        self.verify_in(&self.shop.setup())
    }

    pub fn verify_in(&self, setup: &VirtualSetup<'_>) -> Verification {
        let program = read_program(&self.text, Dialect::Fanuc).unwrap();
        verify(&program, setup, &VerifySettings::default(), &Silent).unwrap()
    }
}

pub fn only(v: &Verification) -> &Finding {
    assert_eq!(v.findings.len(), 1, "{:#?}", v.findings);
    &v.findings[0]
}

/// Height of the tip above the plane that a cutter with the axis (slope, 0, 1) touches: (R − r)·sin
/// α + r·(1 − cos α), the rim's lowest point being that much below the tip.
pub fn lift_of(slope: f64) -> f64 {
    let alpha = slope.atan();
    (RADIUS - CORNER) * alpha.sin() + CORNER * (1.0 - alpha.cos())
}
