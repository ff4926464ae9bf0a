//! MTL files: short, and read in full.

use super::numbers::number;
use super::text::{Lines, shorten, split_keyword, without_comment, words};
use crate::error::{Error, Result};

/// A material as its MTL file gives it.
#[derive(Debug, Clone, PartialEq)]
pub struct MtlMaterial {
    /// Its name.
    pub name: String,
    /// `FILE:LINE` of its `newmtl`.
    pub place: String,
    /// Diffuse colour, components 0 or above.
    pub kd: Option<[f32; 3]>,
    /// Specular colour, components 0 or above.
    pub ks: Option<[f32; 3]>,
    /// Emission, components 0 or above.
    pub ke: Option<[f32; 3]>,
    /// `FILE:LINE` and file name of the diffuse texture.
    pub map_kd: Option<(String, String)>,
    /// The illumination model; 3 and above reflect or refract.
    pub illum: Option<u32>,
}

/// Reads an MTL file, called `file` in errors: names, Kd, Ks, Ke, map_Kd and illum. Also what else it holds that would show.
///
/// # Errors
/// Kind `Input` with file and line: a statement before `newmtl`, no name, a colour that is negative, not finite or not
/// of 1 or 3 numbers, a texture with options or without a name.
pub fn read_mtl(bytes: &[u8], file: &str) -> Result<(Vec<MtlMaterial>, Vec<String>)> {
    let mut materials: Vec<MtlMaterial> = Vec::new();
    let mut ignored: Vec<String> = Vec::new();
    for (line, text) in Lines::new(bytes) {
        let place = format!("{file}:{line}");
        let (keyword, rest) = split_keyword(&text);
        if keyword.is_empty() || keyword[0] == b'#' {
            continue;
        }
        let (Ok(keyword), Ok(rest)) = (std::str::from_utf8(keyword), std::str::from_utf8(rest)) else {
            return Err(Error::input(place, "expected text in UTF-8, found other bytes"));
        };
        let rest = rest.trim();
        if keyword == "newmtl" {
            materials.push(new_material(rest, &place)?);
            continue;
        }
        let Some(material) = materials.last_mut() else {
            return Err(Error::input(place, format!("expected newmtl first, found {:?}", shorten(keyword))));
        };
        match keyword {
            "Kd" => material.kd = Some(colour(rest, &place)?),
            "Ks" => material.ks = Some(colour(rest, &place)?),
            "Ke" => material.ke = Some(colour(rest, &place)?),
            "map_Kd" => material.map_kd = Some((place.clone(), texture_name(rest, &place)?)),
            "illum" => material.illum = rest.parse().ok(),
            _ if shows(keyword) && !ignored.iter().any(|k| k == keyword) => ignored.push(keyword.to_owned()),
            // Ka, Ns, Ni, d, Tr and the extensions: nothing in the sheet's equations reads them.
            _ => {}
        }
    }
    let warnings = match ignored.is_empty() {
        true => Vec::new(),
        false => vec![format!("{file}: not modelled and left out: {}", ignored.join(", "))],
    };
    Ok((materials, warnings))
}

/// Whether an MTL statement that is not read would change the picture, were it modelled.
fn shows(keyword: &str) -> bool {
    keyword.starts_with("map_") || matches!(keyword, "bump" | "disp" | "decal" | "refl" | "norm")
}

fn new_material(name: &str, place: &str) -> Result<MtlMaterial> {
    if name.is_empty() {
        return Err(Error::input(place, "expected newmtl with a name, found nothing"));
    }
    let place = place.to_owned();
    Ok(MtlMaterial { name: name.to_owned(), place, kd: None, ks: None, ke: None, map_kd: None, illum: None })
}

/// A colour of three numbers, or of one that stands for all three, as the format allows.
fn colour(rest: &str, place: &str) -> Result<[f32; 3]> {
    let found: Vec<Option<f32>> =
        words(without_comment(rest.as_bytes())).map(|w| number(w).filter(|x| x.is_finite() && *x >= 0.0)).collect();
    match found.as_slice() {
        [Some(r), Some(g), Some(b)] => Ok([*r, *g, *b]),
        [Some(grey)] => Ok([*grey; 3]),
        _ => Err(Error::input(
            place,
            format!("expected a colour of 3 finite numbers, 0 or above, found {:?}", shorten(rest)),
        )),
    }
}

fn texture_name(rest: &str, place: &str) -> Result<String> {
    match rest {
        "" => Err(Error::input(place, "expected map_Kd with a file name, found nothing")),
        _ if rest.starts_with('-') => {
            let what = "expected map_Kd with a file name alone (its options are not modelled; apply them to the texture coordinates)";
            Err(Error::input(place, format!("{what}, found {:?}", shorten(rest))))
        }
        name => Ok(name.to_owned()),
    }
}
