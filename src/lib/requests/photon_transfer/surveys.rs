//! What the frames of all conditions tell: flats first, which show where photosites are full, then darks; and again without photosites
//! that are stuck, where there are some.

use super::checks::{check_no_copies, check_same_light, end_below, end_of_codes};
use super::conditions::{Group, Reading};
use crate::analysis::photon_transfer::{
    Asked, Blur, ClassFindings, Condition, Ends, Level, Picture, Settings, Site, SiteSurvey, Stuck, Survey,
    dark_of_offset, dark_of_tail, full_mean, hot_tail, of_class, parted, pattern_view, survey_as,
};
use crate::error::{Error, Result};
use crate::frame::Geometry;
use crate::metadata::FrameHeader;
use rayon::prelude::*;

/// Frames of all conditions, and what was found of them.
pub struct Surveys<'a> {
    head: &'a FrameHeader,
    groups: &'a [Group],
    read: &'a Reading,
    are_codes: bool,
    /// The largest code: as it is said, or as the brightest flats show it, where that is less.
    pub largest: Option<f64>,
    /// Whether that is said.
    is_said: bool,
    /// The mean from which on photosites count as full.
    full: Option<f64>,
    stuck: Stuck,
    /// Condition by condition.
    pub found: Vec<Survey>,
}

impl<'a> Surveys<'a> {
    /// Reads all frames, which are like `head`.
    ///
    /// # Errors
    ///
    /// Those of the frames; [`Error::Data`] for frames of one condition that are not.
    pub fn of(head: &'a FrameHeader, groups: &'a [Group], read: &'a Reading, are_codes: bool) -> Result<Self> {
        let largest = head.metadata.white_level_adu.map(|white| white.largest());
        let is_said = largest.is_some();
        let (full, stuck, found) = (None, Stuck::default(), Vec::new());
        let mut surveys = Self { head, groups, read, are_codes, largest, is_said, full, stuck, found };
        surveys.read_all()?;
        check_no_copies(groups, &surveys.found)?;
        Ok(surveys)
    }

    fn read_all(&mut self) -> Result<()> {
        let stacks = stacks(self.groups);
        let mut found: Vec<Option<Survey>> = vec![None; self.groups.len()];
        for is_lit in [true, false] {
            let wanted = |(place, _): &(usize, &mut Option<Survey>)| self.groups[*place].condition.is_lit == is_lit;
            let mut own: Vec<_> = found.iter_mut().enumerate().filter(wanted).collect();
            // Stacks begin first, so that no thread is left alone with one.
            own.sort_by_key(|(place, _)| std::cmp::Reverse(self.groups[*place].files.len()));
            own.into_par_iter().with_max_len(1).try_for_each(|(place, survey)| -> Result<()> {
                *survey = Some(self.survey(place, stacks.contains(&place))?);
                Ok(())
            })?;
            if is_lit {
                self.full = self.full_mean(&found);
            }
        }
        // Where the largest code is not known, the brightest flats tell how far codes reach.
        let means = |survey: &Survey| survey.sites.iter().map(|site| site.mean).fold(0.0, f64::max);
        let reach = self.largest.unwrap_or_else(|| found.iter().flatten().map(means).fold(0.0, f64::max));
        for (group, survey) in self.groups.iter().zip(&found) {
            survey.iter().flat_map(|survey| &survey.sites).try_for_each(|site| check_same_light(group, site, reach))?;
        }
        self.found = found.into_iter().flatten().collect();
        if !self.is_said && self.are_codes && !self.is_corrected() {
            self.largest = end_of_codes(self.groups, &mut self.found);
        }
        // Codes that end below what is said to be their end: samples at the end are counted again.
        if let Some(said) = self.largest.filter(|_| self.is_said && self.are_codes)
            && let Some(end) = end_below(said, self.groups, &self.found)
        {
            self.largest = Some(end);
            return self.read_all();
        }
        Ok(())
    }

    /// Whether more than a level came off the samples, which then do not tell where codes end.
    fn is_corrected(&self) -> bool {
        self.head.metadata.correction.is_some()
    }

    /// The least mean of full photosites of all classes that saturate.
    fn full_mean(&self, found: &[Option<Survey>]) -> Option<f64> {
        let of = |class: &String| {
            let lit = (0..found.len()).filter_map(|place| Some((place, found[place].as_ref()?)));
            full_mean(&lit.map(|(place, survey)| self.level(class, place, survey)).collect::<Vec<_>>())
        };
        self.classes().iter().filter_map(of).reduce(f64::min)
    }

    /// Reads the frames of a condition.
    fn survey(&self, place: usize, keeps: bool) -> Result<Survey> {
        /// Files that other groups may have open meanwhile.
        const OTHERS: usize = 64;
        let group = &self.groups[place];
        let mut frames = self.read.open_all(&group.files, OTHERS)?;
        let top = self.largest.filter(|_| self.is_said);
        let full = self.full.filter(|_| !group.condition.is_lit);
        let ends = Ends { bottom: (!self.is_corrected()).then_some(0.0), top };
        let found = survey_as(&mut frames, &Asked { ends, full, stuck: Some(&self.stuck), keeps })?;
        for site in &found.sites {
            if let Some((frame, mean)) =
                site.frame_means.iter().enumerate().find(|(_, mean)| top.is_some_and(|top| **mean > top))
            {
                let (file, top) = (group.files[frame].display(), top.unwrap_or_default());
                let problem =
                    format!("{file}: its mean is {mean:.1}, above the largest code, {top}; name the right one");
                return Err(Error::Usage(problem).change(&["white"]));
            }
        }
        if let Some([one, other]) = found.sites.iter().find_map(|site| site.copies) {
            let [one, other] = [one, other].map(|frame| group.files[frame].display());
            let problem = format!("{one} and {other}: their samples are the same, or differ by one number alone");
            return Err(Error::Data(problem + "; copies of one exposure do not count as two"));
        }
        Ok(found)
    }

    /// Names of the classes.
    fn classes(&self) -> Vec<String> {
        let mut names: Vec<String> = Vec::new();
        for site in Site::of(self.head) {
            if !names.contains(&site.class) {
                names.push(site.class);
            }
        }
        names
    }

    fn level(&self, class: &str, place: usize, survey: &Survey) -> Level {
        let sites = Site::of(self.head);
        let own = sites.iter().zip(&survey.sites).filter(|(site, _)| site.class == class);
        Level::of(place, self.groups[place].condition, own.map(|(_, survey)| survey.clone()).collect())
    }

    /// What is measured of each class, with the pictures of what patterns are measured on.
    ///
    /// # Errors
    ///
    /// Those of the frames.
    pub fn measured(&mut self, temperature_k: Option<f64>, settings: &Settings) -> Result<Vec<ClassFindings>> {
        let classes = self.findings(temperature_k, settings);
        self.keep_pictures(&classes)?;
        let all = self.stuck_photosites(&classes)?.unwrap_or_default();
        let all = all.with_others(&Site::of(self.head), &self.early(), &self.mended());
        if !all.is_any() {
            return Ok(classes);
        }
        self.stuck = all.few();
        let mut classes = classes;
        if self.stuck.is_any() {
            self.read_all()?;
            classes = self.findings(temperature_k, settings);
            self.keep_pictures(&classes)?;
        }
        for class in &mut classes {
            class.early = self.stuck.early_of_class(&class.name);
            if !class.early.is_empty() {
                let count = class.early.len();
                class.notes.push(format!(
                    "photosites that are full, or reach the largest code, under light that is far from it, as hot ones do, are left out of all numbers, dark \
                     current and its pattern too: {count}, which `defects.clipped` of the JSON names"
                ));
            }
            let mended = self.stuck.mended_of_class(&class.name);
            if mended > 0 {
                class.notes.push(format!(
                    "photosites that are marked as defective, or were interpolated from others, are left out of all numbers: {mended}"
                ));
            } else if all.mended_of_class(&class.name) > 0 {
                class.doubts.push(
                    "more than one in a hundred photosites are marked as defective, or were interpolated from others: they count in all \
                     numbers, and make noise too small"
                        .into(),
                );
            }
            class.stuck = self.stuck.of_class(&class.name);
            let share = all.share(&class.name);
            if !class.stuck.is_empty() {
                let count = class.stuck.len();
                class.notes.push(format!(
                    "photosites that hold one value with light and without are left out of all numbers: {count}, which `defects.stuck` of \
                     the JSON names"
                ));
            } else if share > 0.0 {
                class.doubts.push(format!(
                    "{:.1} % of the photosites do not follow the light, which are too many to be left out: they count in all numbers",
                    share * 100.0
                ));
            }
        }
        Ok(classes)
    }

    /// Finds hot photosites apart from all others, of each class, in the darks of such a temperature.
    ///
    /// # Errors
    ///
    /// Those of the frames.
    pub fn find_hot(&mut self, classes: &mut [ClassFindings], temperature_k: Option<f64>, rounding: f64) -> Result<()> {
        let Geometry { width, channels, .. } = &self.head.geometry;
        let (size, sites) = ([*width, channels.len()], Site::of(self.head));
        for class in classes {
            let is_own = |condition: &Condition| {
                !condition.is_lit && (condition.temperature_k == temperature_k || condition.temperature_k.is_none())
            };
            let darks: Vec<Level> = (0..self.groups.len())
                .filter(|place| is_own(&self.groups[*place].condition))
                .map(|place| self.level(&class.name, place, &self.found[place]))
                .collect();
            let Some((dark, exposure_s)) =
                dark_of_tail(&darks).and_then(|dark| Some((dark, dark.condition.exposure_s?)))
            else {
                continue;
            };
            self.keep_picture(dark.place)?;
            let blur = Blur::of(dark, rounding);
            let own: Vec<&Site> = sites.iter().filter(|site| site.class == class.name).collect();
            let picture = self.found[dark.place].picture.as_deref();
            class.hot = picture.and_then(|picture| hot_tail(&own, size, picture, exposure_s, blur));
            let Some((tail, short)) = class.hot.as_mut().zip(dark_of_offset(&darks, rounding)) else { continue };
            self.keep_picture(short.place)?;
            let of_most = |dark: &Level| {
                let picture = self.found[dark.place].picture.as_deref().filter(|_| dark.frames >= 2)?;
                let at = |index: usize| f64::from(picture[index]);
                let view = pattern_view(&own, size, &at, Blur::of(dark, rounding), false)?;
                Some((dark.condition.exposure_s?, view.rest[0]))
            };
            tail.parted = of_most(short).zip(of_most(dark)).and_then(|(short, long)| parted([short, long]));
        }
        Ok(())
    }

    fn keep_pictures(&mut self, classes: &[ClassFindings]) -> Result<()> {
        for (place, _) in classes.iter().flat_map(|class| class.stacks).flatten() {
            self.keep_picture(place)?;
        }
        Ok(())
    }

    fn keep_picture(&mut self, place: usize) -> Result<()> {
        if self.found[place].picture.is_none() {
            let kept = self.survey(place, true)?;
            let end = self.found[place].sites.iter().map(|site| site.at_ends);
            // What is at the largest code may have been counted with that taken from all.
            let ends: Vec<[u64; 2]> = end.collect();
            self.found[place] = kept;
            self.found[place].sites.iter_mut().zip(ends).for_each(|(site, ends)| site.at_ends = ends);
        }
        Ok(())
    }

    /// Photosites of each grid that have samples at the largest code, or are full in the flats whose picture is kept, where the mean of
    /// these is so far below that noise and pattern of all others do not reach it: columns and rows.
    fn early(&self) -> Vec<Vec<[usize; 2]>> {
        /// Standard deviations that noise and pattern do not reach over.
        const BEYOND: f64 = 6.0;
        /// Fits take flats up to this share of saturation.
        const SHARE: f64 = 0.7;
        let sites = Site::of(self.head);
        let Geometry { width, channels, .. } = &self.head.geometry;
        let lit = || self.groups.iter().zip(&self.found).filter(|(group, _)| group.condition.is_lit);
        let is_far = |site: &SiteSurvey, end: f64| {
            let spread = (site.variance + site.spatial.rest.value).sqrt();
            site.mean + BEYOND * spread < end && site.mean < SHARE * end
        };
        let of = |(grid, site): (usize, &Site)| {
            let mut places: Vec<[usize; 2]> = Vec::new();
            for (_, survey) in lit() {
                let own = &survey.sites[grid];
                let end = self.largest.or(self.full.filter(|_| self.is_corrected()));
                if end.is_some_and(|end| own.at_ends[0] > 0 && is_far(own, end)) {
                    places.extend(&own.at_top);
                }
                let full = self.full.filter(|full| is_far(own, *full));
                if let Some((picture, full)) = survey.picture.as_deref().zip(full) {
                    let mean = |[column, row]: [usize; 2]| {
                        let [x, y] = [site.first[0] + column * site.step[0], site.first[1] + row * site.step[1]];
                        f64::from(picture[(y * channels.len() + site.plane) * width + x])
                    };
                    let all = (0..site.size[1]).flat_map(|row| (0..site.size[0]).map(move |column| [column, row]));
                    places.extend(all.filter(|place| mean(*place) >= full));
                }
            }
            places.sort_by_key(|[column, row]| (*row, *column));
            places.dedup();
            places
        };
        if self.are_codes { sites.iter().enumerate().map(of).collect() } else { vec![Vec::new(); sites.len()] }
    }

    /// Photosites of each grid that are marked as mended in any frame: columns and rows.
    fn mended(&self) -> Vec<Vec<[usize; 2]>> {
        let of = |grid: usize| {
            let mut places: Vec<[usize; 2]> =
                self.found.iter().flat_map(|survey| &survey.sites[grid].mended).copied().collect();
            places.sort_by_key(|[column, row]| (*row, *column));
            places.dedup();
            places
        };
        (0..Site::of(self.head).len()).map(of).collect()
    }

    /// Photosites that hold one value, by a flat and the dark of the time nearest to its own; none where there are none, or no dark.
    fn stuck_photosites(&mut self, classes: &[ClassFindings]) -> Result<Option<Stuck>> {
        let both = classes.iter().find_map(|class| Some([class.stacks[0]?.0, class.stacks[1]?.0]));
        let Some(places) = both.or_else(|| self.light_and_dark()) else { return Ok(None) };
        for place in places {
            self.keep_picture(place)?;
        }
        let picture = |place: usize| {
            let survey = &self.found[place];
            let noise = survey.sites.iter().map(|site| site.variance / site.frames as f64).collect();
            survey.picture.as_deref().map(|means| Picture { means, noise })
        };
        let [light, dark] = places.map(picture);
        let Some((light, dark)) = light.zip(dark) else { return Ok(None) };
        let Geometry { width, channels, .. } = &self.head.geometry;
        let are_codes = self.are_codes && !self.is_corrected();
        let found = Stuck::of(&Site::of(self.head), [*width, channels.len()], [&dark, &light], are_codes);
        Ok(found.is_any().then_some(found))
    }

    /// The flat nearest to the middle of all, and the dark nearest to its time.
    fn light_and_dark(&self) -> Option<[usize; 2]> {
        let mean = |place: usize| {
            let sites = &self.found[place].sites;
            sites.iter().map(|site| site.mean).sum::<f64>() / sites.len() as f64
        };
        let of_kind =
            |is_lit: bool| (0..self.groups.len()).filter(move |place| self.groups[*place].condition.is_lit == is_lit);
        let black = of_kind(false).map(mean).reduce(f64::min)?;
        let middle = f64::midpoint(black, of_kind(true).map(mean).reduce(f64::max)?);
        let off = |place: &usize| (mean(*place) - middle).abs();
        let flat = of_kind(true).min_by(|a, b| off(a).total_cmp(&off(b)))?;
        let time = |place: usize| self.groups[place].condition.exposure_s.unwrap_or(0.0);
        let apart = |place: &usize| (time(*place) - time(flat)).abs();
        Some([flat, of_kind(false).min_by(|a, b| apart(a).total_cmp(&apart(b)))?])
    }

    /// What levels of each class tell.
    fn findings(&self, temperature_k: Option<f64>, settings: &Settings) -> Vec<ClassFindings> {
        let light = |level: &Level| {
            let Condition { photons, exposure_s, .. } = level.condition;
            [photons.or(exposure_s).unwrap_or(0.0), level.mean]
        };
        let by_photons =
            self.groups.iter().filter(|group| group.condition.is_lit).all(|group| group.condition.photons.is_some());
        let of = |name: &String| {
            let levels = |wanted: &dyn Fn(&Condition) -> bool| -> Vec<Level> {
                let own = (0..self.groups.len()).filter(|place| wanted(&self.groups[*place].condition));
                own.map(|place| self.level(name, place, &self.found[place])).collect()
            };
            let is_of_it =
                |condition: &Condition| condition.temperature_k == temperature_k || condition.temperature_k.is_none();
            let mut flats = levels(&|condition| condition.is_lit && is_of_it(condition));
            let darks = levels(&|condition| !condition.is_lit && is_of_it(condition));
            flats.sort_by(|a, b| {
                let ([light_a, mean_a], [light_b, mean_b]) = (light(a), light(b));
                let by_light = if by_photons { light_a.total_cmp(&light_b) } else { std::cmp::Ordering::Equal };
                by_light.then(mean_a.total_cmp(&mean_b))
            });
            // That may be less than was said, once photosites that are stuck do not count.
            let settings = Settings { top: self.largest, ..*settings };
            of_class(name, &flats, &darks, &levels(&|condition| !condition.is_lit), &settings)
        };
        self.classes().par_iter().map(of).collect()
    }
}

/// The conditions of the most frames, one with light and one without, where they are alone in that.
fn stacks(groups: &[Group]) -> Vec<usize> {
    let of_kind = |is_lit: bool| {
        let own = || groups.iter().enumerate().filter(move |(_, group)| group.condition.is_lit == is_lit);
        let most = own().map(|(_, group)| group.files.len()).max()?;
        let mut with_most = own().filter(move |(_, group)| group.files.len() == most).map(|(place, _)| place);
        with_most.next().filter(|_| with_most.next().is_none())
    };
    [true, false].into_iter().filter_map(of_kind).collect()
}
