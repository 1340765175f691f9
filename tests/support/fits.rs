//! FITS as the software of cameras writes them.

use super::workshop::Workshop;
use std::fs;

/// Writes a FITS of 16-bit codes of an array RGGB, `of` column and row, with these cards beside, or in place of, those that all have.
pub fn write_fits(shop: &Workshop, name: &str, size: [u32; 2], cards: &[(&str, &str)], of: impl Fn(u32, u32) -> f64) {
    let [width, height] = size.map(|side| side.to_string());
    let always = [
        ("SIMPLE", "T"),
        ("BITPIX", "16"),
        ("NAXIS", "2"),
        ("NAXIS1", &width),
        ("NAXIS2", &height),
        ("BZERO", "32768"),
        ("ROWORDER", "'TOP-DOWN'"),
        ("BAYERPAT", "'RGGB'"),
    ];
    let others = always.iter().filter(|(key, _)| !cards.iter().any(|(own, _)| own == key));
    let cards = others.chain(cards).map(|(key, value)| format!("{:<80}", format!("{key:<8}= {value}")));
    let mut bytes: Vec<u8> = cards.chain([format!("{:<80}", "END")]).collect::<String>().into_bytes();
    bytes.resize(bytes.len().next_multiple_of(2880), b' ');
    for [x, y] in (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| [x, y])) {
        #[expect(clippy::cast_possible_truncation, reason = "codes of 16 bits")]
        let code = of(x, y).round().clamp(0.0, 65_535.0) as i64;
        bytes.extend(i16::try_from(code - 32_768).unwrap().to_be_bytes());
    }
    bytes.resize(bytes.len().next_multiple_of(2880), 0);
    fs::write(shop.path(name), bytes).unwrap();
}

/// A number between -1 and 1 of variance 1/6, of column, row and a seed: the sum of two evenly spread ones.
pub fn chance(x: u32, y: u32, seed: u64) -> f64 {
    let mut state = (u64::from(x) << 32 | u64::from(y)).wrapping_add(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15));
    let mut next = || {
        state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut mixed = state;
        mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        (mixed ^ (mixed >> 31)) as f64 / 2_f64.powi(64)
    };
    next() - next()
}

/// Writes s.yaml, a sensor of 1 ADU per e⁻ over a bias of 500 ADU, of such a dark current at 263 K, and with such `dcnu`, `prnu` and read noise
/// in e⁻.
pub fn write_sensor(shop: &Workshop, size: [u32; 2], dark_current_e_per_s: f64, [dcnu, prnu, read_noise_e]: [f64; 3]) {
    let readout = format!(
        "width: {}, height: {}, cfa: rggb, full_well_e: 60000, dark_current_e_per_s: {dark_current_e_per_s}, temperature_k: 263, \
         dcnu: {dcnu}, prnu: {prnu}, read_noise_e: {read_noise_e}, bits: 16, bias_adu: 500, adu_per_e: 1",
        size[0], size[1]
    );
    fs::write(shop.path("s.yaml"), format!("schema: cyanometer-sensor/2\nname: s\nreadout: {{{readout}}}\n")).unwrap();
}
