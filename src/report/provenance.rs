//! Every artefact says what made it: experiment, seed, version and command.

use crate::experiment::results::About;

/// One line: `experiment assignment-4, seed 4, sampler-lab 0.1.0, by "sampler-lab run …"`.
pub fn line(about: &About) -> String {
    let About { version, command, experiment, .. } = about;
    format!("experiment {}, seed {}, sampler-lab {version}, by \"{command}\"", experiment.name, experiment.seed)
}

/// The SVG with `text` as its `<desc>`.
pub fn stamped_svg(svg: &str, text: &str) -> String {
    let escaped = text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;");
    let end_of_root = svg.find("<svg").and_then(|start| svg[start..].find('>').map(|end| start + end + 1));
    match end_of_root {
        Some(at) => format!("{}\n<desc>{escaped}</desc>{}", &svg[..at], &svg[at..]),
        None => svg.to_owned(),
    }
}

/// The PNG with `text` as an `iTXt` chunk `Description` behind its header (PNG, third edition, §11.3.3.4).
pub fn stamped_png(png: &[u8], text: &str) -> Vec<u8> {
    // Signature (8 bytes), then the header's length, name, 13 bytes and checksum.
    const HEADER_END: usize = 8 + 4 + 4 + 13 + 4;
    if png.len() < HEADER_END {
        return png.to_vec();
    }
    let mut body = b"iTXtDescription\0\0\0\0\0".to_vec();
    body.extend(text.as_bytes());
    let mut stamped = png[..HEADER_END].to_vec();
    stamped.extend(((body.len() - 4) as u32).to_be_bytes());
    stamped.extend(&body);
    stamped.extend(crc32(&body).to_be_bytes());
    stamped.extend(&png[HEADER_END..]);
    stamped
}

/// CRC-32 of PNG (ISO 3309), bit by bit: a stamp is a line of text.
fn crc32(bytes: &[u8]) -> u32 {
    let step = |crc: u32| if crc & 1 == 1 { crc >> 1 ^ 0xedb8_8320 } else { crc >> 1 };
    !bytes.iter().fold(!0, |crc, &byte| (0..8).fold(crc ^ u32::from(byte), |crc, _| step(crc)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The check value of CRC-32/ISO-HDLC.
    #[test]
    fn the_checksum_has_its_published_check_value() {
        assert_eq!(crc32(b"123456789"), 0xcbf4_3926);
    }

    #[test]
    fn a_stamped_png_still_reads_and_a_stamped_svg_says_who_made_it() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.png");
        crate::film::write_png_rgb8(&path, 2, 1, &[1, 2, 3, 4, 5, 6]).unwrap();
        let stamped = stamped_png(&std::fs::read(&path).unwrap(), "made by ü");
        let image = image::load_from_memory(&stamped).unwrap().to_rgb8();
        assert_eq!(image.as_raw(), &[1, 2, 3, 4, 5, 6]);
        let text = "made by ü".as_bytes();
        assert!(stamped.windows(text.len()).any(|window| window == text));
        assert_eq!(stamped_svg("<svg a=\"b\">x</svg>", "a < b"), "<svg a=\"b\">\n<desc>a &lt; b</desc>x</svg>");
    }
}
