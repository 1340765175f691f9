//! Reads stacks, and frames out of arrays that others have written.

use crate::layout::SCHEMA;
use crate::layout::{CHANNEL, LAYER, MASK, METADATA, SAMPLES, SIGMA};
use crate::samples::{StoredArray, missing, unreadable};
use cyanometer::error::{Error, Result};
use cyanometer::formats::format::{SampleReader, SampleType};
use cyanometer::formats::places::{FRAME_OF, STACK_DESCRIPTION};
use cyanometer::formats::register;
use cyanometer::frame::Geometry;
use cyanometer::metadata::Metadata;
use cyanometer::text::counted;
use cyanometer::units::QuantityKind;
use serde_json::Value;
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};
use zarrs::array::{Array, ArrayCreateError, data_type};
use zarrs::filesystem::FilesystemStore;
use zarrs::group::Group;
use zarrs::storage::{ReadableStorageTraits, StoreKey};

/// What may be along an axis of channels.
const MAX_CHANNELS: u64 = 1 << 16;

/// A stack that is read: one of ours, or an array of another program.
pub struct Stack {
    name: String,
    arrays: Vec<StoredArray>,
    /// The metadata of each frame; none in arrays of others.
    records: Option<Records>,
    geometry: Geometry,
    own_tags: Metadata,
    frames: u64,
}

/// Metadata of frames, and those that were read last.
struct Records {
    array: Array<FilesystemStore>,
    kept: Mutex<(u64, Vec<String>)>,
}

impl Stack {
    /// Opens a stack, or an array that another program has written, of version 3 or 2: rows and columns, and frames or channels, or
    /// both.
    ///
    /// # Errors
    ///
    /// [`Error::Format`] for what is neither, or damaged; [`Error::Usage`] for what this run writes.
    pub fn open(path: &Path) -> Result<Arc<Self>> {
        let name = path.display().to_string();
        let description = path.join(STACK_DESCRIPTION);
        if let Ok(about) = std::fs::metadata(&description) {
            register::note_input(&about, &name)?;
        }
        let store = FilesystemStore::new(path).map_err(|error| unreadable(&name, &error))?;
        let store = Arc::new(store);
        let found: Value = match std::fs::read(&description) {
            Ok(text) => serde_json::from_slice(&text).map_err(|error| unreadable(&name, &error))?,
            Err(_) if path.join(".zgroup").is_file() => Value::from_iter([("node_type", "group")]),
            Err(_) => Value::Null,
        };
        if found["node_type"] != "group" {
            return Self::of_array(&store, &name).map(Arc::new);
        }
        match found["attributes"]["schema"].as_str() {
            Some(SCHEMA) => Self::of_ours(&store, &found["attributes"], &name).map(Arc::new),
            Some(other) => {
                Err(Error::format(&name, format!("it is of the schema `{other}`; this version reads `{SCHEMA}`")))
            }
            None => {
                let group = Group::open(store, "/").map_err(|error| unreadable(&name, &error))?;
                let paths = group.child_array_paths().unwrap_or_default();
                let names: Vec<&str> = paths.iter().map(|path| path.as_str().trim_start_matches('/')).collect();
                let problem = match names.first() {
                    Some(first) => format!(
                        "it is another program's group of arrays, {}; name one of them, as in {}",
                        names.join(", "),
                        path.join(first).display()
                    ),
                    None => "it is a group without arrays".into(),
                };
                Err(Error::format(&name, problem))
            }
        }
    }

    /// How many frames it has.
    pub fn frames(&self) -> u64 {
        self.frames
    }

    /// The stack as messages call it.
    pub fn name(&self) -> &str {
        &self.name
    }

    fn of_ours(store: &Arc<FilesystemStore>, attributes: &Value, name: &str) -> Result<Self> {
        let damaged = |what: &str| Error::format(name, format!("{what}; it is no stack, or damaged"));
        let open = |array: &str| {
            let found = Array::open(store.clone(), &format!("/{array}"));
            found.map_err(|error| unreadable(name, &format!("its array `{array}`: {error}")))
        };
        let is_there = |array: &str| {
            let key = StoreKey::new(format!("{array}/{STACK_DESCRIPTION}"));
            key.is_ok_and(|key| store.size_key(&key).is_ok_and(|size| size.is_some()))
        };
        let names = attributes["channels"].as_array().map(Vec::as_slice).unwrap_or_default();
        let channels: Vec<String> = names.iter().filter_map(|name| Some(name.as_str()?.to_owned())).collect();
        let (mut arrays, mut next, mut form) = (Vec::new(), 0, None);
        let parts = [(SAMPLES, Some(CHANNEL)), (SIGMA, Some(LAYER)), (MASK, None)];
        for (array, axis) in parts.into_iter().filter(|(array, _)| *array == SAMPLES || is_there(array)) {
            let found = open(array)?;
            let axes = ["frame", "row", "column"].into_iter().chain(axis);
            let named = found.dimension_names().iter().flatten().map(|name| name.as_deref().unwrap_or_default());
            if !named.eq(axes.clone()) {
                return Err(damaged(&format!("the axes of `{array}` are not {}", axes.collect::<Vec<_>>().join(", "))));
            }
            let count = axis.map_or(1, |_| usize::try_from(found.shape()[3]).unwrap_or(usize::MAX));
            let [frames, rows, columns] = [found.shape()[0], found.shape()[1], found.shape()[2]];
            if *form.get_or_insert([frames, rows, columns]) != [frames, rows, columns] {
                return Err(damaged(&format!("`{array}` has another shape than `{SAMPLES}`")));
            }
            let end = count.saturating_add(next);
            let axes = [Some(0), Some(1), Some(2), axis.map(|_| 3)];
            let layout = (array, axis, next..end);
            next = end;
            arrays.push(StoredArray::of(found, layout, axes, true, name)?);
        }
        if next != channels.len() {
            return Err(damaged(&format!(
                "its arrays have not the {} that it names",
                counted(channels.len() as u64, "channels")
            )));
        }
        let records = open(METADATA)?;
        let [frames, rows, columns] = form.unwrap_or_default();
        if records.shape() != [frames] || *records.data_type() != data_type::string() {
            return Err(damaged(&format!("its metadata are not of {}", counted(frames, "frames"))));
        }
        let origin = |at: usize| attributes["origin"][at].as_i64().and_then(|at| i32::try_from(at).ok());
        let origin = [origin(0), origin(1)].map(Option::unwrap_or_default);
        let geometry = Geometry { origin, ..geometry(columns, rows, channels, name)? };
        let records = Some(Records { array: records, kept: Mutex::new((u64::MAX, Vec::new())) });
        let own_tags = Metadata::new(QuantityKind::Unspecified);
        Ok(Self { name: name.to_owned(), arrays, records, geometry, own_tags, frames })
    }

    /// A single array, by the names of its axes, or, where they have none, as rows and columns, with frames before and channels
    /// behind them.
    fn of_array(store: &Arc<FilesystemStore>, name: &str) -> Result<Self> {
        let array = Array::open(store.clone(), "/").map_err(|error| match error {
            ArrayCreateError::MissingMetadata => Error::format(name, "it is neither a stack nor another array of Zarr"),
            other => unreadable(name, &other),
        })?;
        let shape = array.shape().to_vec();
        let axes = axes_of(array.dimension_names().as_deref(), shape.len()).ok_or_else(|| {
            let named: Vec<&str> = array.dimension_names().iter().flatten().filter_map(Option::as_deref).collect();
            let found = match shape.len() {
                count if named.len() == count => format!("its axes are {}", named.join(", ")),
                1 => "it has a single axis".into(),
                count => format!("it has {count} axes, some without names"),
            };
            Error::format(
                name,
                format!("{found}; wanted are row, column, or frame, row, column, channel, in this order"),
            )
        })?;
        let along = |axis: Option<usize>| axis.map_or(1, |axis| shape[axis]);
        let [frames, rows, columns, channels] = axes.map(along);
        let names = match channels {
            1 => vec!["Y".to_owned()],
            3 => ["R", "G", "B"].map(str::to_owned).to_vec(),
            4 => ["R", "G", "B", "A"].map(str::to_owned).to_vec(),
            0..=MAX_CHANNELS => (0..channels).map(|channel| format!("C{channel}")).collect(),
            _ => return Err(Error::format(name, format!("it has {channels} channels; no frame has so many"))),
        };
        let geometry = geometry(columns, rows, names, name)?;
        let layout = (SAMPLES, axes[3].map(|_| CHANNEL), 0..geometry.channels.len());
        let arrays = vec![StoredArray::of(array, layout, axes, false, name)?];
        let own_tags = Metadata::new(QuantityKind::Unspecified);
        Ok(Self { name: name.to_owned(), arrays, records: None, geometry, own_tags, frames })
    }

    /// The metadata of a frame.
    fn record(&self, index: u64) -> Result<Option<String>> {
        let Some(Records { array, kept }) = &self.records else { return Ok(None) };
        let chunk = array.chunk_shape(&[0]).map_err(|error| unreadable(&self.name, &error))?[0].get();
        let (kept_chunk, kept) = &mut *kept.lock().unwrap_or_else(PoisonError::into_inner);
        if *kept_chunk != index / chunk {
            let found =
                array.retrieve_chunk_if_exists(&[index / chunk]).map_err(|error| unreadable(&self.name, &error))?;
            *kept = found.ok_or_else(|| missing(&self.name, &array.chunk_key(&[index / chunk])))?;
            *kept_chunk = index / chunk;
        }
        // A chunk has as many as it says, or was not decoded.
        Ok(kept.get(usize::try_from(index % chunk).unwrap_or(usize::MAX)).cloned())
    }
}

/// Rows, columns and channels as a frame has them.
fn geometry(columns: u64, rows: u64, channels: Vec<String>, name: &str) -> Result<Geometry> {
    let most = i32::MAX.unsigned_abs().into();
    let [width, height] =
        [columns, rows].map(|count| if count > most { 0 } else { usize::try_from(count).unwrap_or(0) });
    if width == 0 || height == 0 || channels.is_empty() {
        let count = channels.len();
        return Err(Error::format(name, format!("{columns}x{rows} pixels of {count} channels are no frame")));
    }
    Ok(Geometry { width, height, origin: [0, 0], channels })
}

/// Where frame, row, column and channel are among axes; none where these are others, or in another order.
fn axes_of(names: Option<&[Option<String>]>, count: usize) -> Option<[Option<usize>; 4]> {
    const KNOWN: [&[&str]; 4] = [
        &["frame", "time", "t", "exposure", "index"],
        &["row", "y", "line"],
        &["column", "col", "x"],
        &["channel", "c", "band", "rgb"],
    ];
    let names: Vec<&str> = names.into_iter().flatten().map(|name| name.as_deref().unwrap_or_default()).collect();
    if names.iter().all(|name| name.is_empty()) {
        return match count {
            2 => Some([None, Some(0), Some(1), None]),
            3 => Some([Some(0), Some(1), Some(2), None]),
            4 => Some([Some(0), Some(1), Some(2), Some(3)]),
            _ => None,
        };
    }
    let mut axes = [None; 4];
    let mut next = 0;
    for (at, name) in names.iter().enumerate() {
        let place = (next..KNOWN.len()).find(|place| KNOWN[*place].contains(&name.to_ascii_lowercase().as_str()))?;
        axes[place] = Some(at);
        next = place + 1;
    }
    (names.len() == count && axes[1].is_some() && axes[2].is_some()).then_some(axes)
}

/// A frame of a stack.
pub struct StackedFrame {
    stack: Arc<Stack>,
    index: u64,
    record: Option<String>,
    next_row: usize,
}

impl StackedFrame {
    /// Opens a frame, counted from 0.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] where there is no such frame; [`Error::Format`] where its metadata are damaged.
    pub fn open(stack: &Arc<Stack>, index: u64) -> Result<Self> {
        if index >= stack.frames {
            let problem =
                format!("{}: it has no frame {index}; it has {}", stack.name, counted(stack.frames, "frames"));
            return Err(Error::Usage(problem));
        }
        Ok(Self { stack: stack.clone(), index, record: stack.record(index)?, next_row: 0 })
    }

    /// What messages call it.
    pub fn name(&self) -> String {
        let Self { stack, index, .. } = self;
        if *index == 0 { stack.name.clone() } else { format!("{}{FRAME_OF}{index}", stack.name) }
    }
}

impl SampleReader for StackedFrame {
    fn geometry(&self) -> &Geometry {
        &self.stack.geometry
    }

    fn stored_as(&self) -> Option<SampleType> {
        self.stack.arrays.first().map(|array| array.part.stored)
    }

    fn natural_rows(&self) -> usize {
        self.stack.arrays.first().map_or(1, |array| array.size(1))
    }

    fn embedded(&self) -> Option<&str> {
        self.record.as_deref()
    }

    fn describes_samples(&self) -> bool {
        true
    }

    fn own_tags(&self) -> &Metadata {
        &self.stack.own_tags
    }

    fn notes(&self) -> &[String] {
        &[]
    }

    fn read(&mut self, rows: usize, samples: &mut Vec<f32>) -> Result<()> {
        let first = samples.len();
        samples.resize(first + rows * self.stack.geometry.row_samples(), 0.0);
        for array in &self.stack.arrays {
            array.fill(&self.stack.geometry, self.index, self.next_row, &mut samples[first..])?;
        }
        self.next_row += rows;
        Ok(())
    }
}
