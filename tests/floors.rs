//! The house has floors: the sources are read, and a module that uses a higher floor than its own is told so, as are files
//! that use each other.

#![allow(clippy::unwrap_used, reason = "a source that cannot be read shall stop the test")]

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::PathBuf;

const TREE: &str = env!("CARGO_MANIFEST_DIR");

/// A Rust source: its path from the root of the tree, and its text without comments and strings.
struct Source {
    path: String,
    code: String,
}

fn sources(directory: &str) -> Vec<Source> {
    let mut found = Vec::new();
    let mut waiting = vec![PathBuf::from(TREE).join(directory)];
    while let Some(directory) = waiting.pop() {
        for entry in fs::read_dir(directory).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                waiting.push(path);
            } else if path.extension().is_some_and(|end| end == "rs") {
                let code = without_comments_and_strings(&fs::read_to_string(&path).unwrap());
                let path = path.strip_prefix(TREE).unwrap().display().to_string();
                found.push(Source { path, code });
            }
        }
    }
    assert!(!found.is_empty(), "no sources under {directory}");
    found.sort_by(|a, b| a.path.cmp(&b.path));
    found
}

/// Blanks what is not code; line breaks stay, so that lines keep their numbers.
fn without_comments_and_strings(text: &str) -> String {
    let mut code = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(first) = rest.chars().next() {
        let length = if rest.starts_with("//") {
            rest.find('\n').unwrap_or(rest.len())
        } else if rest.starts_with("/*") {
            rest.find("*/").map_or(rest.len(), |end| end + 2)
        } else if rest.starts_with("r#\"") {
            rest.find("\"#").map_or(rest.len(), |end| end + 2)
        } else if first == '"' {
            string_length(rest)
        } else {
            // A quoted character; a lifetime has no second quote near.
            char_length(rest).unwrap_or(0)
        };
        let (skipped, after) = rest.split_at(length);
        code.extend(skipped.chars().filter(|c| *c == '\n'));
        rest = after;
        if length == 0 {
            code.push(first);
            rest = &rest[first.len_utf8()..];
        }
    }
    code
}

fn string_length(rest: &str) -> usize {
    let mut escaped = false;
    for (index, c) in rest.char_indices().skip(1) {
        match c {
            _ if escaped => escaped = false,
            '\\' => escaped = true,
            '"' => return index + 1,
            _ => {}
        }
    }
    rest.len()
}

fn char_length(rest: &str) -> Option<usize> {
    let inside = rest.strip_prefix('\'')?;
    let length = if let Some(escape) = inside.strip_prefix('\\') {
        1 + escape.char_indices().skip(1).find(|(_, c)| *c == '\'')?.0
    } else {
        inside.chars().next()?.len_utf8()
    };
    inside[length..].starts_with('\'').then_some(length + 2)
}

/// Blanks the modules that only tests see.
fn without_tests(code: &str) -> String {
    let mut kept = String::new();
    let mut rest = code;
    while let Some(start) = rest.find("#[cfg(test)]") {
        let (before, after) = rest.split_at(start);
        kept.push_str(before);
        let semicolon = after.find(';').unwrap_or(after.len());
        let end = match after.find('{') {
            Some(brace) if brace < semicolon => brace + braces_length(&after[brace..]),
            _ => semicolon,
        };
        kept.extend(after[..end].chars().filter(|c| *c == '\n'));
        rest = &after[end..];
    }
    kept + rest
}

fn braces_length(text: &str) -> usize {
    let mut depth = 0;
    for (index, c) in text.char_indices() {
        match c {
            '{' => depth += 1,
            '}' if depth == 1 => return index + 1,
            '}' => depth -= 1,
            _ => {}
        }
    }
    text.len()
}

/// The floor of each module, from the table on the library's front page.
fn floors() -> BTreeMap<String, usize> {
    let front = fs::read_to_string(std::path::Path::new(TREE).join("src/lib/lib.rs")).unwrap();
    let mut floors = BTreeMap::new();
    for line in front.lines().filter_map(|line| line.strip_prefix("//! | ")) {
        let Ok(floor) = line.split(' ').next().unwrap().parse::<usize>() else { continue };
        let modules = line.split('|').nth(1).unwrap();
        for name in modules.split('`').skip(1).step_by(2) {
            let twice = floors.insert(name.to_owned(), floor);
            assert_eq!(twice, None, "{name} stands twice in the table of lib.rs");
        }
    }
    assert!(floors.len() > 10, "the table of lib.rs was not understood: {floors:?}");
    floors
}

/// A path in the sources: `a::b::C` as its parts.
type Path = Vec<String>;

/// The modules of the library and what they use of each other.
struct House {
    /// The file of each module, by its path from the root of the library; the root itself is left out.
    modules: BTreeMap<Path, Source>,
    /// What a module hands on under a name: `pub use`.
    faces: BTreeMap<Path, Path>,
}

/// A module's use of another: where, and what is named.
struct Use {
    line: usize,
    of: Path,
}

/// The paths that a tree of `use` names: `a::{b, c::d as e}` is `a::b`, `a::c::d`.
fn expanded(tree: &str) -> Vec<String> {
    let tree = tree.trim();
    let Some(brace) = tree.find('{') else {
        let end = tree.find(" as ").unwrap_or(tree.len());
        return if tree.is_empty() { Vec::new() } else { vec![tree[..end].to_owned()] };
    };
    let (before, group) = (&tree[..brace], &tree[brace + 1..tree.rfind('}').unwrap_or(tree.len())]);
    let mut depth = 0;
    let parts = group.split(|c| {
        depth += i32::from(c == '{') - i32::from(c == '}');
        c == ',' && depth == 0
    });
    parts.flat_map(expanded).map(|part| format!("{before}{part}")).collect()
}

/// The `use` declarations of a piece of code: line, whether they hand on, tree.
fn declarations(code: &str) -> Vec<(usize, bool, &str)> {
    let mut found = Vec::new();
    for (start, _) in code.match_indices("use ") {
        let before = code[..start].trim_end_matches(' ');
        let first = before.rsplit('\n').next().unwrap_or("");
        let hands_on = first.trim_start().starts_with("pub");
        if first.trim().is_empty() || hands_on {
            let tree = &code[start + 4..];
            found.push((
                code[..start].matches('\n').count() + 1,
                hands_on,
                &tree[..tree.find(';').unwrap_or(tree.len())],
            ));
        }
    }
    found
}

/// All paths of two parts and more that a piece of code spells out, but for those of its `use` declarations.
fn spelled_out(code: &str) -> Vec<(usize, String)> {
    let mut found = Vec::new();
    let mut rest = 0;
    while let Some(colons) = code[rest..].find("::").map(|at| rest + at) {
        let is_part = |c: char| c.is_alphanumeric() || c == '_' || c == ':';
        let start = code[..colons].rfind(|c| !is_part(c)).map_or(0, |at| at + 1);
        let end = code[colons..].find(|c| !is_part(c)).map_or(code.len(), |at| colons + at);
        let line = code[..start].rsplit('\n').next().unwrap_or("").trim_start().to_owned();
        let is_declared = line.starts_with("use ") || line.starts_with("pub") && line.contains("use ");
        // `pub(in path)` says who may see, not what is used.
        if !is_declared && !line.ends_with("(in ") {
            found.push((code[..start].matches('\n').count() + 1, code[start..end].trim_end_matches(':').to_owned()));
        }
        rest = end.max(colons + 2);
    }
    found
}

impl House {
    fn of_library() -> Self {
        let mut modules = BTreeMap::new();
        for source in sources("src/lib") {
            let inside = source.path.strip_prefix("src/lib/").unwrap().trim_end_matches(".rs");
            let path: Path = inside.split('/').filter(|part| *part != "mod").map(str::to_owned).collect();
            if path != ["lib"] && path.last().unwrap() != "tests" {
                let code = without_tests(&source.code);
                modules.insert(path, Source { code, ..source });
            }
        }
        let mut house = Self { modules, faces: BTreeMap::new() };
        let mut faces = BTreeMap::new();
        for (module, source) in &house.modules {
            for (_, _, tree) in declarations(&source.code).into_iter().filter(|(_, hands_on, _)| *hands_on) {
                for of in expanded(tree).iter().filter_map(|path| house.absolute(module, path)) {
                    let name = module.iter().chain(of.last()).cloned().collect();
                    faces.insert(name, of);
                }
            }
        }
        house.faces = faces;
        house
    }

    /// A path as it is spelled in a module, from the root of the library; none where it leads out of it.
    fn absolute(&self, module: &Path, spelled: &str) -> Option<Path> {
        let mut parts: Vec<&str> = spelled.split("::").collect();
        let mut base = match parts[0] {
            "crate" => Vec::new(),
            "self" | "super" => module.clone(),
            child => {
                let of_child: Path = module.iter().map(String::as_str).chain([child]).map(str::to_owned).collect();
                return self
                    .modules
                    .contains_key(&of_child)
                    .then(|| module.iter().map(String::as_str).chain(parts).map(str::to_owned).collect());
            }
        };
        while let Some(&first) = parts.first().filter(|part| ["crate", "self", "super"].contains(part)) {
            if first == "super" {
                base.pop();
            }
            parts.remove(0);
        }
        Some(base.into_iter().chain(parts.into_iter().map(str::to_owned)).collect())
    }

    /// The module that defines what a path from the root names, through the faces of others.
    fn defining(&self, path: &Path) -> Option<&Path> {
        for length in (1..=path.len()).rev() {
            if let Some((module, _)) = self.modules.get_key_value(&path[..length]) {
                let face = path.get(..=length).and_then(|named| self.faces.get(named));
                let behind = |of: &Path| of.iter().chain(&path[length + 1..]).cloned().collect::<Path>();
                return face.map_or(Some(module), |of| self.defining(&behind(of)));
            }
        }
        None
    }

    /// What a module uses of others; what it hands on is used by those who take it.
    fn uses(&self, module: &Path) -> Vec<Use> {
        let code = &self.modules[module].code;
        let mut imported: BTreeMap<String, Path> = BTreeMap::new();
        let mut named: Vec<(usize, Path)> = Vec::new();
        for (line, hands_on, tree) in declarations(code) {
            for path in expanded(tree).iter().filter_map(|path| self.absolute(module, path)) {
                if path.last().is_some_and(|last| last == "self") {
                    continue;
                }
                if !hands_on {
                    named.push((line, path.clone()));
                }
                imported.insert(path.last().cloned().unwrap_or_default(), path);
            }
            // `a::{self, b}` names the module a.
            for path in expanded(tree).iter().filter_map(|path| path.strip_suffix("::self")) {
                let Some(path) = self.absolute(module, path) else { continue };
                imported.insert(path.last().cloned().unwrap_or_default(), path);
            }
        }
        for (line, spelled) in spelled_out(code) {
            let (first, rest) = spelled.split_once("::").unwrap_or((&spelled, ""));
            match imported.get(first) {
                Some(of) => {
                    named.push((line, of.iter().cloned().chain(rest.split("::").map(str::to_owned)).collect()));
                }
                None => named.extend(self.absolute(module, &spelled).map(|path| (line, path))),
            }
        }
        let defined =
            named.into_iter().filter_map(|(line, path)| Some(Use { line, of: self.defining(&path)?.clone() }));
        defined.filter(|used| used.of != *module).collect()
    }
}

#[test]
fn no_module_uses_a_higher_floor() {
    let (house, floors) = (House::of_library(), floors());
    let mut wrong = Vec::new();
    let mut uses_seen = 0;
    for (module, source) in &house.modules {
        let Some(&floor) = floors.get(&module[0]) else {
            wrong.push(format!("{}: {} is not in the table of lib.rs", source.path, module[0]));
            continue;
        };
        for Use { line, of } in house.uses(module) {
            uses_seen += 1;
            let Some(&other) = floors.get(&of[0]) else { continue };
            if other > floor {
                wrong.push(format!("{}:{line}: floor {floor} uses {} (floor {other})", source.path, of.join("::")));
            }
        }
    }
    assert!(wrong.is_empty(), "\n{}", wrong.join("\n"));
    assert!(uses_seen > 500, "only {uses_seen} uses were seen: the reading of sources is broken");
}

/// Each row of the table is needed: on every floor but the ground something uses the floor below.
#[test]
fn every_floor_stands_on_a_lower_one() {
    let (house, floors) = (House::of_library(), floors());
    let top = floors.values().copied().max().unwrap();
    for floor in 1..=top {
        let on_it = house.modules.keys().filter(|module| floors.get(&module[0]) == Some(&floor));
        let lower: BTreeSet<usize> =
            on_it.flat_map(|module| house.uses(module)).map(|used| floors[&used.of[0]]).collect();
        assert!(lower.iter().any(|&other| other < floor), "floor {floor} uses nothing below: {lower:?}");
    }
}

/// Files use each other in one direction.
#[test]
fn no_files_use_each_other_in_a_circle() {
    let house = House::of_library();
    let uses: BTreeMap<&Path, BTreeSet<Path>> = house
        .modules
        .keys()
        .map(|module| (module, house.uses(module).into_iter().map(|used| used.of).collect()))
        .collect();
    // Takes away, again and again, what uses nothing that is left: what stays is in a circle or above one.
    let mut left: BTreeSet<&Path> = uses.keys().copied().collect();
    while let Some(free) = left.iter().find(|module| !uses[**module].iter().any(|used| left.contains(used))).copied() {
        left.remove(free);
    }
    let shown: Vec<String> = left
        .iter()
        .map(|module| {
            let used: Vec<String> =
                uses[*module].iter().filter(|used| left.contains(used)).map(|used| used.join("::")).collect();
            format!("{} uses {}", module.join("::"), used.join(", "))
        })
        .collect();
    assert!(shown.is_empty(), "in a circle, or above one:\n{}", shown.join("\n"));
}

#[test]
fn the_table_lists_the_modules_that_there_are() {
    let front = fs::read_to_string(std::path::Path::new(TREE).join("src/lib/lib.rs")).unwrap();
    let mut declared: Vec<&str> = front
        .lines()
        .filter_map(|line| line.strip_prefix("pub mod ").or(line.strip_prefix("mod ")))
        .map(|rest| rest.trim_end_matches(';'))
        .collect();
    declared.sort_unstable();
    let listed: Vec<String> = floors().into_keys().collect();
    assert_eq!(listed, declared, "the table of lib.rs and its modules differ");
}

/// A program parses, opens, drives and closes; beyond this many lines it does something that belongs into the library.
const PROGRAM_LINES: usize = 80;

/// The same, on average.
const MEAN_PROGRAM_LINES: usize = 60;

#[test]
fn programs_are_thin() {
    // What stands beside the main file of a program is a library of its own.
    let is_main = |path: &str| path.ends_with("/main.rs") || !path.trim_start_matches("src/bin/").contains('/');
    let in_library = sources("src/lib/programs").into_iter().filter(|source| !source.path.ends_with("/mod.rs"));
    let whole =
        sources("src/bin").into_iter().filter(|source| is_main(&source.path) && !source.code.contains("program!("));
    let programs: Vec<_> = in_library.chain(whole).collect();
    let mut all = 0;
    for source in &programs {
        let lines = source.code.lines().count();
        all += lines;
        assert!(lines <= PROGRAM_LINES, "{}: {lines} lines; move what is no option into the library", source.path);
        for function in ["sqrt(", "powi(", "powf(", "exp(", "ln(", "cos(", "sin("] {
            assert!(
                !source.code.contains(&format!(".{function}")),
                "{}: `.{function}…)` is arithmetic; it belongs into the library",
                source.path
            );
        }
    }
    let mean = all / programs.len();
    assert!(
        mean <= MEAN_PROGRAM_LINES,
        "programs have {mean} lines on average; what several do belongs into the library"
    );
}

/// To link each program a second time, for tests that it has none of, takes a minute.
#[test]
fn programs_with_tests_are_tested() {
    let script = fs::read_to_string(PathBuf::from(TREE).join("scripts/test")).unwrap();
    let programs = ["src/bin", "studies/src/bin"].into_iter().flat_map(sources);
    for source in programs.filter(|source| source.code.contains("#[test]")) {
        let (_, place) = source.path.split_once("bin/").unwrap();
        let program = place.split(['/', '.']).next().unwrap();
        let wanted = format!("--bin {program} ");
        assert!(script.contains(&wanted), "{} has tests; scripts/test must name it: `{wanted}`", source.path);
    }
}

/// What no program of tests includes would never run.
#[test]
fn every_file_of_tests_is_run() {
    let place = PathBuf::from(TREE).join("tests");
    let mut there: Vec<String> = fs::read_dir(&place)
        .unwrap()
        .filter_map(|entry| entry.unwrap().file_name().to_str()?.strip_suffix(".rs").map(str::to_owned))
        .filter(|name| name != "all")
        .collect();
    there.sort_unstable();
    let all = fs::read_to_string(place.join("all.rs")).unwrap();
    let declared = all.lines().filter_map(|line| line.strip_prefix("mod ")?.strip_suffix(';'));
    let declared: Vec<&str> = declared.filter(|name| *name != "support").collect();
    assert_eq!(declared, there, "tests/all.rs and the files of tests differ");
}

/// A file has one subject; beyond this many lines before its tests it has several.
const FILE_LINES: usize = 500;

/// Files that are longer, and why: tables, of which a part is none.
const LONG_FILES: &[(&str, &str)] = &[];

#[test]
fn files_are_short() {
    let mut wrong = Vec::new();
    for source in
        ["src", "studies/src"].into_iter().flat_map(sources).filter(|source| !source.path.ends_with("tests.rs"))
    {
        let lines = without_tests(&source.code).trim_end().lines().count();
        let reason = LONG_FILES.iter().find(|(path, _)| *path == source.path);
        match reason {
            None if lines > FILE_LINES => wrong.push(format!("{}: {lines} lines; split it by subject", source.path)),
            Some(_) if lines <= FILE_LINES => wrong.push(format!("{}: {lines} lines; it is no exception", source.path)),
            _ => {}
        }
    }
    assert!(wrong.is_empty(), "\n{}", wrong.join("\n"));
}

#[test]
fn nothing_is_left_to_do_in_the_sources() {
    for source in sources("src") {
        for left in ["dbg!", "todo!", "unimplemented!"] {
            let line = source.code.lines().position(|line| line.contains(left));
            assert_eq!(line, None, "{}: {left} in line (from 0)", source.path);
        }
    }
}

#[test]
fn the_reader_of_sources_sees_what_is_there() {
    let text = "use crate::{a::{b, C}, d};\n// crate::e\nlet s = \"crate::f\"; let q = '\"'; super::g::h();\n\
                #[cfg(test)]\nmod tests { use crate::i; }\npub(in crate::a) fn j<'a>() { b::K::new(); other::l(); }\n\
                pub use inner::M;\nfn n() { inner::o(); crate::g::M; }\n";
    let source = |name: &str, code: &str| {
        let path: Path = name.split("::").map(str::to_owned).collect();
        let code = without_tests(&without_comments_and_strings(code));
        (path, Source { path: name.to_owned(), code })
    };
    let mut house = House {
        modules: ["a", "a::b", "d", "e", "f", "g", "i", "here::inner"].map(|name| source(name, "")).into(),
        faces: BTreeMap::new(),
    };
    house.modules.extend([source("here", text)]);
    house.faces.insert(vec!["g".into(), "M".into()], vec!["here".into(), "inner".into(), "M".into()]);
    let seen: Vec<String> =
        house.uses(&vec!["here".into()]).iter().map(|used| format!("{} {}", used.line, used.of.join("::"))).collect();
    assert_eq!(seen, ["1 a::b", "1 a", "1 d", "3 g", "6 a::b", "8 here::inner", "8 here::inner"]);
}
