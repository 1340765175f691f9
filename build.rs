//! Tells what is built for release which commit it is of, for `--version`.
//!
//! Other builds are told nothing: each commit would compile the library anew.

use std::process::Command;

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    println!("cargo:rerun-if-env-changed=CYANOMETER_COMMIT");
    if std::env::var("PROFILE").as_deref() != Ok("release") || std::env::var_os("CYANOMETER_COMMIT").is_some() {
        return;
    }
    // What changes the answer: the sources, and what git writes with each commit or checkout.
    for path in ["src", "sample_data", "Cargo.toml", "Cargo.lock", ".git/HEAD", ".git/logs/HEAD", PACKAGED] {
        if std::path::Path::new(path).exists() {
            println!("cargo:rerun-if-changed={path}");
        }
    }
    if let Some(commit) = packaged().or_else(checked_out) {
        println!("cargo:rustc-env=CYANOMETER_COMMIT={commit}");
    }
}

/// What `cargo package` puts beside the manifest.
const PACKAGED: &str = ".cargo_vcs_info.json";

/// The commit that the crate was packaged from: 12 digits of `{"git": {"sha1": "…"}}`.
fn packaged() -> Option<String> {
    let text = std::fs::read_to_string(PACKAGED).ok()?;
    let (_, behind) = text.split_once("\"sha1\"")?;
    Some(behind.chars().filter(char::is_ascii_hexdigit).take(12).collect())
}

/// The commit of the working tree that holds this manifest itself, not of a repository around it.
fn checked_out() -> Option<String> {
    if !std::path::Path::new(".git").exists() {
        return None;
    }
    let told = Command::new("git").args(["describe", "--always", "--dirty", "--abbrev=12"]).output().ok()?;
    let commit = String::from_utf8(told.stdout).ok()?.trim().to_owned();
    (told.status.success() && !commit.is_empty()).then_some(commit)
}
