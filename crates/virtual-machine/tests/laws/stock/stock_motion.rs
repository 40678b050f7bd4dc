//! Cuts and contacts are those of the motion which the control makes: the stock's lines against
//! samples of the motion in time, by a formula for points in the cutter.

use facemill_test_kit::Random;
use std::fmt::Write;

use crate::kit::depth::TipAndAxis;
use crate::kit::stock::cut_stock;
use crate::kit::{CUTTER, Shop, Text};
use facemill_cl_data::{CuttingLaw, RapidLaw};
use facemill_inverse_kinematics::machine_file::{CuttingLawFile, Joint, RapidLawFile};
use facemill_inverse_kinematics::{AxisValues, BlockLaw, Machine, Motion, preset_head_b_table_c};
use facemill_nc_program::read_program;
use facemill_nc_program::words::AxisKind;
use facemill_nc_program::{Dialect, ReadProgram};
use facemill_virtual_machine::{Finding, FindingKind, VerifySettings, VirtualSetup};
use facemill_z_map::DexelMap;
use nalgebra::{Isometry3, Point3, Unit, Vector3};

/// That of the cut stock, mm.
const TOLERANCE: f64 = 0.02;

/// Distance of the stock's lines, mm.
const CELL: f64 = 3.0;

/// Largest way of the tip and of the rim from one sample of a motion to the next, mm.
const SAMPLE: f64 = 0.08;

/// How programs say where the tool is.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Form {
    /// Words of all axes.
    Axes,
    /// Words of the tip and the rotary axes, under RTCP.
    Tip,
    /// Words of the tip and the tool's vector.
    Vector,
}

const FORMS: [Form; 3] = [Form::Axes, Form::Tip, Form::Vector];

impl Form {
    fn law(self) -> CuttingLaw {
        match self {
            Self::Axes => CuttingLaw::AxesLinear,
            Self::Tip => CuttingLaw::TipAndRotariesLinear,
            Self::Vector => CuttingLaw::TipLinearVectorTurned,
        }
    }

    fn dialect(self) -> Dialect {
        if self == Self::Vector { Dialect::Siemens840d } else { Dialect::Fanuc }
    }
}

/// A mill with head and table, and a trunnion, whose controls move like this.
fn shops(cutting: CuttingLawFile, rapid: RapidLawFile) -> [Shop; 2] {
    let trunnion = concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets/machines/table-table-a-c.json");
    [preset_head_b_table_c().as_bytes().to_vec(), std::fs::read(trunnion).unwrap()].map(|bytes| {
        let mut file = Machine::from_json(&bytes).unwrap().to_file();
        (file.motion.cutting, file.motion.rapid) = (cutting, rapid);
        // Room for a workpiece that is mounted off the middle.
        for row in &mut file.tool_chains[0].rows {
            if let Some(Joint::Prismatic(axis)) = &mut row.joint {
                (axis.min_mm, axis.max_mm) = (axis.min_mm - 1000.0, axis.max_mm + 1000.0);
            }
        }
        Shop::with_machine(Machine::from_file(file).unwrap())
    })
}

fn shops_of(form: Form) -> [Shop; 2] {
    let law = match form {
        Form::Axes => CuttingLawFile::AxesLinear,
        Form::Tip => CuttingLawFile::TipAndRotariesLinear,
        Form::Vector => CuttingLawFile::TipLinearVectorTurned,
    };
    shops(law, RapidLawFile::Linear)
}

/// A tip and a tool axis, workpiece frame.
type Pose = ([f64; 3], [f64; 3]);

/// Poses on a way over a block of ±15 mm that dips into it, the tool leaning by up to 25 degrees,
/// otherwise at each pose but never upright, where the machines are singular.
fn way(random: &mut Random) -> Vec<Pose> {
    [-45.0, -8.0, 12.0, 45.0]
        .map(|x| {
            let tip = [x, random.between(-12.0, 12.0), random.between(6.0, 14.0)];
            let (lean, turn) = (random.between(0.1, 0.45), random.between(0.2, 1.4));
            (tip, [lean.sin() * turn.cos(), lean.sin() * turn.sin(), lean.cos()])
        })
        .into()
}

/// The axes at each pose, each near the one before.
fn axes(shop: &Shop, poses: &[Pose]) -> Vec<AxisValues> {
    let mut at = shop.machine.home();
    let next = |(tip, axis): &Pose| {
        at = shop.axes_near(*tip, *axis, &at);
        at
    };
    poses.iter().map(next).collect()
}

fn words(shop: &Shop, axes: &AxisValues, only: Option<AxisKind>) -> String {
    let words = shop.words.words(axes.as_slice()).unwrap();
    let wanted = words.iter().filter(|w| only.is_none_or(|kind| w.letter.kind() == kind));
    wanted.fold(String::new(), |mut line, w| {
        write!(line, " {}{:.6}", w.letter, w.value).unwrap();
        line
    })
}

fn linear([x, y, z]: [f64; 3]) -> String {
    format!(" X{x:.6} Y{y:.6} Z{z:.6}")
}

/// A program that goes to the first pose from above, and cuts to the others.
fn program(shop: &Shop, form: Form, poses: &[Pose], axes: &[AxisValues]) -> ReadProgram {
    let ([x, y, _], rotary) = (poses[0].0, words(shop, &axes[0], Some(AxisKind::Rotary)));
    let above = linear([x, y, 200.0]);
    // At the pole the table turns alone: a vector turned out of it by both axes would have one of
    // them jump.
    let table = rotary.split(' ').find(|w| w.starts_with('C')).unwrap();
    let mut text = match form {
        Form::Axes => format!("{}G0 G43{} H7\n", Text::new(shop).text, words(shop, &axes[0], None)),
        Form::Tip => {
            format!("{}G0 G43.4{above} H7\nG0{above}{rotary}\nG0{}\n", Text::new(shop).text, linear(poses[0].0))
        }
        Form::Vector => format!(
            "G710 G90 G94\nT7 M6\nS2000 M3\nD1\nTRAORI\nORIWKS ORIVECT\nG0 {table}\nG0{above}{rotary}\nG0{}\n",
            linear(poses[0].0)
        ),
    };
    for (k, (tip, axis)) in poses.iter().enumerate().skip(1) {
        let said = match form {
            Form::Axes => words(shop, &axes[k], None),
            Form::Tip => linear(*tip) + &words(shop, &axes[k], Some(AxisKind::Rotary)),
            Form::Vector => {
                let [a, b, c] = Unit::new_normalize(Vector3::from(*axis)).into_inner().into();
                format!("{} A3={a:.9} B3={b:.9} C3={c:.9}", linear(*tip))
            }
        };
        writeln!(text, "G1{said} F500.").unwrap();
    }
    read_program(&text, form.dialect()).unwrap_or_else(|e| panic!("{e}\n{text}"))
}

/// Places of the tool on the work at samples of a motion in time, so many that neither tip nor rim
/// goes far between them.
fn places(shop: &Shop, law: BlockLaw, from: &AxisValues, to: &AxisValues) -> Vec<TipAndAxis> {
    let length = shop.tool.gauge_length();
    let motion = Motion::new(&shop.machine, law, from, to, length).unwrap();
    let work_from_table = shop.table_from_work.inverse();
    let at = |t: f64| {
        let cl = shop.machine.cl_point(&motion.at(t).unwrap(), length).transformed(&work_from_table);
        (cl.tip, cl.axis)
    };
    let sampled = |n: u32| -> Vec<TipAndAxis> { (0..=n).map(|k| at(f64::from(k) / f64::from(n))).collect() };
    let far = |w: &[TipAndAxis]| {
        (w[1].0 - w[0].0).norm() + CUTTER.radius * (w[1].1.into_inner() - w[0].1.into_inner()).norm()
    };
    let mut n = 100;
    loop {
        let all = sampled(n);
        let longest = all.windows(2).map(far).fold(0.0, f64::max);
        if longest <= SAMPLE {
            return all;
        }
        n = (f64::from(n) * (1.1 * longest / SAMPLE)).ceil() as u32;
    }
}

/// How far a point is outside of the cutter at the place where it is nearest, inside negative, mm.
fn outside(places: &[TipAndAxis], p: &Point3<f64>) -> f64 {
    places.iter().map(|place| CUTTER.outside(place, p).0).fold(f64::INFINITY, f64::min)
}

/// Points of a map's lines within heights, and whether there is material: in steps, and just beside
/// the ends of all intervals.
fn points(map: &DexelMap, [low, high]: [f64; 2]) -> Vec<(Point3<f64>, bool)> {
    let mut points = Vec::new();
    let [nx, ny] = map.grid().n_lines();
    for (i, j) in (0..nx).flat_map(|i| (0..ny).map(move |j| (i, j))) {
        let intervals: Vec<[f64; 2]> = map.intervals(i, j).map(|s| [s.bottom, s.top]).collect();
        let ends = intervals.iter().flatten().flat_map(|z| [z - 1e-4, z + 1e-4]);
        let steps = (0..=20).map(|k| low + (high - low) * f64::from(k) / 20.0);
        for z in ends.chain(steps).filter(|z| (low..=high).contains(z)) {
            let is_material = intervals.iter().any(|[low, high]| (*low..=*high).contains(&z));
            points.push((map.grid().in_work(i, j, z), is_material));
        }
    }
    points
}

const HEIGHT: f64 = 16.0;

fn block() -> DexelMap {
    DexelMap::of_box(&Isometry3::identity(), [-15.0, -15.0, 0.0], [15.0, 15.0, HEIGHT], CELL).unwrap()
}

fn setup(shop: &Shop, form: Form) -> VirtualSetup<'_> {
    let length_register = if form == Form::Vector { 1 } else { shop.tool.number() };
    VirtualSetup { length_register, ..shop.setup() }
}

/// Cuts the block; returns it with the volume that was taken.
fn cut(shop: &Shop, form: Form, poses: &[Pose], axes: &[AxisValues]) -> (DexelMap, f64) {
    let mut stock = block();
    let program = program(shop, form, poses, axes);
    let run = cut_stock(&program, &setup(shop, form), &VerifySettings::default(), &mut stock, TOLERANCE);
    assert_eq!(run.blocks.len(), poses.len() - 1, "{form:?}");
    assert!(run.findings.iter().all(|f| f.kind != FindingKind::ReachFailure), "{:?}", run.findings);
    (stock, run.removed_mm3)
}

/// Whether the axes can follow all blocks.
fn is_followed(shop: &Shop, form: Form, poses: &[Pose]) -> bool {
    let program = program(shop, form, poses, &axes(shop, poses));
    let settings = VerifySettings::default();
    let run = cut_stock(&program, &setup(shop, form), &settings, &mut block(), TOLERANCE);
    run.findings.iter().all(|f| f.kind != FindingKind::ReachFailure)
}

/// Samples of a whole way.
fn sweep(shop: &Shop, form: Form, axes: &[AxisValues]) -> Vec<TipAndAxis> {
    axes.windows(2).flat_map(|w| places(shop, form.law().into(), &w[0], &w[1])).collect()
}

/// How deep material that is left is in the cutter at any sample, and how far material that was
/// taken is outside of all, mm.
fn errors(stock: &DexelMap, sweep: &[TipAndAxis]) -> [f64; 2] {
    let mut errors = [0.0_f64; 2];
    for (p, is_material) in points(stock, [0.0, HEIGHT]) {
        let away = outside(sweep, &p);
        if is_material { errors[0] = errors[0].max(-away) } else { errors[1] = errors[1].max(away) }
    }
    errors
}

/// Largest distance of material in or outside of the samples, mm: twice the tolerance, and for
/// removed material half of the samples' distance.
const ALLOWED: [f64; 2] = [2.0 * TOLERANCE + 1e-3, 2.0 * TOLERANCE + 1e-3 + 0.5 * SAMPLE];

#[test]
fn stock_is_cut_by_the_motion_of_the_law_within_the_tolerance() {
    for (form, other) in FORMS.into_iter().zip([Form::Tip, Form::Vector, Form::Axes]) {
        let mut random = Random(3);
        for shop in shops_of(form) {
            // Of vectors 5 of 80 ways are not followed: the control says so, and cuts nothing
            // there.
            let poses = std::iter::repeat_with(|| way(&mut random)).take(4).find(|w| is_followed(&shop, form, w));
            let poses = poses.expect("most ways are followed");
            let axes = axes(&shop, &poses);
            let (stock, removed) = cut(&shop, form, &poses, &axes);
            assert!(removed > 500.0 && removed < 0.95 * 900.0 * HEIGHT, "{form:?}: {removed}");
            let [deep, away] = errors(&stock, &sweep(&shop, form, &axes));
            assert!(deep <= ALLOWED[0] && away <= ALLOWED[1], "{form:?}: {deep} deep, {away} away");
            // Another law is another motion: the samples tell.
            let [deep, away] = errors(&stock, &sweep(&shop, other, &axes));
            assert!(deep > 2.0 * ALLOWED[0] || away > 2.0 * ALLOWED[1], "{form:?} {other:?}: {deep} {away}");
        }
    }
}

/// Blocks so short that all laws are the same motion within this, mm.
const SHORT: f64 = 0.01;

#[test]
fn short_blocks_cut_the_same_stock_in_all_forms() {
    let mut random = Random(5);
    let poses = way(&mut random);
    for machine in 0..2 {
        let mut cuts = Vec::new();
        for form in FORMS {
            let shop = &shops_of(form)[machine];
            // Places of one motion, whatever the form.
            let (ends, length) = (axes(shop, &poses), shop.tool.gauge_length());
            let work_from_table = shop.table_from_work.inverse();
            let divided = |w: &[AxisValues]| -> Vec<AxisValues> {
                let law = CuttingLaw::TipLinearVectorTurned.into();
                let motion = Motion::new(&shop.machine, law, &w[0], &w[1], length).unwrap();
                (1..=60).map(|k| motion.at(f64::from(k) / 60.0).unwrap()).collect()
            };
            let at: Vec<AxisValues> = std::iter::once(ends[0]).chain(ends.windows(2).flat_map(divided)).collect();
            let pose = |q: &AxisValues| {
                let cl = shop.machine.cl_point(q, length).transformed(&work_from_table);
                (cl.tip.coords.into(), cl.axis.into_inner().into())
            };
            let (stock, removed) = cut(shop, form, &at.iter().map(pose).collect::<Vec<_>>(), &at);
            let [deep, away] = errors(&stock, &sweep(shop, Form::Vector, &ends));
            assert!(deep <= ALLOWED[0] + SHORT && away <= ALLOWED[1] + SHORT, "{form:?}: {deep} deep, {away} away");
            cuts.push(removed);
        }
        let [least, most] = [f64::min, f64::max].map(|of| cuts.iter().copied().reduce(of).unwrap());
        assert!(least > 500.0 && most - least < 0.01 * least, "{cuts:?}");
    }
}

/// Distance that rapids keep from the material of lines, mm, besides tolerances.
const KEPT: f64 = CELL * std::f64::consts::FRAC_1_SQRT_2;

/// Posts in the way of a rapid on which each axis goes by itself, and of one on which all go
/// together: each is met by the motion of the machine's law alone.
#[test]
fn rapids_meet_obstacles_on_the_way_of_their_law() {
    let laws = [(RapidLawFile::PerAxis, RapidLaw::PerAxis), (RapidLawFile::Linear, RapidLaw::Linear)];
    let shops = laws.map(|(file, _)| shops(CuttingLawFile::AxesLinear, file));
    let mut random = Random(11);
    // By machine and by the law whose way the post blocks: how often it was met by this one alone.
    let mut alone = [[0; 2]; 2];
    for (machine, _) in shops[0].iter().enumerate().flat_map(|machine| [machine; 4]) {
        let shop = &shops[0][machine];
        let mut pose = |x: f64| {
            let (lean, turn) = (random.between(0.1, 0.4), random.between(0.0, 1.5));
            let tip = [x, random.between(-150.0, 150.0), random.between(0.0, 150.0)];
            (tip, [lean.sin() * turn.cos(), lean.sin() * turn.sin(), lean.cos()])
        };
        let at = axes(shop, &[pose(-150.0), pose(150.0)]);
        let ways = laws.map(|(_, law)| places(shop, law.into(), &at[0], &at[1]));
        for (own, of_law) in alone[machine].iter_mut().enumerate() {
            let (tip, axis) = ways[own][ways[own].len() * 2 / 5];
            let middle = tip + axis.into_inner() * 6.0;
            let [x, y, z] = middle.coords.into();
            let post = || {
                let (low, high) = ([x - CELL, y - CELL, z - 2.0], [x + CELL, y + CELL, z + 2.0]);
                DexelMap::of_box(&Isometry3::identity(), low, high, CELL).unwrap()
            };
            let nearest = ways.each_ref().map(|way| {
                let points = points(&post(), [z - 2.0, z + 2.0]).into_iter().filter(|p| p.1);
                points.map(|(p, _)| outside(way, &p)).fold(f64::INFINITY, f64::min)
            });
            for (k, shops) in shops.iter().enumerate() {
                let shop = &shops[machine];
                let said = at.iter().map(|q| format!("G0 G43{} H7\n", words(shop, q, None)));
                let text = Text::new(shop).text + &said.collect::<String>();
                let program = read_program(&text, Dialect::Fanuc).unwrap();
                let run = cut_stock(&program, &shop.setup(), &VerifySettings::default(), &mut post(), TOLERANCE);
                let line = crate::kit::HEAD + 2;
                let is_met = |f: &Finding| f.kind == FindingKind::RapidCollision && f.last_line == line;
                let found = run.findings.iter().any(is_met);
                let met = nearest[k] < KEPT - 2.0 * TOLERANCE - SAMPLE;
                assert!(found || !met, "not found {} mm in: {:?}", -nearest[k], laws[k]);
                // The first way, from home, may lead there, too.
                let free = nearest[k] > KEPT + 2.0 * TOLERANCE;
                assert!(!found || !free, "found {} mm away: {:?}", nearest[k], laws[k]);
                assert!(k != own || met && found);
                *of_law += usize::from(k != own && free);
            }
        }
    }
    assert!(alone.iter().flatten().all(|n| *n >= 2), "{alone:?}");
}
