//! Laws of programs that name the tool's axis in place of rotary words.

use facemill_cl_data::{CuttingLaw, MotionLaw};
use facemill_nc_program::dialect::{Orientation, PostFile, RtcpRapids};
use facemill_nc_program::words::AxisKind;
use facemill_nc_program::*;
use nalgebra::{Unit, Vector3};

use crate::dialects::{home, law};
use crate::kit::{AXES, Random, spec, words};
use crate::slow_control::split_word;

/// How a dialect names vectors: of the tool, and of the surface.
struct Names {
    tool: [&'static str; 3],
    normal: Option<[&'static str; 3]>,
    /// Every block says everything.
    is_complete: bool,
    law: CuttingLaw,
}

fn names(dialect: Dialect) -> Option<Names> {
    match dialect {
        Dialect::Siemens840d => Some(Names {
            tool: ["A3", "B3", "C3"],
            normal: None,
            is_complete: false,
            law: CuttingLaw::TipLinearVectorTurned,
        }),
        Dialect::Heidenhain => Some(Names {
            tool: ["TX", "TY", "TZ"],
            normal: Some(["NX", "NY", "NZ"]),
            is_complete: true,
            law: CuttingLaw::TipAndRotariesLinear,
        }),
        _ => None,
    }
}

fn post(dialect: Dialect) -> PostFile {
    // The longest line is nobody's word: what a vector block needs fits by itself.
    PostFile { dialect, feed_mode: FeedMode::Rtcp, orientation: Orientation::Vectors, ..PostFile::default() }
}

fn settings(dialect: Dialect) -> PostSettings {
    let cutting = names(dialect).unwrap().law;
    post(dialect).settings(None).unwrap().on_machine(MotionLaw { cutting, ..law(0.01) }, home()).unwrap()
}

fn unit(random: &mut Random) -> Unit<Vector3<f64>> {
    // Often along an axis, where components are 0 and 1.
    let along = [Vector3::x(), -Vector3::y(), Vector3::z()];
    match random.below(4) {
        0 => Unit::new_normalize(along[random.below(3)]),
        _ => Unit::new_normalize(Vector3::from_fn(|_, _| random.unit() - 0.5)),
    }
}

/// A rapid that names every axis, then cuts with vectors, some of which say little new, and rapids
/// and cuts without between.
fn blocks(random: &mut Random, n: usize) -> Vec<Block> {
    let mut at: Vec<(AxisLetter, f64)> = AXES.iter().map(|l| (*l, random.coordinate())).collect();
    let mut vectors = CutVectors { tool_axis: unit(random), normal: unit(random) };
    let mut all = vec![Block::Rapid { words: words(&at) }];
    for _ in 0..n {
        for word in &mut at {
            if random.below(2) == 0 {
                word.1 = random.coordinate();
            }
        }
        if random.below(2) == 0 {
            vectors = CutVectors { tool_axis: unit(random), normal: unit(random) };
        }
        let words = words(&at);
        all.push(match random.below(6) {
            0 => Block::Rapid { words },
            1 => Block::Linear { words, feed: 10.0 + 900.0 * random.unit() },
            _ => Block::LinearVectors { words, feed: 10.0 + 900.0 * random.unit(), vectors: Box::new(vectors) },
        });
    }
    all
}

/// The text agrees with the blocks within half a unit, if words that it leaves out are remembered;
/// rotary words are in blocks without vectors alone, and there anew behind every cut, because only
/// the control knows where it turned them.
#[test]
fn vectors_come_back_from_the_text() {
    for dialect in Dialect::ALL {
        let Some(names) = names(dialect) else { continue };
        let settings = settings(dialect);
        let mut random = Random(51);
        for _ in 0..20 {
            let spec = spec(blocks(&mut random, 50));
            let written = write_program_with_lines(&spec, &settings).unwrap_or_else(|e| panic!("{dialect:?} {e}"));
            let lines: Vec<&str> = written.text.lines().collect();
            let mut known = std::collections::BTreeMap::<String, f64>::new();
            for (block, line) in spec.program.blocks.iter().zip(&written.block_lines) {
                let line = lines[*line as usize - 1];
                let said: Vec<(String, String)> = line.split(' ').filter_map(split_word).collect();
                let has = |name: &str| said.iter().any(|(n, _)| n == name);
                known.extend(said.iter().filter_map(|(n, v)| Some((n.clone(), v.parse().ok()?))));
                let (at, vectors) = match block {
                    Block::Rapid { words } | Block::Linear { words, .. } => (words, None),
                    Block::LinearVectors { words, vectors, .. } => (words, Some(vectors)),
                    other => panic!("{other:?}"),
                };
                for word in at.iter() {
                    let name = word.letter.to_string();
                    if word.letter.kind() == AxisKind::Rotary && vectors.is_some() {
                        assert!(!has(&name), "{line}");
                        known.remove(&name);
                        continue;
                    }
                    assert!((known[&name] - word.value).abs() <= 0.0005 + 1e-9, "{dialect:?} {line}");
                    assert!(!names.is_complete || vectors.is_none() || has(&name), "{dialect:?} {line}");
                }
                let Some(vectors) = vectors else {
                    assert!(names.tool.iter().all(|n| !has(n)), "{line}");
                    known.retain(|name, _| !names.tool.contains(&name.as_str()));
                    continue;
                };
                let pairs = [(Some(names.tool), vectors.tool_axis), (names.normal, vectors.normal)];
                for (names_of, vector) in pairs.into_iter().filter_map(|(n, v)| Some((n?, v))) {
                    let found = Vector3::from_fn(|k, _| known[names_of[k]]);
                    // Half a unit of six decimals in each component.
                    assert!((found - vector.into_inner()).amax() <= 0.5e-6 + 1e-12, "{dialect:?} {line}");
                    assert!(!names.is_complete || names_of.iter().all(|n| has(n)), "{line}");
                }
            }
        }
    }
}

#[test]
fn a_cut_without_vectors_is_refused_where_the_dialect_wants_them_in_all() {
    for dialect in Dialect::ALL {
        if names(dialect).is_none() {
            let error = post(dialect).settings(None).unwrap_err().to_string();
            assert!(error.starts_with("orientation: ") || error.starts_with("max_line_length"), "{dialect:?} {error}");
            continue;
        }
        let first = Block::Rapid { words: words(&AXES.map(|l| (l, 0.0))) };
        let cut = Block::Linear { words: words(&[(AxisLetter::X, 1.0)]), feed: 100.0 };
        let mixed = spec(vec![first.clone(), cut]);
        assert!(write_program(&mixed, &settings(dialect)).is_ok());
        let mut rules = dialect.file();
        rules.motion.rtcp.as_mut().unwrap().vectors.as_mut().unwrap().between_rotary_words = false;
        let strict = post(dialect).settings_of(rules, dialect.template()).unwrap();
        let motion = MotionLaw { cutting: names(dialect).unwrap().law, ..law(0.01) };
        let error = write_program(&mixed, &strict.on_machine(motion, home()).unwrap()).unwrap_err();
        assert_eq!(error, WriteError::NoVectors { place: "block 1".to_owned() });
        let long = Unit::new_unchecked(Vector3::new(0.0, 0.0, 1.001));
        for (tool_axis, normal) in [(long, Vector3::z_axis()), (Vector3::z_axis(), long)] {
            let vectors = Box::new(CutVectors { tool_axis, normal });
            let cut = Block::LinearVectors { words: words(&[(AxisLetter::X, 1.0)]), feed: 100.0, vectors };
            let written = write_program(&spec(vec![first.clone(), cut]), &settings(dialect));
            let is_named = tool_axis == long || names(dialect).unwrap().normal.is_some();
            assert_eq!(written.is_err(), is_named, "{dialect:?} {written:?}");
        }
    }
}

/// The angle between a vector and its text is within the bound, which is nearly reached, and 0
/// without vectors.
#[test]
fn the_rounding_bound_of_vectors_holds() {
    for dialect in Dialect::ALL.into_iter().filter(|d| names(*d).is_some()) {
        let settings = settings(dialect);
        let bound = settings.rounding_bound().vector;
        let mut random = Random(54);
        let mut largest = 0.0_f64;
        for _ in 0..5000 {
            let vector = unit(&mut random);
            let text = settings.vector_in_text(&vector);
            let apart = vector.cross(&text).norm().atan2(vector.dot(&text));
            largest = largest.max(apart);
            let scale = 10f64.powi(dialect.file().numbers.vector_decimals.into());
            assert!((text * scale).iter().all(|c| (c - c.round()).abs() < 1e-6));
        }
        assert!(largest <= bound && largest > 0.8 * bound, "{dialect:?} {largest} {bound}");
        let rotary = PostFile { orientation: Orientation::Rotary, ..post(dialect) }.settings(None).unwrap();
        assert_eq!((rotary.rounding_bound().vector, rotary.vector_rule()), (0.0, None));
    }
}

/// The same blocks with rotary words: vectors are not needed and not written.
#[test]
fn dialects_that_name_no_vectors_write_the_rotary_words() {
    let blocks = blocks(&mut Random(52), 30);
    let plain: Vec<Block> = blocks
        .iter()
        .map(|b| match b {
            Block::LinearVectors { words, feed, .. } => Block::Linear { words: *words, feed: *feed },
            other => other.clone(),
        })
        .collect();
    for dialect in Dialect::ALL {
        let post = PostFile { orientation: Orientation::Rotary, max_line_length: Some(120), ..post(dialect) };
        let settings = post.settings(None).unwrap().on_machine(law(0.01), home()).unwrap();
        let write = |blocks: &[Block]| write_program(&spec(blocks.to_vec()), &settings).unwrap();
        assert_eq!(write(&blocks), write(&plain), "{dialect:?}");
    }
}

#[test]
fn siemens_turns_rotary_words_linearly_and_vectors_in_their_plane() {
    let spec = spec(blocks(&mut Random(53), 10));
    let rotary = PostFile { orientation: Orientation::Rotary, ..post(Dialect::Siemens840d) }.settings(None).unwrap();
    let linear = rotary.on_machine(law(0.01), home()).unwrap();
    assert_eq!(linear.cutting_law(), CuttingLaw::TipAndRotariesLinear);
    let text = write_program(&spec, &linear).unwrap();
    assert!(text.contains("TRAORI\n") && text.contains("ORIMKS ORIAXES\n") && !text.contains("A3="), "{text}");
    assert!(text.contains("FGROUP(X,Y,Z)\n") && text.contains("CYCLE832(0.0100,11,0.0100)\n"), "{text}");
    let turned = MotionLaw { cutting: CuttingLaw::TipLinearVectorTurned, ..law(0.01) };
    for settings in [rotary.on_machine(turned, home()).unwrap(), settings(Dialect::Siemens840d)] {
        assert_eq!(settings.cutting_law(), CuttingLaw::TipLinearVectorTurned);
        assert!(write_program(&spec, &settings).unwrap().contains("ORIWKS ORIVECT\n"));
        assert_eq!(settings.rtcp_rapids(), Some(RtcpRapids::TipLinear));
    }
    // Which interpolation vectors with ORIAXES get is a machine datum.
    let error =
        post(Dialect::Siemens840d).settings(None).unwrap().on_machine(law(0.01), home()).unwrap_err().to_string();
    assert!(error.contains("tip_and_rotaries_linear; it does tip_linear_vector_turned"), "{error}");
}

/// Way home, check of the tool, and all axes in F without RTCP.
#[test]
fn siemens_goes_home_without_transformation_and_without_length() {
    let first = Block::Rapid { words: words(&AXES.map(|l| (l, 1.5))) };
    let cut = Block::Linear { words: words(&[(AxisLetter::X, 2.0)]), feed: 800.0 };
    let post = PostFile { dialect: Dialect::Siemens840d, ..PostFile::default() };
    let exact = post.settings(None).unwrap().on_machine(law(0.0), home()).unwrap();
    let text = write_program(&spec(vec![first, cut]), &exact).unwrap();
    let mut rest = text.as_str();
    let lines = [
        "; AXIS C TURNS WITHOUT END, ITS WORDS GO ON BEYOND 360: NO MODULO AXIS (MD30310 IS 0)\n",
        "N1 G710 G17 G40 G90 G94\n",
        "TRAFOOF\n",
        "RTLION\n",
        "G0 SUPA Z1500. D0\n",
        "G0 SUPA X0. Y0. D0\n",
        "G0 SUPA B0. C0. D0\n",
        "T7 M6\n",
        "D1\n",
        "IF ABS($P_TOOLL[1]-420.000)<=0.01 GOTOF LENGTH_OK\n",
        "SETAL(65000)\n",
        "M0\n",
        "LENGTH_OK:\n",
        "G54\n",
        "S350 M3\n",
        "FGROUP(X,Y,Z,B,C)\n",
        "FGREF[B]=57.29578\n",
        "FGREF[C]=57.29578\n",
        "G0 B1.5 C1.5\n",
        "G0 X1.5 Y1.5\n",
        "G0 Z1.5\n",
        "M8\n",
        "G60\n",
        "G90 G94 G0 X1.5 Y1.5 Z1.5 B1.5 C1.5\n",
        "G1 X2. F800.\n",
        "G64\n",
        "TRAFOOF\n",
        "G0 SUPA Z1500. D0\n",
        "M30\n",
    ];
    for line in lines {
        rest = rest.split_once(line).unwrap_or_else(|| panic!("{line} in\n{text}")).1;
    }
    let per_axis = MotionLaw { rapid: facemill_cl_data::RapidLaw::PerAxis, ..law(0.0) };
    assert!(post.settings(None).unwrap().on_machine(per_axis, home()).is_err());
}

#[test]
fn heidenhain_says_face_mill_blocks_with_normal_and_tool_vector() {
    let first = Block::Rapid { words: words(&AXES.map(|l| (l, 1.5))) };
    let tool_axis = Unit::new_normalize(Vector3::new(0.6, 0.0, 0.8));
    let vectors = CutVectors { tool_axis, normal: -Vector3::z_axis() };
    let cut = |x: f64| Block::LinearVectors {
        words: words(&[(AxisLetter::X, x)]),
        feed: 1200.07,
        vectors: Box::new(vectors),
    };
    let blocks = vec![first, cut(-2.0), cut(-2.5)];
    let text = write_program(&spec(blocks.clone()), &settings(Dialect::Heidenhain)).unwrap();
    let mut rest = text.as_str();
    let lines = [
        "0 BEGIN PGM PROPELLER_PRUEFUNG MM\n1 ; PROGRAM PROPELLER (PRUEFUNG)\n",
        "FUNCTION RESET TCPM\n",
        "PLANE RESET STAY\n",
        "L Z+1500 R0 FMAX M91\n",
        "L B+0 C+0 R0 FMAX M91\n",
        "TOOL CALL 7 Z S350\n",
        "FN 2: Q99 = +Q114 - +420.000\n",
        "FN 3: Q99 = +Q99 * +Q99\n",
        "FN 12: IF +Q99 LT +0.0001 GOTO LBL 99\n",
        "FN 14: ERROR = 1004\n",
        "M0\n",
        "LBL 99\n",
        "CYCL DEF 247 DATUM SETTING ~\nQ339=+1 ;DATUM NUMBER\n",
        "M3\n",
        "L B+14 C+15 R0 FMAX\n",
        "FUNCTION TCPM F TCP AXIS POS PATHCTRL AXIS\n",
        "L X+11 Y+12 Z+13 R0 FMAX\n",
        "CYCL DEF 32.1 T0.0100\n",
        "CYCL DEF 32.2 HSC-MODE:0 TA0.0100\n",
        "L X+1.5 Y+1.5 Z+1.5 B+1.5 C+1.5 R0 FMAX\n",
        "LN X-2 Y+1.5 Z+1.5 NX+0 NY+0 NZ-1 TX+0.6 TY+0 TZ+0.8 F1200\n",
        "LN X-2.5 Y+1.5 Z+1.5 NX+0 NY+0 NZ-1 TX+0.6 TY+0 TZ+0.8\n",
        "FUNCTION RESET TCPM\n",
        "L Z+1500 R0 FMAX M91\n",
        "M30\n",
        "END PGM PROPELLER_PRUEFUNG MM\n",
    ];
    for line in lines {
        rest = rest.split_once(line).unwrap_or_else(|| panic!("{line} in\n{text}")).1;
    }
    assert!(rest.is_empty());
    let turned = MotionLaw { cutting: CuttingLaw::TipLinearVectorTurned, ..law(0.01) };
    let turned = post(Dialect::Heidenhain).settings(None).unwrap().on_machine(turned, home()).unwrap();
    assert!(write_program(&spec(blocks.clone()), &turned).unwrap().contains("AXIS POS PATHCTRL VECTOR\n"));
    // It always smooths: how far, a program has to say, and what plan and verification took for
    // nothing cannot be said.
    let exact = post(Dialect::Heidenhain).settings(None).unwrap().on_machine(law(0.0), home()).unwrap();
    let error = write_program(&spec(blocks.clone()), &exact).unwrap_err();
    assert_eq!(error, WriteError::Tolerance { name: "Heidenhain TNC".to_owned(), key: "path_mm" });
    let straight = facemill_cl_data::ControlTolerance { path: 0.01, orientation: 0.0 };
    let straight = MotionLaw { control_tolerance: straight, ..law(0.0) };
    let straight = post(Dialect::Heidenhain).settings(None).unwrap().on_machine(straight, home()).unwrap();
    let error = write_program(&spec(blocks), &straight).unwrap_err().to_string();
    assert!(error.contains("motion.control_tolerance.orientation_deg"), "{error}");
}

#[test]
fn heidenhain_has_no_words_for_inverse_time_and_for_words_without_length() {
    let post = PostFile { feed_mode: FeedMode::G93, orientation: Orientation::Rotary, ..post(Dialect::Heidenhain) };
    let error = post.settings(None).unwrap_err().to_string();
    assert_eq!(error, "feed_mode: Heidenhain TNC has no g93; take g94 or rtcp");
    let post = PostFile { feed_mode: FeedMode::G94, ..post };
    let settings = post.settings(None).unwrap().on_machine(law(0.01), home()).unwrap();
    let first = Block::Rapid { words: words(&AXES.map(|l| (l, 0.0))) };
    let write = |block: Block| write_program(&spec(vec![first.clone(), block]), &settings);
    let error = write(Block::LengthCompensationOff).unwrap_err().to_string();
    assert!(error.starts_with("block 1: Heidenhain TNC has no word"), "{error}");
    assert!(write(Block::Dwell { seconds: 0.25 }).unwrap().contains("CYCL DEF 9.1 DWELL 0.250\n"));
    assert!(write(Block::WorkOffset(WorkOffset::new(12).unwrap())).unwrap().contains("~\nQ339=+12 ;DATUM NUMBER\n"));
    // Once at the start, once at the end, and once here.
    let homed = write(Block::Home { axes: vec![AxisLetter::Z] }).unwrap();
    assert_eq!(homed.matches(" L Z+1500 R0 FMAX M91\n").count(), 3, "{homed}");
}
