//! The file of the program that runs, beside which other programs and data lie.

use std::env;
use std::ffi::OsStr;
use std::io;
use std::path::{Path, PathBuf};

/// The file of the program that runs; where the system does not tell (Linux without /proc), that which it was called as: a path, or a name
/// that `PATH` has.
///
/// # Errors
///
/// Why the system does not tell, where what it was called as is no file either.
pub fn own_program() -> io::Result<PathBuf> {
    env::current_exe().or_else(|error| {
        let called = env::args_os().next().map(PathBuf::from);
        called.and_then(|called| called_as(&called, &env::var_os("PATH").unwrap_or_default())).ok_or(error)
    })
}

/// The file of a program that was called so, without links.
fn called_as(called: &Path, searched: &OsStr) -> Option<PathBuf> {
    let found = match called.components().count() {
        1 => env::split_paths(searched).map(|directory| directory.join(called)).find(|file| file.is_file())?,
        _ => called.to_owned(),
    };
    found.canonicalize().ok().filter(|file| file.is_file())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_program_is_found_by_what_it_was_called_as() {
        let directory = tempfile::tempdir().unwrap();
        let [place, other] = ["bin", "other"].map(|name| directory.path().join(name));
        [&place, &other].into_iter().for_each(|place| std::fs::create_dir(place).unwrap());
        std::fs::write(place.join("tool"), "").unwrap();
        std::os::unix::fs::symlink(place.join("tool"), other.join("link")).unwrap();
        let searched = env::join_paths([directory.path().join("none"), other.clone(), place.clone()]).unwrap();
        let wanted = place.join("tool").canonicalize().unwrap();
        for called in [Path::new("tool"), Path::new("link"), &place.join("tool"), &other.join("../other/link")] {
            assert_eq!(called_as(called, &searched).as_ref(), Some(&wanted), "{}", called.display());
        }
        for called in [Path::new("bin"), Path::new("no-such-tool"), &place, &place.join("x")] {
            assert_eq!(called_as(called, &searched), None, "{}", called.display());
        }
    }
}
