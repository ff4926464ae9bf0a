//! The report's Markdown as the body of a page: the same text, its figures inside.
//!
//! Names of scenes and samplers come from files of other people. Of HTML in the text only what [`super::super::markdown`] writes is
//! taken as such; anything else is shown as text.

use std::collections::HashMap;

use pulldown_cmark::{Event, HeadingLevel, Options, Parser, Tag, TagEnd, html::push_html};

use super::super::markdown::anchor;

/// `text` inside an element or a quoted attribute.
pub fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&#39;"),
            c => out.push(c),
        }
    }
    out
}

/// The body of the page and its title, the first heading.
///
/// `image` gives what stands for the file at a path (a data URI), `None` where it is not there. `below` gives HTML that follows
/// the heading of this text.
pub fn body(
    markdown: &str,
    image: impl Fn(&str) -> Option<String>,
    below: impl Fn(&str) -> Option<String>,
) -> (String, String) {
    // A link to the bitmap beside a drawing leads out of the page.
    let markdown = without_file_links(markdown);
    let mut writer = Writer::new(&image, &below);
    for event in Parser::new_ext(&markdown, Options::ENABLE_TABLES) {
        writer.take(event);
    }
    let mut html = String::with_capacity(2 * markdown.len());
    push_html(&mut html, writer.events.into_iter());
    (html, writer.title.unwrap_or_default())
}

/// The text without ` ([PNG](figures/…))`.
fn without_file_links(markdown: &str) -> String {
    let mut pieces = markdown.split(" ([PNG](figures/");
    let mut out = pieces.next().unwrap_or_default().to_owned();
    for piece in pieces {
        out.push_str(piece.split_once("))").map_or(piece, |(_, rest)| rest));
    }
    out
}

/// Rewrites the parser's events.
struct Writer<'a> {
    image: &'a dyn Fn(&str) -> Option<String>,
    below: &'a dyn Fn(&str) -> Option<String>,
    events: Vec<Event<'a>>,
    title: Option<String>,
    /// How often each anchor was used.
    anchors: HashMap<String, usize>,
    /// The heading under way: its events and its text.
    heading: Option<(HeadingLevel, Vec<Event<'a>>, String)>,
    /// The image under way: what stands for it, and its words.
    picture: Option<(String, String)>,
    /// Links that stay, innermost last.
    links: Vec<bool>,
    /// Whether the next list is the table of contents, or how deep it is open.
    contents: Option<usize>,
    /// The last anchor of a table, its name.
    table: Option<String>,
}

impl<'a> Writer<'a> {
    fn new(image: &'a dyn Fn(&str) -> Option<String>, below: &'a dyn Fn(&str) -> Option<String>) -> Self {
        Self {
            image,
            below,
            events: Vec::new(),
            title: None,
            anchors: HashMap::new(),
            heading: None,
            picture: None,
            links: Vec::new(),
            contents: None,
            table: None,
        }
    }

    /// HTML of our own.
    fn raw(&mut self, html: String) {
        self.push(Event::Html(html.into()));
    }

    fn push(&mut self, event: Event<'a>) {
        match &mut self.heading {
            Some((_, events, _)) => events.push(event),
            None => self.events.push(event),
        }
    }

    fn take(&mut self, event: Event<'a>) {
        if self.picture.is_some() {
            return self.take_of_picture(event);
        }
        match event {
            Event::Start(Tag::Heading { level, .. }) => self.heading = Some((level, Vec::new(), String::new())),
            Event::End(TagEnd::Heading(_)) => self.end_heading(),
            Event::Start(Tag::Image { dest_url, .. }) => self.picture = Some((dest_url.into_string(), String::new())),
            Event::Start(Tag::Link { ref dest_url, .. }) => {
                let stays = dest_url.starts_with('#');
                self.links.push(stays);
                if stays {
                    self.push(event);
                }
            }
            Event::End(TagEnd::Link) => {
                if self.links.pop().unwrap_or(false) {
                    self.push(event);
                }
            }
            Event::Start(Tag::Table(_)) => {
                let name = self.table.take().unwrap_or_else(|| "Table".to_owned());
                self.raw(format!("<div class=\"scroll\" role=\"region\" aria-label=\"{name}\">\n"));
                self.push(event);
            }
            Event::End(TagEnd::Table) => {
                self.push(event);
                self.raw("</div>\n".to_owned());
            }
            Event::Html(html) | Event::InlineHtml(html) => self.take_html(&html),
            Event::Text(ref text) => {
                if let Some((_, _, words)) = &mut self.heading {
                    words.push_str(text);
                }
                self.push(event);
            }
            Event::Code(ref text) => {
                if let Some((_, _, words)) = &mut self.heading {
                    words.push_str(text);
                }
                self.push(event);
            }
            event => self.take_list(event),
        }
    }

    /// The table of contents is the list behind the paragraph that says so: a landmark to find it by.
    fn take_list(&mut self, event: Event<'a>) {
        match event {
            Event::Start(Tag::List(_)) => {
                if let Some(depth) = &mut self.contents {
                    *depth += 1;
                }
                self.push(event);
            }
            Event::End(TagEnd::List(_)) => {
                self.push(event);
                if let Some(depth) = self.contents {
                    self.contents = (depth > 1).then(|| depth - 1);
                    if depth == 1 {
                        self.raw("</nav>\n".to_owned());
                    }
                }
            }
            Event::End(TagEnd::Paragraph) if self.is_contents_word() => {
                self.events.truncate(self.events.len() - 4);
                self.raw("<nav id=\"contents\" aria-labelledby=\"contents-title\">\n<p id=\"contents-title\"><strong>Contents</strong></p>\n".to_owned());
                self.contents = Some(0);
            }
            event => self.push(event),
        }
    }

    /// Whether the events end in a paragraph of the one bold word `Contents`, not yet closed.
    fn is_contents_word(&self) -> bool {
        matches!(
            self.events.as_slice(),
            [.., Event::Start(Tag::Paragraph), Event::Start(Tag::Strong), Event::Text(word), Event::End(TagEnd::Strong)]
                if &**word == "Contents"
        )
    }

    fn end_heading(&mut self) {
        let Some((level, events, words)) = self.heading.take() else { return };
        let plain = anchor(&words);
        let count = self.anchors.entry(plain.clone()).or_insert(0);
        let id = if *count == 0 { plain } else { format!("{plain}-{count}") };
        *count += 1;
        self.raw(format!("<{level} id=\"{}\" tabindex=\"-1\">", escaped(&id)));
        self.events.extend(events);
        self.raw(format!("</{level}>\n"));
        self.title.get_or_insert_with(|| words.clone());
        if let Some(html) = (self.below)(&words) {
            self.raw(html);
        }
    }

    fn take_of_picture(&mut self, event: Event<'a>) {
        let Some((path, words)) = &mut self.picture else { return };
        match event {
            Event::Text(text) | Event::Code(text) | Event::InlineHtml(text) => words.push_str(&text),
            Event::SoftBreak | Event::HardBreak => words.push(' '),
            Event::End(TagEnd::Image) => {
                let (is_chart, words) = (path.ends_with(".svg"), escaped(words));
                let html = match (self.image)(path) {
                    // A chart keeps its letters readable in a narrow window, and is scrolled there.
                    Some(source) if is_chart => {
                        let name = words.split_once('.').map_or("Figure", |(name, _)| name);
                        format!(
                            "<span class=\"scroll\" role=\"region\" aria-label=\"{name}\"><img class=\"chart\" alt=\"{words}\" src=\"{source}\"></span>"
                        )
                    }
                    Some(source) => format!("<img class=\"raster\" alt=\"{words}\" src=\"{source}\">"),
                    None => format!("<em>Not here: {}</em>", escaped(path)),
                };
                self.picture = None;
                self.push(Event::InlineHtml(html.into()));
            }
            _ => {}
        }
    }

    /// What [`super::super::markdown::Page`] writes as HTML stays; all else is text.
    fn take_html(&mut self, html: &str) {
        let line = html.trim_end();
        if let Some(title) = line.strip_prefix("<details><summary>").and_then(|rest| rest.strip_suffix("</summary>")) {
            return self.raw(format!("<details><summary>{}</summary>\n", escaped(title)));
        }
        if matches!(line, "</details>" | "</a>") {
            return self.push(Event::InlineHtml(html.to_owned().into()));
        }
        if let Some(id) = line.strip_prefix("<a id=\"").and_then(|rest| rest.strip_suffix("\">")) {
            let (sort, number) = id.split_once('-').unwrap_or_default();
            if matches!(sort, "figure" | "table") && number.parse::<u32>().is_ok() {
                if sort == "table" {
                    self.table = Some(format!("Table {number}"));
                }
                return self.push(Event::InlineHtml(html.to_owned().into()));
            }
        }
        self.push(Event::Text(html.to_owned().into()));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn html(markdown: &str) -> String {
        let image = |path: &str| (path == "figures/a.svg").then(|| "data:image/svg+xml;base64,AA".to_owned());
        body(markdown, image, |heading| (heading == "B").then(|| "<section>viewer</section>\n".to_owned())).0
    }

    #[test]
    fn headings_have_the_anchors_that_the_text_links_to_and_their_insertions() {
        let page = html("# Bias² and `a01`\n\n## B\n\n## B\n\n[see](#b-1)\n");
        assert!(page.contains("<h1 id=\"bias-and-a01\" tabindex=\"-1\">Bias² and <code>a01</code></h1>"), "{page}");
        assert!(
            page.contains("<h2 id=\"b\" tabindex=\"-1\">B</h2>\n<section>viewer</section>\n<h2 id=\"b-1\""),
            "{page}"
        );
        assert!(page.contains("<a href=\"#b-1\">see</a>"), "{page}");
    }

    #[test]
    fn figures_are_inside_and_links_out_of_the_page_are_words() {
        let page = html(
            "<a id=\"figure-1\"></a>![Figure 1. A \"b\" <c>.](figures/a.svg)\n\n**Figure 1.** A. ([PNG](figures/a.png))\n\n\
             [out](https://example.org) [script](javascript:alert) ![gone](figures/gone.png)\n",
        );
        assert!(page.contains("<a id=\"figure-1\"></a><span class=\"scroll\" role=\"region\" aria-label=\"Figure 1\"><img class=\"chart\" alt=\"Figure 1. A &quot;b&quot; &lt;c&gt;.\" src=\"data:image/svg+xml;base64,AA\"></span>"), "{page}");
        assert!(page.contains("<strong>Figure 1.</strong> A.</p>"), "{page}");
        assert!(page.contains("out script <em>Not here: figures/gone.png</em>"), "{page}");
        assert!(!page.contains("href") && !page.contains("example.org") && !page.contains("javascript"), "{page}");
    }

    #[test]
    fn tables_scroll_under_their_name_and_what_is_folded_stays_folded() {
        let page = html(
            "<details><summary>All <b> rows</summary>\n\n<a id=\"table-7\"></a>**Table 7.** Rows.\n\n| x | y |\n| --- | ---: |\n| a | 1 |\n\n</details>\n",
        );
        assert!(page.contains("<details><summary>All &lt;b&gt; rows</summary>"), "{page}");
        assert!(page.contains("<div class=\"scroll\" role=\"region\" aria-label=\"Table 7\">\n<table>"), "{page}");
        assert!(page.contains("</table>\n</div>\n") && page.trim_end().ends_with("</details>"), "{page}");
    }

    #[test]
    fn html_of_names_is_shown_and_never_taken() {
        for hostile in [
            "<script>alert(1)</script>",
            "<img src=x onerror=alert(1)>",
            "a <b onclick=\"x\"> c",
            "<a id=\"figure-1\" onclick=\"x\">",
            "<a id=\"other-1\">",
            "<details open ontoggle=alert(1)><summary>x</summary>",
            "<details><summary><img src=x onerror=alert(1)></summary>",
            "`</code><script>x</script>`",
            "![x\" onerror=\"y](figures/a.svg)",
            "![x](figures/\"onerror=y)",
            "## <script>x</script>",
        ] {
            let page = html(&format!("{hostile}\n"));
            for bad in
                ["<script", "<img src", "<b ", "<a id=\"figure-1\" ", "<a id=\"other", "<details open", "onerror=\"y"]
            {
                assert!(!page.contains(bad), "{hostile}: {page}");
            }
        }
    }

    #[test]
    fn the_table_of_contents_is_a_landmark() {
        let page = html("**Contents**\n\n- [A](#a)\n  - [B](#b)\n- [C](#c)\n\n## A\n\n- a list\n");
        assert!(page.starts_with("<nav id=\"contents\" aria-labelledby=\"contents-title\">"), "{page}");
        assert_eq!(page.matches("</nav>").count(), 1);
        assert!(page.find("</nav>").unwrap() < page.find("<h2").unwrap(), "{page}");
    }
}
