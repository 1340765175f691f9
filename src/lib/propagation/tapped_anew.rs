//! What is drawn anew in each exposure of a frame that several amplifiers have read.
//!
//! Behind each amplifier photosites scatter from exposure to exposure by their own law, with its slope and its read noise, and about no mean:
//! what amplifiers make of a level is the same in all exposures. Over a frame they are groups of known sizes.

use super::frame::{FramePrediction, OF_ONE, Sites};
use super::ground::quantity_of_sites;
use super::moments::{Equations, Prediction};
use super::spaces::Channels;
use super::tap_lines::{Lit, TapLines};
use super::tapped::TappedPixels;
use super::taps::{self, Group};
use super::unlike::Temporal;
use super::unpredictable::{Predicted, Unpredictable};
use crate::metadata::FrameHeader;

/// What one of the amplifiers reads: its photosites, and what is drawn anew at them.
pub(super) struct Read {
    pub sites: Sites,
    pub temporal: [Temporal; 3],
}

/// What each of the amplifiers reads that have a part in a frame, and a frame whose sample covariance scatters N − 1 times as much, in variance,
/// as what is drawn anew in N exposures; none where one amplifier has read all.
///
/// # Errors
///
/// As [`super::of_frame`].
pub(super) fn drawn_anew(
    frame: &FrameHeader,
    equations: Equations,
    frames: u32,
) -> Predicted<Option<(Vec<Read>, FramePrediction)>> {
    if frame.taps().is_none() {
        return Ok(None);
    }
    let is_demosaicked = frame.metadata.demosaic.is_some();
    let parts = if is_demosaicked { taps::parts(&taps::with_footprint(frame)) } else { taps::parts(frame) };
    if parts.len() < 2 {
        return Ok(None);
    }
    if is_demosaicked && equations == Equations::Paper {
        return Err(Unpredictable::Beyond(OF_ONE));
    }
    let (mut groups, mut read) = (Vec::new(), Vec::new());
    for part in parts {
        let of_tap = FrameHeader { geometry: frame.geometry.clone(), ..part.frame };
        let sites = Sites::of(&of_tap, equations)?;
        let temporal = sites.photosite.temporal_of(sites.expected_e)?;
        let of_variances = temporal.each_ref().map(|temporal| temporal.of_variances(frames));
        groups.push((part.tap, Group { counts: part.counts, sites: of_variances }));
        read.push(Read { sites, temporal });
    }
    let lit: Vec<Lit> = read.iter().map(|Read { sites, .. }| (sites.photosite, sites.expected_e)).collect();
    let moments: Vec<[Prediction; 3]> = groups.iter().map(|(_, group)| group.sites).collect();
    let lines = TapLines::drawn_anew(&lit, &moments)?;
    let prediction = if is_demosaicked {
        let channels = Channels::of(&frame.metadata, quantity_of_sites(frame))?;
        // There is no mean that black would come off.
        FramePrediction::Tapped(Box::new(TappedPixels::of(frame, &channels, 0.0, &groups, lines.as_ref())?))
    } else {
        let groups = groups.into_iter().map(|(_, group)| group).collect();
        match taps::of_groups(frame, groups, lines) {
            Some(sites) => FramePrediction::Groups(sites),
            None => return Ok(None),
        }
    };
    Ok(Some((read, prediction)))
}
