//! Landscapes of stated size: hills with bumpy balls on them under one square light, of one design at two tessellations.
//!
//! All of it is a function of integers and of arithmetic that is the same on every machine (crate `libm`, no platform
//! functions), so every machine measures the same triangles. Surfaces are given as functions: their places and normals do
//! not depend on the tessellation, and a finer one shows more of the same bumps.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use glam::{DVec3, Vec2, Vec3};
use rayon::prelude::*;

use crate::error::{Error, Result};
use crate::film::write_whole;
use crate::sampling::hash::{bits32, derive};
use crate::scene::compile::{Scene, Stage};
use crate::scene::config::{CameraConfig, FramebufferConfig, SceneConfig};
use crate::scene::mesh::{Material, Mesh};

/// Balls stand on a jittered grid of this many columns and rows.
const BALL_GRID: (u32, u32) = (6, 4);
/// Half the side of the ground, scene units.
const HALF_SIDE: f64 = 12.0;
/// Seed of all bumps and places.
const SEED: u64 = 0x6c61_6e64;

/// A landscape of one design at some tessellation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Landscape {
    /// Its name in tables and files.
    pub name: &'static str,
    /// Quads along a side of the ground.
    ground_quads: u32,
    /// Quads along an edge of the cube that becomes a ball.
    ball_quads: u32,
}

/// An indexed surface of one material.
struct Surface {
    material: u32,
    positions: Vec<Vec3>,
    /// As written to files.
    normals: Vec<Vec3>,
    /// Corners, counter-clockwise from the front.
    triangles: Vec<[u32; 3]>,
}

impl Landscape {
    /// 200 074 triangles.
    pub const MEDIUM: Self = Self { name: "landscape-200k", ground_quads: 206, ball_quads: 20 };
    /// 3 201 154 triangles.
    pub const LARGE: Self = Self { name: "landscape-3200k", ground_quads: 824, ball_quads: 80 };
    /// Both, the smaller first.
    pub const ALL: [Self; 2] = [Self::MEDIUM, Self::LARGE];

    /// The same design with `quads` ∈ 1..=80 along the edges of a ball's faces, and 10.3 times as many along the ground's side.
    ///
    /// # Panics
    /// For another number.
    pub fn of_quads(quads: u32) -> Self {
        assert!((1..=80).contains(&quads), "{quads} quads");
        Self { name: "landscape", ground_quads: 103 * quads / 10, ball_quads: quads }
    }

    /// Triangles: 2 a quad of the ground, 12 a quad of a cube's face for each ball, 2 of the light.
    pub fn triangle_count(self) -> usize {
        let (ground, ball) = (self.ground_quads as usize, self.ball_quads as usize);
        2 * ground * ground + 12 * ball * ball * (BALL_GRID.0 * BALL_GRID.1) as usize + 2
    }

    /// The scene file's content: thin lens, 1280 × 720, one emissive square.
    pub fn config(self) -> SceneConfig {
        let (pos, target) = (Vec3::new(-9.5, 6.0, -8.5), Vec3::new(0.6, 0.0, 0.8));
        SceneConfig {
            camera: CameraConfig {
                pos,
                dir: target - pos,
                up: Vec3::Y,
                fov_degrees: 42.0,
                lens_radius: 0.08,
                focal_depth: 12.0,
            },
            auto_focus: false,
            framebuffer: FramebufferConfig { res_w: 1280, res_h: 720, sppx: 26, exposure: 1.0 },
            mesh_files: vec![format!("{}.obj", self.name)],
            ..SceneConfig::default()
        }
    }

    /// The triangles with normals and materials, as the loader would read them from the files of [`Self::write`].
    pub fn mesh(self) -> Mesh {
        let mut mesh = Mesh { materials: materials(), ..Mesh::default() };
        let count = self.triangle_count();
        mesh.positions.reserve_exact(count);
        mesh.normals.reserve_exact(count);
        for surface in self.surfaces() {
            let at = |list: &[Vec3], t: &[u32; 3]| t.map(|i| list[i as usize]);
            let normals: Vec<Vec3> = surface.normals.iter().copied().map(unit).collect();
            mesh.positions.extend(surface.triangles.iter().map(|t| at(&surface.positions, t)));
            mesh.normals.extend(surface.triangles.iter().map(|t| at(&normals, t)));
            mesh.material_of.resize(mesh.positions.len(), surface.material);
        }
        mesh.uvs = vec![[Vec2::ZERO; 3]; mesh.positions.len()];
        mesh
    }

    /// The scene, for an image of `size` (columns, rows).
    pub fn scene(self, size: (u32, u32)) -> Scene {
        Scene::new(&self.config(), self.mesh(), size, Stage::Final).expect("coordinates of a few units")
    }

    /// Writes `NAME.json`, `NAME.obj` and `NAME.mtl` into `folder`, which `render` and other programs read. Numbers are
    /// written so that they read back to themselves. Returns the paths.
    ///
    /// # Errors
    /// Kind `Write` where a file cannot be written; then it is absent.
    pub fn write(self, folder: &Path) -> Result<Vec<PathBuf>> {
        std::fs::create_dir_all(folder).map_err(|e| Error::write(folder, e))?;
        let texts = [("json", self.config().to_json()), ("obj", self.obj()), ("mtl", mtl())];
        let mut paths = Vec::new();
        for (extension, text) in texts {
            let path = folder.join(format!("{}.{extension}", self.name));
            write_whole(&path, text.as_bytes())?;
            paths.push(path);
        }
        Ok(paths)
    }

    /// Ground, balls, light, in this order.
    fn surfaces(self) -> Vec<Surface> {
        let mut surfaces = vec![ground(self.ground_quads)];
        let (columns, rows) = BALL_GRID;
        surfaces.extend((0..columns * rows).map(|i| Ball::standing(i).surface(self.ball_quads)));
        surfaces.push(light());
        surfaces
    }

    fn obj(self) -> String {
        let names = materials();
        let count = self.triangle_count();
        let mut text = String::with_capacity(count * 80);
        writeln!(text, "# {count} triangles: hills, bumpy balls, one square light\nmtllib {}.mtl", self.name)
            .expect("a String takes all");
        let mut first = 1;
        for surface in self.surfaces() {
            surface.write(&mut text, &names[surface.material as usize].name, &mut first);
        }
        text
    }
}

impl Surface {
    /// As OBJ text; `first` is the number of its first vertex.
    fn write(&self, text: &mut String, material: &str, first: &mut u32) {
        let expect = "a String takes all";
        for p in &self.positions {
            writeln!(text, "v {} {} {}", p.x, p.y, p.z).expect(expect);
        }
        for n in &self.normals {
            writeln!(text, "vn {} {} {}", n.x, n.y, n.z).expect(expect);
        }
        writeln!(text, "usemtl {material}").expect(expect);
        for t in &self.triangles {
            let [a, b, c] = t.map(|i| i + *first);
            writeln!(text, "f {a}//{a} {b}//{b} {c}//{c}").expect(expect);
        }
        *first += self.positions.len() as u32;
    }
}

/// Diffuse colours of ground and balls, and the light's radiance: albedo, strength.
const MATERIALS: [(&str, [f32; 3], f32); 5] = [
    ("ground", [0.5, 0.55, 0.4], 0.0),
    ("clay", [0.7, 0.35, 0.25], 0.0),
    ("slate", [0.3, 0.4, 0.6], 0.0),
    ("chalk", [0.8, 0.8, 0.75], 0.0),
    ("light", [1.0, 1.0, 1.0], 14.0),
];

/// The material of the light.
const LIGHT: u32 = 4;

fn materials() -> Vec<Material> {
    let material = |(name, albedo, strength): (&str, [f32; 3], f32)| {
        let albedo = Vec3::from_array(albedo);
        let emission = albedo * strength;
        Material { name: name.to_owned(), file: 0, albedo, texture: None, emission, is_emitter: strength > 0.0 }
    };
    MATERIALS.map(material).into()
}

fn mtl() -> String {
    let entry = |(name, [r, g, b], strength): (&str, [f32; 3], f32)| {
        let emission = if strength > 0.0 { format!("Ke {strength} {strength} {strength}\n") } else { String::new() };
        format!("newmtl {name}\nKd {r} {g} {b}\n{emission}\n")
    };
    MATERIALS.map(entry).concat()
}

/// The square that lights it all, facing down.
fn light() -> Surface {
    let corner = |x: f32, z: f32| Vec3::new(2.0 + 2.5 * x, 13.0, -1.0 + 2.5 * z);
    Surface {
        material: LIGHT,
        positions: vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)],
        normals: vec![Vec3::NEG_Y; 4],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
    }
}

/// Height of the ground above y = 0.
fn height(x: f64, z: f64) -> f64 {
    1.6 * bumps(DVec3::new(0.22 * x, 0.0, 0.22 * z), 6, derive(SEED, &[0]))
}

/// The ground: a square grid over the height field.
fn ground(quads: u32) -> Surface {
    let at = |k: u32| HALF_SIDE * (2.0 * f64::from(k) / f64::from(quads) - 1.0);
    let vertex = |i: u32| {
        let (x, z) = (at(i % (quads + 1)), at(i / (quads + 1)));
        let step = 1e-3;
        let slope_x = height(x + step, z) - height(x - step, z);
        let slope_z = height(x, z + step) - height(x, z - step);
        let normal = DVec3::new(-slope_x, 2.0 * step, -slope_z).normalize();
        (DVec3::new(x, height(x, z), z).as_vec3(), normal.as_vec3())
    };
    let (positions, normals) = (0..(quads + 1) * (quads + 1)).into_par_iter().map(vertex).unzip();
    // Seen from above (y up), z then x turns counter-clockwise.
    Surface { material: 0, positions, normals, triangles: grid(quads, 0, false) }
}

/// Two triangles for each quad of a grid of (quads + 1)² vertices from number `first` on.
fn grid(quads: u32, first: u32, turned: bool) -> Vec<[u32; 3]> {
    let row = quads + 1;
    let quad = |i: u32| {
        let a = first + (i / quads) * row + i % quads;
        let (b, c, d) = (a + 1, a + row, a + row + 1);
        // Diagonals alternate, so that no direction is preferred.
        let pair = match (i / quads + i % quads) % 2 {
            0 => [[a, c, d], [a, d, b]],
            _ => [[a, c, b], [b, c, d]],
        };
        if turned { pair.map(|[p, q, r]| [p, r, q]) } else { pair }
    };
    (0..quads * quads).flat_map(quad).collect()
}

/// A bumpy ball.
struct Ball {
    centre: DVec3,
    radius: f64,
    material: u32,
    key: u64,
}

impl Ball {
    /// Ball `i` of the grid, standing on the ground.
    fn standing(i: u32) -> Self {
        let key = derive(SEED, &[1, u64::from(i)]);
        let random = |k| f64::from(bits32(key, k)) / 4_294_967_296.0;
        let (columns, rows) = BALL_GRID;
        let place =
            |k: u32, of: u32, jitter: f64| HALF_SIDE * 0.75 * ((2.0 * f64::from(k) + jitter) / f64::from(of) - 1.0);
        let x = place(i % columns, columns, 0.4 + 1.2 * random(0));
        let z = place(i / columns, rows, 0.4 + 1.2 * random(1));
        let radius = 0.45 + 0.75 * random(2);
        Self { centre: DVec3::new(x, height(x, z) + 0.85 * radius, z), radius, material: 1 + i % 3, key }
    }

    /// The surface's point in a direction, whose length does not matter.
    fn point(&self, direction: DVec3) -> DVec3 {
        let unit = direction.normalize();
        let swell = 1.0 + 0.15 * bumps(2.2 * unit + DVec3::splat(9.0), 4, self.key);
        self.centre + self.radius * swell * unit
    }

    fn vertex(&self, direction: DVec3) -> (Vec3, Vec3) {
        let unit_direction = direction.normalize();
        let across = unit_direction.any_orthonormal_vector();
        let (u, v) = (1e-3 * across, 1e-3 * unit_direction.cross(across));
        let at = |d: DVec3| self.point(unit_direction + d);
        let normal = (at(u) - at(-u)).cross(at(v) - at(-v)).normalize();
        (self.point(direction).as_vec3(), normal.as_vec3())
    }

    /// A cube of `quads` × `quads` a face, blown up to the ball; vertices of two faces coincide bit for bit.
    fn surface(&self, quads: u32) -> Surface {
        let at = |k: u32| 2.0 * f64::from(k) / f64::from(quads) - 1.0;
        let row = quads + 1;
        let vertex = |i: u32| {
            let (face, k) = (i / (row * row), i % (row * row));
            self.vertex(cube(face, at(k % row), at(k / row)))
        };
        let (positions, normals) = (0..6 * row * row).into_par_iter().map(vertex).unzip();
        let triangles = (0..6).flat_map(|face| grid(quads, face * row * row, face.is_multiple_of(2))).collect();
        Surface { material: self.material, positions, normals, triangles }
    }
}

/// A point of a face of the cube [−1, 1]³; the second three faces are opposite, so they turn the other way.
fn cube(face: u32, u: f64, v: f64) -> DVec3 {
    let sign = if face.is_multiple_of(2) { 1.0 } else { -1.0 };
    match face / 2 {
        0 => DVec3::new(sign, u, v),
        1 => DVec3::new(v, sign, u),
        _ => DVec3::new(u, v, sign),
    }
}

/// A normal as written to a file → as a loader has it: of unit length but for rounding.
fn unit(written: Vec3) -> Vec3 {
    let v = written.as_dvec3();
    (v / v.length()).as_vec3()
}

/// Bumps, within (−1.6, 1.6): octaves of gradient noise, each half as wide as the one before and 0.36 as high, so that a
/// finer tessellation shows more of them and a coarse one still follows the surface.
fn bumps(p: DVec3, octaves: u64, key: u64) -> f64 {
    let (mut sum, mut width, mut high) = (0.0, 1.0, 1.0);
    for octave in 0..octaves {
        sum += high * gradient_noise(p / width, derive(key, &[octave]));
        width *= 0.5;
        high *= 0.36;
    }
    sum
}

/// Gradient noise (Perlin 2002, doi:10.1145/566654.566636: quintic blend, edge directions), gradients by an integer hash.
fn gradient_noise(p: DVec3, key: u64) -> f64 {
    let cell = DVec3::new(libm::floor(p.x), libm::floor(p.y), libm::floor(p.z));
    let f = p - cell;
    let blend = f * f * f * (f * (f * 6.0 - 15.0) + 10.0);
    let corner = |i: u32| {
        let offset = DVec3::new(f64::from(i & 1), f64::from((i >> 1) & 1), f64::from(i >> 2));
        let place = (cell + offset).to_array().map(|c| c as i64 as u64);
        slope(derive(key, &place), f - offset)
    };
    let mix = |a: f64, b: f64, t: f64| a + (b - a) * t;
    let edge = |i: u32| mix(corner(i), corner(i + 1), blend.x);
    mix(mix(edge(0), edge(2), blend.y), mix(edge(4), edge(6), blend.y), blend.z)
}

/// Dot product with one of the twelve directions to the middles of a cube's edges.
fn slope(bits: u64, d: DVec3) -> f64 {
    let signed = |x: f64, bit: u64| if (bits >> bit) & 1 == 0 { x } else { -x };
    match (bits >> 32) % 3 {
        0 => signed(d.x, 0) + signed(d.y, 1),
        1 => signed(d.y, 0) + signed(d.z, 1),
        _ => signed(d.z, 0) + signed(d.x, 1),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::geometry::face_normal;
    use crate::scene::load::{OpenOptions, open};

    #[test]
    fn the_counts_are_as_stated() {
        assert_eq!(Landscape::ALL.map(Landscape::triangle_count), [200_074, 3_201_154]);
        assert_eq!(Landscape::of_quads(20).triangle_count(), 200_074);
        assert_eq!(Landscape::of_quads(5).mesh().len(), Landscape::of_quads(5).triangle_count());
        let mesh = Landscape::MEDIUM.mesh();
        assert_eq!(mesh.len(), 200_074);
        assert_eq!((mesh.normals.len(), mesh.uvs.len(), mesh.material_of.len()), (200_074, 200_074, 200_074));
    }

    #[test]
    fn every_triangle_has_area_and_faces_the_way_its_normals_do() {
        let mesh = Landscape::MEDIUM.mesh();
        for (corners, normals) in mesh.positions.iter().zip(&mesh.normals) {
            let face = face_normal(corners);
            assert!((face.length() - 1.0).abs() < 1e-5, "{corners:?}");
            assert!(normals.iter().all(|n| face.dot(*n) > 0.0), "{corners:?}: {face} against {normals:?}");
        }
    }

    /// An edge within a closed surface is walked once in each direction.
    #[test]
    fn balls_are_closed() {
        let surface = Ball::standing(5).surface(6);
        let bits = |i: u32| surface.positions[i as usize].to_array().map(f32::to_bits);
        let mut edges: Vec<_> = Vec::new();
        for [a, b, c] in &surface.triangles {
            edges.extend([(a, b), (b, c), (c, a)].map(|(p, q)| (bits(*p), bits(*q))));
        }
        edges.sort_unstable();
        let mut back: Vec<_> = edges.iter().map(|&(p, q)| (q, p)).collect();
        back.sort_unstable();
        assert_eq!(edges, back);
        assert!(edges.windows(2).all(|pair| pair[0] != pair[1]));
    }

    #[test]
    fn files_read_back_to_the_same_scene() {
        let folder = tempfile::tempdir().unwrap();
        let paths = Landscape::MEDIUM.write(folder.path()).unwrap();
        let loaded = open(&paths[0], &OpenOptions::default()).unwrap();
        assert_eq!(loaded.config, Landscape::MEDIUM.config());
        let made = Landscape::MEDIUM.mesh();
        assert_eq!(loaded.mesh.materials, made.materials);
        assert!(loaded.mesh.positions == made.positions && loaded.mesh.material_of == made.material_of);
        let other = loaded.mesh.normals.iter().zip(&made.normals).find(|(read, made)| read != made);
        assert_eq!(other, None);
        assert!(loaded.mesh == made);
        assert!(loaded.warnings.len() == 1 && loaded.warnings[0].contains("emits"), "{:?}", loaded.warnings);
    }

    #[test]
    fn one_parallelogram_lights_it() {
        let scene = Landscape::MEDIUM.scene((16, 9));
        assert!(
            matches!(&scene.lights, Some(crate::scene::light::LightSet::One { light, .. }) if light.is_parallelogram())
        );
        assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
    }
}
