//! Parts of a frame that see no light, and the part that is the picture: `BIASSEC` and `DATASEC`, or `TRIMSEC`, as IRAF has them and
//! programs of cameras write them.

use super::header::Header;
use crate::frame::Geometry;
use crate::text::visible;

/// What the sections of a header tell of a frame.
#[derive(Debug, Default, PartialEq)]
pub(super) struct Sections {
    /// X, Y, width and height of photosites, or of cycles of the read-out without any, that no light reaches.
    pub masked: Vec<[i64; 4]>,
    /// The part that is the picture, where it is not all, and the keyword that tells it.
    pub picture: Option<(&'static str, [i64; 4])>,
    pub notes: Vec<String>,
}

impl Sections {
    /// Those of a frame of one plane, whose rows are turned over where the file begins with the lowest.
    pub(super) fn of(header: &Header, geometry: &Geometry, is_bottom_up: bool) -> Self {
        let mut found = Self::default();
        if geometry.channels.len() != 1 {
            return found;
        }
        let size = [geometry.width, geometry.height].map(|side| side as i64);
        let mut told = |key: &str| {
            let text = header.text(key).map(str::trim).filter(|text| !text.is_empty())?;
            let area = section(text, size);
            if area.is_none() {
                let [width, height] = size;
                found.notes.push(format!(
                    "its {key} `{}` is passed over: it is no part [X1:X2,Y1:Y2] of the {width}x{height} samples",
                    visible(text)
                ));
            }
            let turned = |[x, y, width, height]: [i64; 4]| [x, size[1] - y - height, width, height];
            area.map(|area| if is_bottom_up { turned(area) } else { area })
        };
        let masked = told("BIASSEC");
        let data = told("DATASEC").map(|area| ("DATASEC", area)).or_else(|| Some(("TRIMSEC", told("TRIMSEC")?)));
        if let Some([x, y, width, height]) = masked {
            found.notes.push(format!("no light reaches {width}x{height} of its samples from {x},{y} (BIASSEC)"));
            found.masked.push([x, y, width, height]);
        }
        found.picture = data.filter(|(_, area)| *area != [0, 0, size[0], size[1]]);
        found
    }
}

/// X, Y, width and height, from 0 on, of a section `[x1:x2,y1:y2]` of columns and rows from 1 on, both ends of which lie in it; none of
/// what is no part of a frame of such a size.
fn section(text: &str, size: [i64; 2]) -> Option<[i64; 4]> {
    let (columns, rows) = text.strip_prefix('[')?.strip_suffix(']')?.split_once(',')?;
    let range = |text: &str, most: i64| -> Option<[i64; 2]> {
        if text.trim() == "*" {
            return Some([0, most]);
        }
        let (from, to) = text.split_once(':')?;
        let [from, to] = [from.trim().parse::<i64>().ok()?, to.trim().parse::<i64>().ok()?];
        let [first, last] = [from.min(to), from.max(to)];
        (first >= 1 && last <= most).then_some([first - 1, last - first + 1])
    };
    let ([x, width], [y, height]) = (range(columns, size[0])?, range(rows, size[1])?);
    Some([x, y, width, height])
}

#[cfg(test)]
mod tests {
    use super::super::header::Value;
    use super::*;

    #[test]
    fn sections_are_parts_of_the_frame() {
        for (text, wanted) in [
            ("[1:4,1:3]", Some([0, 0, 4, 3])),
            ("[ 9:10 , 2:6 ]", Some([8, 1, 2, 5])),
            ("[10:9,6:2]", Some([8, 1, 2, 5])),
            ("[*,1:3]", Some([0, 0, 10, 3])),
            ("[0:4,1:3]", None),
            ("[1:11,1:3]", None),
            ("[1:4]", None),
            ("1:4,1:3", None),
            ("[a:4,1:3]", None),
        ] {
            assert_eq!(section(text, [10, 6]), wanted, "{text}");
        }
    }

    /// Rows count from the first that is stored, which may be the lowest.
    #[test]
    fn what_is_no_picture_is_told_from_the_top_row_on() {
        let geometry = Geometry::new(10, 6, &["Y"]);
        let text = |text: &str| Value::Text(text.into());
        let header = Header::of(&[("BIASSEC", text("[9:10,1:4]")), ("DATASEC", text("[1:8,1:4]"))]);
        let told = |is_bottom_up| Sections::of(&header, &geometry, is_bottom_up);
        assert_eq!((told(false).masked, told(true).masked), (vec![[8, 0, 2, 4]], vec![[8, 2, 2, 4]]));
        assert_eq!(told(true).picture, Some(("DATASEC", [0, 2, 8, 4])));
        let whole = Header::of(&[("TRIMSEC", text("[1:10,1:6]")), ("BIASSEC", text("[11:12,1:6]"))]);
        let found = Sections::of(&whole, &geometry, false);
        assert!(
            found.masked.is_empty()
                && found.picture.is_none()
                && found.notes[0].contains("`[11:12,1:6]` is passed over")
        );
        let none = Sections::of(&header, &Geometry::new(10, 6, &["R", "G", "B"]), false);
        assert_eq!(none, Sections::default());
    }
}
