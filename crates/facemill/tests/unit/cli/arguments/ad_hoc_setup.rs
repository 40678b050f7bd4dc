use crate::cli::arguments::ad_hoc_setup::*;
use crate::cli::arguments::program::ProgramArguments;

#[derive(clap::Parser)]
struct Command {
    #[command(flatten)]
    program: ProgramArguments,
    #[command(flatten)]
    stand: StandArguments,
}

fn taken(options: &str) -> Vec<String> {
    let words = ["verify", "a.nc"].into_iter().chain(options.split_whitespace());
    let command = <Command as clap::Parser>::try_parse_from(words).unwrap_or_else(|e| panic!("{options}: {e}"));
    command.stand.assumptions(command.program.dialect).into_iter().map(|a| a.text).collect()
}

/// Each option that is given takes its own assumption away, and no other one.
#[test]
fn unstated_data_of_an_ad_hoc_setup_is_reported() {
    const STAND: &str = "--part p.stl --stock box --machine m.json --tool t.json";
    let all = taken(STAND);
    let options = [
        ("--mount", "0,0,0"),
        ("--work-offset", "0,0,0"),
        ("--work-register", "G55"),
        ("--length-register", "3"),
        ("--mesh-unit", "inch"),
        ("--mesh-up", "z"),
    ];
    assert_eq!(all.len(), options.len() + 1);
    for (option, value) in options {
        let text = all.iter().find(|text| text.starts_with(&format!("no {option}:"))).expect(option);
        let left = taken(&format!("{STAND} {option} {value}"));
        assert_eq!(left, all.iter().filter(|other| *other != text).cloned().collect::<Vec<_>>());
    }
    let siemens = taken(&format!("{STAND} --dialect siemens_840d"));
    assert!(!siemens.iter().any(|text| text.contains("--dialect") || text.contains("--length-register")));
    assert!(all.iter().any(|text| text == "no --dialect: the program is read as one for fanuc"), "{all:?}");
    assert!(all.iter().any(|text| text.ends_with("p.stl is taken in millimetres")), "{all:?}");
    let gltf = taken(&STAND.replace("p.stl", "p.glb"));
    assert!(gltf.iter().any(|text| text.ends_with("p.glb is taken in metres")), "{gltf:?}");
    // Each mesh by its own format, once.
    let beside = taken(&format!("{} --fixture c.glb --fixture p.stl", STAND.replace("box", "s.obj")));
    for reported in [
        "no --mesh-unit: p.stl is taken in millimetres, s.obj is taken in millimetres, c.glb is taken in metres",
        "no --mesh-up: z of p.stl is taken to be up, z of s.obj is taken to be up, y of c.glb is taken to be up",
    ] {
        assert!(beside.iter().any(|text| text == reported), "{beside:?}");
    }
    assert_eq!(taken(""), Vec::<String>::new());
}

#[test]
fn stock_is_a_box_a_thickness_or_a_file() {
    assert_eq!(stock("box"), Ok(AdHocStock::Box));
    assert_eq!(stock("offset:2.5"), Ok(AdHocStock::Offset(2.5)));
    assert_eq!(stock("cast.stl"), Ok(AdHocStock::Mesh("cast.stl".into())));
    for wrong in ["offset:", "offset:-1", "offset:nan", "offset:2mm"] {
        assert!(stock(wrong).is_err_and(|why| why.contains("offset:2.5")), "{wrong}");
    }
    assert_eq!(place("1, -2,3.5"), Ok([1.0, -2.0, 3.5]));
    assert!(["1,2", "1,2,3,4", "1,2,inf", "a,b,c"].iter().all(|text| place(text).is_err()));
}
