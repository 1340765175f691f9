//! The commands of the tutorial run as they stand, and say what it says.

#![allow(clippy::unwrap_used, reason = "a test that cannot be set up shall stop there")]

use std::path::Path;
use std::process::Command;

const TREE: &str = env!("CARGO_MANIFEST_DIR");

/// The blocks of a kind in a page.
fn blocks<'a>(page: &'a str, kind: &str) -> Vec<&'a str> {
    let begin = format!("```{kind}\n");
    page.split(&begin).skip(1).map(|rest| rest.split("```").next().unwrap()).collect()
}

#[test]
fn the_tutorial_runs() {
    let page = std::fs::read_to_string(format!("{TREE}/docs/tutorial.md")).unwrap();
    let directory = tempfile::tempdir().unwrap();
    std::os::unix::fs::symlink(format!("{TREE}/sample_data"), directory.path().join("sample_data")).unwrap();
    let programs = Path::new(env!("CARGO_BIN_EXE_measure")).parent().unwrap();
    let path = format!("{}:{}", programs.display(), std::env::var("PATH").unwrap());
    let commands = blocks(&page, "sh");
    // One block makes the frames.
    assert_eq!(commands.len(), 11);
    let run = Command::new("sh")
        .args(["-e", "-c", &commands.concat()])
        .current_dir(directory.path())
        .env("PATH", path)
        .output()
        .unwrap();
    let (said, complaints) = (String::from_utf8_lossy(&run.stdout), String::from_utf8_lossy(&run.stderr));
    assert!(run.status.success(), "{complaints}");
    assert_eq!(complaints, "", "the tutorial warns of something");
    for line in blocks(&page, "text").concat().lines() {
        assert!(said.contains(line), "not said: {line}\n{said}");
    }
    for made in ["light.tiff", "light.png", "corrected.exr", "xyz.exr", "xyy.exr", "picture.tiff", "m.yaml"] {
        assert!(directory.path().join(made).is_file(), "{made} is not made");
    }
}
