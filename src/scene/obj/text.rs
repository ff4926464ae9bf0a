//! Lines and words of OBJ and MTL files.

use std::borrow::Cow;

/// The lines of a text with their numbers. A backslash at the end of a line of numbers joins the next one to it.
pub(super) struct Lines<'a> {
    left: &'a [u8],
    /// Number of the last line read.
    pub line: usize,
}

impl<'a> Lines<'a> {
    /// The lines of a whole file, from 1.
    pub fn new(bytes: &'a [u8]) -> Self {
        Self::after(0, without_mark(bytes))
    }

    /// The lines of a text that follows `line` others.
    pub fn after(line: usize, text: &'a [u8]) -> Self {
        Self { left: text, line }
    }

    fn physical(&mut self) -> Option<&'a [u8]> {
        if self.left.is_empty() {
            return None;
        }
        self.line += 1;
        let end = line_end(self.left);
        let line = &self.left[..end];
        self.left = self.left.get(end + 1..).unwrap_or(&[]);
        Some(line.strip_suffix(b"\r").unwrap_or(line))
    }
}

impl<'a> Iterator for Lines<'a> {
    type Item = (usize, Cow<'a, [u8]>);

    #[inline]
    fn next(&mut self) -> Option<Self::Item> {
        let first = self.physical()?;
        let line = self.line;
        // In names and comments a backslash is a backslash (a Windows path, a drawing).
        if first.last() != Some(&b'\\') || !matches!(split_keyword(first).0, b"v" | b"vt" | b"vn" | b"f" | b"l" | b"p")
        {
            return Some((line, Cow::Borrowed(first)));
        }
        let mut joined = first.to_vec();
        while joined.last() == Some(&b'\\') {
            joined.pop();
            joined.push(b' ');
            joined.extend_from_slice(self.physical().unwrap_or(&[]));
        }
        Some((line, Cow::Owned(joined)))
    }
}

/// A file's text without the byte-order mark that some editors put before it.
pub(super) fn without_mark(bytes: &[u8]) -> &[u8] {
    bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes)
}

/// Where the first line ends: at its line feed, or with the text.
#[inline]
pub(super) fn line_end(text: &[u8]) -> usize {
    const ONES: u64 = u64::MAX / 255;
    let (words, _) = text.as_chunks::<8>();
    for (i, word) in words.iter().enumerate() {
        // A byte that is the line feed is 0 after ⊕, and borrows from its top bit in the difference.
        let x = u64::from_le_bytes(*word) ^ (ONES * b'\n' as u64);
        let found = x.wrapping_sub(ONES) & !x & (ONES << 7);
        if found != 0 {
            return 8 * i + found.trailing_zeros() as usize / 8;
        }
    }
    let start = 8 * words.len();
    text[start..].iter().position(|&b| b == b'\n').map_or(text.len(), |at| start + at)
}

/// Cuts a text into pieces of whole lines, joined ones together, each of at least `bytes` but the last.
pub(super) fn pieces(text: &[u8], bytes: usize) -> Vec<&[u8]> {
    let mut pieces = Vec::with_capacity(text.len() / bytes + 1);
    let mut left = text;
    while !left.is_empty() {
        let mut end = bytes.min(left.len());
        // A line that ends in a backslash may belong to the next.
        while end < left.len() && (left[end - 1] != b'\n' || joins(&left[..end - 1])) {
            end += line_end(&left[end..]) + 1;
        }
        let (piece, rest) = left.split_at(end.min(left.len()));
        pieces.push(piece);
        left = rest;
    }
    pieces
}

/// Whether a line's end asks for the next line.
fn joins(line: &[u8]) -> bool {
    line.strip_suffix(b"\r").unwrap_or(line).last() == Some(&b'\\')
}

/// The first word of a line, and what follows it.
#[inline]
pub(super) fn split_keyword(line: &[u8]) -> (&[u8], &[u8]) {
    let line = line.trim_ascii_start();
    let end = line.iter().position(u8::is_ascii_whitespace).unwrap_or(line.len());
    line.split_at(end)
}

pub(super) fn words(text: &[u8]) -> Words<'_> {
    Words { left: text }
}

/// The words of a text between ASCII white space.
pub(super) struct Words<'a> {
    left: &'a [u8],
}

impl<'a> Iterator for Words<'a> {
    type Item = &'a [u8];

    fn next(&mut self) -> Option<&'a [u8]> {
        let start = self.left.iter().position(|b| !b.is_ascii_whitespace())?;
        let left = &self.left[start..];
        let end = left.iter().position(u8::is_ascii_whitespace).unwrap_or(left.len());
        let (word, left) = left.split_at(end);
        self.left = left;
        Some(word)
    }
}

/// The text up to a `#`, which starts a comment among numbers (in names it is a letter).
pub(super) fn without_comment(text: &[u8]) -> &[u8] {
    text.iter().position(|&b| b == b'#').map_or(text, |end| text[..end].trim_ascii_end())
}

/// At most 40 characters of what was found.
pub(super) fn shorten(text: &str) -> Cow<'_, str> {
    match text.char_indices().nth(40) {
        Some((end, _)) => Cow::Owned(format!("{}…", &text[..end])),
        None => Cow::Borrowed(text),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_counted_as_an_editor_counts_them() {
        let text = b"\xef\xbb\xbfv 1 \\\r\n2 \\\n3\n# a \\\nusemtl b\\\n\nf";
        let found: Vec<(usize, String)> =
            Lines::new(text).map(|(n, line)| (n, String::from_utf8(line.into_owned()).unwrap())).collect();
        let expected = [(1, "v 1  2  3"), (4, "# a \\"), (5, "usemtl b\\"), (6, ""), (7, "f")];
        assert_eq!(found, expected.map(|(n, line)| (n, line.to_owned())));
        assert_eq!(Lines::new(b"f 1 2 \\").count(), 1);
    }

    #[test]
    fn pieces_hold_the_lines_of_the_whole() {
        let text = b"v 1 \\\r\n2 \\\n3\n# a \\\nusemtl bbbbbbbbbbbbbbbbbbbbbbbbbbbbbb\\\n\nf 1 \\\n2 3\n\n\nv";
        let whole: Vec<_> = Lines::after(0, text).collect();
        for bytes in 1..text.len() + 2 {
            let mut found = Vec::new();
            let mut line = 0;
            for piece in pieces(text, bytes) {
                let mut lines = Lines::after(line, piece);
                found.extend(lines.by_ref());
                line = lines.line;
            }
            assert_eq!(found, whole, "pieces of {bytes}");
        }
    }

    #[test]
    fn a_line_ends_at_its_first_line_feed() {
        for length in 0..40 {
            for at in 0..length {
                let mut text = vec![b'\x8a'; length];
                assert_eq!(line_end(&text), length);
                text[at] = b'\n';
                text[length - 1] = b'\n';
                assert_eq!(line_end(&text), at);
            }
        }
    }
}
