//! What the headers of an EXR file say about its parts, or why a part cannot be read.

use super::{ExrTags, METADATA_ATTRIBUTE, Primaries, UNITS_ATTRIBUTE, XYZ_PRIMARIES, attributes};
use crate::camera::optics::Exposure;
use crate::error::{Error, Result};
use crate::formats::foreign::{self, STORE_WITHOUT_LOSS, SUBSAMPLED};
use crate::formats::format::SampleType;
use crate::frame::{Geometry, THREE_PLANES, bare_name};
use crate::metadata::Metadata;
use crate::spectrum::channel_wavelength_nm;
use crate::stages::saturation::MASK_LAYER;
use crate::units::{QuantityKind, RELATIVE_UNIT};
use exr::compression::Compression;
use exr::math::Vec2;
use exr::meta::MetaData;
use exr::meta::attribute::{AttributeValue, SampleType as ExrSampleType, Text};
use exr::meta::header::Header;
use std::collections::HashMap;
use std::io::Read;

/// A block (a tile, or the scanlines that are compressed together) may take this much memory, not more.
const MAX_BLOCK_BYTES: usize = 1 << 30;
/// All headers of a file may take this much.
const MAX_HEADER_BYTES: u64 = 64 << 20;

/// What a part holds.
pub(super) struct Contents {
    /// Size, place and channels; the data window's corner is the origin.
    pub geometry: Geometry,
    /// For each channel of the geometry, its place in the file's list.
    pub order: Vec<usize>,
    /// Attributes.
    pub tags: ExrTags,
    /// How samples are stored; none where channels differ in it.
    pub stored_as: Option<SampleType>,
    /// What the attributes, those of our metadata apart, say in the project's terms.
    pub own_tags: Metadata,
    /// Attributes that were passed over, and why.
    pub notes: Vec<String>,
}

/// Reads the headers of all parts.
pub(super) fn read_meta(input: &mut impl Read, name: &str) -> Result<MetaData> {
    let complaint = |error| foreign::exr_complaint(name, &error);
    let headers = attributes::headers(&mut input.take(MAX_HEADER_BYTES), name)?;
    let meta = MetaData::read_from_buffered(headers.as_slice(), false).map_err(complaint)?;
    if meta.requirements.has_deep_data && !meta.headers.iter().any(|header| header.deep) {
        return Err(Error::format(name, "its flags speak of deep data and its headers do not; it is damaged"));
    }
    // The strict check of the whole, as the crate makes it before it writes.
    for header in &meta.headers {
        let mut long_names = false;
        header.validate(meta.requirements.has_multiple_layers, &mut long_names, false).map_err(complaint)?;
    }
    Ok(meta)
}

impl Contents {
    /// What part `part` holds.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] where there is no such part, [`Error::Format`] where it is not supported.
    pub fn of(meta: &MetaData, part: usize, name: &str) -> Result<Self> {
        let Some(header) = meta.headers.get(part) else {
            let last = meta.headers.len().saturating_sub(1);
            return Err(Error::Usage(format!("{name}: there is no part {part}; its parts are 0 to {last}")));
        };
        check_kind(header, name)?;
        let (width, height) = (header.layer_size.width(), header.layer_size.height());
        if width == 0 || height == 0 || header.channels.list.is_empty() {
            return Err(Error::format(name, "it has no samples"));
        }
        let channels = &header.channels;
        let names: Vec<String> =
            channels.list.iter().map(|channel| String::from_utf8_lossy(channel.name.as_slice()).into()).collect();
        let order = canonical_order(&names);
        let origin = header.own_attributes.layer_position;
        let geometry = Geometry {
            width,
            height,
            origin: [origin.x(), origin.y()],
            channels: order.iter().map(|&place| names[place].clone()).collect(),
        };
        let stored_as = channels.uniform_sample_type.map(|kind| match kind {
            ExrSampleType::F32 => SampleType::F32,
            ExrSampleType::F16 => SampleType::F16,
            ExrSampleType::U32 => SampleType::U32,
        });
        let tags = read_tags(header);
        let mut notes = Vec::new();
        let own_tags = own_tags(&tags, &geometry, &mut notes);
        Ok(Self { geometry, order, tags, stored_as, own_tags, notes })
    }
}

/// The attributes in the project's terms.
fn own_tags(tags: &ExrTags, geometry: &Geometry, notes: &mut Vec<String>) -> Metadata {
    let near = |found: &Primaries| {
        found.iter().flatten().zip(XYZ_PRIMARIES.iter().flatten()).all(|(a, b)| (a - b).abs() < 1e-6)
    };
    let is_spectral = geometry.channels.iter().any(|channel| channel_wavelength_nm(channel).is_some());
    let mut metadata = Metadata::new(match tags.primaries {
        _ if is_spectral => QuantityKind::SpectralRadiance,
        Some(primaries) if near(&primaries) => QuantityKind::Xyz,
        _ => QuantityKind::Unspecified,
    });
    if is_spectral {
        metadata.unit = emissive_unit(tags);
    }
    if metadata.quantity == QuantityKind::Xyz {
        // Samples are shares of the luminance of R = G = B = 1 \[OpenEXR, whiteLuminance].
        match tags.white_luminance.filter(|luminance| *luminance > 0.0 && luminance.is_finite()) {
            Some(luminance) => metadata.sample_scale = Some(luminance.recip()).filter(|scale| *scale != 1.0),
            None => {
                metadata.unit = RELATIVE_UNIT.into();
                notes.push(
                    "it has no whiteLuminance: its XYZ count as relative, Y = 1 for white; metadata with `unit: cd m-2` say otherwise"
                        .into(),
                );
            }
        }
    }
    metadata.iso_speed = tags.iso_speed.filter(|iso| *iso > 0.0 && iso.is_finite());
    let is_time = |time_s: &f64| *time_s > 0.0 && time_s.is_finite();
    metadata.exposure_time_s = tags.exposure_s.filter(is_time);
    if let Some((exposure_s, f_number)) = tags.exposure_s.zip(tags.f_number) {
        match (Exposure { exposure_s, f_number, lens_transmittance: 1.0 }).checked() {
            Ok(exposure) => (metadata.exposure, metadata.exposure_time_s) = (Some(exposure), None),
            Err(error) => notes.push(format!("its attributes expTime and aperture are passed over: {error}")),
        }
    }
    metadata
}

/// The unit of a spectral image. In layout 1.0 \[Fichet2021] emission is per nm, whether `emissiveUnits` say so or not: the
/// authors' programs and pbrt-v4 write `W.m^-2.sr^-1`.
fn emissive_unit(tags: &ExrTags) -> String {
    let unit = tags.emissive_units.as_deref().unwrap_or_default().trim();
    let is_short = tags.spectral_layout.as_deref() == Some("1.0") && unit == "W.m^-2.sr^-1";
    if is_short { format!("{unit}.nm^-1") } else { unit.to_owned() }
}

/// Refuses parts that are of a kind that is not read, naming it.
fn check_kind(header: &Header, name: &str) -> Result<()> {
    let refuse = |problem: &str| Err(Error::format(name, problem));
    if header.deep {
        return refuse(
            "deep data are not supported; flatten them first, for example with `oiiotool in.exr --flatten -o out.exr`",
        );
    }
    if header.channels.list.iter().any(|channel| channel.sampling != Vec2(1, 1)) {
        return refuse(SUBSAMPLED);
    }
    let is_read = match header.compression {
        Compression::Uncompressed | Compression::RLE | Compression::ZIP1 | Compression::ZIP16 | Compression::PIZ => {
            true
        }
        // It cuts 32-bit floats to 24 bits, and loses nothing of the other types.
        Compression::PXR24 => header.channels.list.iter().all(|channel| channel.sample_type != ExrSampleType::F32),
        _ => false,
    };
    if !is_read {
        return Err(Error::format(name, format!("its {} is not read here; {STORE_WITHOUT_LOSS}", header.compression)));
    }
    if header.max_block_byte_size() > MAX_BLOCK_BYTES {
        return refuse("its blocks are larger than 1 GiB; store it in smaller ones");
    }
    Ok(())
}

fn read_tags(header: &Header) -> ExrTags {
    let text = |text: &Text| String::from_utf8_lossy(text.as_slice()).into_owned();
    let own = &header.own_attributes;
    let other = |name: &str| match own.other.get(&Text::new_or_none(name)?)? {
        AttributeValue::Text(value) => Some(text(value)),
        _ => None,
    };
    let point = |Vec2(x, y): Vec2<f32>| [f64::from(x), f64::from(y)];
    ExrTags {
        metadata: other(METADATA_ATTRIBUTE),
        software: own.software_name.as_ref().map(text),
        exposure_s: own.exposure.map(f64::from),
        f_number: own.aperture.map(f64::from),
        iso_speed: own.iso_speed.map(f64::from),
        white_luminance: own.white_luminance.map(f64::from),
        neutral_xy: own.adopted_neutral.map(point),
        interop_id: None,
        primaries: header
            .shared_attributes
            .chromaticities
            .map(|c| [point(c.red), point(c.green), point(c.blue), point(c.white)]),
        emissive_units: other(UNITS_ATTRIBUTE),
        spectral_layout: other("spectralLayoutVersion"),
    }
}

/// The order in which channels are worked on: R, G, B (or Y; x, y, Y; L, a, b) first, the rest layer by layer as the file
/// has them, each again R, G, B (or the like) first. Where all belong to layers, as in `left.R`, what stands behind the
/// last dot counts. Marks come last of all, as they are made.
pub(super) fn canonical_order(names: &[String]) -> Vec<usize> {
    let place = |wanted: &str| {
        let exact = names.iter().position(|name| name == wanted);
        exact.or_else(|| names.iter().position(|name| bare_name(name) == wanted))
    };
    let sets = THREE_PLANES.iter().map(|planes| &planes[..]).chain([&["X", "Y", "Z"][..], &["Y"]]);
    let mut sets = sets.map(|set| set.iter().map(|name| place(name)).collect());
    let leading: Vec<usize> = sets.find_map(|found| found).unwrap_or_default();
    let mut order: Vec<usize> = (0..names.len()).collect();
    let prefix = |place: usize| {
        let name = &names[place];
        &name.as_bytes()[..name.len() - bare_name(name).len()]
    };
    // Each layer stands where the first name does that begins so; names are looked up in order, so that many take no time.
    let mut sorted: Vec<usize> = (0..names.len()).collect();
    sorted.sort_by(|a, b| names[*a].as_bytes().cmp(names[*b].as_bytes()));
    let mut first_of: HashMap<&[u8], usize> = HashMap::new();
    for place in 0..names.len() {
        let prefix = prefix(place);
        first_of.entry(prefix).or_insert_with(|| {
            let from = sorted.partition_point(|place| names[*place].as_bytes() < prefix);
            let with = sorted[from..].iter().take_while(|place| names[**place].as_bytes().starts_with(prefix));
            with.min().copied().unwrap_or(place)
        });
    }
    let first_of_layer = |place: usize| first_of.get(prefix(place)).copied();
    let rank = |place: usize| {
        const INNER: [&str; 13] = ["R", "G", "B", "CCT", "Duv", "x", "y", "Y", "L", "a", "b", "u", "v"];
        INNER.iter().position(|name| *name == bare_name(&names[place])).unwrap_or(INNER.len())
    };
    order.sort_by_cached_key(|&place| {
        let leads = leading.iter().position(|leader| *leader == place);
        let is_mask = names[place] == MASK_LAYER;
        (
            is_mask,
            leads.unwrap_or(leading.len()),
            if leads.is_none() { first_of_layer(place) } else { None },
            rank(place),
        )
    });
    order
}

#[cfg(test)]
mod tests {
    use super::*;

    /// XYZ are shares of the luminance of white, and on no scale where nothing tells it.
    #[test]
    fn xyz_are_absolute_where_their_white_is() {
        let told = |white_luminance: Option<f64>| {
            let tags = ExrTags { white_luminance, primaries: Some(XYZ_PRIMARIES), ..ExrTags::default() };
            let mut notes = Vec::new();
            let own = own_tags(&tags, &Geometry::new(1, 1, &["R", "G", "B"]), &mut notes);
            (own.unit, own.sample_scale, notes.len())
        };
        let absolute = QuantityKind::Xyz.unit().to_owned();
        assert_eq!(told(Some(1.0)), (absolute.clone(), None, 0));
        assert_eq!(told(Some(80.0)), (absolute, Some(0.0125), 0));
        for nothing in [None, Some(0.0), Some(-3.0), Some(f64::NAN), Some(f64::INFINITY)] {
            assert_eq!(told(nothing), (RELATIVE_UNIT.to_owned(), None, 1));
        }
    }

    /// What pbrt-v4 writes is per nm, as the layout has it; without the layout nobody knows.
    #[test]
    fn emission_of_the_spectral_layout_is_per_nm() {
        let unit = |layout: Option<&str>, unit: &str| {
            let (emissive_units, spectral_layout) = (Some(unit.into()), layout.map(Into::into));
            emissive_unit(&ExrTags { emissive_units, spectral_layout, ..ExrTags::default() })
        };
        assert_eq!(unit(Some("1.0"), "W.m^-2.sr^-1"), "W.m^-2.sr^-1.nm^-1");
        assert_eq!(unit(Some("1.0"), "W.m^-2.sr^-1.nm^-1"), "W.m^-2.sr^-1.nm^-1");
        assert_eq!(unit(Some("1.0"), "W.m^-2"), "W.m^-2");
        assert_eq!(unit(Some("2.0"), "W.m^-2.sr^-1"), "W.m^-2.sr^-1");
        assert_eq!(unit(None, "W.m^-2.sr^-1"), "W.m^-2.sr^-1");
    }
}
