//! Plots as files.

use super::files::FileId;
use super::output::write_bytes;
use crate::error::{Error, Result};
use crate::plot::Plot;
use std::path::Path;

/// The file formats of plots.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PlotFormat {
    /// Scalable vector graphics.
    Svg,
    /// Portable network graphics.
    Png,
}

impl PlotFormat {
    /// The format that the extension of a name asks for. Programs ask before they do long work.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] for any but `.svg` and `.png`.
    pub fn of_path(path: &Path) -> Result<Self> {
        match path.extension().map(|end| end.to_string_lossy().to_ascii_lowercase()).as_deref() {
            Some("svg") => Ok(Self::Svg),
            Some("png") => Ok(Self::Png),
            _ => Err(Error::Usage(format!(
                "{}: a plot is written as SVG or PNG; end the name in .svg or .png",
                path.display()
            ))),
        }
    }
}

/// Writes a plot to a file, as its extension says. `input` is the file that was read, if it is one.
///
/// # Errors
///
/// [`Error::Usage`] for an extension other than `.svg` and `.png`, or where the output is the input; [`Error::Disk`].
pub fn write_plot(path: &Path, plot: &Plot, input: Option<&(FileId, String)>) -> Result<()> {
    let bytes = match PlotFormat::of_path(path)? {
        PlotFormat::Svg => plot.svg().into_bytes(),
        PlotFormat::Png => plot.png()?,
    };
    write_bytes(path, &bytes, input)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::files::regular_file;
    use crate::plot::{Axis, Panel};

    #[test]
    fn the_extension_chooses_the_format() {
        let directory = tempfile::tempdir().unwrap();
        let plot = Plot::new("title", Panel::new(Axis::linear("x"), Axis::log10("y")));
        let path = |name: &str| directory.path().join(name);
        write_plot(&path("a.svg"), &plot, None).unwrap();
        write_plot(&path("a.PNG"), &plot, None).unwrap();
        assert_eq!(std::fs::read_to_string(path("a.svg")).unwrap(), plot.svg());
        assert_eq!(std::fs::read(path("a.PNG")).unwrap(), plot.png().unwrap());
        for name in ["a.pdf", "a", "svg"] {
            let error = write_plot(&path(name), &plot, None).unwrap_err();
            assert!(matches!(&error, Error::Usage(text) if text.contains(".svg or .png")), "{error}");
        }
        // Nothing but the two files is left.
        assert_eq!(std::fs::read_dir(directory.path()).unwrap().count(), 2);
    }

    #[test]
    fn a_plot_does_not_replace_what_was_read() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("input.svg");
        std::fs::write(&path, "spectrum").unwrap();
        let plot = Plot::new("title", Panel::new(Axis::linear("x"), Axis::linear("y")));
        let input = regular_file(&path);
        let error = write_plot(&path, &plot, input.as_ref()).unwrap_err();
        assert!(matches!(&error, Error::Usage(text) if text.contains("input.svg")), "{error}");
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "spectrum");
    }
}
