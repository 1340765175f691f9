//! What reports of measured cameras tell of single photosites, and of what patterns look like.

use super::in_digits;
use crate::analysis::photon_transfer::{ClassFindings, NAMED, OUTSTANDING, PatternFigure, PatternView};
use crate::text::counted;
use serde_json::{Map, Value, json};

/// Photosites that stand out, under light and in the dark, that hold one value, and that are clipped, each kind with how many there are and
/// how many are listed.
pub(super) fn defects_of(class: &ClassFindings, views: &[Option<PatternView>; 2]) -> Value {
    let stuck = &class.stuck[..class.stuck.len().min(NAMED)];
    let clipped: Vec<Value> = class.early.iter().take(NAMED).map(|[x, y]| json!({"x": x, "y": y})).collect();
    let [light, dark] = views.each_ref().map(|view| view.as_ref().map(standing_out));
    json!({
        "light": light,
        "dark": dark,
        "stuck": {"count": class.stuck.len(), "listed": stuck.len(), "sites": stuck},
        "clipped": {"count": class.early.len(), "listed": clipped.len(), "sites": clipped},
    })
}

/// Photosites that stand out from those around them.
fn standing_out(view: &PatternView) -> Value {
    let [count, expected] = view.outstanding;
    json!({
        "beyond_std": OUTSTANDING,
        "std": view.spread,
        "count": count,
        "expected": expected,
        "listed": view.outliers.len(),
        "worst": view.outliers,
    })
}

/// What the patterns under light and in the dark look like, where a figure is asked for: shares of the signal, and samples.
pub(super) fn patterns_of(views: &[Option<PatternView>; 2]) -> Option<Value> {
    let drawn = |view: &Option<PatternView>| Some(pattern(view.as_ref()?, view.as_ref()?.figure.as_ref()?));
    let named = ["light", "dark"].into_iter().zip(views);
    let all: Map<String, Value> = named.filter_map(|(name, view)| Some((name.into(), drawn(view)?))).collect();
    (!all.is_empty()).then(|| all.into())
}

/// Pairs of what each panel has across and up.
fn pattern(view: &PatternView, figure: &PatternFigure) -> Value {
    let [columns, rows] = &view.profiles;
    let [horizontal, vertical] = &figure.spectra;
    json!({
        "spectrograms": {"horizontal": horizontal, "vertical": vertical},
        "profiles": {"columns": columns, "rows": rows},
        "histogram": figure.histogram,
        "accumulated": figure.accumulated,
    })
}

/// How many photosites stand out, in words.
pub(super) fn outstanding(view: &PatternView, place: &str) -> String {
    let [count, expected] = view.outstanding;
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a number of photosites")]
    let count = count as u64;
    format!(
        "{} {} out {place} by more than {OUTSTANDING} standard deviations of most; of a normal law {} would",
        counted(count, "photosites"),
        if count == 1 { "stands" } else { "stand" },
        in_digits(expected, 2)
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One photosite stands out, and two do; what a figure shows is told where there is one.
    #[test]
    fn photosites_are_counted_in_words_and_patterns_listed() {
        let figure = PatternFigure {
            spectra: [vec![[0.0, 1.0], [0.5, 2.0]], vec![[0.0, 3.0]]],
            histogram: vec![[0.25, 4.0]],
            normal: vec![],
            accumulated: vec![[0.5, 1.0]],
            normal_accumulated: vec![],
        };
        let view = |count: f64, figure: Option<PatternFigure>| PatternView {
            profiles: [vec![[2.0, 0.5]], vec![[2.0, 0.75]]],
            figure,
            spread: 1.0,
            outstanding: [count, 0.004],
            outliers: vec![],
            lines: [[0.0; 2]; 2],
            rest: [0.0; 2],
        };
        assert!(outstanding(&view(1.0, None), "in the dark").starts_with("1 photosite stands out in the dark by"));
        assert!(outstanding(&view(2.0, None), "under light").starts_with("2 photosites stand out under light by"));
        assert_eq!(patterns_of(&[Some(view(1.0, None)), None]), None);
        let told = patterns_of(&[None, Some(view(1.0, Some(figure)))]);
        let wanted = json!({"dark": {
            "spectrograms": {"horizontal": [[0.0, 1.0], [0.5, 2.0]], "vertical": [[0.0, 3.0]]},
            "profiles": {"columns": [[2.0, 0.5]], "rows": [[2.0, 0.75]]},
            "histogram": [[0.25, 4.0]],
            "accumulated": [[0.5, 1.0]],
        }});
        assert_eq!(told, Some(wanted));
    }
}
