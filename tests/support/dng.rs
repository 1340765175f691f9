//! Small DNGs: one strip behind R G / G B.

#![allow(dead_code, reason = "each file of tests takes what it needs")]

const BLACK_LEVEL: u16 = 50714;

/// The bytes of a DNG with one strip of so many bits a sample, stored with a compression, and tags of its own: numbers of 32
/// bits each; black reads 0 where they do not say otherwise.
pub fn dng(size: [u32; 2], bits: u32, compression: u32, strip: &[u8], more: &[(u16, &[u32])]) -> Vec<u8> {
    let has_black = more.iter().any(|(tag, _)| *tag == BLACK_LEVEL);
    let black: &[(u16, &[u32])] = if has_black { &[] } else { &[(BLACK_LEVEL, &[0])] };
    written(size, bits, compression, strip, &[more, black].concat(), &[])
}

/// The same of samples of 16 bits, with no level of black but that of the tags.
pub fn dng_as_told(size: [u32; 2], strip: &[u8], more: &[(u16, &[u32])]) -> Vec<u8> {
    written(size, 16, 1, strip, more, &[])
}

/// The same of samples of 16 bits, where the tags of colors and shares are ratios: numerators and divisors.
pub fn dng_with_ratios(size: [u32; 2], strip: &[u8], more: &[(u16, &[u32])]) -> Vec<u8> {
    let has_black = more.iter().any(|(tag, _)| *tag == BLACK_LEVEL);
    let black: &[(u16, &[u32])] = if has_black { &[] } else { &[(BLACK_LEVEL, &[0])] };
    let ratios = [(50721, 10), (50722, 10), (50727, 5), (50728, 5), (50734, 5), (50935, 5)];
    written(size, 16, 1, strip, &[more, black].concat(), &ratios)
}

fn written(
    size: [u32; 2],
    bits: u32,
    compression: u32,
    strip: &[u8],
    more: &[(u16, &[u32])],
    ratios: &[(u16, u16)],
) -> Vec<u8> {
    let kind_of = |tag: u16| ratios.iter().find(|(of, _)| *of == tag).map_or(4, |(_, kind)| *kind);
    let [width, height] = size;
    let mut tags: Vec<(u16, u16, Vec<u32>)> = vec![
        (256, 4, vec![width]),
        (257, 4, vec![height]),
        (258, 4, vec![bits]),
        (259, 4, vec![compression]),
        (262, 4, vec![32803]),
        (273, 4, vec![8]),
        (277, 4, vec![1]),
        (278, 4, vec![height]),
        (279, 4, vec![u32::try_from(strip.len()).unwrap()]),
        (33421, 4, vec![2, 2]),
        (33422, 4, vec![0, 1, 1, 2]),
        (50706, 4, vec![1, 4, 0, 0]),
    ];
    tags.extend(more.iter().map(|(tag, values)| (*tag, kind_of(*tag), values.to_vec())));
    tags.sort();
    let mut out = [b"II*\0\0\0\0\0", strip].concat();
    let mut table = u16::try_from(tags.len()).unwrap().to_le_bytes().to_vec();
    for (tag, kind, values) in tags {
        let bytes: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
        table.extend([tag.to_le_bytes(), kind.to_le_bytes()].concat());
        let count = if kind == 4 { values.len() } else { values.len() / 2 };
        table.extend(u32::try_from(count).unwrap().to_le_bytes());
        if bytes.len() > 4 {
            table.extend(u32::try_from(out.len()).unwrap().to_le_bytes());
            out.extend(bytes);
        } else {
            table.extend(bytes);
        }
    }
    let place = u32::try_from(out.len()).unwrap().to_le_bytes();
    out[4..8].copy_from_slice(&place);
    [out, table, vec![0; 4]].concat()
}

/// A lossless JPEG of samples of 16 bits that are all 32768: one bit for each.
pub fn gray_jpeg([width, height]: [u16; 2]) -> Vec<u8> {
    let [[high, low], [wide, narrow]] = [height, width].map(u16::to_be_bytes);
    let mut stream = vec![0xFF, 0xD8, 0xFF, 0xC4, 0, 20, 0, 1];
    stream.extend([0; 16]);
    stream.extend([0xFF, 0xC3, 0, 11, 16, high, low, wide, narrow, 1, 0, 0x11, 0]);
    stream.extend([0xFF, 0xDA, 0, 8, 1, 0, 0, 1, 0, 0]);
    stream.resize(stream.len() + (usize::from(width) * usize::from(height)).div_ceil(8), 0);
    stream.extend([0xFF, 0xD9]);
    stream
}
