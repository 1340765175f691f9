//! What stands before the samples of a lossless JPEG: size, tables of codes, predictor.

use super::entropy::Table;
use super::{SHORT, damaged};

/// The head of a stream with one scan of all components.
#[derive(Debug)]
pub(super) struct Header {
    /// Bits of a sample, 2 to 16.
    pub precision: u32,
    /// Samples of a component in a row.
    pub width: usize,
    pub height: usize,
    /// The tables of codes that occur.
    pub tables: Vec<Table>,
    /// For each component the place of its table among them.
    pub table_of: Vec<usize>,
    /// Selection value of the predictor, 1 to 7 \[T81, Table H.1].
    pub predictor: u8,
    /// Samples are stored less so many low bits.
    pub point_transform: u32,
    /// After so many rows prediction begins anew; 0 where it never does.
    pub restart_rows: usize,
    /// Where the coded samples begin.
    pub begin: usize,
}

/// The size of a frame and the names of its components.
struct Frame {
    precision: u32,
    width: usize,
    height: usize,
    names: Vec<u8>,
}

impl Header {
    /// Reads the segments up to the samples.
    ///
    /// # Errors
    ///
    /// What is wrong, in words: no such stream, a kind of JPEG that loses something, damage.
    pub fn read(bytes: &[u8], largest_has_bits: bool) -> Result<Self, String> {
        if !bytes.starts_with(&[0xFF, 0xD8]) {
            return Err(if bytes.is_empty() { SHORT.into() } else { damaged("does not begin as one") });
        }
        let mut at = 2;
        let mut tables: [Option<Table>; 4] = [const { None }; 4];
        let (mut frame, mut restart) = (None, 0);
        loop {
            let (marker, body, next) = segment(bytes, at)?;
            at = next;
            match marker {
                0xC4 => read_tables(body, &mut tables, largest_has_bits)?,
                0xC3 if frame.is_none() => frame = Some(Frame::read(body)?),
                0xC3 => return Err(damaged("has two sizes")),
                0xC0..=0xC2 => {
                    return Err("is a JPEG that loses something, which is not supported; convert it without lossy \
                                compression from the camera's own file"
                        .into());
                }
                0xC5..=0xC7 | 0xC9..=0xCB | 0xCD..=0xCF => {
                    return Err(format!("is a JPEG of a kind that is not supported (SOF{})", marker - 0xC0));
                }
                0xDD => restart = number(body, 0)?,
                0xDA => return Self::of(frame, body, tables, restart, at),
                0xD9 => return Err(SHORT.into()),
                // Of applications, comments and quantization, which lossless coding has no use for.
                _ => {}
            }
        }
    }

    /// Reads the head of the scan.
    fn of(
        frame: Option<Frame>,
        body: &[u8],
        tables: [Option<Table>; 4],
        restart: usize,
        begin: usize,
    ) -> Result<Self, String> {
        let Some(Frame { precision, width, height, names }) = frame else {
            return Err(damaged("has samples, but no size"));
        };
        let components = names.len();
        let cut = || damaged("has a head of its samples that is cut short");
        let [count, rest @ ..] = body else { return Err(cut()) };
        if usize::from(*count) != components {
            return Err("is a JPEG with its components one after another, which is not supported".into());
        }
        let (listed, last) = rest.split_at_checked(2 * components).ok_or_else(cut)?;
        let [predictor, _, transform, ..] = *last else { return Err(cut()) };
        let mut found: Vec<(u8, Table)> = Vec::new();
        let mut table_of = Vec::with_capacity(components);
        for ([name, table], wanted) in listed.as_chunks::<2>().0.iter().zip(&names) {
            let number = table >> 4;
            if name != wanted {
                return Err(damaged("has its components out of order"));
            }
            let known = found.iter().position(|(other, _)| *other == number);
            let place = known.map_or_else(
                || {
                    let table = tables.get(usize::from(number)).and_then(Clone::clone);
                    found.push((number, table.ok_or_else(|| damaged("lacks a table of codes"))?));
                    Ok::<_, String>(found.len() - 1)
                },
                Ok,
            )?;
            table_of.push(place);
        }
        if !(1..=7).contains(&predictor) {
            return Err(damaged(format!("has predictor {predictor}, which does not exist")));
        }
        let point_transform = u32::from(transform & 15);
        if point_transform >= precision {
            return Err(damaged(format!("leaves out {point_transform} of {precision} bits")));
        }
        if !restart.is_multiple_of(width) {
            return Err(damaged("begins anew within a row"));
        }
        let tables = found.into_iter().map(|(_, table)| table).collect();
        let restart_rows = restart / width;
        Ok(Self { precision, width, height, tables, table_of, predictor, point_transform, restart_rows, begin })
    }
}

impl Frame {
    fn read(body: &[u8]) -> Result<Self, String> {
        let [precision, _, _, _, _, components, listed @ ..] = body else {
            return Err(damaged("has a size that is cut short"));
        };
        let precision = u32::from(*precision);
        let (height, width) = (number(body, 1)?, number(body, 3)?);
        if !(2..=16).contains(&precision) || width == 0 || height == 0 {
            return Err(damaged(format!("has {width}x{height} samples of {precision} bits")));
        }
        if !(1..=4).contains(components) || listed.len() != 3 * usize::from(*components) {
            return Err(damaged(format!("has {components} components")));
        }
        if listed.as_chunks::<3>().0.iter().any(|[_, sampling, _]| *sampling != 0x11) {
            return Err("is a JPEG with subsampled components, which is not supported".into());
        }
        let names = listed.as_chunks::<3>().0.iter().map(|[name, ..]| *name).collect();
        Ok(Self { precision, width, height, names })
    }
}

/// The marker at `at`, what belongs to it, and where the next one stands.
fn segment(bytes: &[u8], mut at: usize) -> Result<(u8, &[u8], usize), String> {
    if bytes.get(at).is_some_and(|byte| *byte != 0xFF) {
        return Err(damaged("has no marker where one should be"));
    }
    // Markers may have any number of these before them.
    while bytes.get(at) == Some(&0xFF) {
        at += 1;
    }
    let marker = *bytes.get(at).ok_or(SHORT)?;
    at += 1;
    if matches!(marker, 0xD0..=0xD9 | 1) {
        return Ok((marker, &[], at));
    }
    let length = bytes.get(at..).map_or(Err(SHORT.into()), |rest| number(rest, 0)).map_err(|_| SHORT)?;
    let body = at.checked_add(2).zip(at.checked_add(length)).and_then(|(from, to)| bytes.get(from..to));
    if length < 2 {
        return Err(damaged("has a part without length"));
    }
    Ok((marker, body.ok_or(SHORT)?, at + length))
}

/// The number of two bytes at `at`.
fn number(body: &[u8], at: usize) -> Result<usize, String> {
    match body.get(at..at + 2) {
        Some([high, low]) => Ok(usize::from(u16::from_be_bytes([*high, *low]))),
        _ => Err(damaged("has a part that is cut short")),
    }
}

fn read_tables(mut body: &[u8], tables: &mut [Option<Table>; 4], largest_has_bits: bool) -> Result<(), String> {
    while let [place, rest @ ..] = body {
        let Some((counts, rest)) = rest.split_first_chunk::<16>() else {
            return Err(damaged("has a table of codes that is cut short"));
        };
        let total = counts.iter().map(|count| usize::from(*count)).sum();
        let Some((sizes, rest)) = rest.split_at_checked(total) else {
            return Err(damaged("has a table of codes that is cut short"));
        };
        // The upper half is the class: 0 of lossless coding, 1 is for coefficients.
        let Some(table) = tables.get_mut(usize::from(*place)) else {
            return Err(damaged(format!("has a table of codes at the place {place}")));
        };
        *table = Some(Table::new(*counts, sizes, largest_has_bits)?);
        body = rest;
    }
    Ok(())
}
