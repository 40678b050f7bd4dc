use facemill_cl_data::{ClPoint, PlacedSolid, Solid};
use facemill_interference::{Interference, MeshTree, solid_mesh};
use facemill_inverse_kinematics::{AxisValues, Carrier, Machine, MachineBody};
use nalgebra::{Isometry3, Vector3};

use crate::finding::FindingKind;
use crate::motion::moves::Move;
use crate::motion::setup::{HeldAsCut, ObstacleKind, VerifyError, VerifySettings, VirtualObstacle, VirtualSetup};
use crate::run::cutter_depth::CutterDepth;
use crate::run::track::Shape;

/// The setup with what does not change from position to position worked out.
pub(crate) struct RunScene<'a> {
    pub(crate) setup: &'a VirtualSetup<'a>,
    pub(crate) settings: &'a VerifySettings,
    pub(crate) work_from_table: Isometry3<f64>,
    pub(crate) tool_length: f64,
    pub(crate) cutter: CutterDepth,
    /// Non-cutting bodies: of the tool assembly, then of the machine.
    pub(crate) bodies: Vec<SceneBody>,
    /// Whether a body of the tool assembly is tested against each obstacle.
    pub(crate) tool_meets: Vec<bool>,
    /// The meshes of the setup, then the bodies of the machine's bed, table and other head.
    pub(crate) obstacles: Vec<SceneObstacle<'a>>,
    /// The machine as the other head sees it, where there is one, and the length of its tool, mm.
    pub(crate) other: Option<(Machine, f64)>,
}

/// A non-cutting body.
#[derive(Clone)]
pub(crate) struct SceneBody {
    pub(crate) name: String,
    pub(crate) kind: FindingKind,
    pub(crate) shape: Shape,
    /// Rounding of the body as it is, without clearance, mm.
    pub(crate) rounding: f64,
    /// Distance it is to keep, mm.
    pub(crate) clearance: f64,
    pub(crate) mount: Mount,
    /// Whether it is tested against each obstacle.
    pub(crate) meets: Vec<bool>,
}

/// Carrier of a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Mount {
    /// The tool, at this pose in its frame.
    Tool(Isometry3<f64>),
    /// The machine: index among its bodies.
    Machine(usize),
}

/// Obstacle of tool and bodies.
pub(crate) struct SceneObstacle<'a> {
    pub(crate) name: String,
    pub(crate) frame: Frame,
    /// Material that the cutter has to leave on it, mm; the clearance of a body of the machine.
    pub(crate) allowance: f64,
    /// Distance that everything else keeps from its mesh at least, mm, where the stock is as it was
    /// at first.
    pub(crate) stock: f64,
    /// The same of the tool assembly and the cutter in rapid, as the settings have it; and of
    /// bodies of the machine.
    pub(crate) tool_stock: f64,
    machine_stock: f64,
    pub(crate) role: Role,
    /// Whether the cutter moves against it.
    pub(crate) meets_cutter: bool,
    /// Whether distances from it count as clearance of the program.
    pub(crate) counts: bool,
    /// Index among the machine's bodies, where it is one.
    body: Option<usize>,
    mesh: SceneMesh<'a>,
}

/// Frame of an obstacle's mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Frame {
    /// The workpiece frame.
    Work,
    /// That of the machine's body of this index.
    Machine(usize),
}

/// Permitted contact with an obstacle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Role {
    /// As the setup says.
    Work(ObstacleKind),
    /// A body of the machine's bed or table, or of the other head: not to be touched by anything.
    Machine,
}

enum SceneMesh<'a> {
    Borrowed(&'a dyn Interference),
    Own(Box<MeshTree>),
}

/// Distance that the cutter keeps from an obstacle in a move.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct CutterLimit {
    /// Thickness of what the cutter may not enter, mm.
    pub(crate) thickness: f64,
    /// Depth in it from which on it is a finding, mm.
    pub(crate) depth: f64,
    /// Kind of the finding.
    pub(crate) kind: FindingKind,
}

impl<'a> RunScene<'a> {
    pub(crate) fn new(setup: &'a VirtualSetup<'a>, settings: &'a VerifySettings) -> Result<Self, VerifyError> {
        let work_from_table = setup.table_from_work.inverse();
        let links = Links::new(setup.machine);
        let machine = setup.machine.bodies().iter().enumerate();
        let mut obstacles: Vec<_> = setup.obstacles.iter().map(|o| SceneObstacle::of_mesh(o, settings)).collect();
        let stays = machine.clone().filter(|(_, b)| b.carrier() != Some(Carrier::Head));
        for (k, _) in stays {
            obstacles.push(SceneObstacle::of_body(setup.machine, k, &links, &work_from_table)?);
        }
        let tool = setup.tool.collision_bodies().into_iter().map(SceneBody::of_tool);
        // The other head's bodies are tested against the rest when the program is run for that
        // head.
        let moves = |k: usize| links.between(Link::Work, Link::Body(k)) > 0;
        let is_own = |b: &MachineBody| b.carrier() != Some(Carrier::OtherHead);
        let moving = machine.filter(|(k, b)| moves(*k) && is_own(b)).map(|(k, b)| {
            let name = b.name().to_owned();
            SceneBody::new(name, FindingKind::Collision, &b.body.solid, b.clearance, Mount::Machine(k))
        });
        let mut bodies: Vec<_> = tool.chain(moving).collect();
        let meets = |mount: Mount| -> Vec<bool> {
            let is_cut = if matches!(mount, Mount::Tool(_)) { settings.as_cut.tool } else { settings.as_cut.machine };
            // A run of its own checks the stock that is cut.
            let is_left = |o: &SceneObstacle<'_>| !is_cut || o.role != Role::Work(ObstacleKind::Stock);
            obstacles.iter().map(|o| is_left(o) && may_meet(setup.machine, &links, mount, o)).collect()
        };
        for body in &mut bodies {
            body.meets = meets(body.mount);
        }
        let tool_meets = meets(Mount::Tool(Isometry3::identity()));
        Ok(Self {
            setup,
            settings,
            work_from_table,
            tool_length: setup.tool.gauge_length(),
            cutter: CutterDepth::new(setup.tool.cutter()),
            bodies,
            tool_meets,
            obstacles,
            other: other_view(setup),
        })
    }

    /// These bodies of the setup's machine and nothing else, against meshes as stock.
    pub(crate) fn of_bodies(
        setup: &'a VirtualSetup<'a>,
        settings: &'a VerifySettings,
        bodies: &[&SceneBody],
        stock: impl Iterator<Item = &'a dyn Interference>,
    ) -> Self {
        let obstacle = |mesh| {
            let (name, kind) = (String::new(), ObstacleKind::Stock);
            SceneObstacle::of_mesh(&VirtualObstacle { name, mesh, kind, allowance: 0.0, stock: 0.0 }, settings)
        };
        let obstacles: Vec<SceneObstacle<'a>> = stock.map(obstacle).collect();
        let meets = vec![true; obstacles.len()];
        Self {
            setup,
            settings,
            work_from_table: setup.table_from_work.inverse(),
            tool_length: setup.tool.gauge_length(),
            cutter: CutterDepth::new(setup.tool.cutter()),
            bodies: bodies.iter().map(|body| SceneBody { meets: meets.clone(), ..(*body).clone() }).collect(),
            tool_meets: vec![false; obstacles.len()],
            obstacles,
            other: None,
        }
    }

    /// The tool at these axis values, workpiece frame.
    pub(crate) fn cl_at(&self, axes: &AxisValues) -> ClPoint {
        cl_of(&(self.work_from_table * self.setup.machine.forward(axes, self.tool_length)))
    }

    /// Whether an obstacle moves with the other head.
    pub(crate) fn is_on_other_head(&self, obstacle: &SceneObstacle<'_>) -> bool {
        let body = obstacle.body.map(|k| &self.setup.machine.bodies()[k]);
        body.is_some_and(|b| b.carrier() == Some(Carrier::OtherHead))
    }

    /// Returns the distance that the cutter keeps from an obstacle in a move; `None` if it may
    /// enter.
    pub(crate) fn cutter_limit(&self, obstacle: &SceneObstacle<'_>, m: &Move) -> Option<CutterLimit> {
        let (depth, is_rapid) = (self.settings.gouge_limit_in(m.section), m.is_rapid_of_tool());
        match (is_rapid, obstacle.role) {
            (_, Role::Machine) => {
                let kind = if is_rapid { FindingKind::RapidCollision } else { FindingKind::Collision };
                let thickness = obstacle.allowance;
                Some(CutterLimit { thickness, depth: self.settings.clearance_slack.min(thickness), kind })
            }
            (true, Role::Work(_)) => {
                let thickness = obstacle.tool_stock.max(obstacle.allowance);
                Some(CutterLimit { thickness, depth, kind: FindingKind::RapidCollision })
            }
            (false, Role::Work(ObstacleKind::Stock)) => None,
            (false, Role::Work(_)) => {
                Some(CutterLimit { thickness: obstacle.allowance, depth, kind: FindingKind::Gouge })
            }
        }
    }

    /// Returns the control's largest addition to a depth, mm: its tolerance at the point of the
    /// cutter that is farthest from the tip.
    pub(crate) fn cutter_control(&self) -> f64 {
        let cutter = self.setup.tool.cutter();
        let farthest = cutter.radius().hypot(cutter.flute_length().max(cutter.corner_radius()));
        self.setup.machine.motion_law().control_tolerance.charge(farthest)
    }

    /// Distance from an obstacle's mesh at which a body is a collision, mm: all of the stock, but a
    /// little less than the clearance.
    pub(crate) fn hit_distance(&self, body: &SceneBody, obstacle: &SceneObstacle<'_>) -> f64 {
        let slack = self.settings.clearance_slack;
        match obstacle.role {
            Role::Machine => (body.clearance + obstacle.stock - slack).max(0.0),
            Role::Work(_) => obstacle.stock_for(body) + (body.clearance - slack).max(0.0),
        }
    }
}

/// The view of the other head, and the length of its tool.
fn other_view(setup: &VirtualSetup<'_>) -> Option<(Machine, f64)> {
    if setup.machine.head_count() < 2 {
        return None;
    }
    // The views of a machine that there is a view of; its axes are the words'.
    let views = Machine::heads(setup.machine.to_file()).ok()?;
    let other = views.into_iter().find(|view| view.head() != setup.machine.head())?;
    let axis = |letter| setup.words.axes().iter().position(|a| a.letter == letter);
    let head = setup.words.heads().iter().find(|h| axis(h.spindle_axis).is_some_and(|k| other.moves_tool(k)))?;
    Some((other, head.tool_length))
}

/// Whether a body is tested against an obstacle.
///
/// Bodies of the machine are tested against objects on the table where they move against it, and
/// those of the head against those of bed, table and other head, as are tool and cutter. Bodies of
/// the other head are nothing but obstacles here: against workpiece, table and bed they are tested
/// in that head's own view. Two bodies of the machine that one joint joins lie within each other by
/// construction (a ram in its guide, a table in its cradle), and those without a joint between them
/// never move against each other: both are left out.
fn may_meet(machine: &Machine, links: &Links, mount: Mount, obstacle: &SceneObstacle<'_>) -> bool {
    match (mount, obstacle.body) {
        (_, None) => true,
        (Mount::Tool(_), Some(k)) => links.between(Link::Tool, Link::Body(k)) > 0,
        (Mount::Machine(i), Some(k)) => {
            machine.bodies()[i].carrier() == Some(Carrier::Head) && links.between(Link::Body(i), Link::Body(k)) > 1
        }
    }
}

/// How many joints lie between the parts of the machine.
struct Links {
    /// Per axis, whether it moves the tool and then each body against the table.
    moved: Vec<Vec<bool>>,
}

#[derive(Clone, Copy)]
enum Link {
    Work,
    Tool,
    Body(usize),
}

impl Links {
    fn new(machine: &Machine) -> Self {
        let poses = |q: &AxisValues| -> Vec<Isometry3<f64>> {
            let bodies = machine.body_poses(q).map(|b| b.table_from_solid);
            std::iter::once(machine.forward(q, 0.0)).chain(bodies).collect()
        };
        let home = machine.home();
        let at_home = poses(&home);
        let moved = (0..home.len()).map(|k| {
            let mut q = home;
            // By a mm or a rad every joint moves what is behind it by far more than rounding.
            q[k] += 1.0;
            let differs =
                |(a, b): (&Isometry3<f64>, &Isometry3<f64>)| (a.to_homogeneous() - b.to_homogeneous()).norm() > 1e-6;
            at_home.iter().zip(&poses(&q)).map(differs).collect()
        });
        Self { moved: moved.collect() }
    }

    /// Joints between two parts: those that move one of the two against the table and not the
    /// other. The parts stand one behind the other in a chain from the table, or, on two heads,
    /// each in a chain that begins with the same joints.
    fn between(&self, a: Link, b: Link) -> usize {
        let moves = |axis: &[bool], link: Link| match link {
            Link::Work => false,
            Link::Tool => axis[0],
            Link::Body(k) => axis[1 + k],
        };
        self.moved.iter().filter(|axis| moves(axis, a) != moves(axis, b)).count()
    }
}

impl SceneBody {
    /// A body of the tool assembly, its tests left open.
    pub(crate) fn of_tool(b: PlacedSolid) -> Self {
        // Sections of a tool are sharp frusta: all their rounding is clearance.
        let clearance = b.solid.rounding();
        let mount = Mount::Tool(b.frame_from_solid);
        Self::new(b.name, FindingKind::HolderCollision, &b.solid, clearance, mount)
    }

    fn new(name: String, kind: FindingKind, solid: &Solid, clearance: f64, mount: Mount) -> Self {
        let rounding = (solid.rounding() - clearance).max(0.0);
        Self { name, kind, shape: Shape::core_of(solid), rounding, clearance, mount, meets: Vec::new() }
    }
}

impl<'a> SceneObstacle<'a> {
    /// Distance that a body keeps from the mesh at least, mm.
    pub(crate) fn stock_for(&self, body: &SceneBody) -> f64 {
        if matches!(body.mount, Mount::Tool(_)) { self.tool_stock } else { self.machine_stock }
    }

    fn of_mesh(o: &VirtualObstacle<'a>, settings: &VerifySettings) -> Self {
        let HeldAsCut { tool, machine } = settings.as_cut;
        // A fixture is not cut, whatever is on it.
        let is_cut = o.kind != ObstacleKind::Fixture;
        Self {
            name: o.name.clone(),
            frame: Frame::Work,
            allowance: o.allowance,
            stock: o.stock,
            tool_stock: if tool { o.allowance } else { o.stock },
            machine_stock: if machine && is_cut { o.stock.min(o.allowance) } else { o.stock },
            role: Role::Work(o.kind),
            meets_cutter: !(tool && o.kind == ObstacleKind::Stock),
            // The raw stock is gone where the cutter has been: only of the others is the distance
            // worth telling.
            counts: o.kind != ObstacleKind::Stock,
            body: None,
            mesh: SceneMesh::Borrowed(o.mesh),
        }
    }

    fn of_body(
        machine: &Machine,
        index: usize,
        links: &Links,
        work_from_table: &Isometry3<f64>,
    ) -> Result<Self, VerifyError> {
        let body = &machine.bodies()[index];
        let mut mesh = solid_mesh(&body.body.solid)
            .map_err(|e| VerifyError::Body { body: body.name().to_owned(), problem: e.to_string() })?;
        let stands_still = links.between(Link::Work, Link::Body(index)) == 0;
        let home = machine.home();
        if let Some(pose) = machine.body_poses(&home).nth(index).filter(|_| stands_still) {
            mesh = mesh.transformed(&(work_from_table * pose.table_from_solid));
        }
        Ok(Self {
            name: body.name().to_owned(),
            frame: if stands_still { Frame::Work } else { Frame::Machine(index) },
            allowance: body.clearance,
            stock: body.clearance,
            tool_stock: body.clearance,
            machine_stock: body.clearance,
            role: Role::Machine,
            meets_cutter: links.between(Link::Tool, Link::Body(index)) > 0,
            counts: stands_still || body.carrier() == Some(Carrier::OtherHead),
            body: Some(index),
            mesh: SceneMesh::Own(Box::new(MeshTree::new(&mesh))),
        })
    }

    pub(crate) fn mesh(&self) -> &dyn Interference {
        match &self.mesh {
            SceneMesh::Borrowed(mesh) => *mesh,
            SceneMesh::Own(mesh) => &**mesh,
        }
    }
}

/// The tool at a pose.
pub(crate) fn cl_of(work_from_tool: &Isometry3<f64>) -> ClPoint {
    ClPoint {
        tip: work_from_tool.translation.vector.into(),
        axis: nalgebra::Unit::new_unchecked(work_from_tool.rotation * Vector3::z()),
    }
}
