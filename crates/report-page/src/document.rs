//! The data of a page from job, program and report.

mod control_settings;
mod motion_figures;
mod named_lines;
mod work_offset;

use std::collections::HashMap;
use std::path::Path;

use facemill_cl_data::Solid;
use facemill_feedrate::MotionLimit;
use facemill_inverse_kinematics::{AxisKind, AxisValues, Carrier, Machine, MachineBody};
use facemill_job::failure::Failure;
use facemill_job::format::program_stamp::ProgramStamp;
use facemill_job::format::verification_file::VERIFICATION_FORMAT;
use facemill_job::load::HEADS_APART;
use facemill_job::load::job::{Job, Setup};
use facemill_job::load::obstacle_meshes::ObstacleRole;
use facemill_job::setup::cell::largest_left;
use facemill_job::setup::scene::Scene;
use facemill_job::stock::map::StockMeshes;
use facemill_nc_program::Dialect;
use facemill_nc_program::dialect::DialectFile;
use facemill_surface_model::{Surface, SurfaceSettings, TriMesh};
use facemill_tool_model::ToolAssembly;
use facemill_verification::remaining::LeftByLine;
use nalgebra::{Isometry3, Point3};
use serde_json::Value;

use crate::document::control_settings::{ReadText, is_own, length_place};
use crate::document::motion_figures::MotionMeasures;
use crate::document::named_lines::{FileLines, place_of};
use crate::format::{
    AxisData, BodyData, DeviationData, FirstMotion, MachineData, Matrix, MeshData, MotionData, OperationLines,
    OperationTimes, OutlineData, PAGE_FORMAT, PageDocument, PathData, PictureData, PosturesData, ProgramData,
    SetupData, ShapeData, StockData, ToolData, WorstPlace, WrittenLines,
};
use crate::line_figures::{LineProof, proofs};
use crate::meshes::{ScreenMesh, has_same_triangles, joined_once, outline, points_around, thinned};
use crate::motion::{Poses, ProgramMotion, SHOWN_WITHIN, Segment, SegmentKind, law_code, program_motion};
use crate::packed::{Arrays, NumberArray};
use crate::postures::postures;
use crate::program_text::{operation_lines, pass_lines};
use crate::stock::{KeyedStock, PartDeviation, keyed_stock, part_deviation};
use crate::verdict::{AssumedValues, Moves, finding_faults, verdict};

/// Sources of a page.
pub struct PageSource<'a> {
    /// The job.
    pub job: &'a Job,
    /// Index of the setup.
    pub setup: usize,
    /// Control that the program is read for.
    pub dialect: Dialect,
    /// Name of the program's file.
    pub program: &'a Path,
    /// Its bytes.
    pub text: &'a [u8],
    /// Places of its lines in the written files, if its calls of subprograms were expanded.
    pub written: Vec<WrittenLines>,
    /// Report of the plan, or the verification, as its file says it.
    pub result: Value,
    /// File of certificates, or those of the verification, if there are any.
    pub certificates: Option<Value>,
    /// Table of chips (`chips.csv`), if there is one.
    pub chips: Option<&'a [u8]>,
    /// Maps of feasible postures of a plan (`postures.json`), if there are any.
    pub postures: Option<Value>,
    /// Names and bytes of pictures (SVG).
    pub pictures: Vec<(String, &'a [u8])>,
    /// The setup, if it has been read already, of a machine with one head.
    pub read: Option<&'a Setup<'a>>,
    /// Heights that the program leaves beside its blocks, if they have been measured already; else
    /// they are measured if `result` says what the program leaves.
    pub left: Option<LeftByLine>,
}

/// Data of a page.
#[derive(Clone, Debug)]
pub struct PageData {
    /// The document.
    pub document: PageDocument,
    /// Its arrays.
    pub arrays: Arrays,
    /// Motions of the program, from which `document.motion` is.
    pub motion: ProgramMotion,
    /// Surfaces as they are shown, from which `document.meshes` is.
    pub(crate) surfaces: Vec<ShownSurface>,
}

/// Deviation of the scale's middle without operations, mm.
const SCALE: f64 = 0.1;

/// Most triangles of all surfaces, points of a path, and motions with clearances.
const MOST: Most = Most { triangles: 120_000, points: 150_000, clearances: 200_000 };

struct Most {
    triangles: usize,
    points: usize,
    clearances: usize,
}

/// Returns the data of a page: the program is read back and its axes followed, the stock is cut on
/// coarse lines, surfaces are thinned for the screen.
///
/// # Errors
/// If a file of the job is wrong, the setup does not exist, or the program is not understood.
pub fn page_data(source: PageSource<'_>) -> Result<PageData, Failure> {
    let job = source.job;
    let setups = &job.file.setups;
    if source.setup >= setups.len() {
        return Err(job.wrong(format!("setup {} was requested, but the job has {}", source.setup + 1, setups.len())));
    }
    let job = &job.for_setup(source.setup);
    if job.second.is_none() {
        let own;
        let setup = match source.read {
            Some(setup) => setup,
            None => {
                own = Setup::read(job, source.setup)?;
                &own
            }
        };
        let scene = Scene::new(job, setup, source.setup)?;
        return PageScene { scenes: &[&scene], scene: &scene, heads: vec![(&job.machine, &job.tool)] }.data(source);
    }
    let seen = [0, 1].map(|head| job.seen_by(head, HEADS_APART));
    let machines = [0, 1].map(|head| job.seen_by(head, 0.0).machine);
    let read = [Setup::read(&seen[0], source.setup)?, Setup::read(&seen[1], source.setup)?];
    let scenes = Scene::of_heads(seen.each_ref(), read.each_ref(), machines.each_ref(), source.setup)?;
    let heads = vec![(&machines[0], &seen[0].tool), (&machines[1], &seen[1].tool)];
    PageScene { scenes: &[&scenes[0], &scenes[1]], scene: &scenes[0], heads }.data(source)
}

/// A setup with the heads that work in it.
struct PageScene<'a> {
    /// Scene of each head.
    scenes: &'a [&'a Scene<'a>],
    /// That of the first one.
    scene: &'a Scene<'a>,
    /// Machine as each head sees it, and its tool.
    heads: Vec<(&'a Machine, &'a ToolAssembly)>,
}

impl PageScene<'_> {
    fn data(&self, source: PageSource<'_>) -> Result<PageData, Failure> {
        let (job, setup) = (self.scene.job, self.scene.setup);
        let program = job.read_program(source.text, source.dialect).map_err(|e| Failure::input(source.program, e))?;
        self.scene.check_frame_of(&program, source.program)?;
        let views: Vec<(&Machine, f64)> = self.heads.iter().map(|(m, tool)| (*m, tool.gauge_length())).collect();
        let motion = program_motion(self.scene, &views, &program, source.text, source.dialect);
        let (mut arrays, mut thin, mut not_shown) = (Arrays::default(), Vec::new(), Vec::new());
        // Neither is parallel throughout, and neither needs the other.
        let (shapes, measured) = rayon::join(|| self.shapes(&motion), || self.measured(&motion, &source, &program));
        let (Shapes { meshes, stock, deviation, outlines }, measured) = (shapes, measured?);
        let text = String::from_utf8_lossy(source.text);
        let lines = FileLines::of(&text, &source.written);
        let rules = self.rules(source.dialect);
        let read = ReadText { program: &program, lines: &lines, rules: &rules, is_own: is_own(&source) };
        let control_settings = self.control_settings(&read, &motion);
        let first_motion = first_motion(&motion);
        let machine = self.machine(&motion);
        let moves = match (&motion.segments[..], &motion.not_followed) {
            ([], None) => Moves::None,
            ([], Some(_)) => Moves::NotFollowed,
            _ => Moves::Some,
        };
        let operations: Vec<_> = job.operations_of(setup.file).map(|(_, o)| o.clone()).collect();
        let program = ProgramData {
            stamp: ProgramStamp::new(source.program, source.text),
            dialect: source.dialect.name().to_owned(),
            text: arrays.bytes(source.text),
            lines: text.lines().count(),
            operations: operation_lines(&text, operations.iter().map(|o| o.name.as_str())),
            passes: pass_lines(&text),
            written: source.written.clone(),
        };
        thin.extend(surfaces_thinned(&meshes));
        if let Err(why) = &stock {
            not_shown.push(format!("stock and deviation: {why}"));
        }
        let stock = stock.ok();
        thin.extend(stock.iter().map(|stock| stock_thinned(stock, motion.segments.len())));
        let is_verification = source.result.get("format").and_then(Value::as_str) == Some(VERIFICATION_FORMAT);
        if is_verification && source.certificates.is_some() {
            thin.push(
                "certificates: the page has figures, sums and the blocks that are not certified; `facemill verify \
                 --certificates` writes all of them"
                    .to_owned(),
            );
        }
        let deviation = deviation.map(|found| found.map(|found| self.deviation_data(&found, &meshes, &mut arrays)));
        let deviation = deviation.and_then(|d| d.map_err(|why| not_shown.push(format!("deviation: {why}"))).ok());
        let postures = self.postures(&source, &measured, (&mut thin, &mut not_shown));
        let corners = |b: facemill_cl_data::Aabb| [[b.min.x, b.min.y, b.min.z], [b.max.x, b.max.y, b.max.z]];
        let part_box = meshes.iter().find(|m| m.role == "part").map(|m| corners(m.full.aabb()));
        let stock_box = {
            let of_stock = StockMeshes::of(setup).extents();
            (of_stock.min.x <= of_stock.max.x).then(|| corners(of_stock))
        };
        let document = PageDocument {
            format: PAGE_FORMAT,
            facemill: env!("CARGO_PKG_VERSION"),
            job: job.file.name.clone(),
            verdict: verdict(&source.result, moves, &self.assumed_values(&machine)),
            finding_faults: finding_faults(&source.result),
            machine,
            setup: SetupData {
                file: setup.file.clone(),
                number: [source.setup + 1, job.file.setups.len()],
                operations,
                table_from_work: matrix(&setup.table_from_work),
                table_from_words: self.scene.rtcp_frame.as_ref().map(matrix),
                work_offset: self.work_offset(&rules),
                part_box,
                stock_box,
                outlines,
            },
            operation_times: operation_times(&motion, &program.operations),
            line_texts: lines.named(&source.result, first_motion.iter().map(|first| first.line)),
            first_motion,
            control_settings,
            tools: self.tools(&motion, source.dialect),
            motion: self.motion(&motion, (&source, &measured), &mut arrays, (&mut thin, &mut not_shown)),
            program,
            meshes: meshes.iter().map(|mesh| mesh.packed(&mut arrays)).collect(),
            stock: stock.as_ref().map(|stock| stock_data(stock, &mut arrays)),
            deviation,
            postures,
            pictures: source
                .pictures
                .iter()
                .map(|(name, svg)| PictureData { name: name.clone(), svg: arrays.bytes(svg) })
                .collect(),
            thinned: thin,
            not_shown,
            result: source.result,
        };
        Ok(PageData { document, arrays, motion, surfaces: meshes })
    }

    fn poses(&self) -> Vec<(Poses<'_>, &ToolAssembly)> {
        let work_from_table = self.scene.setup.table_from_work.inverse();
        self.heads
            .iter()
            .map(|&(machine, tool)| (Poses { machine, tool_length: tool.gauge_length(), work_from_table }, tool))
            .collect()
    }

    /// Returns surfaces and stock with their comparison.
    fn shapes(&self, motion: &ProgramMotion) -> Shapes {
        let setup = self.scene.setup;
        let (stock, meshes) =
            rayon::join(|| keyed_stock(self.scene.job, setup, motion, &self.poses()), || self.meshes());
        let part = meshes.iter().find(|m| m.role == "part");
        let deviation = stock.as_ref().ok().zip(part).map(|(stock, part)| self.deviation(stock, part));
        let outlines = self.outlines(&meshes);
        Shapes { meshes, stock, deviation, outlines }
    }

    /// Returns the surfaces of the setup, the part first.
    fn meshes(&self) -> Vec<ShownSurface> {
        let setup = self.scene.setup;
        let of_role = |role: ObstacleRole| setup.obstacles.iter().filter(move |o| o.role == role);
        let mut full = Vec::new();
        let part = joined_once(of_role(ObstacleRole::Part).map(|o| &o.mesh));
        full.push(("part".to_owned(), "part", part));
        for (role, name) in [(ObstacleRole::Check, "check"), (ObstacleRole::Fixture, "fixture")] {
            full.extend(of_role(role).map(|o| (o.name.clone(), name, o.mesh.clone())));
        }
        let own = StockMeshes::of(setup);
        full.extend(own.solid().map(|solid| ("stock before".to_owned(), "stock", solid.clone())));
        full.retain(|(_, _, mesh)| !mesh.triangles().is_empty());
        let total: usize = full.iter().map(|(_, _, mesh)| mesh.triangles().len()).sum();
        let share = |n: usize| if total <= MOST.triangles { n } else { (n * MOST.triangles / total).max(200) };
        let surface = |(name, role, full): (String, &'static str, TriMesh)| {
            let shown = thinned(&full, share(full.triangles().len()));
            ShownSurface { name, role, full, shown }
        };
        full.into_iter().map(surface).collect()
    }

    /// Compares the cut stock with the part.
    fn deviation(&self, stock: &KeyedStock, part: &ShownSurface) -> Result<PartDeviation, String> {
        let setup = self.scene.setup;
        let own;
        let surface = if has_same_triangles(&part.full, setup.around_drive.mesh()) {
            &*setup.around_drive
        } else {
            own = Surface::new(part.full.clone(), SurfaceSettings::default());
            &own
        };
        let at = (&part.shown.vertices[..], &part.shown.normals[..]);
        part_deviation(stock, surface, setup.drive_allowance, at, self.permitted().unwrap_or(SCALE))
    }

    /// Returns the smallest deviation that an operation permits, mm.
    fn permitted(&self) -> Option<f64> {
        let job = self.scene.job;
        let of_operations = job.operations_of(self.scene.setup.file).map(|(_, o)| largest_left(job, o));
        of_operations.filter(|t| *t > 0.0).reduce(f64::min)
    }

    fn deviation_data(&self, found: &PartDeviation, meshes: &[ShownSurface], arrays: &mut Arrays) -> DeviationData {
        let permitted = self.permitted();
        let values: Vec<Option<f64>> = found.vertices.iter().map(|v| v.map(|v| v.value)).collect();
        let cut = found.vertices.iter().map(|v| i64::from(v.is_some_and(|v| v.is_cut)));
        DeviationData {
            mesh: meshes.iter().position(|m| m.role == "part").unwrap_or(0),
            values: arrays.numbers_with_gaps(&values, 1e-3),
            cut: arrays.integers(cut),
            tolerance: permitted.unwrap_or(SCALE),
            permitted,
            worst: found.worst.iter().map(|w| WorstPlace { at: w.position.into(), value: w.value }).collect(),
            histogram: found.histogram.clone(),
        }
    }

    fn postures(
        &self,
        source: &PageSource<'_>,
        measured: &MotionMeasures,
        (thin, not_shown): (&mut Vec<String>, &mut Vec<String>),
    ) -> Option<PosturesData> {
        let Some(file) = &source.postures else {
            not_shown.push("feasible postures of passes: there is no postures.json of a plan".to_owned());
            return None;
        };
        let data = postures(file, &measured.cut_poses);
        let data = data.map_err(|why| not_shown.push(format!("feasible postures of passes: postures.json: {why}")));
        let data = data.ok()?;
        if data.maps.len() < data.n_passes {
            thin.push(format!(
                "feasible postures: maps of {} of {} passes, those in the first place of a pattern",
                data.maps.len(),
                data.n_passes
            ));
        }
        Some(data)
    }

    fn machine(&self, motion: &ProgramMotion) -> MachineData {
        let machine = self.scene.machine;
        let file = machine.to_file();
        let (workpiece_rows, tool_rows) = MachineData::rows(&file);
        let travel = |k: usize| {
            let values = motion.segments.iter().map(|s| s.to[k]);
            let [low, high] = values.fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], x| [a.min(x), b.max(x)]);
            (low <= high).then_some([low, high])
        };
        let axes = machine.axes().iter().enumerate().map(|(k, axis)| AxisData {
            letter: axis.letter.as_str().to_owned(),
            is_rotary: axis.kind == AxisKind::Rotary,
            limits: [axis.min, axis.max].map(|limit| (limit.is_finite() && !axis.has_no_stops()).then_some(limit)),
            home: axis.home,
            max_velocity: axis.max_velocity,
            max_acceleration: axis.max_acceleration,
            travel: travel(k),
        });
        // Bodies of the view of the first head, without the other head's tool.
        let bodies = self.scene.machine.bodies().iter().filter(|body| !is_tool(body, &file));
        MachineData {
            name: machine.name().to_owned(),
            axes: axes.collect(),
            workpiece_rows,
            tool_rows,
            bodies: bodies.map(body_data).collect(),
            assumed: file
                .assumed
                .iter()
                .filter_map(|a| serde_json::to_value(a).ok()?.get("value")?.as_str().map(str::to_owned))
                .collect(),
        }
    }

    /// Returns the words of a control; those of the job's post where it is for this one.
    fn rules(&self, dialect: Dialect) -> DialectFile {
        let post = &self.scene.job.post;
        if post.dialect() == dialect { post.rules().clone() } else { dialect.file() }
    }

    fn tools(&self, motion: &ProgramMotion, dialect: Dialect) -> Vec<ToolData> {
        let mut times = [0.0; 2];
        for segment in motion.segments.iter().filter(|s| s.is_timed) {
            times[usize::from(segment.kind == SegmentKind::Rapid)] += segment.time;
        }
        let files = self.heads.iter().map(|(_, tool)| tool.to_file());
        files.map(|file| ToolData { length_place: length_place(dialect, &file), file, times }).collect()
    }

    fn assumed_values(&self, machine: &MachineData) -> AssumedValues {
        let of_tool = |(_, tool): &(_, &ToolAssembly)| tool.to_file().assumed.into_iter().map(|one| one.key);
        AssumedValues { n_machine: machine.assumed.len(), tool_keys: self.heads.iter().flat_map(of_tool).collect() }
    }

    fn motion(
        &self,
        motion: &ProgramMotion,
        (source, measured): (&PageSource<'_>, &MotionMeasures),
        arrays: &mut Arrays,
        (thin, not_shown): (&mut Vec<String>, &mut Vec<String>),
    ) -> MotionData {
        let segments = &motion.segments;
        let axes = self.scene.machine.axes();
        let ends = (0..axes.len()).map(|k| {
            let value = |q: &AxisValues| if axes[k].kind == AxisKind::Rotary { q[k].to_degrees() } else { q[k] };
            let values: Vec<f64> = segments.iter().map(|s| value(&s.to)).collect();
            let unit = decimal_unit(&values, value(&motion.start));
            arrays.numbers(values, (unit, value(&motion.start)))
        });
        let ends = ends.collect();
        let mut limit_names: Vec<String> = Vec::new();
        let limits: Vec<i64> = segments
            .iter()
            .map(|s| {
                let Some(name) = s.limit.map(|limit| limit_name(limit, self.scene.machine)) else { return 0 };
                let place = limit_names.iter().position(|known| *known == name).unwrap_or_else(|| {
                    limit_names.push(name);
                    limit_names.len() - 1
                });
                place as i64 + 1
            })
            .collect();
        let feeds: Vec<Option<f64>> = segments.iter().map(|s| s.feed).collect();
        let inverse_feeds: Vec<Option<f64>> = segments.iter().map(|s| s.inverse_feed).collect();
        let paths = measured.paths.iter().map(|path| {
            let n = path.points.len();
            if path.left_out_within > 0.0 {
                let within = SHOWN_WITHIN[0] + path.left_out_within;
                thin.push(format!(
                    "path of the tip: {n} points are shown of {} motions, within {within:.3} mm of it",
                    segments.len()
                ));
            } else if n > segments.len() + 1 {
                thin.push(format!("path of the tip: straight lines within {} mm of it", SHOWN_WITHIN[0]));
            }
            PathData {
                points: [0, 1, 2].map(|k| arrays.numbers(path.points.iter().map(|p| p[k]), (1e-3, 0.0))),
                motions: arrays.integers(path.segments.iter().map(|s| i64::from(*s))),
            }
        });
        let paths = paths.collect();
        let proofs: Option<HashMap<u32, LineProof>> =
            source.certificates.as_ref().map(proofs).filter(|proofs| !proofs.is_empty());
        let uncertified = proofs.as_ref().map(|proofs| {
            let of_line = |s: &Segment| proofs.get(&s.line).map_or(2, |proof| i64::from(!proof.is_certified));
            arrays.integers(segments.iter().map(of_line))
        });
        let n_untimed = segments.iter().filter(|s| !s.is_timed).count();
        MotionData {
            n: segments.len(),
            start: motion.start.iter().collect(),
            ends,
            lines: arrays.integers(segments.iter().map(|s| i64::from(s.line))),
            kinds: arrays.integers(segments.iter().map(|s| kind_code(s.kind))),
            laws: arrays.integers(segments.iter().map(|s| law_code(s.law))),
            rtcp: arrays.integers(segments.iter().map(|s| i64::from(s.is_rtcp))),
            times: arrays.numbers(segments.iter().map(|s| s.time), (1e-5, 0.0)),
            by_law: motion.by_law,
            n_untimed,
            untimed: (n_untimed > 0).then(|| arrays.integers(segments.iter().map(|s| i64::from(!s.is_timed)))),
            uncertified,
            feeds: arrays.numbers_with_gaps(&feeds, 1e-3),
            inverse_feeds: arrays.numbers_with_gaps(&inverse_feeds, 1e-3),
            figures: self.figures(segments, (source, measured, proofs.unwrap_or_default()), arrays, not_shown),
            limits: arrays.integers(limits),
            limit_names,
            paths,
            not_followed: motion
                .not_followed
                .as_ref()
                .map(|(line, why)| format!("{}: {why}", place_of(&source.written, *line))),
        }
    }

    /// Returns outlines of what is on the table, table frame.
    fn outlines(&self, meshes: &[ShownSurface]) -> Vec<OutlineData> {
        let setup = self.scene.setup;
        let at_home = self.scene.machine.home();
        let on_table = self.scene.machine.body_poses(&at_home).filter(|at| at.body.joints_from_table() == 0);
        let mut outlines: Vec<OutlineData> = on_table
            .map(|at| outline_of(at.body.name(), "table", &points_around(&at.body.body.solid, &at.table_from_solid)))
            .collect();
        outlines.extend(meshes.iter().map(|mesh| mesh.outline(&setup.table_from_work)));
        outlines
    }
}

/// Surfaces and stock of a page.
struct Shapes {
    meshes: Vec<ShownSurface>,
    /// The stock, or why there is none.
    stock: Result<KeyedStock, String>,
    /// Deviation of the part, if there are part and stock.
    deviation: Option<Result<PartDeviation, String>>,
    outlines: Vec<OutlineData>,
}

/// Returns how surfaces are coarser than they are.
fn surfaces_thinned(meshes: &[ShownSurface]) -> Option<String> {
    let sum = |n: fn(&ShownSurface) -> usize| meshes.iter().map(n).sum::<usize>();
    let (total, shown) = (sum(|m| m.full.triangles().len()), sum(|m| m.shown.triangles.len()));
    (shown < total)
        .then(|| format!("surfaces: {shown} of {total} triangles are shown; tests and figures use all of them"))
}

fn outline_of(name: &str, role: &'static str, points: &[Point3<f64>]) -> OutlineData {
    OutlineData {
        name: name.to_owned(),
        role,
        top: outline(points.iter().map(|p| [p.x, p.y]).collect()),
        front: outline(points.iter().map(|p| [p.x, p.z]).collect()),
    }
}

/// Returns the times of the parts of a program, with what is before the first.
fn operation_times(motion: &ProgramMotion, starts: &[OperationLines]) -> Vec<OperationTimes> {
    let names = std::iter::once(String::new()).chain(starts.iter().map(|s| s.operation.clone()));
    let mut times: Vec<OperationTimes> =
        names.map(|operation| OperationTimes { operation, cut: 0.0, rapid: 0.0 }).collect();
    for segment in motion.segments.iter().filter(|s| s.is_timed) {
        let part = &mut times[starts.partition_point(|s| s.first_line <= segment.line)];
        *(if segment.kind == SegmentKind::Rapid { &mut part.rapid } else { &mut part.cut }) += segment.time;
    }
    times.retain(|t| t.cut + t.rapid > 0.0);
    times
}

/// Returns the end of the first motion that leads away from home.
fn first_motion(motion: &ProgramMotion) -> Option<FirstMotion> {
    let first = motion.segments.iter().find(|s| s.to != motion.start)?;
    let moves = first.to.iter().zip(first.from.iter()).map(|(to, from)| to != from);
    Some(FirstMotion { line: first.line, position: first.to.iter().collect(), moves: moves.collect() })
}

/// A surface, whole and thinned.
#[derive(Clone, Debug)]
pub(crate) struct ShownSurface {
    pub(crate) name: String,
    pub(crate) role: &'static str,
    full: TriMesh,
    pub(crate) shown: ScreenMesh,
}

impl ShownSurface {
    /// Returns the outline of the whole surface: a person measures by it.
    fn outline(&self, table_from_work: &Isometry3<f64>) -> OutlineData {
        let mut is_used = vec![false; self.full.vertices().len()];
        self.full.triangles().iter().flatten().for_each(|&v| is_used[v as usize] = true);
        let used = self.full.vertices().iter().zip(is_used).filter(|(_, is_used)| *is_used);
        let points: Vec<Point3<f64>> = used.map(|(p, _)| table_from_work * p).collect();
        outline_of(&self.name, self.role, &points)
    }

    fn packed(&self, arrays: &mut Arrays) -> MeshData {
        let ScreenMesh { vertices, normals, triangles } = &self.shown;
        MeshData {
            name: self.name.clone(),
            role: self.role,
            positions: [0, 1, 2].map(|k| arrays.numbers(vertices.iter().map(|p| p[k]), (1e-3, 0.0))),
            normals: [0, 1, 2].map(|k| arrays.numbers(normals.iter().map(|n| n[k]), (1.0 / 127.0, 0.0))),
            triangles: arrays.integers(triangles.iter().flatten().map(|v| i64::from(*v))),
        }
    }
}

fn stock_data(stock: &KeyedStock, arrays: &mut Arrays) -> StockData {
    let grid = stock.before.grid();
    let [nx, ny] = grid.n_lines();
    let lines = || (0..ny).flat_map(move |j| (0..nx).map(move |i| (i, j)));
    let of_line = |(i, j): (usize, usize)| stock.before.intervals(i, j);
    let mut height = |values: Vec<f64>| arrays.numbers(values, (0.01, 0.0));
    let first_ends = height(lines().flat_map(of_line).flat_map(|v| [v.bottom, v.top]).collect());
    let changes = || stock.changes.iter().flatten();
    let ends = height(changes().flat_map(|c| c.intervals.iter().flatten().copied()).collect());
    let mut counts = |values: Vec<usize>| -> NumberArray { arrays.integers(values.into_iter().map(|n| n as i64)) };
    StockData {
        origin: grid.origin(),
        cell: grid.cell(),
        n_lines: [nx, ny],
        first_counts: counts(lines().map(|at| of_line(at).count()).collect()),
        first_ends,
        keys: counts(stock.keys.iter().map(|k| *k as usize).collect()),
        change_counts: counts(stock.changes.iter().map(Vec::len).collect()),
        change_keys: counts(changes().map(|c| c.key as usize).collect()),
        interval_counts: counts(changes().map(|c| c.intervals.len()).collect()),
        ends,
    }
}

/// Returns how the stock is coarser than it is.
fn stock_thinned(stock: &KeyedStock, n_motions: usize) -> String {
    let grid = stock.before.grid();
    format!(
        "stock: lines along z {:.2} mm apart, cut within 0.1 mm, {} states of {n_motions} motions",
        grid.cell(),
        stock.keys.len()
    )
}

/// Returns whether a body of a head's view is the tool of the other head: no body of the file.
fn is_tool(body: &MachineBody, file: &facemill_inverse_kinematics::machine_file::MachineFile) -> bool {
    let rows = file.tool_chains.iter().flat_map(|c| &c.rows).chain(&file.workpiece_chain.rows);
    let mut named = rows.flat_map(|r| &r.bodies).chain(&file.bed_bodies).map(|b| b.name.as_str());
    !named.any(|name| name == body.name())
}

fn body_data(body: &MachineBody) -> BodyData {
    let (carrier, row) = match body.link {
        facemill_inverse_kinematics::LinkId::Bed => ("bed", 0),
        facemill_inverse_kinematics::LinkId::Row { carrier, row } => {
            let name = match carrier {
                Carrier::Head => "head",
                Carrier::Table => "table",
                Carrier::OtherHead => "other_head",
            };
            (name, row)
        }
    };
    let shape = match &body.body.solid {
        Solid::Frustum(f) => ShapeData::Frustum([f.z_low, f.z_high, f.radius_low, f.radius_high]),
        Solid::Box(b) => ShapeData::Box(b.half_extents.into()),
        Solid::Hull(hull) => ShapeData::Hull {
            vertices: hull.core.vertices().iter().map(|p| [p.x, p.y, p.z]).collect(),
            triangles: hull.core.triangles().collect(),
        },
    };
    BodyData {
        name: body.name().to_owned(),
        carrier,
        row,
        pose: matrix(&body.body.frame_from_solid),
        shape,
        clearance: body.clearance,
    }
}

fn matrix(pose: &Isometry3<f64>) -> Matrix {
    let m = pose.to_homogeneous();
    std::array::from_fn(|k| m[(k / 4, k % 4)])
}

/// Returns the largest of a few decimal units in which values are, from an offset, whole numbers;
/// without one 10⁻⁹, which with degrees is 2·10⁻⁸ mm at a lever of a metre.
fn decimal_unit(values: &[f64], offset: f64) -> f64 {
    let fits = |unit: &f64| {
        values.iter().all(|v| {
            let steps = (v - offset) / unit;
            // Rounding of values in radians; relative to the unit it is small.
            (steps - steps.round()).abs() * unit < 5e-10
        })
    };
    [1e-3, 1e-4, 1e-5, 1e-6].into_iter().find(fits).unwrap_or(1e-9)
}

fn kind_code(kind: SegmentKind) -> i64 {
    match kind {
        SegmentKind::Rapid => 0,
        SegmentKind::Cut => 1,
        SegmentKind::Other => 2,
    }
}

fn limit_name(limit: MotionLimit, machine: &Machine) -> String {
    let of_axis = |what: &str, axis: usize| {
        let letter = machine.axes().get(axis).map_or_else(|| axis.to_string(), |a| a.letter.to_string());
        format!("{what} of axis {letter}")
    };
    match limit {
        MotionLimit::Velocity(axis) => of_axis("velocity", axis),
        MotionLimit::Acceleration(axis) => of_axis("acceleration", axis),
        MotionLimit::Jerk(axis) => of_axis("jerk", axis),
        MotionLimit::TipFeed => "tip feed".to_owned(),
    }
}

#[cfg(test)]
#[path = "../tests/unit/document.rs"]
mod tests;
