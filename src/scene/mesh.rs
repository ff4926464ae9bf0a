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
    /// Linear RGB (sRGB decoded), row by row, the top row first.
    pub texels: Vec<[f32; 3]>,
}

impl Texture {
    /// Bilinear look-up: v points up, texel centres lie at half-integers, both axes repeat.
    ///
    /// Finite for every `uv`: a coordinate too large for a fraction, or not finite, reads as 0.
    pub fn sample(&self, uv: Vec2) -> Vec3 {
        let (x0, x1, fx) = neighbours(fraction(uv.x), self.width);
        let (y0, y1, fy) = neighbours(1.0 - fraction(uv.y), self.height);
        let texel = |x: u32, y: u32| Vec3::from_array(self.texels[y as usize * self.width as usize + x as usize]);
        let top = texel(x0, y0) * (1.0 - fx) + texel(x1, y0) * fx;
        let bottom = texel(x0, y1) * (1.0 - fx) + texel(x1, y1) * fx;
        top * (1.0 - fy) + bottom * fy
    }
}

/// t − ⌊t⌋ in [0, 1); where rounding gives 1, or nothing finite, 0.
fn fraction(t: f32) -> f32 {
    let f = t - t.floor();
    if f < 1.0 { f } else { 0.0 }
}

/// The two texels around `t` in [0, 1] among `n` in a ring, and the weight of the second.
fn neighbours(t: f32, n: u32) -> (u32, u32, f32) {
    let x = t * n as f32 - 0.5;
    let below = x.floor();
    // −1 where t lies in the first half texel, n where rounding reaches past the last: both wrap.
    let first = (below as i64).rem_euclid(i64::from(n)) as u32;
    (first, if first + 1 == n { 0 } else { first + 1 }, x - below)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 3 × 2 texels, red counts columns, green rows from the top.
    fn ramp() -> Texture {
        let texels = (0..6).map(|i| [(i % 3) as f32, (i / 3) as f32, 1.0]).collect();
        Texture { width: 3, height: 2, texels }
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
        let dot = Texture { width: 1, height: 1, texels: vec![[0.25; 3]] };
        assert_eq!(dot.sample(Vec2::new(-3.7, 0.2)), Vec3::splat(0.25));
    }
}
