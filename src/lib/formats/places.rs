//! How files and standard streams are called.

use std::ffi::OsString;
use std::os::unix::ffi::{OsStrExt, OsStringExt};
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

/// What stands for the name of an input, without its directory and the part behind its last dot, in the name of an output.
pub const STEM: &str = "{stem}";

/// Where what is made of `input` goes by a pattern: a name with [`STEM`], or a directory, which ends in `/`, where it is
/// `STEM.EXTENSION`. Other names are what they are.
pub fn output_of(pattern: &Path, input: &Path, extension: &str) -> PathBuf {
    let bytes = pattern.as_os_str().as_bytes();
    let pattern = if bytes.ends_with(b"/") {
        [bytes, STEM.as_bytes(), b".", extension.as_bytes()].concat()
    } else {
        bytes.to_vec()
    };
    let stem = input.file_stem().unwrap_or_default().as_bytes();
    let mut name = Vec::with_capacity(pattern.len() + stem.len());
    let mut rest = pattern.as_slice();
    while let Some((first, others)) = rest.split_first() {
        if let Some(behind) = rest.strip_prefix(STEM.as_bytes()) {
            name.extend(stem);
            rest = behind;
        } else {
            name.push(*first);
            rest = others;
        }
    }
    PathBuf::from(OsString::from_vec(name))
}

/// The place that a named output has in the file system, by which two can be compared; none of the standard output.
pub fn place(path: Option<&Path>) -> Option<PathBuf> {
    let path = named(path)?;
    let directory = path.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let beside = || Some(directory.canonicalize().ok()?.join(path.file_name()?));
    Some(path.canonicalize().ok().or_else(beside).unwrap_or_else(|| path.to_owned()))
}

/// Whether two outputs are one file, or both the standard output.
pub fn same_place(a: Option<&Path>, b: Option<&Path>) -> bool {
    place(a) == place(b)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn patterns_take_the_name_of_the_input() {
        for (pattern, input, wanted) in [
            ("{stem}.tiff", "shots/IMG_1.NEF", "IMG_1.tiff"),
            ("out/{stem}/{stem}-a.exr", "a.b.dng", "out/a.b/a.b-a.exr"),
            ("out/", "x/y.cr2", "out/y.exr"),
            ("{stem}/", "y.cr2", "y/y.exr"),
            ("plain.tiff", "y.cr2", "plain.tiff"),
            ("{stem", "{stem}.raw", "{stem"),
            ("{stem}", "{stem}.raw", "{stem}"),
        ] {
            assert_eq!(output_of(Path::new(pattern), Path::new(input), "exr"), Path::new(wanted), "{pattern} {input}");
        }
    }
}
