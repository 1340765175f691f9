//! What YAML may look like before any parser sees it: what would take one very long, or much memory, is refused.

/// A document may be this long.
const MAX_BYTES: usize = 1 << 20;
/// Brackets may nest this deep.
const MAX_BRACKETS: usize = 32;
/// A document may open so many brackets: some in strings and comments may close none that a parser sees, so that depth alone
/// does not tell how deep they nest, and time goes by the square of that.
const MAX_OPENED: usize = 10_000;
/// A line may be indented by this many columns.
const MAX_INDENT: usize = 128;
/// A document may have this many anchors, aliases and tags each: a handful cannot blow up.
const MAX_REFERENCES: usize = 8;

/// What makes brackets nest.
const BRACKETS: [char; 4] = ['[', ']', '{', '}'];
/// What begins an anchor, an alias or a tag.
const REFERENCES: [char; 3] = ['&', '*', '!'];
/// What indents a line besides white space: entries of lists, and keys and values that are marked as such.
const INDENTING: [char; 3] = ['-', '?', ':'];

/// Checks length, encoding and nesting. Strings count too, as only a parser knows where they begin and end; the writer
/// escapes in them what would be too much ([`may_count`]).
///
/// # Errors
///
/// What is wrong, in words that follow the name of the file.
pub fn checked_text(bytes: &[u8]) -> Result<&str, &'static str> {
    let is_utf16 = bytes.starts_with(&[0xFF, 0xFE]) || bytes.starts_with(&[0xFE, 0xFF]);
    if !is_utf16 && bytes.contains(&0) {
        return Err("it is no text but a binary file, such as a frame; a YAML file is wanted here");
    }
    if bytes.len() > MAX_BYTES {
        return Err("it is longer than 1 MiB; no metadata, sensor or matrix is");
    }
    if is_utf16 {
        return Err("it is UTF-16 text; save it as UTF-8");
    }
    let text = std::str::from_utf8(bytes).map_err(|_| "it is not UTF-8 text; save it as UTF-8")?;
    let text = text.strip_prefix('\u{FEFF}').unwrap_or(text);
    let (mut depth, mut opened) = (0_usize, 0_usize);
    for bracket in text.bytes() {
        match bracket {
            b'[' | b'{' => (depth, opened) = (depth + 1, opened + 1),
            b']' | b'}' => depth = depth.saturating_sub(1),
            _ => {}
        }
        if depth > MAX_BRACKETS {
            return Err("its brackets nest too deep");
        }
    }
    if opened > MAX_OPENED {
        return Err("it has more than 10000 brackets; no metadata, sensor or matrix has");
    }
    let indent =
        |line: &str| line.len() - line.trim_start_matches(|c| c == ' ' || c == '\t' || INDENTING.contains(&c)).len();
    if text.lines().any(|line| line.len() > MAX_INDENT && indent(line) > MAX_INDENT) {
        return Err("its lines nest too deep");
    }
    if REFERENCES.iter().any(|mark| references(text, *mark) > MAX_REFERENCES) {
        return Err("it has too many anchors, aliases or tags; write the values out");
    }
    Ok(text)
}

/// How often a mark stands where an anchor, an alias or a tag may begin; where it stands nowhere else too often, how often at all.
fn references(text: &str, mark: char) -> usize {
    // Where there are none, or few, it does not matter where they stand.
    let all = text.bytes().filter(|byte| char::from(*byte) == mark).count();
    if all <= MAX_REFERENCES {
        return all;
    }
    let mut before = '\n';
    let mut count = 0;
    for character in text.chars() {
        let starts = before.is_whitespace() || "[{,:-?".contains(before);
        count += usize::from(character == mark && starts);
        before = character;
    }
    count
}

/// Whether a character may count for the guard, wherever it stands in a string.
pub fn may_count(character: char) -> bool {
    BRACKETS.contains(&character) || REFERENCES.contains(&character)
}

/// Whether a string may count for the guard where it is not quoted.
pub fn may_indent(string: &str) -> bool {
    string.starts_with(INDENTING)
}
