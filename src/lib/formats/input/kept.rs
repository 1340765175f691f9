//! What is kept of a frame: its channels, and a rectangle.

use super::options::InputOptions;
use crate::analysis::statistics::Region;
use crate::error::{Error, Result};
use crate::formats::register;
use crate::frame::{Geometry, THREE_PLANES};
use crate::metadata::{FrameHeader, Metadata};
use crate::names::place_of;
use crate::stages::saturation::{MASK_BITS, MASK_LAYER, bits};
use crate::units::QuantityKind;

/// What the names of layers of standard deviations begin with.
const SIGMA: &str = "sigma.";

/// The channels that are kept.
pub(super) struct Taken {
    /// The place of the first among those that are stored.
    pub(super) place: usize,
    /// What reports call the one that is taken alone, as the plane Y.
    pub(super) called: Option<String>,
    pub(super) geometry: Geometry,
}

impl Taken {
    /// The channel that the options name, of whose unit the metadata are then, or those that stages work on.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] where there is no such channel.
    pub(super) fn of(stored: &Geometry, options: &InputOptions, name: &str, metadata: &mut Metadata) -> Result<Self> {
        let plane = || filtered_plane(stored).filter(|_| options.wants_plane);
        let Some(channel) = options.channel.as_deref().or_else(plane) else {
            let geometry = keep_planes(stored, options.all_channels, metadata.quantity);
            return Ok(Self { place: 0, called: None, geometry });
        };
        let taken = Self::one(stored, channel, name, metadata.quantity)?;
        if options.channel.is_none() {
            register::doubt(format!(
                "{name}: its channel `{channel}` is taken for the plane behind the filter array; --channel NAME takes another"
            ));
        }
        metadata.unit = unit_of(stored, taken.place, &metadata.unit);
        Ok(taken)
    }

    /// That of a name: the one that reports give it, or that it is stored by; a layer of standard deviations also by that of what these are
    /// of, `sigma.X`.
    fn one(stored: &Geometry, channel: &str, name: &str, quantity: QuantityKind) -> Result<Self> {
        let frame = FrameHeader { name: name.to_owned(), geometry: stored.clone(), metadata: Metadata::new(quantity) };
        let names: Vec<&str> = (0..stored.channels.len()).map(|place| frame.channel_name(place)).collect();
        let layer = |stored: &String| stored.strip_prefix(SIGMA).map(|base| format!("{SIGMA}{}", frame.name_of(base)));
        let layers: Vec<String> = stored.channels.iter().map(|stored| layer(stored).unwrap_or_default()).collect();
        let place = place_of(channel, names.iter().copied())
            .or_else(|| place_of(channel, layers.iter().map(String::as_str)))
            .or_else(|| place_of(channel, stored.channels.iter().map(String::as_str)));
        let Some(place) = place else {
            let some = names.iter().take(8).copied().collect::<Vec<_>>().join(", ");
            let more = if names.len() > 8 { ", …" } else { "" };
            let problem = format!("{name}: there is no channel `{channel}`; it has {some}{more}");
            return Err(Error::Usage(problem).change(&["channel"]));
        };
        Ok(Self { place, called: Some(names[place].to_owned()), geometry: stored.with_channels(&["Y"]) })
    }
}

/// The one of several channels whose name, or the end of it, says that it is the plane behind a filter array.
fn filtered_plane(stored: &Geometry) -> Option<&str> {
    const NAMES: [&str; 7] = ["y", "raw", "cfa", "bayer", "mosaic", "gray", "grey"];
    let is_plane = |channel: &&str| {
        let last = channel.rsplit('.').next().unwrap_or(channel);
        NAMES.iter().any(|name| last.eq_ignore_ascii_case(name))
    };
    // Beside X it is luminance.
    let are_stimuli = stored.channels.iter().any(|channel| channel.eq_ignore_ascii_case("x"));
    let mut found = stored.channels.iter().map(String::as_str).filter(is_plane);
    // A plane Y that leads, with layers behind it, is the frame whatever is wanted.
    let leads = stored.channels.first().is_some_and(|first| first == "Y");
    found.next().filter(|_| !(leads || are_stimuli) && stored.channels.len() > 1 && found.next().is_none())
}

/// The unit of one channel, or of its standard deviation, of a frame whose channels may have one each.
fn unit_of(stored: &Geometry, place: usize, unit: &str) -> String {
    let channel = &stored.channels[place];
    let base = channel.strip_prefix(SIGMA).unwrap_or(channel);
    let units: Vec<&str> = unit.split(", ").collect();
    let own = stored.channels.iter().position(|known| known == base).and_then(|at| units.get(at));
    own.filter(|_| units.len() > 1).map_or(unit, |own| *own).to_owned()
}

/// Cuts a frame down to a rectangle, where one is wanted, and gives the column and row that come first. A frame that has more than the
/// picture which its file tells, by what tag and where, is doubted.
///
/// # Errors
///
/// As [`cut`].
pub(super) fn cut_to(
    header: &mut FrameHeader,
    crop: Option<Region>,
    picture: Option<(&'static str, [i64; 4])>,
) -> Result<[usize; 2]> {
    let Geometry { width, height, .. } = header.geometry;
    let Region { x, y, width, height } = crop.unwrap_or(Region { x: 0, y: 0, width, height });
    let kept = [x, y, x.saturating_add(width), y.saturating_add(height)].map(|side| side as i64);
    let beyond = picture.filter(|(_, [x, y, width, height])| {
        kept[0] < *x || kept[1] < *y || kept[2] > x + width || kept[3] > y + height
    });
    // Where pixels were mirrored is where the plane ended, not where the crop does.
    let on_sensor = header.geometry.on_sensor();
    if let Some(record) = header.metadata.demosaic.as_mut().filter(|_| crop.is_some()) {
        record.plane.get_or_insert(on_sensor);
    }
    let corner = crop.map_or(Ok([0, 0]), |crop| cut(header, crop))?;
    if let Some((tag, [x, y, width, height])) = beyond {
        register::doubt(format!(
            "{}: its picture is {width}x{height} from {x},{y} ({tag}), and what lies beside counts as picture too; --crop \
             {x},{y},{width},{height} leaves it out",
            header.name
        ));
    }
    Ok(corner)
}

/// Cuts a frame down to a rectangle, and gives the column and row that come first.
///
/// # Errors
///
/// [`Error::Usage`] where it does not lie within the frame.
fn cut(header: &mut FrameHeader, crop: Region) -> Result<[usize; 2]> {
    crop.check(header).map_err(|error| error.change(&["crop"]))?;
    let geometry = &mut header.geometry;
    for (first, by) in geometry.origin.iter_mut().zip([crop.x, crop.y]) {
        let moved = i32::try_from(by).ok().and_then(|by| first.checked_add(by));
        *first = moved.ok_or_else(|| Error::format(&header.name, "it lies too far from the sensor's corner"))?;
    }
    (geometry.width, geometry.height) = (crop.width, crop.height);
    // The counts of a sidecar are those of the whole frame.
    header.metadata.samples = None;
    Ok([crop.x, crop.y])
}

/// The channels that stages work on: the first three where they are R, G, B; Y alone; otherwise all.
fn keep_planes(stored: &Geometry, all: bool, quantity: QuantityKind) -> Geometry {
    let mut kept = stored.clone();
    let starts =
        |names: &[&str]| stored.channels.len() > names.len() && stored.channels.iter().zip(names).all(|(a, b)| a == b);
    if !all && quantity != QuantityKind::SpectralRadiance {
        if THREE_PLANES.iter().any(|planes| starts(planes)) {
            kept.channels.truncate(3);
        } else if starts(&["Y"]) {
            kept.channels.truncate(1);
        }
    }
    kept
}

/// Counts the pixels that a row of the layer of marks tells, by [`MASK_BITS`].
pub(super) fn count_marks(row: &[f32], counts: &mut [u64; MASK_BITS.len()]) {
    for mark in row.iter().map(|mark| bits(*mark)) {
        counts.iter_mut().zip(MASK_BITS).for_each(|(count, (bit, _))| *count += u64::from(mark & bit != 0));
    }
}

/// How the note of channels that no stage sees ends.
pub(super) const LEFT_OUT: &str = " are left out";

/// That note; none where there are no such channels but marks.
pub(super) fn left_out(name: &str, channels: &[String]) -> Option<String> {
    let dropped: Vec<&str> = channels.iter().map(String::as_str).filter(|channel| *channel != MASK_LAYER).collect();
    (!dropped.is_empty()).then(|| format!("{name}: channels {}{LEFT_OUT}", dropped.join(", ")))
}
