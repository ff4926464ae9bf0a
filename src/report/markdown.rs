//! A page of Markdown, piece by piece.

/// Text under construction.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Page {
    text: String,
}

impl Page {
    /// An empty page.
    pub fn new() -> Self {
        Self::default()
    }

    /// The whole text, with one line end at its end.
    pub fn finish(self) -> String {
        format!("{}\n", self.text.trim_end())
    }

    /// A heading of level 1 (the page's) to 6.
    pub fn heading(&mut self, level: usize, text: &str) {
        self.block(&format!("{} {text}", "#".repeat(level)));
    }

    /// A paragraph; an empty one leaves nothing.
    pub fn paragraph(&mut self, text: &str) {
        if !text.is_empty() {
            self.block(text);
        }
    }

    /// Sentences joined to one paragraph.
    pub fn sentences<S: AsRef<str>>(&mut self, sentences: &[S]) {
        let sentences: Vec<&str> = sentences.iter().map(S::as_ref).filter(|s| !s.is_empty()).collect();
        self.paragraph(&sentences.join(" "));
    }

    /// A list; an empty one leaves nothing.
    pub fn bullets<S: AsRef<str>>(&mut self, items: &[S]) {
        let lines: Vec<String> = items.iter().map(|item| format!("- {}", item.as_ref())).collect();
        self.paragraph(&lines.join("\n"));
    }

    /// A numbered list; an empty one leaves nothing.
    pub fn numbered<S: AsRef<str>>(&mut self, items: &[S]) {
        let lines: Vec<String> =
            items.iter().enumerate().map(|(i, item)| format!("{}. {}", i + 1, item.as_ref())).collect();
        self.paragraph(&lines.join("\n"));
    }

    /// A table; columns of numbers are set to the right. Without rows it leaves nothing.
    pub fn table(&mut self, head: &[&str], rows: &[Vec<String>]) {
        if rows.is_empty() {
            return;
        }
        let line = |cells: &[String]| format!("| {} |", cells.join(" | "));
        let cell = |text: &str| text.replace('|', "\\|").replace('\n', " ");
        let mut lines = vec![line(&head.iter().map(|text| cell(text)).collect::<Vec<_>>())];
        let is_number = |text: &String| text.starts_with(|c: char| c.is_ascii_digit() || "−+–<".contains(c));
        let numbers = |i: usize| 2 * rows.iter().filter_map(|row| row.get(i)).filter(|text| is_number(text)).count();
        let rule = (0..head.len()).map(|i| if numbers(i) > rows.len() { "---:" } else { "---" }.to_owned());
        lines.push(line(&rule.collect::<Vec<_>>()));
        lines.extend(rows.iter().map(|row| line(&row.iter().map(|text| cell(text)).collect::<Vec<_>>())));
        self.block(&lines.join("\n"));
    }

    /// Text shown as it is, letter by letter.
    pub fn code(&mut self, text: &str) {
        self.block(&format!("```sh\n{text}\n```"));
    }

    fn block(&mut self, text: &str) {
        self.text.push_str(text);
        self.text.push_str("\n\n");
    }
}

/// A link to a heading of the page: lower case, spaces to hyphens, other signs dropped, as viewers make anchors.
pub fn link_to(heading: &str) -> String {
    let kept = heading.to_lowercase();
    let anchor: String = kept
        .chars()
        .filter(|c| c.is_alphanumeric() || " -".contains(*c))
        .map(|c| if c == ' ' { '-' } else { c })
        .collect();
    format!("[{heading}](#{anchor})")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_page_has_blank_lines_between_its_pieces_and_one_end() {
        let mut page = Page::new();
        page.heading(1, "A");
        page.paragraph("");
        page.table(&["x", "y"], &[vec!["a|b".to_owned(), "1".to_owned()]]);
        page.bullets::<&str>(&[]);
        page.sentences(&["One.", "", "Two."]);
        assert_eq!(page.finish(), "# A\n\n| x | y |\n| --- | ---: |\n| a\\|b | 1 |\n\nOne. Two.\n");
    }

    #[test]
    fn links_follow_the_anchors_of_common_viewers() {
        assert_eq!(link_to("Bias² and variance"), "[Bias² and variance](#bias²-and-variance)");
        assert_eq!(link_to("Identical?"), "[Identical?](#identical)");
    }
}
