//! What was seen of a region, beside what is predicted of it.

use super::check::{self, Expected, Measured, Test};
use super::expectation::{Expectation, Predicted};
use super::grids::Array;
use super::levels::Levels;
use super::region::Region;
use super::repeated_check;
use super::report::{ChannelReport, RegionReport};
use super::tally::Tally;
use crate::cfa::Class;
use crate::metadata::FrameHeader;
use crate::numerics::moments::Moments;
use crate::propagation::sampling::Sampling;
use crate::propagation::{FramePrediction, PixelMoments};
use nalgebra::Matrix3;

/// The groups of channels that a region is measured in.
pub(super) struct Assessment<'a> {
    /// All channels of the frame.
    channels: Group<'a>,
    /// The classes of a CFA plane, each by itself; none of other frames.
    classes: Vec<Group<'a>>,
    /// Frames' worth of samples whose covariances are averaged.
    repeats: f64,
}

/// Channels that were observed together.
struct Group<'a> {
    names: Vec<String>,
    moments: &'a Moments,
    predicted: Predicted,
}

impl<'a> Assessment<'a> {
    /// Lays a tally beside a prediction; `sampling` tells how mixed pixels scatter there.
    pub fn new(
        tally: &'a Tally,
        frame: &FrameHeader,
        region: Region,
        prediction: Option<&FramePrediction>,
        sampling: impl FnOnce(&PixelMoments) -> Sampling,
    ) -> Self {
        let count = tally.channels.count;
        // Layers of standard deviations may follow the three planes of a demosaicked frame.
        let is_demosaicked = frame.metadata.demosaic.is_some();
        let planes = tally.channels.channels();
        let is_three = count > 0 && (planes == 3 || (planes > 3 && is_demosaicked));
        let counts = tally.classes.as_ref().map(|classes| classes.each_ref().map(|class| class.count));
        let bayer = frame.metadata.cfa.and_then(|array| array.bayer());
        let array = bayer.map(|pattern| Array::of(pattern, &frame.geometry, region));
        let mut of_classes: [Predicted; 3] = Default::default();
        let of_channels = match (prediction, counts) {
            (Some(FramePrediction::Planes(predictions)), Some(counts)) => {
                of_classes =
                    [0, 1, 2].map(|k| Predicted::of_class(&predictions[k], Class::ALL[k], counts[k], array.as_ref()));
                Predicted::of_cfa_plane(predictions, counts, array.as_ref())
            }
            (Some(FramePrediction::Planes(predictions)), None) if is_three => {
                Predicted::of_planes(predictions, count, region, frame.geometry.origin)
            }
            (Some(FramePrediction::Groups(sites)), Some(counts)) if count > 0 => {
                of_classes = Class::ALL.map(|class| match counts[class as usize] {
                    0 => Predicted::default(),
                    _ => Predicted::of_class_in_groups(sites, class),
                });
                Predicted::of_plane_in_groups(sites)
            }
            (Some(FramePrediction::Groups(sites)), None) if is_three => Predicted::of_groups(sites),
            (Some(FramePrediction::Tapped(pixels)), None) if is_three => Predicted::of_tapped(pixels),
            (Some(FramePrediction::Pixels(mixture)), None) if is_three => {
                Predicted::of_pixels(mixture, sampling(mixture))
            }
            _ => Predicted::default(),
        };
        let names = (0..planes).map(|index| frame.channel_name(index).to_owned()).collect();
        let channels = Group { names, moments: &tally.channels, predicted: of_channels };
        let classes = tally.classes.iter().flatten().zip(Class::ALL).zip(of_classes);
        let classes = classes.map(|((moments, class), predicted)| Group {
            names: vec![class.letter().to_owned()],
            moments,
            predicted,
        });
        Self { channels, classes: classes.collect(), repeats: 1.0 }
    }

    /// What is said of the region, without tests.
    pub fn report(&self, frame: &FrameHeader, region: Region, levels: &Levels) -> RegionReport {
        let metadata = &frame.metadata;
        let black = levels.mean_black(frame, region.x..region.x + region.width, region.y..region.y + region.height);
        let has_rails = levels.has_rails();
        let reports = |group: &Group<'_>, black: f64| -> Vec<ChannelReport> {
            (0..group.names.len()).map(|index| group.channel(index, black, has_rails, self.repeats)).collect()
        };
        let mut channels = reports(&self.channels, black.whole);
        // Errors of what is known to share rows or columns are those of the prediction.
        if let ([plane], false, false) = (&mut channels[..], self.classes.is_empty(), self.shares_lines()) {
            (plane.mean_error, plane.std_error) = self.plane_errors();
        }
        let mut classes: Vec<ChannelReport> =
            self.classes.iter().zip(black.classes).flat_map(|(group, black)| reports(group, black)).collect();
        let mut mean_std = self.channels.predicted.mean_std.clone();
        if metadata.is_transferred() {
            // Charge transfer mixes neighbors: no sampling error is that of independent samples.
            channels.iter_mut().chain(&mut classes).for_each(ChannelReport::forget_errors);
            mean_std = None;
        }
        let Group { moments, predicted, .. } = &self.channels;
        let row = |i| (0..channels.len()).map(|j| moments.covariance(i, j)).collect::<Option<Vec<f64>>>();
        RegionReport {
            region,
            patch: None,
            sample: None,
            count: moments.count,
            not_finite: moments.not_finite,
            saturated: 0,
            defective: 0,
            corrected: 0,
            beyond_model: 0,
            leaves_saturated_out: false,
            quantity: metadata.quantity,
            unit: metadata.unit.clone(),
            classes,
            covariance: (0..channels.len()).map(row).collect(),
            channels,
            predicted_covariance: predicted.covariance.clone(),
            patch_mean_std: mean_std,
            tests: Vec::new(),
        }
    }

    /// The same where samples are what is drawn anew in frames of so many degrees of freedom.
    #[must_use]
    pub fn repeated(mut self, freedom: f64) -> Self {
        for group in std::iter::once(&mut self.channels).chain(&mut self.classes) {
            group.predicted = std::mem::take(&mut group.predicted).repeated(freedom);
        }
        self.repeats = freedom;
        self
    }

    /// Tests of means over frames.
    pub fn tests_of_means(&self) -> Vec<Test> {
        self.groups().flat_map(|group| group.tested(repeated_check::tests_of_means)).collect()
    }

    /// Tests of what is drawn anew in so many frames, whose own means have variances: of all channels, and of each class.
    pub fn tests_over_frames(&self, variances_of_means: &[Vec<f64>], frames: u32) -> Vec<Test> {
        let groups = self.groups().zip(variances_of_means);
        let of_group = |(group, variances): (&Group<'_>, &Vec<f64>)| {
            group.tested(|measured, expected| repeated_check::tests_over_frames(measured, variances, expected, frames))
        };
        groups.flat_map(of_group).collect()
    }

    /// The same report with what is expected of samples of this region in place of what a large frame has.
    pub fn of_region(&self, mut report: RegionReport) -> RegionReport {
        if report.count < 2 {
            return report;
        }
        let expect = |channels: &mut [ChannelReport], groups: &[&Group<'_>]| {
            let expected = groups.iter().flat_map(|group| &group.predicted.channels);
            for (channel, expected) in channels.iter_mut().zip(expected) {
                channel.predicted_std = channel.predicted_std.map(|_| expected.sample_std);
            }
        };
        expect(&mut report.channels, &[&self.channels]);
        expect(&mut report.classes, &self.classes.iter().collect::<Vec<_>>());
        let Predicted { channels, tested, .. } = &self.channels.predicted;
        let of_three = tested.as_ref().map(|expected| &expected.sampling.covariance);
        report.predicted_covariance = match (of_three, &channels[..]) {
            (Some(c), _) => Some((0..3).map(|i| (0..3).map(|j| c[(i, j)]).collect()).collect()),
            (None, [one]) => Some(vec![vec![one.sample_std * one.sample_std]]),
            (None, _) => report.predicted_covariance,
        };
        report
    }

    /// Standard deviations by formula of the means of the channels, and of each class.
    pub fn mean_stds(&self) -> Vec<Vec<f64>> {
        let of_group = |group: &Group<'_>| group.predicted.channels.iter().map(|channel| channel.mean_error).collect();
        self.groups().map(of_group).collect()
    }

    fn groups(&self) -> impl Iterator<Item = &Group<'a>> {
        std::iter::once(&self.channels).chain(&self.classes)
    }

    /// Tests of everything that is predicted.
    pub fn tests(&self) -> Vec<Test> {
        self.groups().flat_map(|group| group.tested(check::tests)).collect()
    }

    /// Whether a prediction says that photosites share rows or columns.
    fn shares_lines(&self) -> bool {
        let tested = self.classes.iter().filter_map(|class| class.predicted.tested.as_ref());
        tested.into_iter().any(|expected| expected.sampling.variance_thirds.is_some())
    }

    /// Standard errors of mean and standard deviation of a CFA plane, whose classes have shares w that are not drawn.
    ///
    /// x̄ = Σ w x̄ₖ,  s² ≈ Σ w (sₖ² + (x̄ₖ − x̄)²),  so that to first order
    /// var x̄ = Σ w² sₖ²/nₖ,  var s² = Σ w² (2 sₖ⁴/(nₖ − 1) + 4 (x̄ₖ − x̄)² sₖ²/nₖ)
    fn plane_errors(&self) -> (Option<f64>, Option<f64>) {
        let plane = self.channels.moments;
        let total = plane.count as f64;
        let (mut of_mean, mut of_variance) = (0.0, 0.0);
        for class in self.classes.iter().map(|class| class.moments).filter(|class| class.count > 0) {
            let Some(variance) = class.covariance(0, 0) else { return (None, None) };
            let (n, offset) = (class.count as f64, class.mean[0] - plane.mean[0]);
            let share = (n / total).powi(2);
            of_mean += share * variance / n;
            of_variance +=
                share * (2.0 * variance * variance / (n - 1.0) / self.repeats + 4.0 * offset * offset * variance / n);
        }
        let std = plane.std(0);
        let of_std = std.map(|std| if std > 0.0 { of_variance.sqrt() / (2.0 * std) } else { 0.0 });
        (std.map(|_| of_mean.sqrt()), of_std)
    }
}

impl Group<'_> {
    /// What is said of a channel, of so many frames' worth of samples.
    fn channel(&self, index: usize, black: f64, has_rails: bool, repeats: f64) -> ChannelReport {
        let moments = self.moments;
        let expectation = self.predicted.channels.get(index);
        let count = moments.count;
        let seen = |value: f64| (count > 0).then_some(value);
        let mean = seen(moments.mean[index]);
        let std = moments.std(index);
        let ratio_db = |mean: f64, std: f64| {
            let ratio = (mean - black) / std;
            (ratio > 0.0 && ratio.is_finite()).then(|| 20.0 * ratio.log10())
        };
        let spread = expectation.filter(|expected| expected.is_resolved());
        let n = count as f64;
        // Errors of independent normal samples, relative to their standard deviation.
        let independent = (1.0 / n.sqrt(), (2.0 * (n - 1.0) * repeats).sqrt().recip());
        let known = |expected: &Expectation| (expected.mean_error / expected.sample_std, expected.std_error);
        let is_known = |errors: &(f64, f64)| errors.0.is_finite() && errors.1.is_finite();
        let (mean_error, std_error) = expectation.map(known).filter(is_known).unwrap_or(independent);
        ChannelReport {
            name: self.names[index].clone(),
            count,
            mean,
            std,
            min: seen(moments.min[index]),
            max: seen(moments.max[index]),
            snr_db: mean.zip(std).and_then(|(mean, std)| ratio_db(mean, std)),
            clipped: has_rails.then_some(moments.beyond[index]),
            predicted_mean: expectation.map(|expected| expected.mean),
            predicted_std: expectation.map(|expected| expected.std),
            z_mean: mean.zip(spread).map(|(mean, expected)| (mean - expected.mean) / expected.mean_error),
            z_std: std.zip(spread).map(|(std, expected)| (std / expected.sample_std - 1.0) / expected.std_error),
            mean_error: std.map(|std| std * mean_error),
            std_error: std.map(|std| std * std_error),
        }
    }

    /// Tests of what is predicted of the channels.
    fn tested(&self, tests: impl Fn(&Measured<'_>, &Expected) -> Vec<Test>) -> Vec<Test> {
        let Some(expected) = &self.predicted.tested else { return Vec::new() };
        let tested = self.predicted.channels.len();
        // The one channel of a class stands for all three.
        let place = |i: usize| i.min(tested - 1);
        let covariance = |i, j| self.moments.covariance(place(i), place(j)).unwrap_or(0.0);
        let measured = Measured {
            names: &self.names[..tested],
            mean: [0, 1, 2].map(|i| self.moments.mean[place(i)]),
            covariance: Matrix3::from_fn(covariance),
        };
        tests(&measured, expected).into_iter().filter(Test::is_sound).collect()
    }
}
