use super::*;
use clap::Parser;

#[derive(Parser)]
struct Command {
    #[command(flatten)]
    verify: VerifyArguments,
}

fn cut(options: &[&str]) -> Result<Option<CutRequest>, Failure> {
    let all = [&["verify", "program.nc", "--job", "job.json"], options].concat();
    cut_of(&Command::try_parse_from(all).unwrap_or_else(|e| panic!("{e}")).verify, None)
}

#[test]
fn what_needs_a_cut_stock_says_so() {
    for option in [
        ["--rest-out", "a.stock"],
        ["--rest-mesh", "a.obj"],
        ["--deviation", "a.glb"],
        ["--deviation-tolerance-mm", "0.1"],
        ["--stock-tolerance-mm", "0.1"],
    ] {
        let why = cut(&option).expect_err("nothing is cut").to_string();
        assert!(why.contains(option[0]) && why.contains("--stock-cell-mm"), "{why}");
        let with = cut(&[&option[..], &["--stock-cell-mm", "1"]].concat()).expect("stock is cut").expect("a cell");
        assert_eq!(with.deviation.is_some(), option[0].starts_with("--deviation"));
        assert_eq!(with.tolerance, if option[0] == "--stock-tolerance-mm" { 0.1 } else { STOCK_TOLERANCE });
    }
    assert!(cut(&[]).expect("nothing is requested").is_none());
    let both = cut(&["--stock-cell-mm", "1", "--deviation", "a.glb", "--deviation-tolerance-mm", "0.1"]);
    let requested = both.expect("fine").and_then(|c| c.deviation);
    assert_eq!(requested, Some(DeviationRequest { tolerance: Some(0.1), painted: true, since_stock: false }));
}

#[test]
fn a_job_or_part_stock_machine_and_tool_are_needed() {
    let parsed = |options: &str| Command::try_parse_from(["verify", "a.nc"].into_iter().chain(options.split(' ')));
    let all = "--part p.obj --stock box --machine m.json --tool t.json";
    assert!(parsed(all).is_ok() && parsed("--job j.json").is_ok());
    assert!(parsed(&format!("{all} --work-offset -1,0,2.5 --length-register 3 --mesh-unit inch")).is_ok());
    let refused = |options: &str, of: &str| {
        let why = parsed(options).err().unwrap_or_else(|| panic!("{options} is taken")).to_string();
        assert!(why.contains(of), "{options}: {why}");
    };
    refused("--certificates", "--job");
    refused("--certificates", "--part");
    assert!(parsed("--job j.json --fast").is_ok_and(|command| command.verify.fast));
    refused("--job j.json --fast --certificates", "--certificates");
    refused(&format!("{all} --job j.json"), "--job");
    refused(&format!("{all} --setup top"), "--setup");
    refused("--job j.json --tool t.json", "--part");
    for missing in ["--stock", "--machine", "--tool"] {
        let words: Vec<&str> = all.split(' ').collect();
        let others = words.chunks(2).filter(|pair| pair[0] != missing).flatten();
        refused(&others.copied().collect::<Vec<_>>().join(" "), missing);
    }
    refused(&format!("{all} --mount 1,2"), "X,Y,Z");
}
