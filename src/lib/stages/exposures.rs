//! Exposures of one scene by one camera: whether frames that come one after another are.

use crate::error::{Error, Result};
use crate::metadata::{
    BlackNoise, Difference, DrawnExposures, ExposureSet, FrameHeader, Metadata, SamplesRecord, TakenAs,
};
use std::collections::HashMap;

/// What is known of exposures that came so far.
#[derive(Debug, Clone)]
pub struct Exposures {
    first: FrameHeader,
    head: FrameHeader,
    /// What the first that differs in more than the exposure differs in.
    unlike: Option<String>,
    differ_in_matrix: bool,
    /// Those whose metadata tell their seed and number.
    drawn: ExposureSet,
    /// Sum of what the black level of each is uncertain by, which was measured in its own border.
    black_noise: Option<BlackNoise>,
    count: u32,
    /// By the digest of its samples, what each is called whose sidecar tells it.
    by_digest: HashMap<String, String>,
}

impl Exposures {
    /// Those that `first` begins.
    pub fn of(first: &FrameHeader) -> Self {
        let (head, drawn, by_digest) = (without_border(first), ExposureSet::default(), HashMap::new());
        let black_noise = first.metadata.black_noise;
        let first_of_all = first.clone();
        let (unlike, differ_in_matrix, count) = (None, false, 1);
        let mut exposures =
            Self { first: first_of_all, head, unlike, differ_in_matrix, drawn, black_noise, count, by_digest };
        // Runs of one frame that overlap are told by no other.
        first.drawn().into_iter().for_each(|run| _ = exposures.drawn.insert(run));
        exposures.by_digest.extend(digest(first).map(|digest| (digest, first.name.clone())));
        exposures
    }

    /// Seeds and numbers, as far as metadata tell them.
    pub fn drawn(&self) -> Vec<DrawnExposures> {
        self.drawn.runs()
    }

    /// The first frame; where charge has spilled in others, it tells of the one that has most.
    pub fn first(&self) -> &FrameHeader {
        &self.first
    }

    /// What their black levels are uncertain by on average, where each has its own.
    pub fn black_noise(&self) -> Option<BlackNoise> {
        self.black_noise.map(|sum| sum.times(1.0 / f64::from(self.count)))
    }

    /// What they differ in beside what tells exposures apart, in words; none where that is nothing.
    pub fn unlike(&self) -> Option<&str> {
        self.unlike.as_deref()
    }

    /// Whether raw files tell other matrices (`relative_matrix`) of them, by their white balance say.
    pub fn differ_in_matrix(&self) -> bool {
        self.differ_in_matrix
    }

    /// Takes in the next.
    ///
    /// # Errors
    ///
    /// [`Error::Format`] for a frame that shows another scene or other pixels than the first, by another camera or one that was set
    /// in another way, or is the same exposure as another, as far as metadata tell.
    pub fn take(&mut self, frame: &FrameHeader) -> Result<()> {
        self.check(frame)?;
        for run in frame.drawn() {
            self.drawn.insert(run).map_err(|number| {
                let seed = run.seed;
                frame.refuse(format!(
                    "exposure {number} of seed {seed} comes twice; its noise would count as that of two"
                ))
            })?;
        }
        if let Some(other) = digest(frame).and_then(|digest| self.by_digest.insert(digest, frame.name.clone())) {
            return Err(frame.refuse(format!(
                "its samples are those of {other}, by the digests of both; copies of one exposure do not count as two"
            )));
        }
        self.black_noise = self.black_noise.zip(frame.metadata.black_noise).map(|(sum, noise)| sum.plus(&noise));
        self.count += 1;
        self.differ_in_matrix |= frame.metadata.relative_matrix != self.first.metadata.relative_matrix;
        let head = without_border(frame);
        if self.unlike.is_none() && head != self.head {
            let differs = match Difference::of([&head.metadata, &self.head.metadata]) {
                Some(Difference { key, values: [its, theirs] }) => {
                    format!("`{key}` of {} is {its}, but that of {} is {theirs}", frame.name, self.first.name)
                }
                None => format!("{} and {} differ in more than the exposure", frame.name, self.first.name),
            };
            self.unlike = Some(differs);
        }
        // What is full in any is full in the average.
        let whites = [&self.first, frame].map(|frame| frame.metadata.white_level_adu);
        if let [Some(white), Some(other)] = whites {
            self.first.metadata.white_level_adu = Some(white.lower(other));
        }
        let spilled = &mut self.first.metadata.bloomed_photosites;
        *spilled = (*spilled).max(frame.metadata.bloomed_photosites);
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
            let aperture = frame.metadata.exposure.map(|exposure| format!(" at f/{}", exposure.f_number));
            or_unknown(frame.metadata.time_s().map(|time_s| format!("{time_s} s{}", aperture.unwrap_or_default())))
        })?;
        let (a, b) = (&first.metadata.scene, &frame.metadata.scene);
        if a != b {
            compare("scene", &|frame| or_unknown(frame.metadata.scene.as_ref().map(|scene| scene.source.clone())))?;
            return Err(frame.refuse(format!(
                "its scene has another light than that of {}; only exposures of one scene by one camera go together",
                first.name
            )));
        }
        // What a camera was set to tells more than the black level that follows from it.
        let differs = [camera, blacks].into_iter().find_map(|of| Difference::of([frame, first].map(of).each_ref()));
        let Some(Difference { key, values: [its, theirs] }) = differs else { return Ok(()) };
        let advice = if key.starts_with("black") { "; take them back first (correct-frame)" } else { "" };
        Err(frame.refuse(format!(
            "its `{key}` is {its}, but that of {} is {theirs}; only exposures of one scene by one camera go together{advice}",
            first.name
        )))
    }
}

/// What tells more than the exposure: not the level that its own border told, and not the filter of what was taken without light.
fn without_border(frame: &FrameHeader) -> FrameHeader {
    let mut head = frame.without_exposure();
    if matches!(head.metadata.taken_as, Some(TakenAs::Dark | TakenAs::Bias)) {
        head.metadata.camera_settings.iter_mut().for_each(|settings| settings.filter = None);
    }
    if let (Some(noise), Some(correction)) = (&mut head.metadata.black_noise, &mut head.metadata.correction) {
        // By which lines it was told is the same of all.
        *noise = noise.signs();
        correction.black_adu = 0.0.into();
        head.metadata.white_level_adu = None;
    }
    head
}

/// What is known of the camera and of how it was set, and nothing else.
fn camera(frame: &FrameHeader) -> Metadata {
    let known = without_border(frame).metadata;
    Metadata {
        sensor: known.sensor,
        camera: known.camera,
        iso_speed: known.iso_speed,
        camera_settings: known.camera_settings,
        capture: known.capture,
        exposure: known.exposure,
        taken_as: known.taken_as,
        adc: known.adc,
        noise: known.noise,
        white_level_adu: known.white_level_adu,
        ..Metadata::new(known.quantity)
    }
}

/// What is known of its black level.
fn blacks(frame: &FrameHeader) -> Metadata {
    let known = &frame.metadata;
    Metadata {
        dark_signal_e: known.dark_signal_e,
        black_level_adu: known.black_level_adu,
        black_by_row: known.black_by_row.clone(),
        black_by_column: known.black_by_column.clone(),
        ..Metadata::new(known.quantity)
    }
}

/// The digest of samples with noise, where the sidecar tells it.
fn digest(frame: &FrameHeader) -> Option<String> {
    // Numbers of exposures that were drawn tell them apart, and samples of one value tell nothing.
    let is_told = |samples: &&SamplesRecord| frame.is_noisy() && frame.metadata.noise.is_none() && !samples.one_value;
    frame.metadata.samples.as_ref().filter(is_told).map(|samples| samples.digest.clone())
}

/// The error of fewer than two.
///
/// # Errors
///
/// [`Error::Data`] always.
pub fn too_few<T>(what: &str) -> Result<T> {
    Err(Error::Data(format!("{what} of two exposures of a scene or more; there is no second")))
}
