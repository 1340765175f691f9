//! Plots as files.

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

/// Writes a plot to a file, as its extension says.
///
/// # Errors
///
/// [`Error::Usage`] for an extension other than `.svg` and `.png`, or where the output is a file that is read; [`Error::Disk`].
pub fn write_plot(path: &Path, plot: &Plot) -> Result<()> {
    let bytes = match PlotFormat::of_path(path)? {
        PlotFormat::Svg => plot.svg().into_bytes(),
        PlotFormat::Png => plot.png()?,
    };
    write_bytes(path, &bytes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plot::{Axis, Panel};

    #[test]
    fn the_extension_chooses_the_format() {
        let directory = tempfile::tempdir().unwrap();
        let plot = Plot::new("title", Panel::new(Axis::linear("x"), Axis::log10("y")));
        let path = |name: &str| directory.path().join(name);
        write_plot(&path("a.svg"), &plot).unwrap();
        write_plot(&path("a.PNG"), &plot).unwrap();
        assert_eq!(std::fs::read_to_string(path("a.svg")).unwrap(), plot.svg());
        assert_eq!(std::fs::read(path("a.PNG")).unwrap(), plot.png().unwrap());
        for name in ["a.pdf", "a", "svg"] {
            let error = write_plot(&path(name), &plot).unwrap_err();
            assert!(matches!(&error, Error::Usage(text) if text.contains(".svg or .png")), "{error}");
        }
        // Nothing but the two files is left.
        assert_eq!(std::fs::read_dir(directory.path()).unwrap().count(), 2);
    }
}
