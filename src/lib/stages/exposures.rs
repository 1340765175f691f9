//! Exposures of one scene by one camera: whether frames that come one after another are.

use crate::error::{Error, Result};
use crate::metadata::FrameHeader;
use std::collections::HashSet;

/// What is known of exposures that came so far.
#[derive(Debug, Clone)]
pub struct Exposures {
    first: FrameHeader,
    head: FrameHeader,
    are_alike: bool,
    /// Seed and number of each that tells them.
    drawn: HashSet<(u64, u32)>,
}

impl Exposures {
    /// Those that `first` begins.
    pub fn of(first: &FrameHeader) -> Self {
        let mut exposures =
            Self { first: first.clone(), head: first.without_exposure(), are_alike: true, drawn: HashSet::new() };
        exposures.drawn.extend(drawn(first));
        exposures
    }

    /// The first frame.
    pub fn first(&self) -> &FrameHeader {
        &self.first
    }

    /// Whether all have the same head but for what tells exposures apart.
    pub fn are_alike(&self) -> bool {
        self.are_alike
    }

    /// Takes in the next.
    ///
    /// # Errors
    ///
    /// [`Error::Format`] for a frame that shows another scene or other pixels than the first, or is the same exposure as another, as
    /// far as metadata tell.
    pub fn take(&mut self, frame: &FrameHeader) -> Result<()> {
        self.check(frame)?;
        if let Some((seed, number)) = drawn(frame) {
            if !self.drawn.insert((seed, number)) {
                let problem =
                    format!("exposure {number} of seed {seed} comes twice; its noise would count as that of two");
                return Err(frame.refuse(problem));
            }
        }
        self.are_alike &= frame.without_exposure() == self.head;
        Ok(())
    }

    fn check(&self, frame: &FrameHeader) -> Result<()> {
        let first = &self.first;
        let compare = |what: &str, of: &dyn Fn(&FrameHeader) -> String| -> Result<()> {
            let [its, theirs] = [frame, first].map(of);
            if its == theirs {
                return Ok(());
            }
            let problem = format!("its {what} is {its}, but that of {} is {theirs}", first.name);
            Err(frame.refuse(problem + "; only exposures of one scene by one camera go together"))
        };
        let or_unknown = |text: Option<String>| text.unwrap_or_else(|| "unknown".into());
        compare("size", &|frame| format!("{}x{}", frame.geometry.width, frame.geometry.height))?;
        compare("layout", &|frame| {
            let [x, y] = frame.geometry.origin;
            format!("{} at {x},{y}", frame.geometry.channels.join(", "))
        })?;
        compare("quantity", &|frame| format!("{} in {}", frame.metadata.quantity, frame.metadata.unit))?;
        compare("pattern", &|frame| or_unknown(frame.metadata.cfa.map(|cfa| cfa.to_string())))?;
        compare("sensor", &|frame| {
            let metadata = &frame.metadata;
            let seed = metadata.noise.as_ref().map_or(String::new(), |noise| format!(" of seed {}", noise.sensor_seed));
            or_unknown(metadata.sensor.as_ref().map(|sensor| format!("{}{seed}", sensor.name)))
        })?;
        compare("exposure", &|frame| {
            let exposure = frame.metadata.exposure;
            or_unknown(exposure.map(|exposure| format!("{} s at f/{}", exposure.exposure_s, exposure.f_number)))
        })?;
        let (a, b) = (&first.metadata.scene, &frame.metadata.scene);
        if a != b {
            compare("scene", &|frame| or_unknown(frame.metadata.scene.as_ref().map(|scene| scene.source.clone())))?;
            return Err(frame.refuse(format!(
                "its scene has another light than that of {}; only exposures of one scene by one camera go together",
                first.name
            )));
        }
        Ok(())
    }
}

/// Seed and number of an exposure in which noise was drawn.
fn drawn(frame: &FrameHeader) -> Option<(u64, u32)> {
    let noise = frame.metadata.noise.as_ref().filter(|noise| !noise.sources.is_empty());
    noise.map(|noise| (noise.seed, noise.frame))
}

/// The error of fewer than two.
///
/// # Errors
///
/// [`Error::Data`] always.
pub fn too_few<T>(what: &str) -> Result<T> {
    Err(Error::Data(format!("{what} of two exposures of a scene or more; there is no second")))
}
