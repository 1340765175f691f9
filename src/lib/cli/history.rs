//! What of a command line goes into a frame's history.

use crate::metadata::HistoryEntry;

/// Options that say where and how the output is stored, or how the program talks: the samples do not depend on them.
const NOT_RECORDED: [(&str, bool); 12] = [
    ("--output", true),
    ("--output-format", true),
    ("--map", true),
    ("--write-matrix", true),
    ("--write-readout", true),
    ("--format", true),
    ("--compression", true),
    ("--sample-type", true),
    ("--threads", true),
    ("--progress", true),
    ("--quiet", false),
    ("--verbose", false),
];

/// A history entry from a program's arguments.
pub fn history_entry(program: &str, arguments: impl Iterator<Item = String>) -> HistoryEntry {
    let mut recorded = Vec::new();
    let mut skip_value = false;
    for argument in arguments {
        if std::mem::take(&mut skip_value) {
            continue;
        }
        let long = argument.split('=').next().unwrap_or_default();
        if let Some((_, takes_value)) = NOT_RECORDED.iter().find(|(name, _)| *name == long) {
            skip_value = *takes_value && !argument.contains('=');
            continue;
        }
        // Short options: flags q and v, and o with its value attached or next.
        if let Some(letters) = argument.strip_prefix('-').filter(|rest| !rest.is_empty() && !rest.starts_with('-'))
            && letters.trim_start_matches(['q', 'v']).chars().next().is_none_or(|c| c == 'o')
        {
            skip_value = letters.ends_with('o') && letters.trim_start_matches(['q', 'v']) == "o";
            continue;
        }
        recorded.push(argument);
    }
    HistoryEntry { program: program.into(), version: env!("CARGO_PKG_VERSION").into(), arguments: recorded }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn where_the_output_goes_is_not_recorded() {
        let recorded =
            |line: &str| history_entry("add-noise", line.split_whitespace().map(ToOwned::to_owned)).arguments.join(" ");
        assert_eq!(recorded("in.exr --seed 7 -o out.exr"), "in.exr --seed 7");
        assert_eq!(recorded("--output=x.exr --seed=7 -vq -qo y.exr --threads 2"), "--seed=7");
        assert_eq!(recorded("-oout.exr -v - --without ron"), "- --without ron");
        assert_eq!(recorded("--compression zip --exposure -1"), "--exposure -1");
        assert_eq!(recorded("a.exr -1,2,3 --map d.exr --output-format json -o d.json"), "a.exr -1,2,3");
    }
}
