//! How files and standard streams are called.

use std::path::{Path, PathBuf};

/// How messages call the standard input.
pub const STDIN_NAME: &str = "standard input";
/// How messages call the standard output.
pub const STDOUT_NAME: &str = "standard output";

/// The path of a named file; none for `-`, which stands for the standard input or output.
pub fn named(path: Option<&Path>) -> Option<&Path> {
    path.filter(|path| *path != Path::new("-"))
}

/// `frame.exr` → `frame.exr.yaml`.
pub fn sidecar_path(path: &Path) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(".yaml");
    PathBuf::from(name)
}

/// Whether two outputs are one file, or both the standard output.
pub fn same_place(a: Option<&Path>, b: Option<&Path>) -> bool {
    let place = |path: Option<&Path>| {
        let path = named(path)?;
        let directory = path.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let beside = || Some(directory.canonicalize().ok()?.join(path.file_name()?));
        Some(path.canonicalize().ok().or_else(beside).unwrap_or_else(|| path.to_owned()))
    };
    place(a) == place(b)
}
