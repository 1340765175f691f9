//! A plain encoder, for the tests, and what the decoder makes of its streams.

#![expect(clippy::cast_possible_truncation, reason = "tests, with values chosen to fit")]

use super::LjpegRows;

/// What a stream is made with.
#[derive(Debug, Clone)]
pub struct Encoding {
    pub precision: u32,
    pub components: usize,
    pub predictor: u8,
    pub point_transform: u32,
    /// Rows after which prediction begins anew; 0 for never.
    pub restart_rows: usize,
    /// For each component, whether sizes have codes of 1 to 16 bits instead of 5.
    pub long_codes: [bool; 2],
}

impl Default for Encoding {
    fn default() -> Self {
        Self {
            precision: 16,
            components: 1,
            predictor: 1,
            point_transform: 0,
            restart_rows: 0,
            long_codes: [false, true],
        }
    }
}

/// Code and its length for each size from 0 to 16, and the table as the stream has it. Long codes are in an order that gives
/// the sizes of noise some of the longest.
fn codes(long: bool) -> (Vec<(u32, u32)>, Vec<u8>) {
    let order = [16, 0, 15, 1, 14, 2, 13, 3, 12, 4, 11, 5, 10, 6, 9, 7, 8u8];
    let mut counts = [0u8; 16];
    let mut found = vec![(0, 0); 17];
    let (mut code, mut before) = (0u32, 0);
    for (place, size) in order.into_iter().enumerate() {
        let length = if long { (place as u32 + 1).min(16) } else { 5 };
        code <<= length - before;
        found[usize::from(size)] = (code, length);
        counts[length as usize - 1] += 1;
        (code, before) = (code + 1, length);
    }
    (found, [&counts[..], &order].concat())
}

/// Encodes rows of samples, those of all components in turns.
#[allow(clippy::too_many_lines, reason = "a file, segment after segment")]
pub fn encode(samples: &[u16], row: usize, with: &Encoding) -> Vec<u8> {
    let Encoding { precision, components, predictor, point_transform, restart_rows, long_codes } = *with;
    let (width, height) = (row / components, samples.len() / row);
    let mut out = vec![0xFF, 0xD8];
    let segment = |out: &mut Vec<u8>, marker: u8, body: &[u8]| {
        out.extend([0xFF, marker]);
        out.extend(u16::try_from(body.len() + 2).unwrap().to_be_bytes());
        out.extend(body);
    };
    let both = long_codes.map(codes);
    for (place, (_, table)) in both.iter().enumerate() {
        segment(&mut out, 0xC4, &[&[place as u8][..], table].concat());
    }
    let [high, low] = u16::try_from(height).unwrap().to_be_bytes();
    let [wide, narrow] = u16::try_from(width).unwrap().to_be_bytes();
    let mut frame = vec![precision as u8, high, low, wide, narrow, components as u8];
    (0..components).for_each(|c| frame.extend([c as u8, 0x11, 0]));
    segment(&mut out, 0xC3, &frame);
    if restart_rows > 0 {
        segment(&mut out, 0xDD, &u16::try_from(restart_rows * width).unwrap().to_be_bytes());
    }
    let mut scan = vec![components as u8];
    (0..components).for_each(|c| scan.extend([c as u8, ((c % 2) as u8) << 4]));
    scan.extend([predictor, 0, point_transform as u8]);
    segment(&mut out, 0xDA, &scan);

    let mut bits = Vec::new();
    let flush = |bits: &mut Vec<bool>, out: &mut Vec<u8>| {
        bits.resize(bits.len().next_multiple_of(8), true);
        for byte in bits.chunks(8).map(|eight| eight.iter().fold(0u8, |byte, bit| byte << 1 | u8::from(*bit))) {
            out.push(byte);
            if byte == 0xFF {
                out.push(0);
            }
        }
        bits.clear();
    };
    let kept: Vec<i32> = samples.iter().map(|sample| i32::from(sample >> point_transform)).collect();
    for y in 0..height {
        let anew = restart_rows > 0 && y % restart_rows == 0;
        if anew && y > 0 {
            flush(&mut bits, &mut out);
            out.extend([0xFF, 0xD0 + ((y / restart_rows - 1) % 8) as u8]);
        }
        for x in 0..row {
            let at = |x: usize, y: usize| kept[y * row + x];
            let first = y == 0 || anew;
            let predicted = if x < components {
                if first { 1 << (precision - point_transform - 1) } else { at(x, y - 1) }
            } else if first {
                at(x - components, y)
            } else {
                let (a, b, c) = (at(x - components, y), at(x, y - 1), at(x - components, y - 1));
                [a, b, c, a + b - c, a + ((b - c) >> 1), b + ((a - c) >> 1), (a + b) >> 1][usize::from(predictor) - 1]
            };
            let difference = (at(x, y) - predicted).rem_euclid(1 << 16);
            let difference = if difference > 1 << 15 { difference - (1 << 16) } else { difference };
            let size = 32 - difference.unsigned_abs().leading_zeros();
            let value = if difference < 0 { difference - 1 + (1 << size) } else { difference };
            let (code, length) = both[x % components % 2].0[if size > 16 { 16 } else { size as usize }];
            bits.extend((0..length).rev().map(|bit| code >> bit & 1 == 1));
            if size < 16 {
                bits.extend((0..size).rev().map(|bit| value >> bit & 1 == 1));
            }
        }
    }
    flush(&mut bits, &mut out);
    out.extend([0xFF, 0xD9]);
    out
}

/// Samples of so many bits: some follow each other closely, some not at all.
pub fn samples(count: usize, bits: u32, seed: u64) -> Vec<u16> {
    let mut state = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1;
    let mut next = || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        state >> 20
    };
    let mut level = 0;
    let samples = (0..count).map(|_| {
        let step = next();
        level = if step % 7 == 0 { next() } else { level + step % 23 };
        (level % (1 << bits)) as u16
    });
    samples.collect()
}

fn decode(stream: Vec<u8>) -> Result<Vec<u16>, String> {
    let mut rows = LjpegRows::open(stream, false)?;
    let mut decoded = Vec::new();
    while (decoded.len() as u64) < rows.samples() {
        decoded.extend(rows.next()?);
    }
    Ok(decoded)
}

#[test]
fn every_predictor_gives_back_what_was_encoded() {
    for predictor in 1..=7 {
        for components in 1..=4 {
            for (precision, point_transform, restart_rows) in [(16, 0, 0), (14, 0, 3), (12, 2, 1), (8, 0, 2), (2, 0, 0)]
            {
                let row = 12 * components;
                let low = !((1u16 << point_transform) - 1);
                let seed = u64::from(predictor) * 100 + components as u64;
                let wanted: Vec<u16> = samples(row * 11, precision, seed).iter().map(|s| s & low).collect();
                for long_codes in [[false, false], [false, true], [true, true]] {
                    let with = Encoding { precision, components, predictor, point_transform, restart_rows, long_codes };
                    let stream = encode(&wanted, row, &with);
                    assert_eq!(decode(stream).as_deref(), Ok(&wanted[..]), "{with:?}");
                }
            }
        }
    }
}

/// A difference of 32768 has no bits behind its size, but had in files of DNG 1.0.
#[test]
fn the_largest_difference_has_no_bits() {
    let wanted = [0x8000, 0, 0x8000, 0, 0xFFFF, 0x7FFF, 0, 1];
    let stream = encode(&wanted, 4, &Encoding::default());
    assert_eq!(decode(stream.clone()).as_deref(), Ok(&wanted[..]));
    let mut old = LjpegRows::open(stream, true).unwrap();
    assert!(old.next().map(<[u16]>::to_vec) != Ok(wanted[..4].to_vec()));
}

#[test]
fn damage_is_told() {
    let wanted = samples(40 * 9, 14, 5);
    let with = Encoding { precision: 14, restart_rows: 3, ..Encoding::default() };
    let stream = encode(&wanted, 40, &with);
    // Cut anywhere before the marker of the end, or within it: short, and never a result that is wrong.
    for length in 0..stream.len() - 2 {
        assert!(decode(stream[..length].to_vec()).is_err(), "{length}");
    }
    let place = |marker: [u8; 2]| stream.windows(2).position(|two| two == marker).unwrap();
    let (size, scan, tables) = (place([0xFF, 0xC3]), place([0xFF, 0xDA]), place([0xFF, 0xC4]));
    for (at, byte, wanted) in [
        (0, 0, "is damaged; its lossless JPEG does not begin as one"),
        (size + 1, 0xC0, "is a JPEG that loses something, which is not supported"),
        (size + 1, 0xC9, "is a JPEG of a kind that is not supported (SOF9)"),
        (size + 1, 0xFE, "has samples, but no size"),
        (size + 4, 17, "has 40x9 samples of 17 bits"),
        (size + 4, 10, "has samples of more than its 10 bits"),
        (size + 5, 255, "holds fewer bytes than its 2611560 samples need"),
        (size + 9, 2, "has 2 components"),
        (size + 11, 0x21, "is a JPEG with subsampled components"),
        (scan + 4, 0, "is a JPEG with its components one after another"),
        (scan + 5, 9, "has its components out of order"),
        (scan + 6, 0x30, "lacks a table of codes"),
        (scan + 7, 0, "has predictor 0, which does not exist"),
        (scan + 7, 8, "has predictor 8, which does not exist"),
        (scan + 9, 14, "leaves out 14 of 14 bits"),
        (tables + 4, 4, "has a table of codes at the place 4"),
        (tables + 5, 3, "has a table of codes"),
        (place([0xFF, 0xDD]) + 5, 121, "begins anew within a row"),
        (place([0xFF, 0xD0]) + 1, 0xD1, "has its parts out of order"),
        (place([0xFF, 0xD0]) + 1, 0xD9, "ends before its last row"),
    ] {
        let mut damaged = stream.clone();
        damaged[at] = byte;
        let said = decode(damaged).unwrap_err();
        assert!(said.contains(wanted), "{said}, not {wanted}");
    }
}
