//! The house has floors: the sources are read, and a module that uses a higher floor than its own is told so.

#![allow(clippy::unwrap_used, reason = "a source that cannot be read shall stop the test")]

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

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
    let front = fs::read_to_string(Path::new(TREE).join("src/lib/lib.rs")).unwrap();
    let mut floors = BTreeMap::new();
    for line in front.lines().filter_map(|line| line.strip_prefix("//! | ")) {
        let Some(floor) = line.chars().next().and_then(|c| c.to_digit(10)) else { continue };
        let modules = line.split('|').nth(1).unwrap();
        for name in modules.split('`').skip(1).step_by(2) {
            let twice = floors.insert(name.to_owned(), floor as usize);
            assert_eq!(twice, None, "{name} stands twice in the table of lib.rs");
        }
    }
    assert!(floors.len() > 10, "the table of lib.rs was not understood: {floors:?}");
    floors
}

/// The top-level module that a source belongs to, and how deep the source lies in it.
fn place(path: &str) -> (&str, usize) {
    let inside = path.strip_prefix("src/lib/").unwrap().trim_end_matches(".rs");
    let parts: Vec<&str> = inside.split('/').filter(|part| *part != "mod").collect();
    (parts[0], parts.len())
}

fn identifier(text: &str) -> &str {
    let end = text.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(text.len());
    &text[..end]
}

/// The top-level modules that a piece of code names, each with its line.
fn uses(code: &str, depth: usize) -> Vec<(usize, String)> {
    // From a module `depth` deep, that many `super::` lead to the root, as `crate::` does.
    let roots = ["crate::".to_owned(), "super::".repeat(depth)];
    let mut found = Vec::new();
    for root in &roots {
        for (start, _) in code.match_indices(root.as_str()) {
            let before = code[..start].chars().next_back().unwrap_or(' ');
            if before.is_alphanumeric() || before == '_' || before == ':' {
                continue;
            }
            let line = code[..start].lines().count().max(1);
            let after = &code[start + root.len()..];
            if after.starts_with('{') {
                let group = &after[1..braces_length(after) - 1];
                let mut depth = 0;
                let heads = group.split(|c| {
                    depth += i32::from(c == '{') - i32::from(c == '}');
                    c == ',' && depth == 0
                });
                found.extend(heads.map(|head| (line, identifier(head.trim()).to_owned())));
            } else {
                found.push((line, identifier(after).to_owned()));
            }
        }
    }
    found.retain(|(_, name)| !name.is_empty());
    found
}

#[test]
fn no_module_uses_a_higher_floor() {
    let floors = floors();
    let mut wrong = Vec::new();
    let mut uses_seen = 0;
    for source in sources("src/lib") {
        let (module, depth) = place(&source.path);
        if module == "lib" {
            continue;
        }
        let Some(&floor) = floors.get(module) else {
            wrong.push(format!("{}: {module} is not in the table of lib.rs", source.path));
            continue;
        };
        for (line, used) in uses(&without_tests(&source.code), depth) {
            uses_seen += 1;
            match floors.get(&used) {
                Some(&other) if other > floor => {
                    wrong.push(format!("{}:{line}: {module} (floor {floor}) uses {used} (floor {other})", source.path))
                }
                _ => {}
            }
        }
    }
    assert!(wrong.is_empty(), "\n{}", wrong.join("\n"));
    assert!(uses_seen > 50, "only {uses_seen} uses were seen: the reading of sources is broken");
}

#[test]
fn the_table_lists_the_modules_that_there_are() {
    let front = fs::read_to_string(Path::new(TREE).join("src/lib/lib.rs")).unwrap();
    let mut declared: Vec<&str> = front
        .lines()
        .filter_map(|line| line.strip_prefix("pub mod ").or(line.strip_prefix("mod ")))
        .map(|rest| rest.trim_end_matches(';'))
        .collect();
    declared.sort_unstable();
    let listed: Vec<String> = floors().into_keys().collect();
    assert_eq!(listed, declared, "the table of lib.rs and its modules differ");
}

/// A program parses, opens, drives and closes; beyond this many lines of code it does something that belongs into the
/// library.
const PROGRAM_LINES: usize = 130;

#[test]
fn programs_are_thin() {
    for source in sources("src/bin") {
        let lines = source.code.lines().filter(|line| !line.trim().is_empty()).count();
        assert!(
            lines <= PROGRAM_LINES,
            "{}: {lines} lines of code; move what is no option into the library",
            source.path
        );
        for function in ["sqrt(", "powi(", "powf(", "exp(", "ln(", "cos(", "sin("] {
            assert!(
                !source.code.contains(&format!(".{function}")),
                "{}: `.{function}…)` is arithmetic; it belongs into the library",
                source.path
            );
        }
    }
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
    let text = "use crate::{a::{b, c}, d};\n// crate::e\nlet s = \"crate::f\"; let q = '\"'; super::g::h();\n\
                #[cfg(test)]\nmod tests { use crate::i; }\nfn j<'a>() { super::super::k(); my_crate::l(); }\n";
    let code = without_tests(&without_comments_and_strings(text));
    let names = |depth| -> Vec<String> { uses(&code, depth).into_iter().map(|(_, n)| n).collect() };
    assert_eq!(names(1), ["a", "d", "g", "super"]);
    assert_eq!(names(2), ["a", "d", "k"]);
    assert_eq!(uses(&code, 2)[2].0, 6);
}
