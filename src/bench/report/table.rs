//! Table that every format can show.

/// Text cells under a title; the first column names the row.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Table {
    /// Title.
    pub title: String,
    /// Column heads.
    pub columns: Vec<String>,
    /// Rows, with one cell per column.
    pub rows: Vec<Vec<String>>,
}

impl Table {
    /// Plain text for a terminal: columns as wide as their cells, with a minimum width that aligns most tables with each other;
    /// all but the first flush right.
    pub fn text(&self) -> String {
        let lines = || std::iter::once(&self.columns).chain(&self.rows);
        let width = |i: usize| lines().filter_map(|l| l.get(i)).map(|c| c.chars().count()).max().unwrap_or(0);
        let least = |i: usize| if i == 0 { 12 } else { 8 };
        let widths: Vec<usize> = (0..self.columns.len()).map(|i| width(i).max(least(i))).collect();
        let mut out = format!("{}\n", self.title);
        for line in lines() {
            let mut text = String::new();
            for (i, (cell, width)) in line.iter().zip(&widths).enumerate() {
                text += &if i == 0 { format!("{cell:<width$}") } else { format!("  {cell:>width$}") };
            }
            out += text.trim_end();
            out.push('\n');
        }
        out
    }

    /// Markdown table.
    pub fn markdown(&self) -> String {
        let line = |cells: &[String]| format!("| {} |\n", cells.join(" | "));
        let rule = "--:|".repeat(self.columns.len().saturating_sub(1));
        let rows: String = self.rows.iter().map(|row| line(row)).collect();
        format!("### {}\n\n{}|---|{rule}\n{rows}", self.title, line(&self.columns))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table() -> Table {
        let words = |words: &[&str]| words.iter().map(|w| (*w).to_owned()).collect::<Vec<_>>();
        Table {
            title: "Legs".into(),
            columns: words(&["beast", "legs"]),
            rows: vec![words(&["cow", "4"]), words(&["a millipede's", "1 306"])],
        }
    }

    #[test]
    fn columns_of_text_are_flush() {
        let expected = ["Legs", "beast              legs", "cow                   4", "a millipede's     1 306"];
        assert_eq!(table().text().lines().collect::<Vec<_>>(), expected);
    }

    #[test]
    fn markdown_has_a_rule_under_its_heads() {
        let expected = "### Legs\n\n| beast | legs |\n|---|--:|\n| cow | 4 |\n| a millipede's | 1 306 |\n";
        assert_eq!(table().markdown(), expected);
    }
}
