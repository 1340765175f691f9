//! Markdown that the reproductions share.

/// A table of Markdown.
pub struct Table {
    /// The Markdown.
    pub text: String,
}

impl Table {
    /// A table under these heads.
    pub fn new(heads: &[&str]) -> Self {
        let rule: String = heads.iter().map(|_| "---|").collect();
        Self { text: format!("| {} |\n|{rule}\n", heads.join(" | ")) }
    }

    /// Adds a row.
    pub fn row(&mut self, cells: &[String]) {
        self.text.push_str(&format!("| {} |\n", cells.join(" | ")));
    }
}

/// A number with a true minus sign.
pub fn number(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    let is_zero = text.trim_start_matches('-').chars().all(|c| c == '0' || c == '.');
    if is_zero { text.trim_start_matches('-').to_owned() } else { text.replace('-', "−") }
}
