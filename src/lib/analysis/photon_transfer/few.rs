//! Numbers whose uncertainty few photosites make up: hot ones that of the pattern of the dark, ones that jump that of the temporal noise.
//!
//! What a variance scatters by from one sample of photosites to the next is told by sums of fourth powers x of what they are off by. Where these make it far
//! more than that of normal photosites, it is itself told by as many of them as
//!
//! (Σ x)²/Σ x²
//!
//! alike would be. How many of such there are is chance, and none may be among those that were measured: of few no law follows, whatever the interval. The
//! number is that of the photosites that were measured then.

use super::curve::are_whole;
use super::level::Level;
use super::site_survey::SiteSurvey;
use crate::numerics::variance_components::MeanSquare;

/// Of fewer no law follows. Of 3072 photosites, 1 to 15 of them hot by an exponential law, 95 in 100 samples whose scatter hot ones make have fewer, of 600 hot ones 6; of
/// the others of 200 hot ones intervals miss the variance of the law in 7.
const FEW: f64 = 6.0;
/// So many times what normal photosites make a variance scatter by is far more.
const FAR: f64 = 5.0;

/// What is looked at of a grid: a mean square, how many degrees of freedom it had of normal photosites, and sums of fourth powers and of their squares.
type Looked = (MeanSquare, f64, [f64; 2]);

/// Whether few photosites make up what a variance scatters by.
fn is_of_few(level: &Level, of: impl Fn(&SiteSurvey) -> Looked) -> bool {
    let (mut all, mut normal, mut sums) = (0.0, 0.0, [0.0; 2]);
    for site in &level.sites {
        let (square, freedom, [fourth, eighth]) = of(site);
        let own = 2.0 * (site.count() as f64 / level.count() * square.value).powi(2);
        (all, normal) = (all + own / square.freedom, normal + own / freedom);
        sums = [sums[0] + fourth, sums[1] + eighth];
    }
    all > FAR * normal && sums[0] * sums[0] < FEW * sums[1]
}

fn single(site: &SiteSurvey) -> f64 {
    site.size.iter().map(|extent| *extent as f64 - 1.0).product()
}

/// What is said of numbers of the dark whose uncertainty few photosites make up, of the darks that tell them.
pub fn told_of_few(darks: &[Level]) -> Vec<String> {
    let whole = || darks.iter().zip(are_whole(darks)).filter(|(_, is_whole)| *is_whole).map(|(dark, _)| dark);
    let told = |what: &str, kind: &str| {
        format!(
            "few photosites that are far off the others, as {kind} are, make up much of what {what} would be uncertain by from one sample of photosites \
             to the next: numbers are those of the photosites that were measured, and no law of others follows"
        )
    };
    let of_pattern = |dark: &Level| is_of_few(dark, |site| (site.spatial.rest, single(site), site.of_steps));
    let of_noise = |dark: &Level| {
        let freedom = dark.frames as f64 - 1.0;
        dark.frames >= 2 && is_of_few(dark, |site| (site.temporal.rest, freedom * single(site), site.of_noise))
    };
    let pattern = whole().any(of_pattern).then(|| told("DSNU, dark current and its non-uniformity", "hot ones"));
    let noise = whole().any(of_noise).then(|| told("temporal dark noise", "ones that jump"));
    pattern.into_iter().chain(noise).collect()
}
