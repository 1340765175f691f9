//! Histograms of classes or channels beside the laws that are predicted of them.

use super::scale::{HEADROOM, Scale, apart, farther, outside, reference, words_of_reference};
use crate::analysis::statistics::histogram::Histogram;
use crate::analysis::statistics::portrait::{Foreseen, Likeness, Portrait};
use crate::numerics::normal::cumulative;
use crate::plot::{Axis, Color, Marks, Panel};
use crate::text::{in_digits, percent};

/// The middle of a histogram leaves out this share of the samples at each end; what is shown reaches this part of its width
/// beyond: of a normal law 2.6 and 5.2 standard deviations.
const LEFT_OUT: f64 = 0.005;
const BEYOND: f64 = 0.5;
/// So much of the window more is shown at each end.
const ROOM: f64 = 0.05;
/// So many bins make the middle; of a normal law they are about 0.2 standard deviations wide.
const BINS: f64 = 26.0;
/// Draws the histogram of each class or channel of a scale; what lies beyond the axes is told above.
pub(super) fn histogram(portrait: &Portrait, scale: &Scale) -> Panel {
    let density = if scale.unit.is_empty() { "density".to_owned() } else { format!("share per {}", scale.unit) };
    let x = Axis::linear(&scale.with_unit(words_of_reference(portrait)));
    let mut panel = Panel::new(x, Axis::linear(&density));
    let groups: Vec<Bins> =
        scale.groups(portrait).filter_map(|(color, group)| Bins::of(color, group, portrait.has_whole)).collect();
    // One window for all: what it shows of a class is not beyond it.
    let window = groups.iter().map(Bins::window).reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])]).map(|[low, high]| {
        let room = ROOM * (high - low);
        [low - room, high + room]
    });
    let Some(window) = window else { return panel };
    let (mut highest, mut heaped, mut laws) = (0.0_f64, 0.0_f64, Vec::new());
    let (mut beyond, mut all, mut farthest) = (0, 0, 0.0_f64);
    let mut piles = Vec::new();
    let mut is_far = false;
    for bins in &groups {
        let pile = Pile::of(&bins.bins);
        for bin in bins.shown(window) {
            match pile {
                Some(pile) if pile.bin == bin => heaped = heaped.max(bins.density(bin)),
                _ => highest = highest.max(bins.density(bin)),
            }
        }
        let name = with_means(bins.group, &scale.unit);
        panel.add(&name, bins.color, Marks::Line(bins.steps(window)));
        piles.extend(pile.map(|pile| pile.words(&bins.group.name)));
        let foreseen = bins.group.predicted.as_ref().filter(|foreseen| pile.is_none() && !foreseen.is_clipped);
        is_far |= foreseen.is_some_and(|foreseen| foreseen.has_few_far);
        if let Some(foreseen) = foreseen.filter(|foreseen| !foreseen.has_few_far) {
            laws.push((words_of_law(foreseen, portrait.is_whole), bins.law(foreseen, portrait.is_whole)));
        }
        let outside = bins.beyond(window);
        (beyond, all) = (beyond + outside, all + bins.bins.total());
        let far = if outside > 0 { bins.farthest(window) } else { 0.0 };
        farthest = farther(farthest, far);
    }
    let words = laws.first().map_or_else(String::new, |(words, _): &(String, _)| words.clone());
    let laws = laws.into_iter().map(|(_, law)| (Color::Black, law)).collect();
    for (index, (color, law)) in apart(laws, highest).into_iter().enumerate() {
        panel.add(if index == 0 { &words } else { "" }, color, Marks::Dashed(law));
    }
    // Heaps alone make the scale themselves.
    if highest == 0.0 {
        piles.clear();
        highest = heaped;
    }
    if highest > 0.0 {
        panel.y = panel.y.range(0.0, HEADROOM * highest);
    }
    panel.x = panel.x.range(window[0], window[1]);
    let words = outside(beyond, all, "samples", farthest);
    let no_law = if is_far { "no law drawn: few photosites far off make its spread" } else { "" };
    panel.title = [words]
        .into_iter()
        .chain(piles)
        .chain([no_law.to_owned(), of_clipped(&groups)])
        .filter(|words| !words.is_empty())
        .collect::<Vec<_>>()
        .join("; ");
    panel
}

/// Over which groups no law is drawn as full well clips them; empty where over all.
fn of_clipped(groups: &[Bins<'_>]) -> String {
    let is_clipped = |bins: &&Bins| bins.group.predicted.as_ref().is_some_and(|foreseen| foreseen.is_clipped);
    let names: Vec<&str> = groups.iter().filter(is_clipped).map(|bins| bins.group.name.as_str()).collect();
    if names.is_empty() { String::new() } else { format!("no law drawn over {}: full well clips it", names.join(", ")) }
}

/// The histogram of a class or channel as a panel shows it: less a mean, in bins as wide as its own middle asks for.
struct Bins<'a> {
    color: Color,
    group: &'a Likeness,
    reference: f64,
    bins: Histogram,
    /// From where to where bins reach: of whole numbers half of one beyond the lowest and the highest.
    reach: [f64; 2],
    /// The first and the last bin of its middle and some more.
    own: [i64; 2],
}

impl<'a> Bins<'a> {
    fn of(color: Color, group: &'a Likeness, has_whole: bool) -> Option<Self> {
        let reference = reference(group)?;
        let finest = if has_whole { &group.histogram.of_whole() } else { &group.histogram };
        let [from, to] = finest.middle(LEFT_OUT)?;
        #[expect(clippy::cast_possible_truncation, reason = "a few bins; casts saturate")]
        let times = (((to - from) / BINS / finest.width).round() as i64).max(1);
        let bins = if has_whole { finest.merged_within(times) } else { finest.merged(times) };
        let [lowest, highest] = finest.ends;
        let reach = if has_whole { [lowest - 0.5, highest + 0.5] } else { [f64::NEG_INFINITY, f64::INFINITY] };
        let room = BEYOND * (to - from) + bins.width;
        let is_own = |bin: &&i64| (from - room..to + room).contains(&bins.begin(**bin));
        let (first, last) = (bins.counts.keys().find(is_own)?, bins.counts.keys().rfind(is_own)?);
        let own = [*first, *last];
        Some(Self { color, group, reference, own, bins, reach })
    }

    /// Where a bin begins, from the mean.
    fn begin(&self, bin: i64) -> f64 {
        self.bins.begin(bin).max(self.reach[0]) - self.reference
    }

    /// Where it ends.
    fn end(&self, bin: i64) -> f64 {
        self.bins.begin(bin + 1).min(self.reach[1]) - self.reference
    }

    /// From where to where its own bins reach.
    fn window(&self) -> [f64; 2] {
        [self.begin(self.own[0]), self.end(self.own[1])]
    }

    /// Whether the middle of a bin lies in a window.
    fn is_within(&self, bin: i64, [low, high]: [f64; 2]) -> bool {
        (low..=high).contains(&(0.5 * (self.begin(bin) + self.end(bin))))
    }

    /// All its own bins, and the others in a window that hold samples, in their order.
    fn shown(&self, window: [f64; 2]) -> Vec<i64> {
        let [first, last] = self.own;
        let others = |is_there: &dyn Fn(i64) -> bool| -> Vec<i64> {
            let held = self.bins.counts.keys().copied();
            held.filter(|bin| is_there(*bin) && self.is_within(*bin, window)).collect()
        };
        others(&|bin| bin < first).into_iter().chain(first..=last).chain(others(&|bin| bin > last)).collect()
    }

    /// The share of samples in a bin over its width.
    fn density(&self, bin: i64) -> f64 {
        let count = self.bins.counts.get(&bin).copied().unwrap_or(0);
        count as f64 / self.bins.total() as f64 / (self.end(bin) - self.begin(bin))
    }

    /// The line over the bins that are shown; between bins apart it is 0.
    fn steps(&self, window: [f64; 2]) -> Vec<[f64; 2]> {
        let mut steps: Vec<[f64; 2]> = Vec::new();
        let mut before = None;
        for bin in self.shown(window) {
            if let Some(before) = before.filter(|before| before + 1 < bin) {
                steps.extend([[self.begin(before + 1), 0.0], [self.begin(bin), 0.0]]);
            }
            let density = self.density(bin);
            steps.extend([[self.begin(bin), density], [self.end(bin), density]]);
            before = Some(bin);
        }
        steps
    }

    /// What is predicted of its own bins.
    fn law(&self, foreseen: &Foreseen, is_whole: bool) -> Vec<[f64; 2]> {
        let of = |bin: i64| {
            let [from, to] = [self.begin(bin), self.end(bin)];
            let share = share_between(foreseen, is_whole, from + self.reference, to + self.reference);
            [0.5 * (from + to), share / (to - from)]
        };
        (self.own[0]..=self.own[1]).map(of).collect()
    }

    /// How many samples lie in bins outside a window.
    fn beyond(&self, window: [f64; 2]) -> u64 {
        let counts = self.bins.counts.iter();
        counts.filter(|(bin, _)| !self.is_within(**bin, window)).map(|(_, count)| *count).sum()
    }

    /// The farthest sample outside a window.
    fn farthest(&self, [low, high]: [f64; 2]) -> f64 {
        let ends = self.bins.ends.map(|end| end - self.reference);
        let outside = ends.into_iter().filter(|end| !(low..=high).contains(end)).reduce(farther);
        outside.unwrap_or_else(|| farther(ends[0], ends[1]))
    }
}

/// Samples at an end of the range, such as saturated ones, so many that all others would be next to nothing beside them; they
/// reach beyond the axis, and follow no normal law.
#[derive(Debug, Clone, Copy)]
struct Pile {
    bin: i64,
    is_highest: bool,
    share: f64,
}

impl Pile {
    fn of(bins: &Histogram) -> Option<Self> {
        /// So many times as high as any other bin.
        const HIGH: u64 = 3;
        let (&first, &last) = (bins.counts.keys().next()?, bins.counts.keys().next_back()?);
        let count = |bin: i64| bins.counts.get(&bin).copied().unwrap_or(0);
        let others = |end: i64| bins.counts.iter().filter(|(bin, _)| **bin != end).map(|(_, count)| *count).max();
        let is_high = |end: i64| others(end).is_none_or(|others| count(end) > HIGH * others);
        let end = [last, first].into_iter().find(|end| is_high(*end))?;
        let share = count(end) as f64 / bins.total() as f64;
        Some(Self { bin: end, is_highest: end == last, share })
    }

    fn words(self, name: &str) -> String {
        let end = if self.is_highest { "highest" } else { "lowest" };
        format!("{} % of {name} in its {end} bin, beyond the axis", percent(self.share, 2))
    }
}

/// The name of a class or channel with its mean, and that which is predicted, where one is: deviations are counted from that.
fn with_means(group: &Likeness, unit: &str) -> String {
    let shown = |mean: f64| in_digits(mean, 5).replace('-', "−");
    let mean =
        group.mean().map_or(String::new(), |mean| format!(", mean {} {unit}", shown(mean)).trim_end().to_owned());
    let predicted = group.predicted.as_ref().map_or(String::new(), |law| format!(", predicted {}", shown(law.mean)));
    format!("{}{mean}{predicted}", group.name)
}

/// What the predicted law is called.
fn words_of_law(foreseen: &Foreseen, is_whole: bool) -> String {
    let law = if foreseen.stds.len() > 1 { "predicted: normal by phase" } else { "predicted: normal" };
    if is_whole { format!("{law}, rounded") } else { law.to_owned() }
}

/// The predicted share of samples between two edges: of whole numbers that of rounded ones, whose edges lie between codes; there
/// rounding is no part of the spread before.
fn share_between(foreseen: &Foreseen, is_whole: bool, from: f64, to: f64) -> f64 {
    const ROUNDING: f64 = 1.0 / 12.0;
    /// Of samples that all but round to one code.
    const LEAST: f64 = 1e-4;
    let below = |edge: f64| {
        let of = |std: &f64| {
            let variance = if is_whole { (std * std - ROUNDING).max(LEAST) } else { std * std };
            cumulative((edge - foreseen.mean) / variance.sqrt())
        };
        foreseen.stds.iter().map(of).sum::<f64>() / foreseen.stds.len() as f64
    };
    below(to) - below(from)
}
