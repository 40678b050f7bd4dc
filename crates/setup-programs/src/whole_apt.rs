//! APT file of a whole clamping: those of its tools in one.

use facemill_job::format::program_stamp::checksum;
use facemill_planner::Planned;

/// Returns the APT file of a clamping from those of its tools, in their order: one part name, unit
/// and begin of axes, then for each tool its name as PPRINT, CUTTER, LOADTL, SPINDL and COOLNT, its
/// operations each behind a PPRINT with the name, and spindle and coolant off; `None` if a tool has
/// no such file. `program` is name and text of the program with all tools.
pub(crate) fn whole_apt(name: &str, made: &[&Planned], program: (&str, &[u8])) -> Option<Vec<u8>> {
    let mut text =
        format!("PARTNO/{}\n$$ {} blake3 {}\nUNITS/MM\nMULTAX/ON\n", plain(name), program.0, checksum(program.1));
    for planned in made {
        let (_, own) = planned.files.iter().find(|(name, _)| name.ends_with(".apt"))?;
        let tool = &planned.spec.as_ref()?.tool;
        text.push_str(&format!("PPRINT/TOOL {} {}\n", tool.number, plain(&tool.name)));
        let own = std::str::from_utf8(own).ok()?;
        let is_of_file = |line: &&str| {
            ["PARTNO/", "$$", "UNITS/", "MULTAX/"].iter().any(|word| line.starts_with(word)) || *line == "FINI"
        };
        for line in own.lines().filter(|line| !is_of_file(line)) {
            text.push_str(line);
            text.push('\n');
        }
    }
    text.push_str("FINI\n");
    Some(text.into_bytes())
}

/// Returns a text without what would continue a line or is not ASCII.
fn plain(text: &str) -> String {
    text.chars().map(|c| if c == ' ' || c.is_ascii_graphic() && c != '$' { c } else { '?' }).collect()
}
