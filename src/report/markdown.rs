//! A page of Markdown, piece by piece.

/// Text under construction: a page that numbers its figures and tables, and knows its headings.
///
/// Figures and tables count from 1 in the order of the page, each sort on its own. What they are called elsewhere is a *key*
/// chosen by the section: [`figure_ref`] and [`table_ref`] may stand in any text, before or after the thing they name,
/// and [`finish`](Self::finish) puts the number and the link in their place.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Page {
    text: String,
    /// Level, words and anchor of each heading.
    headings: Vec<(usize, String, String)>,
    /// Keys by number.
    figures: Vec<String>,
    tables: Vec<String>,
    /// Where in the text the table of contents goes.
    contents_at: Option<usize>,
}

/// Around a reference that waits for its number: private-use letters, so no text holds them by chance.
const OPEN: char = '\u{E000}';
const CLOSE: char = '\u{E001}';

/// Stands for `Figure 3` with a link, wherever on the page the figure of this key is.
pub fn figure_ref(key: &str) -> String {
    format!("{OPEN}figure:{key}{CLOSE}")
}

/// Stands for `Table 3` with a link, wherever on the page the table of this key is.
pub fn table_ref(key: &str) -> String {
    format!("{OPEN}table:{key}{CLOSE}")
}

impl Page {
    /// An empty page.
    pub fn new() -> Self {
        Self::default()
    }

    /// The whole text, with its table of contents and all references resolved, and one line end at its end.
    ///
    /// A reference to what is not on the page (a figure of images that are not there) becomes plain words.
    pub fn finish(self) -> String {
        let mut text = self.text.clone();
        if let Some(at) = self.contents_at {
            text.insert_str(at, &self.contents_list());
        }
        format!("{}\n", self.resolved(&text).trim_end())
    }

    /// The table of contents goes here: all headings of levels 2 and 3 of the page, before and after this place.
    pub fn contents(&mut self) {
        self.contents_at = Some(self.text.len());
    }

    fn contents_list(&self) -> String {
        let listed = self.headings.iter().filter(|(level, ..)| (2..=3).contains(level));
        let lines: Vec<String> =
            listed.map(|(level, words, anchor)| format!("{}- [{words}](#{anchor})", "  ".repeat(level - 2))).collect();
        if lines.is_empty() { String::new() } else { format!("**Contents**\n\n{}\n\n", lines.join("\n")) }
    }

    /// `text` with each reference as a link, or as words where its target is not on the page.
    fn resolved(&self, text: &str) -> String {
        let mut pieces = text.split(OPEN);
        let mut out = pieces.next().unwrap_or_default().to_owned();
        for piece in pieces {
            let (reference, rest) = piece.split_once(CLOSE).unwrap_or((piece, ""));
            let (sort, key) = reference.split_once(':').unwrap_or(("figure", reference));
            let (keys, word) = if sort == "table" { (&self.tables, "Table") } else { (&self.figures, "Figure") };
            match keys.iter().position(|known| known == key) {
                Some(at) => out.push_str(&format!("[{word} {}](#{sort}-{})", at + 1, at + 1)),
                None => out.push_str(&format!("a {sort} that is not here")),
            }
            out.push_str(rest);
        }
        out
    }

    /// A heading of level 1 (the page's) to 6.
    pub fn heading(&mut self, level: usize, text: &str) {
        let plain = anchor(text);
        let before = self.headings.iter().filter(|(_, words, _)| anchor(words) == plain).count();
        let anchor = if before == 0 { plain } else { format!("{plain}-{before}") };
        self.headings.push((level, text.to_owned(), anchor));
        self.block(&format!("{} {text}", "#".repeat(level)));
    }

    /// A numbered figure: the image at `path`, below it number and caption, then `also` (a link to another format).
    pub fn figure(&mut self, key: &str, path: &str, caption: &str, also: &str) {
        self.figures.push(key.to_owned());
        let n = self.figures.len();
        // What a reader without the image is told: the caption as plain text, without sentences that link elsewhere.
        let sentences =
            caption.split_inclusive(". ").filter(|sentence| !(sentence.contains(OPEN) || sentence.contains("](")));
        let alt: String = sentences.collect::<String>().chars().filter(|c| !"[]`".contains(*c)).collect();
        let alt = alt.trim_end();
        self.block(&format!("<a id=\"figure-{n}\"></a>![Figure {n}. {alt}]({path})"));
        self.block(&format!("**Figure {n}.** {caption}{also}"));
    }

    /// A numbered table below its caption. Without rows it leaves nothing, and takes no number.
    pub fn captioned_table<S: AsRef<str>>(&mut self, key: &str, caption: &str, head: &[S], rows: &[Vec<String>]) {
        if rows.is_empty() {
            return;
        }
        self.tables.push(key.to_owned());
        let n = self.tables.len();
        self.block(&format!("<a id=\"table-{n}\"></a>**Table {n}.** {caption}"));
        self.table(head, rows);
    }

    /// What `inside` writes, behind a line that opens it: evidence that few readers need. Nothing where it writes nothing.
    pub fn folded(&mut self, title: &str, inside: impl FnOnce(&mut Self)) {
        let before = self.text.len();
        self.block(&format!("<details><summary>{title}</summary>"));
        let opened = self.text.len();
        inside(self);
        if self.text.len() == opened {
            self.text.truncate(before);
        } else {
            self.block("</details>");
        }
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

    /// A table without a number; columns of numbers are set to the right. Without rows it leaves nothing.
    pub fn table<S: AsRef<str>>(&mut self, head: &[S], rows: &[Vec<String>]) {
        if rows.is_empty() {
            return;
        }
        let line = |cells: &[String]| format!("| {} |", cells.join(" | "));
        let cell = |text: &str| text.replace('|', "\\|").replace('\n', " ");
        let mut lines = vec![line(&head.iter().map(|text| cell(text.as_ref())).collect::<Vec<_>>())];
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

/// A link to a heading of the page.
pub fn link_to(heading: &str) -> String {
    format!("[{heading}](#{})", anchor(heading))
}

/// A heading's anchor as common viewers make it: lower case, spaces to hyphens; of other signs than letters and digits only
/// `-` and `_` stay (a raised ² is no digit to them).
pub(super) fn anchor(heading: &str) -> String {
    let kept = |c: &char| c.is_alphabetic() || c.is_ascii_digit() || " -_".contains(*c);
    heading.to_lowercase().chars().filter(kept).map(|c| if c == ' ' { '-' } else { c }).collect()
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
        assert_eq!(link_to("Bias² and variance"), "[Bias² and variance](#bias-and-variance)");
        assert_eq!(link_to("Identical?"), "[Identical?](#identical)");
        assert_eq!(link_to("`a01` (with a lens)"), "[`a01` (with a lens)](#a01-with-a-lens)");
    }

    #[test]
    fn figures_and_tables_are_numbered_in_order_and_named_from_anywhere() {
        let mut page = Page::new();
        page.paragraph(&format!("See {}, {} and {}.", figure_ref("b"), table_ref("t"), figure_ref("gone")));
        page.figure("a", "a.svg", "One.", "");
        page.figure("b", "b.svg", "Two, `x` [1, 2]. As [here](y).", " ([PNG](b.png))");
        page.captioned_table("empty", "Nothing.", &["x"], &[]);
        page.captioned_table("t", "Three.", &["x"], &[vec!["y".to_owned()]]);
        let text = page.finish();
        assert!(
            text.starts_with("See [Figure 2](#figure-2), [Table 1](#table-1) and a figure that is not here.\n\n"),
            "{text}"
        );
        assert!(text.contains("<a id=\"figure-2\"></a>![Figure 2. Two, x 1, 2.](b.svg)\n\n**Figure 2.** Two, `x` [1, 2]. As [here](y). ([PNG](b.png))\n"), "{text}");
        assert!(text.ends_with("<a id=\"table-1\"></a>**Table 1.** Three.\n\n| x |\n| --- |\n| y |\n"), "{text}");
    }

    #[test]
    fn the_table_of_contents_lists_headings_before_and_after_it_and_tells_equal_ones_apart() {
        let mut page = Page::new();
        page.heading(1, "Title");
        page.contents();
        page.heading(2, "A");
        page.heading(3, "Part");
        page.heading(4, "Too deep");
        page.heading(2, "B");
        page.heading(3, "Part");
        let text = page.finish();
        let list = "# Title\n\n**Contents**\n\n- [A](#a)\n  - [Part](#part)\n- [B](#b)\n  - [Part](#part-1)\n\n## A\n";
        assert!(text.starts_with(list), "{text}");
    }

    #[test]
    fn what_is_folded_stands_behind_its_title_and_leaves_nothing_where_it_is_empty() {
        let mut page = Page::new();
        page.folded("Nothing", |_| {});
        page.folded("All rows", |page| page.table(&["x"], &[vec!["y".to_owned()]]));
        let text = page.finish();
        assert_eq!(text, "<details><summary>All rows</summary>\n\n| x |\n| --- |\n| y |\n\n</details>\n");
    }
}
