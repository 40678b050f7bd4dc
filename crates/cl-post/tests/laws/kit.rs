//! Machines, tools and files, and a reader of FANUC words that shares nothing with the product's.

use std::collections::BTreeMap;
use std::path::Path;

use facemill_cl_data::{ClPoint, Monitor, Silent};
use facemill_cl_file::read_apt;
use facemill_cl_post::*;
use facemill_inverse_kinematics::{AxisKind, AxisValues, Machine, preset};
use facemill_job::format::program_stamp::ProgramStamp;
use facemill_nc_program::dialect::{Decimals, PostFile};
use facemill_nc_program::{Dialect, FeedMode, PostSettings, WorkOffset};
use facemill_test_kit::Random;
use facemill_tool_model::ToolAssembly;
use nalgebra::{Isometry3, Point3, Unit, Vector3};

/// Gauge length of tool 7, mm.
pub(crate) const LENGTH: f64 = 150.0;

/// Radius of the cutter of all tools, mm.
pub(crate) const RADIUS: f64 = 10.0;

/// Presets of three kinds: both rotary axes on the table, both on the head, one on each.
pub(crate) const MACHINES: [&str; 3] = ["table-table-a-c", "head-head-c-a", "head-b-table-c"];

/// Where programs of a test run.
pub(crate) struct Stage {
    pub(crate) machine: Machine,
    pub(crate) table_from_work: Isometry3<f64>,
    pub(crate) tools: Vec<ToolAssembly>,
    pub(crate) post: PostSettings,
}

pub(crate) fn tool(number: u32, gauge_length: f64) -> ToolAssembly {
    let holder = gauge_length - 40.0;
    let text = format!(
        r#"{{"format": "facemill-tool/1", "name": "mill {number}", "number": {number}, "radius_mm": {RADIUS},
        "corner_radius_mm": 1, "n_inserts": 2, "flute_length_mm": 12, "max_ramp_angle_deg": 3,
        "spindle_rotation": "clockwise", "stick_out_mm": 40, "gauge_length_mm": {gauge_length},
        "body": {{"clearance_mm": 1, "sections": [{{"length_mm": 28, "diameter_low_mm": 19, "diameter_high_mm": 19}}]}},
        "holder": {{"clearance_mm": 2, "sections":
            [{{"length_mm": {holder}, "diameter_low_mm": 50, "diameter_high_mm": 50}}]}}}}"#
    );
    ToolAssembly::from_json(text.as_bytes()).unwrap()
}

/// A preset with another law of motion in cuts, or its own.
pub(crate) fn machine(name: &str, cutting: Option<&str>) -> Machine {
    let text = preset(name).unwrap();
    let own = "\"cutting\": \"axes_linear\"";
    assert!(text.contains(own));
    let text = cutting.map_or_else(|| text.to_owned(), |law| text.replace(own, &format!("\"cutting\": \"{law}\"")));
    Machine::from_json(text.as_bytes()).unwrap()
}

/// Point of the table about which a machine works: in the middle of its travels.
pub(crate) fn middle(machine: &Machine) -> Point3<f64> {
    let middle = AxisValues::from_fn(machine.axes().len(), |k| match machine.axes()[k].kind {
        AxisKind::Linear => 0.5 * (machine.axes()[k].min + machine.axes()[k].max),
        AxisKind::Rotary => 0.0,
    });
    machine.cl_point(&middle, LENGTH).tip
}

impl Stage {
    /// FANUC with so many decimals of all words.
    pub(crate) fn fanuc(name: &str, decimals: u8) -> Self {
        let decimals = Decimals { linear: decimals, rotary: decimals, ..Decimals::default() };
        Self::of(name, None, PostFile { decimals, ..PostFile::default() })
    }

    /// A dialect without RTCP, or with the machine's law under it.
    pub(crate) fn control(name: &str, dialect: Dialect, law: Option<&str>) -> Self {
        let feeds = dialect.file().feeds;
        let feed_mode = match law {
            Some(_) => FeedMode::Rtcp,
            None if feeds.g94.is_some() => FeedMode::G94,
            None => FeedMode::G93,
        };
        Self::of(name, law, PostFile { dialect, feed_mode, ..PostFile::default() })
    }

    /// FANUC under RTCP with so many decimals of linear and rotary words.
    pub(crate) fn rtcp(name: &str, linear: u8, rotary: u8) -> Self {
        let decimals = Decimals { linear, rotary, ..Decimals::default() };
        let post = PostFile { decimals, feed_mode: FeedMode::Rtcp, ..PostFile::default() };
        Self::of(name, Some("tip_and_rotaries_linear"), post)
    }

    fn of(name: &str, law: Option<&str>, post: PostFile) -> Self {
        let machine = machine(name, law);
        let table_from_work = Isometry3::from(middle(&machine).coords);
        let post = post_on(&machine, &post.settings(None).unwrap()).unwrap();
        Self { machine, table_from_work, tools: vec![tool(7, LENGTH)], post }
    }

    pub(crate) fn post_with(&self, text: &str, options: &PostOptions) -> Result<Posted, PostFault> {
        self.post_watched(text, options, &Silent)
    }

    pub(crate) fn post_watched(
        &self,
        text: &str,
        options: &PostOptions,
        monitor: &dyn Monitor,
    ) -> Result<Posted, PostFault> {
        let zero = AxisValues::zeros(self.machine.axes().len());
        let words = |t: &ToolAssembly| machine_words(&self.machine, &zero, WorkOffset::default(), t.gauge_length());
        let tools = self.tools.iter().map(|tool| PostTool { tool, words: words(tool).unwrap() });
        let scene = PostScene {
            machine: &self.machine,
            table_from_work: self.table_from_work,
            tools: tools.collect(),
            post: &self.post,
        };
        let stamp = ProgramStamp::new(Path::new("test.apt"), text.as_bytes());
        post_cl(&read_apt(text).unwrap(), stamp, Path::new("test.nc"), &scene, options, monitor)
    }

    pub(crate) fn post(&self, text: &str) -> Posted {
        self.post_with(text, &PostOptions::new("test")).unwrap_or_else(|e| panic!("{e}"))
    }

    pub(crate) fn refused(&self, text: &str) -> String {
        match self.post_with(text, &PostOptions::new("test")) {
            Err(fault) => fault.to_string(),
            Ok(posted) => panic!("posted: {}", posted.text),
        }
    }

    /// Tip and axis in the frame of the file at each motion of a text for FANUC without RTCP.
    pub(crate) fn reached(&self, text: &str) -> Vec<Reached> {
        motions(text)
            .iter()
            .map(|motion| {
                let axes = self.axes(motion);
                let cl = self.machine.cl_point(&axes, LENGTH).transformed(&self.table_from_work.inverse());
                Reached { is_rapid: motion.is_rapid, feed: motion.feed, axes, cl }
            })
            .collect()
    }

    /// Axis values of words with the length of tool 7.
    fn axes(&self, motion: &Motion) -> AxisValues {
        let along = self.machine.length_compensation_travel().unwrap();
        AxisValues::from_fn(self.machine.axes().len(), |k| {
            let axis = &self.machine.axes()[k];
            let word = motion.words[axis.letter.as_str()];
            match axis.kind {
                AxisKind::Linear => word + along[k] * LENGTH,
                AxisKind::Rotary => word.to_radians(),
            }
        })
    }
}

/// A position of a text.
pub(crate) struct Reached {
    pub(crate) is_rapid: bool,
    pub(crate) feed: f64,
    pub(crate) axes: AxisValues,
    pub(crate) cl: ClPoint,
}

/// A motion as its words say it.
pub(crate) struct Motion {
    pub(crate) is_rapid: bool,
    pub(crate) feed: f64,
    pub(crate) words: BTreeMap<String, f64>,
}

/// Motions of the body of a program for FANUC, word by word: from its first block with G90 and G94
/// or G93 to M9.
pub(crate) fn motions(text: &str) -> Vec<Motion> {
    let mut all = Vec::new();
    let (mut words, mut is_rapid, mut feed, mut is_body) = (BTreeMap::new(), true, 0.0, false);
    for line in text.lines().filter(|line| !line.starts_with(['(', '%', 'O', '/'])) {
        let said: Vec<&str> = line.split_whitespace().filter(|w| !w.starts_with('N')).collect();
        if said.len() > 3 && said[0] == "G90" && ["G94", "G93"].contains(&said[1]) {
            is_body = true;
        }
        if said.first() == Some(&"M9") {
            is_body = false;
        }
        if !is_body {
            continue;
        }
        let mut moves = false;
        for word in said {
            match (word, word.split_at(1)) {
                ("G0", _) => is_rapid = true,
                ("G1", _) => is_rapid = false,
                (_, ("F", value)) => feed = value.parse().unwrap(),
                (_, (axis @ ("X" | "Y" | "Z" | "A" | "B" | "C"), value)) => {
                    words.insert(axis.to_owned(), value.parse().unwrap());
                    moves = true;
                }
                _ => {}
            }
        }
        if moves {
            all.push(Motion { is_rapid, feed, words: words.clone() });
        }
    }
    all
}

/// A pose of a file.
#[derive(Clone, Copy)]
pub(crate) struct FilePose {
    pub(crate) cl: ClPoint,
    pub(crate) is_rapid: bool,
}

/// Poses of a random walk about the zero of the file, within the reach of all machines here: steps
/// of some millimetres and degrees, with rapids, some poses along z and some that repeat.
pub(crate) fn random_walk(random: &mut Random, n: usize) -> Vec<FilePose> {
    let (mut tip, mut tilt, mut turn) = (Vector3::new(0.0, 0.0, 20.0), 0.2, 0.0);
    let mut all = Vec::new();
    for k in 0..n {
        let is_rapid = k == 0 || k + 1 == n || random.one_in(25.0);
        tip += random.vector(if is_rapid { 30.0 } else { 3.0 });
        tip = tip.map(|v: f64| v.clamp(-80.0, 80.0));
        tilt = (tilt + random.between(-0.06, 0.06)).clamp(0.05, 0.7);
        turn += random.between(-0.15, 0.15);
        let axis = Vector3::new(tilt.sin() * turn.cos(), tilt.sin() * turn.sin(), tilt.cos());
        all.push(FilePose { cl: ClPoint { tip: tip.into(), axis: Unit::new_normalize(axis) }, is_rapid });
    }
    all
}

/// A file with these poses, all digits, lengths by `unit` mm.
pub(crate) fn file_of(poses: &[FilePose], (name, unit): (&str, f64)) -> String {
    let mut text = format!("PARTNO/walk\nUNITS/{name}\nMULTAX/ON\nLOADTL/7\nSPINDL/3000,RPM,CLW\nCOOLNT/ON\n");
    text += &format!("FEDRAT/{}\n", 900.0 / unit);
    for FilePose { cl, is_rapid } in poses {
        let (p, a) = (cl.tip / unit, cl.axis);
        let rapid = if *is_rapid { "RAPID\n" } else { "" };
        text += &format!("{rapid}GOTO/{},{},{},{},{},{}\n", p.x, p.y, p.z, a.x, a.y, a.z);
    }
    text + "FINI\n"
}

pub(crate) fn angle(a: &Unit<Vector3<f64>>, b: &Unit<Vector3<f64>>) -> f64 {
    a.cross(b).norm().atan2(a.dot(b))
}

/// Head of a file with tool 7 for statements of a test.
pub(crate) const HEAD: &str =
    "UNITS/MM\nMULTAX/ON\nLOADTL/7\nSPINDL/3000,RPM,CLW\nRAPID\nGOTO/0,0,60\nFEDRAT/600,MMPM\n";
