//! A mill with two heads over a plate, and programs with nine words per block.

use facemill_cl_data::Silent;
use facemill_interference::MeshTree;
use facemill_inverse_kinematics::machine_file::Joint;
use facemill_inverse_kinematics::{AxisKind, AxisValues, Machine};
use facemill_nc_program::dialect::PostFile;
use facemill_nc_program::read::read_fanuc;
use facemill_nc_program::*;
use facemill_tool_model::ToolAssembly;
use facemill_virtual_machine::verify;
use facemill_virtual_machine::{
    Certificates, ObstacleKind, Verification, VerifyError, VerifySettings, VirtualObstacle, VirtualSetup, certify,
};
use nalgebra::{Isometry3, Matrix3, Point3};

/// Length register, tool and spindle of each head, and its tool's length.
pub const NUMBERS: [(u32, u32, u32); 2] = [(7, 7, 1), (31, 12, 2)];
pub const LENGTHS: [f64; 2] = [120.0, 142.5];

/// Faces of the plate that head 1 and head 2 cut, mm.
pub const FACES: [f64; 2] = [160.0, 140.0];

pub struct Shop {
    pub views: Vec<Machine>,
    pub words: WordMap,
    pub tools: [ToolAssembly; 2],
    pub plate: MeshTree,
}

pub fn head_spec(k: usize) -> HeadSpec {
    let (length_register, number, spindle_number) = NUMBERS[k];
    HeadSpec {
        name: ["front", "back"][k].into(),
        spindle_axis: ["Z1", "Z2"][k].parse().unwrap(),
        spindle_number,
        tool: ToolSpec {
            number,
            name: "mill 50".into(),
            radius: super::RADIUS,
            corner_radius: super::CORNER,
            length: LENGTHS[k],
            length_register,
        },
        spindle: SpindleSpec { rpm: 800.0, clockwise: true },
    }
}

impl Shop {
    pub fn new() -> Self {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets/machines/dual-c-horizontal-xyzb.json");
        let mut file = Machine::heads_from_json(&std::fs::read(path).unwrap()).unwrap()[0].to_file();
        // Beside the headstock, which the second head is behind.
        for (chain, home) in file.tool_chains.iter_mut().zip([400.0, -400.0]) {
            let Some(Joint::Prismatic(x)) = &mut chain.rows[0].joint else { panic!("X is the first joint") };
            x.home_mm = home;
        }
        let views = Machine::heads(file).unwrap();
        let offsets = [0.2, 310.0, -12.0, 455.5, 0.0, 290.0, 8.0, 430.25, 0.0];
        let along = |k: usize| {
            let view = views.iter().find(|v| v.moves_tool(k) && !v.is_shared(k)).unwrap_or(&views[0]);
            let (home, mut moved) = (view.home(), view.home());
            moved[k] += 1.0;
            let [a, b] = [home, moved].map(|q| view.cl_point(&q, 0.0));
            if view.axes()[k].kind == AxisKind::Linear { (b.tip - a.tip).dot(&a.axis).round() } else { 0.0 }
        };
        let axis = |(k, offset): (usize, f64)| MappedAxis {
            letter: views[0].axes()[k].letter.as_str().parse().unwrap(),
            offset,
            along_spindle: along(k),
        };
        let axes = offsets.into_iter().enumerate().map(axis).collect();
        let heads = [0, 1].map(|k| head_spec(k).mapped()).to_vec();
        let tools = [0, 1].map(|head| {
            let mut file = super::tool().to_file();
            (file.number, file.gauge_length_mm) = (NUMBERS[head].1, LENGTHS[head]);
            file.holder.sections[0].length_mm += LENGTHS[head] - LENGTHS[0];
            ToolAssembly::new(file).unwrap()
        });
        Self {
            words: WordMap::with_heads(axes, WorkOffset::default(), heads).unwrap(),
            views,
            tools,
            plate: MeshTree::new(&super::box_mesh([250.0, -150.0, FACES[1]], [550.0, 150.0, FACES[0]])),
        }
    }

    pub fn setup(&self, head: usize) -> VirtualSetup<'_> {
        let plate = VirtualObstacle {
            name: "plate".into(),
            mesh: &self.plate,
            kind: ObstacleKind::Part,
            allowance: 0.0,
            stock: 0.0,
        };
        VirtualSetup {
            machine: &self.views[head],
            table_from_work: Isometry3::identity(),
            words: &self.words,
            table_from_rtcp_words: None,
            tool: &self.tools[head],
            length_register: NUMBERS[head].0,
            obstacles: vec![plate],
        }
    }

    /// The table at `c`, both heads square to the plate with their tips at these points of it;
    /// without one the head is where `from` has it.
    pub fn axes_at(&self, c: f64, tips: [Option<[f64; 3]>; 2], from: &AxisValues) -> AxisValues {
        let mut q = *from;
        q[0] = c;
        for (head, tip) in tips.into_iter().enumerate() {
            let (view, length) = (&self.views[head], LENGTHS[head]);
            let own = (0..q.len()).filter(|&k| view.moves_tool(k) && view.axes()[k].kind == AxisKind::Linear);
            let Some(tip) = tip else { continue };
            let at = |q: &AxisValues| view.cl_point(q, length).tip;
            let own: Vec<usize> = own.collect();
            let column = |k: usize| {
                let mut moved = q;
                moved[k] += 1.0;
                at(&moved) - at(&q)
            };
            let directions = Matrix3::from_columns(&[column(own[0]), column(own[1]), column(own[2])]);
            let ways = directions.try_inverse().unwrap() * (Point3::from(tip) - at(&q));
            for (k, way) in own.into_iter().zip(ways.iter()) {
                q[k] += way;
            }
        }
        q
    }

    pub fn verify(&self, text: &str, head: usize) -> Verification {
        let program = read_program(text, Dialect::Fanuc).unwrap();
        verify(&program, &self.setup(head), &VerifySettings::default(), &Silent).unwrap()
    }

    pub fn certify(&self, text: &str, head: usize) -> Certificates {
        let program = read_program(text, Dialect::Fanuc).unwrap();
        certify(&program, &self.setup(head), &VerifySettings::default(), &Silent).unwrap()
    }

    pub fn refused(&self, change: impl Fn(&mut VirtualSetup<'_>)) -> VerifyError {
        let mut setup = self.setup(0);
        change(&mut setup);
        verify(&read_fanuc("").unwrap(), &setup, &VerifySettings::default(), &Silent).unwrap_err()
    }
}

/// A program as its motions, written by the writer with its header and end.
pub struct Program<'a> {
    pub shop: &'a Shop,
    pub at: AxisValues,
    pub blocks: Vec<Block>,
}

impl<'a> Program<'a> {
    pub fn new(shop: &'a Shop) -> Self {
        Self { shop, at: shop.views[0].home(), blocks: Vec::new() }
    }

    pub fn words(&mut self, c: f64, tips: [Option<[f64; 3]>; 2]) -> AxisWords {
        self.at = self.shop.axes_at(c, tips, &self.at);
        self.shop.words.words(self.at.as_slice()).unwrap()
    }

    pub fn rapid(mut self, c: f64, tips: [Option<[f64; 3]>; 2]) -> Self {
        let words = self.words(c, tips);
        self.blocks.push(Block::Rapid { words });
        self
    }

    /// In so many seconds.
    pub fn cut(mut self, c: f64, tips: [Option<[f64; 3]>; 2], seconds: f64) -> Self {
        let words = self.words(c, tips);
        self.blocks.push(Block::Linear { words, feed: 60.0 / seconds });
        self
    }

    pub fn text(self) -> String {
        let axes = self.shop.words.axes().iter().map(|a| AxisSpec {
            letter: a.letter,
            min: -1e3,
            max: 1e3,
            along_spindle: a.along_spindle != 0.0,
            work_offset: a.offset,
        });
        let heads = [head_spec(0), head_spec(1)];
        let spec = ProgramSpec {
            job_name: "blade".into(),
            tool: heads[0].tool.clone(),
            spindle: heads[0].spindle,
            coolant: Coolant::Off,
            work_offset: WorkOffset::default(),
            axes: axes.collect(),
            smallest_feed: 0.0,
            program: NcProgram { blocks: self.blocks },
            rapid: facemill_cl_data::RapidLaw::Linear,
            approach: None,
        };
        let file = PostFile { feed_mode: FeedMode::G93, max_line_length: Some(200), ..PostFile::default() };
        write_program_of_heads(&spec, &heads, &file.settings(None).unwrap()).unwrap().text
    }
}
