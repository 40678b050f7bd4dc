//! Machine, tool, mounting, words and obstacles of a setup, and the views that stages take of them.

use std::path::Path;

use facemill_cutter_location::Workcell;
use facemill_inverse_kinematics::Machine;
use facemill_nc_program::read::Compensation;
use facemill_nc_program::{Dialect, FeedMode, ReadProgram, WordMap};
use facemill_tool_model::ToolAssembly;
use facemill_tool_path::links::LinkScene;
use facemill_tool_path::links::words::LinkWords;
use facemill_virtual_machine::motion::axis_motion::MotionContext;
use facemill_virtual_machine::{ObstacleKind, VirtualObstacle, VirtualSetup};
use facemill_z_map::ZMap;
use nalgebra::Isometry3;

use crate::failure::Failure;
use crate::format::job_file::OperationFile;
use crate::load::clearance_surface::clearance_surface;
use crate::load::job::{Job, Setup};
use crate::load::obstacle_meshes::ObstacleRole;
use crate::setup::cell::workcell;
use crate::setup::word_map::{dual_word_map, rtcp_frame, table_from_rtcp_words, word_map};

/// Setup of a job as one head of its machine sees it, with the words of its program.
///
/// Each stage takes its view from here, so that search, links, verification and stock have the same
/// machine, tool and frames.
#[derive(Clone)]
pub struct Scene<'a> {
    /// Job; of a machine with two heads, as the head sees it in planning.
    pub job: &'a Job,
    /// Index of the setup in the job.
    pub index: usize,
    /// Setup, with the mounting of the workpiece and all obstacles.
    pub setup: &'a Setup<'a>,
    /// Machine that runs the program: that of the job; of a machine with two heads, with the actual
    /// tool of the other head.
    pub machine: &'a Machine,
    /// Words of the program.
    pub words: WordMap,
    /// Table frame ← frame of X, Y and Z words under RTCP; `None` without X, Y and Z at right
    /// angles.
    pub rtcp_frame: Option<Isometry3<f64>>,
}

impl<'a> Scene<'a> {
    /// Returns the scene of a machine with one head. `index` is the index of the setup in the job;
    /// a job with several tools must be the view of this setup ([`Job::for_setup`]).
    ///
    /// # Errors
    /// If the work offset names an axis that the machine does not have, or the job has the tool of
    /// another setup.
    pub fn new(job: &'a Job, setup: &'a Setup<'a>, index: usize) -> Result<Self, Failure> {
        job.check_tool_of(index)?;
        let words = word_map(job, setup, index)?;
        let rtcp_frame = rtcp_frame(job, &words);
        Ok(Self { job, index, setup, machine: &job.machine, words, rtcp_frame })
    }

    /// Returns the scene of each head of a machine with two. Both have the same words, and no frame
    /// for RTCP.
    ///
    /// # Errors
    /// If the work offset names an axis that the machine does not have, or a program cannot
    /// distinguish the heads.
    pub fn of_heads(
        jobs: [&'a Job; 2],
        setups: [&'a Setup<'a>; 2],
        machines: [&'a Machine; 2],
        index: usize,
    ) -> Result<[Self; 2], Failure> {
        let words = dual_word_map(jobs, setups[0], index)?;
        Ok([0, 1].map(|h| Self {
            job: jobs[h],
            index,
            setup: setups[h],
            machine: machines[h],
            words: words.clone(),
            rtcp_frame: None,
        }))
    }

    /// Returns the tool.
    pub fn tool(&self) -> &'a ToolAssembly {
        &self.job.tool
    }

    /// Returns the distance from the gauge line to the tip, mm.
    pub fn tool_length(&self) -> f64 {
        self.job.tool.gauge_length()
    }

    /// Returns the frame of X, Y and Z words of a program of this job: the identity if its post
    /// does not use RTCP.
    ///
    /// # Errors
    /// If the post uses RTCP and the machine has no X, Y and Z at right angles.
    pub fn written_frame(&self) -> Result<Isometry3<f64>, Failure> {
        table_from_rtcp_words(self.job, &self.words)
    }

    /// Checks that the words of a program have a frame in this setup.
    ///
    /// # Errors
    /// If the program uses RTCP and the machine has no X, Y and Z at right angles; with the path of
    /// the program.
    pub fn check_frame_of(&self, program: &ReadProgram, path: &Path) -> Result<(), Failure> {
        if self.rtcp_frame.is_some() || !uses_rtcp(program) {
            return Ok(());
        }
        let message = "its words are the tip's (RTCP), and the machine has no X, Y and Z at right angles: give a program with \
                       the positions of the axes";
        Err(Failure::input(path, message))
    }

    /// Returns the view of the search for postures of an operation.
    pub fn workcell(&self, operation: &OperationFile, z_map: &'a ZMap) -> Workcell<'a> {
        workcell(self.job, self.setup, operation, z_map)
    }

    /// Returns the view of the search for links, with the machine as planned.
    pub fn link_scene(&self) -> LinkScene<'a> {
        LinkScene {
            machine: &self.job.machine,
            tool_length: self.tool_length(),
            table_from_work: self.setup.table_from_work,
            clearance: clearance_surface(&self.setup.file.clearance),
        }
    }

    /// Returns the settings for words of positions.
    pub fn link_words(&self) -> LinkWords<'_> {
        LinkWords {
            machine: &self.job.machine,
            tool_length: self.tool_length(),
            words: &self.words,
            table_from_rtcp_words: self.rtcp_frame,
            decimals: self.job.post.decimals(),
        }
    }

    /// Returns the tool length compensation in force on links of a program for one head.
    pub fn compensation(&self) -> Compensation {
        let register = self.job.tool.length_register();
        match self.job.post.feed_mode() {
            FeedMode::Rtcp => Compensation::Rtcp(register),
            FeedMode::G94 | FeedMode::G93 => Compensation::Length(register),
        }
    }

    /// Returns the view by which feeds and times take positions from a program.
    pub fn motion_context(&self) -> MotionContext<'_> {
        MotionContext {
            machine: self.machine,
            tool_length: self.tool_length(),
            words: &self.words,
            frame: self.rtcp_frame,
            work_offset: None,
        }
    }

    /// Returns the view of the virtual machine for programs of this dialect.
    pub fn virtual_setup(&self, dialect: Dialect) -> VirtualSetup<'_> {
        VirtualSetup {
            machine: self.machine,
            table_from_work: self.setup.table_from_work,
            words: &self.words,
            table_from_rtcp_words: self.rtcp_frame,
            tool: &self.job.tool,
            length_register: register_in(dialect, self.job),
            obstacles: virtual_obstacles(self.setup),
        }
    }
}

/// Returns whether a program moves under RTCP.
pub fn uses_rtcp(program: &ReadProgram) -> bool {
    let mut motions = program.blocks.iter().filter_map(|b| b.motion.as_ref());
    motions.any(|m| matches!(m.compensation, Compensation::Rtcp(_)))
}

/// Returns the bodies on the table, for the virtual machine.
fn virtual_obstacles<'a>(setup: &'a Setup<'_>) -> Vec<VirtualObstacle<'a>> {
    setup
        .obstacles
        .iter()
        .filter(|o| o.role != ObstacleRole::Table)
        .map(|o| VirtualObstacle {
            name: o.name.clone(),
            mesh: o.tree(),
            kind: match o.role {
                ObstacleRole::Part => ObstacleKind::Part,
                ObstacleRole::Check => ObstacleKind::Check,
                ObstacleRole::Fixture | ObstacleRole::Table => ObstacleKind::Fixture,
                ObstacleRole::Stock => ObstacleKind::Stock,
            },
            allowance: o.allowance,
            stock: match o.role {
                ObstacleRole::Part | ObstacleRole::Check => setup.stock_thickness.max(o.allowance),
                // All bodies keep the allowance from a fixture.
                ObstacleRole::Fixture | ObstacleRole::Table | ObstacleRole::Stock => o.allowance,
            },
        })
        .collect()
}

/// Returns the register of the tool's length in a control's reader: edge 1 of Siemens, and the
/// number of the tool on Heidenhain, whose tools include their length.
fn register_in(dialect: Dialect, job: &Job) -> u32 {
    match dialect {
        Dialect::Siemens840d => 1,
        Dialect::Heidenhain => job.tool.number(),
        _ => job.tool.length_register(),
    }
}
