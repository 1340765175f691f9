//! How files and standard streams are called.

use std::ffi::OsString;
use std::os::unix::ffi::{OsStrExt, OsStringExt};
use std::path::{Path, PathBuf};

/// How messages call the standard input.
pub const STDIN_NAME: &str = "standard input";
/// How messages call the standard output.
pub const STDOUT_NAME: &str = "standard output";

/// What stands between the name of a stream and the number of a frame in it, behind the first.
pub const FRAME_OF: &str = ", frame ";

/// The name of the stream that a frame, as messages call it, comes from.
pub fn in_stream(frame: &str) -> &str {
    match frame.rsplit_once(FRAME_OF) {
        Some((stream, number)) if number.bytes().all(|byte| byte.is_ascii_digit()) => stream,
        _ => frame,
    }
}

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

/// What the name of a stack of frames ends in, a Zarr store.
pub const STACK_EXTENSION: &str = "zarr";

/// The file in which Zarr describes a group or an array.
pub const STACK_DESCRIPTION: &str = "zarr.json";

/// Whether a name is that of a stack.
///
/// # Examples
///
/// ```
/// use cyanometer::formats::places::names_stack;
/// use std::path::Path;
///
/// assert!(names_stack(Path::new("night.zarr")) && names_stack(Path::new("night.zarr/")));
/// assert!(!names_stack(Path::new("night.exr")));
/// ```
pub fn names_stack(path: &Path) -> bool {
    path.extension().is_some_and(|end| end.eq_ignore_ascii_case(STACK_EXTENSION))
}

/// Whether a Zarr group or array, of version 3 or 2, lies at a place.
pub fn is_stack(path: &Path) -> bool {
    path.is_dir() && [STACK_DESCRIPTION, ".zarray", ".zgroup"].iter().any(|name| path.join(name).is_file())
}

/// What stands for the name of an input, without its directory and the part behind its last dot, in the name of an output.
pub const STEM: &str = "{stem}";

/// Whether a name is that of several outputs: a directory, which ends in `/`, or one with [`STEM`], [`FRAME`] or [`INDEX`].
pub fn is_pattern(name: &Path) -> bool {
    let bytes = name.as_os_str().as_bytes();
    bytes.ends_with(b"/")
        || bytes.windows(STEM.len()).any(|part| part == STEM.as_bytes())
        || numbered(name, 0, 0).is_some()
}

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

/// What stands for the number of an exposure in the name of an output, at least so many digits long: `{frame}`, `{frame:05}`.
pub const FRAME: &str = "frame";
/// What stands for the number of a frame in its stream, counted from 0: `{index}`, `{index:05}`.
pub const INDEX: &str = "index";

/// A pattern with numbers put in for [`FRAME`] and [`INDEX`]; none where it has neither.
///
/// # Examples
///
/// ```
/// use cyanometer::formats::places::numbered;
/// use std::path::Path;
///
/// assert_eq!(numbered(Path::new("n/{frame:05}.exr"), 7, 0).unwrap(), Path::new("n/00007.exr"));
/// assert_eq!(numbered(Path::new("{stem}-{index}.exr"), 7, 12).unwrap(), Path::new("{stem}-12.exr"));
/// assert_eq!(numbered(Path::new("plain.exr"), 7, 0), None);
/// ```
pub fn numbered(pattern: &Path, frame: u64, index: u64) -> Option<PathBuf> {
    let bytes = pattern.as_os_str().as_bytes();
    let (mut name, mut at, mut is_numbered) = (Vec::with_capacity(bytes.len()), 0, false);
    while at < bytes.len() {
        match [(FRAME, frame), (INDEX, index)]
            .into_iter()
            .find_map(|(key, number)| placeholder(&bytes[at..], key, number))
        {
            Some((length, digits)) => {
                name.extend(digits.bytes());
                at += length;
                is_numbered = true;
            }
            None => {
                name.push(bytes[at]);
                at += 1;
            }
        }
    }
    is_numbered.then(|| PathBuf::from(OsString::from_vec(name)))
}

/// Whether a name has places for numbers.
pub fn is_numbered(name: &Path) -> bool {
    numbered(name, 0, 0).is_some()
}

/// Where bytes begin with `{key}` or `{key:WIDTH}`: how long that is, and the number as it asks for.
fn placeholder(bytes: &[u8], key: &str, number: u64) -> Option<(usize, String)> {
    /// Names of files are no longer.
    const MOST_DIGITS: usize = 200;
    let behind = bytes.strip_prefix(b"{")?.strip_prefix(key.as_bytes())?;
    let end = behind.iter().position(|byte| *byte == b'}')?;
    let width = match &behind[..end] {
        [] => 0,
        [b':', width @ ..] => std::str::from_utf8(width).ok()?.parse().ok().filter(|width| *width <= MOST_DIGITS)?,
        _ => return None,
    };
    Some((1 + key.len() + end + 1, format!("{number:0width$}")))
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

/// Whether a path leads to what is neither a file nor a directory, as named pipes are, on which a reader would wait.
pub fn is_waited_on(path: &Path) -> bool {
    std::fs::metadata(path).is_ok_and(|about| !about.is_file() && !about.is_dir())
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
