//! Triangles, materials and textures as plain data: what a scene is made of once its files are read.

use glam::{Vec2, Vec3};

/// Triangles with their shading data, one entry a triangle in every list, and the materials they refer to.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Mesh {
    /// Corners, scene units, finite; counter-clockwise seen from the side that the winding normal points to.
    pub positions: Vec<[Vec3; 3]>,
    /// Unit normals at the corners; the winding normal three times where the file gives none.
    pub normals: Vec<[Vec3; 3]>,
    /// Texture coordinates at the corners, finite; zero where the file gives none.
    pub uvs: Vec<[Vec2; 3]>,
    /// Index into `materials`.
    pub material_of: Vec<u32>,
    /// The materials that triangles use, in the order of their first triangle.
    pub materials: Vec<Material>,
    /// The textures that materials use.
    pub textures: Vec<Texture>,
}

impl Mesh {
    /// Number of triangles.
    pub fn len(&self) -> usize {
        self.positions.len()
    }

    /// Makes room for `more` triangles.
    pub fn reserve(&mut self, more: usize) {
        self.positions.reserve_exact(more);
        self.normals.reserve_exact(more);
        self.uvs.reserve_exact(more);
        self.material_of.reserve_exact(more);
    }

    /// Whether there is no triangle.
    pub fn is_empty(&self) -> bool {
        self.positions.is_empty()
    }
}

/// How a surface reflects and emits. Materials of one name in two files are two materials.
#[derive(Debug, Clone, PartialEq)]
pub struct Material {
    /// Its name in the MTL file.
    pub name: String,
    /// Index of the mesh file among `mesh_files`.
    pub file: u32,
    /// The sheet's k_a, 0 or above; a texture multiplies it.
    pub albedo: Vec3,
    /// Index into [`Mesh::textures`].
    pub texture: Option<u32>,
    /// Emitted radiance, the sheet's k_e: albedo × strength, without the texture; zero where it does not emit.
    pub emission: Vec3,
    /// Whether it emits; then `emission` has a component above 0.
    pub is_emitter: bool,
}

/// An image over the unit square, repeated without end.
#[derive(Debug, Clone, PartialEq)]
pub struct Texture {
    /// Columns, at least 1.
    pub width: u32,
    /// Rows, at least 1.
    pub height: u32,
    texels: Texels,
}

/// Linear RGB, row by row, the top row first.
#[derive(Debug, Clone, PartialEq)]
enum Texels {
    /// Eight bits a channel and what each of their values stands for: a quarter of the memory that look-ups wait for.
    Coded { codes: Vec<[u8; 3]>, linear: Box<[f32; 256]> },
    /// The values themselves.
    Linear(Vec<[f32; 3]>),
}

impl Texture {
    /// A texture of `width` columns of linear RGB texels, row by row, the top row first.
    ///
    /// # Panics
    /// Where the texels do not make whole rows, or there is none: that is an error of the program.
    pub fn new(width: u32, texels: Vec<[f32; 3]>) -> Self {
        Self { width, height: rows(width, texels.len()), texels: Texels::Linear(texels) }
    }

    /// The same for texels of eight bits a channel; code c stands for `linear[c]`.
    ///
    /// # Panics
    /// As [`Texture::new`].
    pub fn coded(width: u32, codes: Vec<[u8; 3]>, linear: Box<[f32; 256]>) -> Self {
        Self { width, height: rows(width, codes.len()), texels: Texels::Coded { codes, linear } }
    }

    /// Bytes that its texels take.
    pub fn bytes(&self) -> usize {
        match &self.texels {
            Texels::Coded { codes, linear } => size_of_val(codes.as_slice()) + size_of_val(&**linear),
            Texels::Linear(texels) => size_of_val(texels.as_slice()),
        }
    }

    /// Bilinear look-up: v points up, texel centres lie at half-integers, both axes repeat.
    ///
    /// Finite for every `uv`: a coordinate too large for a fraction, or not finite, reads as 0.
    #[inline]
    pub fn sample(&self, uv: Vec2) -> Vec3 {
        match &self.texels {
            Texels::Coded { codes, linear } => self.blend(uv, |at| codes[at].map(|code| linear[usize::from(code)])),
            Texels::Linear(texels) => self.blend(uv, |at| texels[at]),
        }
    }

    /// Linear RGB of the texel in a column from the left and a row from the top.
    ///
    /// # Panics
    /// Beyond the last column or row.
    pub fn texel(&self, column: u32, row: u32) -> [f32; 3] {
        assert!(
            column < self.width && row < self.height,
            "texel ({column}, {row}) of {} x {}",
            self.width,
            self.height
        );
        let at = self.index(column, row);
        match &self.texels {
            Texels::Coded { codes, linear } => codes[at].map(|code| linear[usize::from(code)]),
            Texels::Linear(texels) => texels[at],
        }
    }

    #[inline(always)]
    fn index(&self, column: u32, row: u32) -> usize {
        row as usize * self.width as usize + column as usize
    }

    #[inline(always)]
    fn blend(&self, uv: Vec2, read: impl Fn(usize) -> [f32; 3]) -> Vec3 {
        let texel = |x, y| Vec3::from_array(read(self.index(x, y)));
        let (x0, x1, fx) = neighbours(fraction(uv.x), self.width);
        let (y0, y1, fy) = neighbours(1.0 - fraction(uv.y), self.height);
        let top = texel(x0, y0) * (1.0 - fx) + texel(x1, y0) * fx;
        let bottom = texel(x0, y1) * (1.0 - fx) + texel(x1, y1) * fx;
        top * (1.0 - fy) + bottom * fy
    }
}

/// How many rows of `width` texels there are.
fn rows(width: u32, texels: usize) -> u32 {
    let whole = width > 0 && texels > 0 && texels.is_multiple_of(width as usize);
    assert!(whole, "{texels} texels do not make whole rows of {width}");
    u32::try_from(texels / width as usize).expect("fewer than 2³² rows")
}

/// t − ⌊t⌋ in [0, 1); where rounding gives 1, or nothing finite, 0.
#[inline(always)]
fn fraction(t: f32) -> f32 {
    let f = t - floor(t);
    if f < 1.0 { f } else { 0.0 }
}

/// ⌊t⌋ without a call: baseline processors have no instruction for it, but one for truncation.
#[inline(always)]
fn floor(t: f32) -> f32 {
    // From 2²³ on every number is an integer; a NaN stays one.
    if t.abs() < 8_388_608.0 {
        let toward_zero = t as i32 as f32;
        if toward_zero > t { toward_zero - 1.0 } else { toward_zero }
    } else {
        t
    }
}

/// The two texels around `t` in [0, 1] among `n` in a ring, and the weight of the second.
#[inline(always)]
fn neighbours(t: f32, n: u32) -> (u32, u32, f32) {
    let x = t * n as f32 - 0.5;
    let below = floor(x);
    // −1 where t lies in the first half texel, n where rounding reaches past the last: both wrap.
    let first = if below < 0.0 {
        n - 1
    } else if below as u32 >= n {
        0
    } else {
        below as u32
    };
    (first, if first + 1 == n { 0 } else { first + 1 }, x - below)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn floors_and_neighbours_are_those_of_the_standard_library() {
        let near = |x: f32| [x, f32::from_bits(x.to_bits() + 1), f32::from_bits(x.to_bits().saturating_sub(1))];
        let sizes = [1e-30, 0.5, 1.0, 1.5, 7.0, 8_388_607.0, 8_388_607.5, 8_388_608.0, 2.147_483_6e9, 1e30, f32::MAX];
        for t in sizes.into_iter().flat_map(near).flat_map(|t| [t, -t]).chain([0.0, f32::INFINITY, f32::NEG_INFINITY]) {
            assert_eq!(floor(t), t.floor(), "{t}");
        }
        assert!(floor(f32::NAN).is_nan());
        for n in [1, 2, 3, 512, 8191, 16_777_215, 16_777_216, 67_108_864] {
            for t in [0.0, 1e-9, 0.25, 0.5, 0.75, 1.0 - f32::EPSILON / 2.0, 1.0] {
                let below = (t * n as f32 - 0.5).floor();
                let first = (below as i64).rem_euclid(i64::from(n)) as u32;
                let second = (below as i64 + 1).rem_euclid(i64::from(n)) as u32;
                assert_eq!(neighbours(t, n), (first, second, t * n as f32 - 0.5 - below), "{t} of {n}");
            }
        }
    }

    /// 3 × 2 texels, red counts columns, green rows from the top.
    fn ramp() -> Texture {
        let texels = (0..6).map(|i| [(i % 3) as f32, (i / 3) as f32, 1.0]).collect();
        Texture::new(3, texels)
    }

    #[test]
    fn texel_centres_return_texels_and_v_points_up() {
        for (column, row) in [(0, 0), (1, 0), (2, 0), (0, 1), (1, 1), (2, 1)] {
            let uv = Vec2::new((column as f32 + 0.5) / 3.0, 1.0 - (row as f32 + 0.5) / 2.0);
            let found = ramp().sample(uv);
            assert!((found - Vec3::new(column as f32, row as f32, 1.0)).length() < 1e-6, "{uv}: {found}");
        }
    }

    #[test]
    fn coded_texels_read_as_the_values_they_stand_for() {
        let linear: Box<[f32; 256]> = Box::new(std::array::from_fn(|c| (c as f32).sqrt()));
        let codes: Vec<[u8; 3]> = (0..12u8).map(|i| [i, 100 + i, 255 - i]).collect();
        let plain = Texture::new(4, codes.iter().map(|t| t.map(|c| linear[usize::from(c)])).collect());
        let coded = Texture::coded(4, codes, linear);
        for i in 0..1000 {
            let uv = Vec2::new(i as f32 * 0.137 - 20.0, 9.0 - i as f32 * 0.071);
            assert_eq!(coded.sample(uv), plain.sample(uv), "{uv}");
        }
        assert_eq!((coded.height, coded.texel(3, 2)), (3, plain.texel(3, 2)));
        assert_eq!((coded.bytes(), plain.bytes()), (12 * 3 + 1024, 12 * 12));
    }

    #[test]
    fn the_image_repeats_and_the_seam_is_blended() {
        assert!((ramp().sample(Vec2::new(0.0, 0.75)).x - 1.0).abs() < 1e-6, "half of column 2 and half of column 0");
        assert!((ramp().sample(Vec2::new(0.5, 0.0)).y - 0.5).abs() < 1e-6, "half of either row");
        for uv in [Vec2::new(0.3, 0.6), Vec2::new(0.9, 0.1)] {
            let shifted = ramp().sample(uv + Vec2::new(-7.0, 5.0));
            assert!((ramp().sample(uv) - shifted).length() < 1e-5);
        }
    }

    #[test]
    fn every_coordinate_gives_a_value_within_the_texels() {
        let wild = [0.0, -0.0, 1.0, -1e-30, 1.0 - f32::EPSILON / 2.0, 1e30, -1e30, f32::MAX, f32::INFINITY, f32::NAN];
        for (u, v) in wild.iter().flat_map(|u| wild.map(|v| (*u, v))) {
            let found = ramp().sample(Vec2::new(u, v));
            let within = found.cmpge(Vec3::ZERO).all() && found.cmple(Vec3::new(2.0, 1.0, 1.0)).all();
            assert!(within, "{u} {v}: {found}");
        }
        let dot = Texture::new(1, vec![[0.25; 3]]);
        assert_eq!(dot.sample(Vec2::new(-3.7, 0.2)), Vec3::splat(0.25));
    }
}
