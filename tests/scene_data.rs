//! The committed scenes: what `examples/make_scenes` writes, whole, in bounds and the right way round.

#[path = "../examples/make_scenes/generate/mod.rs"]
mod generate;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use glam::DVec3;
use sampler_lab::analytic::{Horizon, Penumbra, ThinLens};
use sampler_lab::render::render;
use sampler_lab::sampling::{Preset, Sampler, SamplerSpec};
use sampler_lab::scene::compile::{Scene, Stage};
use sampler_lab::scene::config::Estimator;
use sampler_lab::scene::light::LightSet;
use sampler_lab::scene::load::{OpenOptions, open};

/// The scenes' names: `data/NAME/NAME.obj`.
const SCENES: [&str; 6] = ["checkerpots", "cornell", "penumbra", "bokeh", "many-lights", "horizon"];

/// Those lit by one rectangle.
const ONE_LIGHT: [&str; 3] = ["checkerpots", "cornell", "penumbra"];

/// The folder of committed scenes.
fn data() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("data")
}

/// The config `configs/NAME.json`, loaded and compiled for an image of `size`, and what the loader had to say.
fn compiled(name: &str, size: (u32, u32)) -> (Scene, Vec<String>) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("configs").join(format!("{name}.json"));
    let loaded = open(&path, &OpenOptions::default()).unwrap();
    (Scene::new(&loaded.config, loaded.mesh, size, Stage::Final).unwrap(), loaded.warnings)
}

/// One triangle as it stands in a file.
#[derive(Debug, Clone, Copy)]
struct Triangle {
    corners: [DVec3; 3],
    /// Vertex normals, where the file has them.
    normals: Option<[DVec3; 3]>,
}

impl Triangle {
    /// Twice the area times the unit winding normal.
    fn cross(&self) -> DVec3 {
        let [a, b, c] = self.corners;
        (b - a).cross(c - a)
    }
}

/// An object of one material.
#[derive(Debug)]
struct Object {
    name: String,
    material: String,
    triangles: Vec<Triangle>,
}

/// Reads `data/NAME/NAME.obj` by the letter of the format, with nothing but string splitting: an oracle for the loader,
/// and for the writer.
fn objects(scene: &str) -> Vec<Object> {
    let text = std::fs::read_to_string(data().join(scene).join(format!("{scene}.obj"))).unwrap();
    let (mut vertices, mut normals, mut objects) = (Vec::new(), Vec::new(), Vec::<Object>::new());
    for line in text.lines() {
        let (keyword, rest) = line.split_once(' ').unwrap();
        let vector = || DVec3::from_slice(&rest.split(' ').map(|x| x.parse().unwrap()).collect::<Vec<f64>>());
        match keyword {
            "v" => vertices.push(vector()),
            "vn" => normals.push(vector()),
            "o" => objects.push(Object { name: rest.to_owned(), material: String::new(), triangles: Vec::new() }),
            "usemtl" => objects.last_mut().unwrap().material = rest.to_owned(),
            "f" => {
                let corners: Vec<(DVec3, Option<DVec3>)> =
                    rest.split(' ').map(|c| corner(c, &vertices, &normals)).collect();
                for i in 2..corners.len() {
                    let fan = [corners[0], corners[i - 1], corners[i]];
                    let normals = fan.iter().map(|c| c.1).collect::<Option<Vec<_>>>();
                    objects
                        .last_mut()
                        .unwrap()
                        .triangles
                        .push(Triangle { corners: fan.map(|c| c.0), normals: normals.map(|n| [n[0], n[1], n[2]]) });
                }
            }
            _ => assert!(["#", "mtllib", "vt"].contains(&keyword), "{line}"),
        }
    }
    objects
}

/// `v`, `v/vt`, `v//vn` or `v/vt/vn` → position and normal.
fn corner(text: &str, vertices: &[DVec3], normals: &[DVec3]) -> (DVec3, Option<DVec3>) {
    let mut parts = text.split('/');
    let vertex = vertices[parts.next().unwrap().parse::<usize>().unwrap() - 1];
    let normal = parts.nth(1).map(|index| normals[index.parse::<usize>().unwrap() - 1]);
    (vertex, normal)
}

/// Every file below `folder` with its path relative to it and its bytes.
fn files(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut found = BTreeMap::new();
    let mut pending = vec![folder.to_owned()];
    while let Some(next) = pending.pop() {
        for entry in std::fs::read_dir(next).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                pending.push(path);
            } else {
                found.insert(path.strip_prefix(folder).unwrap().to_owned(), std::fs::read(&path).unwrap());
            }
        }
    }
    found
}

#[test]
fn making_the_scenes_again_gives_the_committed_bytes() {
    let folder = tempfile::tempdir().unwrap();
    generate::write_all(folder.path()).unwrap();
    let (made, committed) = (files(folder.path()), files(&data()));
    assert_eq!(made.len(), 15);
    for (path, bytes) in &made {
        assert!(committed.get(path) == Some(bytes), "{}: run `cargo run --example make_scenes`", path.display());
    }
}

#[test]
fn all_data_together_stays_below_15_megabytes() {
    let total: usize = files(&data()).values().map(Vec::len).sum();
    assert!(total < 15_000_000, "{total} bytes");
}

#[test]
fn checkerpots_stays_within_80_000_triangles_and_7_megabytes() {
    let triangles: usize = objects("checkerpots").iter().map(|o| o.triangles.len()).sum();
    assert!((40_000..=80_000).contains(&triangles), "{triangles} triangles");
    let bytes = std::fs::metadata(data().join("checkerpots/checkerpots.obj")).unwrap().len();
    assert!(bytes <= 7_000_000, "{bytes} bytes");
}

#[test]
fn every_triangle_is_finite_and_has_an_area() {
    for scene in SCENES {
        for object in objects(scene) {
            for t in &object.triangles {
                assert!(t.corners.iter().all(|c| c.is_finite()), "{scene} {}: {t:?}", object.name);
                // Coordinates carry four decimals: a sliver thinner than one of them is a welding mistake.
                let longest = (0..3).map(|i| t.corners[i].distance(t.corners[(i + 1) % 3])).fold(0.0, f64::max);
                assert!(t.cross().length() / longest > 1e-4, "{scene} {}: {t:?}", object.name);
            }
        }
    }
}

#[test]
fn vertex_normals_are_unit_vectors_on_the_side_of_the_winding() {
    let mut smooth = 0;
    for scene in SCENES {
        for object in objects(scene) {
            for t in &object.triangles {
                for n in t.normals.into_iter().flatten() {
                    // Four decimals: each coordinate is off by at most 0.5e-4 (and the shifted tie), so |n| by √3 · 0.51e-4.
                    assert!((n.length() - 1.0).abs() < 0.9e-4, "{scene} {}: {n}", object.name);
                    assert!(t.cross().normalize().dot(n) > 0.5, "{scene} {}: {t:?}", object.name);
                    smooth += 1;
                }
            }
        }
    }
    assert!(smooth > 100_000, "{smooth}");
}

/// Volume by the divergence theorem, (1/6) Σ a · (b × c) over triangles about the point `about`.
fn volume(triangles: &[Triangle], about: DVec3) -> f64 {
    let relative = |t: &Triangle| t.corners.map(|c| c - about);
    triangles
        .iter()
        .map(|t| {
            let [a, b, c] = relative(t);
            a.dot(b.cross(c))
        })
        .sum::<f64>()
        / 6.0
}

/// Undirected edges between positions in units of the last printed place: how often each is used, and the uses one way
/// less those the other way.
type Edges = BTreeMap<([i64; 3], [i64; 3]), (u32, i32)>;

/// The edges of a mesh.
fn edges(triangles: &[Triangle]) -> Edges {
    let key = |p: DVec3| p.to_array().map(|x| (x * 1e4).round() as i64);
    let mut edges = Edges::new();
    for t in triangles {
        for i in 0..3 {
            let (a, b) = (key(t.corners[i]), key(t.corners[(i + 1) % 3]));
            let entry = edges.entry((a.min(b), a.max(b))).or_default();
            entry.0 += 1;
            entry.1 += if a < b { 1 } else { -1 };
        }
    }
    edges
}

#[test]
fn the_ball_is_closed_and_holds_a_ball_s_volume() {
    let objects = objects("checkerpots");
    let ball = &objects.iter().find(|o| o.name == "ball").unwrap().triangles;
    assert!(edges(ball).values().all(|&(uses, balance)| uses == 2 && balance == 0));
    // An inscribed polyhedron of 64 × 32 steps holds about 1 − (2π/64)²/6 − (π/32)²/4 = 0.996 of the ball.
    let share = volume(ball, ball[0].corners[0]) / (4.0 / 3.0 * std::f64::consts::PI * 0.45_f64.powi(3));
    assert!((0.99..1.0).contains(&share), "{share}");
}

#[test]
fn no_pot_or_vase_has_a_crack_or_a_flipped_patch() {
    for object in objects("checkerpots").iter().filter(|o| o.name.starts_with("teapot") || o.name == "vase") {
        let edges = edges(&object.triangles);
        // Two faces that share an edge run along it in opposite directions, or one of them is inside out.
        assert!(
            edges.values().all(|&(uses, balance)| uses <= 2 && balance.unsigned_abs() == uses % 2),
            "{}",
            object.name
        );
        // The open borders of a pot of n steps a patch: two ends each of handle and spout (2n edges), rim and lid (4n);
        // of the vase: where its inside ends. A crack would add lines.
        let expected = match object.name.as_str() {
            "vase" => vec![64],
            "teapot_diffuse" => vec![32, 32, 32, 32, 64, 64],
            _ => vec![24, 24, 24, 24, 48, 48],
        };
        let mut borders = border_lengths(&edges);
        borders.sort_unstable();
        assert_eq!(borders, expected, "{}", object.name);
        assert!(volume(&object.triangles, DVec3::ZERO) > 0.0);
    }
}

/// Edge counts of the connected pieces of the border (edges used once).
fn border_lengths(edges: &Edges) -> Vec<usize> {
    let mut open: Vec<_> = edges.iter().filter(|(_, (uses, _))| *uses == 1).map(|(ends, _)| *ends).collect();
    let mut lengths = Vec::new();
    while let Some((a, b)) = open.pop() {
        let (mut reached, mut length) = (vec![a, b], 1);
        loop {
            let before = open.len();
            open.retain(|&(a, b)| {
                let joins = reached.contains(&a) || reached.contains(&b);
                if joins {
                    reached.extend([a, b]);
                }
                !joins
            });
            if open.len() == before {
                break;
            }
            length += before - open.len();
        }
        lengths.push(length);
    }
    lengths
}

#[test]
fn the_pots_are_as_high_as_published() {
    for (name, scale) in [("teapot_diffuse", 0.6), ("teapot_diffuse.001", 0.6), ("teapot_specular", 0.6)] {
        let objects = objects("checkerpots");
        let pot = objects.iter().find(|o| o.material == name).unwrap();
        let heights = pot.triangles.iter().flat_map(|t| t.corners).map(|c| c.y);
        let (low, high) = heights.fold((f64::MAX, f64::MIN), |(low, high), y| (low.min(y), high.max(y)));
        assert_eq!((low, (high * 1e4).round()), (0.0, (3.15 * scale * 1e4_f64).round()), "{name}");
    }
}

#[test]
fn the_floor_alternates_and_reaches_tiles_smaller_than_a_pixel() {
    let objects = objects("checkerpots");
    let tiles =
        |name: &str| objects.iter().filter(|o| o.material == name).flat_map(|o| &o.triangles).collect::<Vec<_>>();
    let (pale, dark) = (tiles("tile_pale"), tiles("tile_dark"));
    let colour = |t: &Triangle| {
        let middle = (t.corners[0] + t.corners[2]) * 0.5 / 0.8;
        assert!(t.corners.iter().all(|c| c.y == 0.0) && t.cross().y > 0.0);
        let lowest = t.corners.iter().fold(middle, |low, c| low.min(*c / 0.8));
        (lowest.x.round() as i64 + lowest.z.round() as i64).rem_euclid(2)
    };
    assert!(pale.iter().all(|t| colour(t) == 0) && dark.iter().all(|t| colour(t) == 1));
    // Seen from 3.29 up, a tile at distance d is 0.8 · 3.29 / d² radians high; 720 rows over 70° make 1/514 rad a pixel.
    let farthest =
        pale.iter().flat_map(|t| t.corners).map(|c| c.distance(DVec3::new(-0.565, 0.0, -4.492))).fold(0.0, f64::max);
    assert!(0.8 * 3.29 / (farthest * farthest) < 1.0 / 514.0, "{farthest}");
}

#[test]
fn each_single_light_is_one_parallelogram_that_faces_down() {
    for scene in ONE_LIGHT {
        let objects = objects(scene);
        let lights: Vec<_> = objects.iter().filter(|o| o.material == "light").collect();
        assert_eq!(lights.len(), 1, "{scene}");
        let [first, second] = lights[0].triangles[..] else { panic!("{scene}: {:?}", lights[0]) };
        let ([a, b, c], [a2, c2, d]) = (first.corners, second.corners);
        assert_eq!((a, c), (a2, c2), "{scene}: the two halves share a diagonal");
        assert!(((a + c) - (b + d)).abs().max_element() < 1e-12, "{scene}: {first:?} {second:?}");
        assert!((b - a).dot(d - a).abs() < 1e-12, "{scene}: a rectangle");
        assert!(first.cross().y < 0.0 && second.cross().y < 0.0, "{scene}");
        let lowest = a.y.min(b.y).min(c.y).min(d.y);
        assert!(lowest > 2.0, "{scene}: above the scene");
    }
}

#[test]
fn the_light_of_checkerpots_shines_on_every_body_and_every_tile_in_the_picture() {
    let objects = objects("checkerpots");
    let light = objects.iter().find(|o| o.material == "light").unwrap().triangles[0];
    // In the picture: in front of the camera, and within its 16:9 field of view to the sides (tan 35° · 16/9 = 1.245).
    let (eye, ahead) = (DVec3::new(-0.56543, 3.2923, -4.4922), DVec3::new(0.2526, -0.56456, 0.78579).normalize());
    let right = ahead.cross(DVec3::new(0.17297, 0.82539, 0.5374)).normalize();
    let in_picture = |p: &DVec3| (*p - eye).dot(right).abs() < 1.245 * (*p - eye).dot(ahead);
    for object in objects.iter().filter(|o| o.material != "light") {
        for corner in object.triangles.iter().flat_map(|t| t.corners).filter(in_picture) {
            assert!(light.corners.iter().all(|l| light.cross().dot(corner - *l) > 0.0), "{}: {corner}", object.name);
        }
    }
}

/// The published measurements' normals, quad by quad in the file's order (the red wall's: of its first triangle, since the
/// measured wall is not quite flat).
const CORNELL: [(&str, &str, [f64; 3]); 16] = [
    ("floor", "white", [0.0, 1.0, 0.0]),
    ("ceiling", "white", [0.0, -1.0, 0.0]),
    ("back_wall", "white", [0.0, 0.0, -1.0]),
    ("right_wall", "green", [1.0, 0.0, 0.0]),
    ("left_wall", "red", [-0.999916, 0.011661, -0.005722]),
    ("short_block_top", "white", [0.0, 1.0, 0.0]),
    ("short_block_side_1", "white", [-0.957826, 0.0, -0.287348]),
    ("short_block_side_2", "white", [-0.285121, 0.0, 0.958492]),
    ("short_block_side_3", "white", [0.9534, 0.0, 0.301709]),
    ("short_block_side_4", "white", [0.292826, 0.0, -0.956166]),
    ("tall_block_top", "white", [0.0, 1.0, 0.0]),
    ("tall_block_side_1", "white", [-0.296209, 0.0, -0.955123]),
    ("tall_block_side_2", "white", [-0.956166, 0.0, 0.292826]),
    ("tall_block_side_3", "white", [0.301709, 0.0, 0.9534]),
    ("tall_block_side_4", "white", [0.955649, 0.0, -0.294508]),
    ("light", "light", [0.0, -1.0, 0.0]),
];

#[test]
fn cornell_has_the_published_surfaces_and_normals() {
    let objects = objects("cornell");
    assert_eq!(objects.len(), CORNELL.len());
    for (object, (name, material, normal)) in objects.iter().zip(CORNELL) {
        assert_eq!((object.name.as_str(), object.material.as_str()), (name, material));
        let [first, second] = object.triangles[..] else { panic!("{name}: {} triangles", object.triangles.len()) };
        assert!(first.normals.is_none(), "flat surfaces shade by their winding");
        let off = first.cross().normalize() - DVec3::from_array(normal);
        assert!(off.abs().max_element() < 1e-6, "{name}: {off}");
        // The red wall's two halves differ by 0.0082 rad.
        assert!(first.cross().normalize().dot(second.cross().normalize()) > 1.0 - 4e-5, "{name}");
    }
}

#[test]
fn cornell_s_room_looks_inward_and_its_blocks_outward() {
    let inside = DVec3::new(2.78, 2.73, 2.8);
    for object in objects("cornell") {
        let t = object.triangles[0];
        if object.name.contains("block") {
            let middle = if object.name.starts_with("short") {
                DVec3::new(1.86, 0.8, 1.69)
            } else {
                DVec3::new(3.68, 1.6, 3.51)
            };
            assert!(t.cross().dot(t.corners[0] - middle) > 0.0, "{}", object.name);
        } else {
            assert!(t.cross().dot(inside - t.corners[0]) > 0.0, "{}", object.name);
        }
    }
}

#[test]
fn cornell_s_light_hangs_where_the_sheet_puts_it_below_a_whole_ceiling() {
    let objects = objects("cornell");
    let corners = |name: &str| -> Vec<DVec3> {
        objects.iter().filter(|o| o.name == name).flat_map(|o| &o.triangles).flat_map(|t| t.corners).collect()
    };
    let bounds = |name: &str| {
        let all = corners(name);
        (all.iter().copied().reduce(DVec3::min).unwrap(), all.iter().copied().reduce(DVec3::max).unwrap())
    };
    assert_eq!(bounds("light"), (DVec3::new(2.13, 5.487, 2.27), DVec3::new(3.43, 5.487, 3.32)));
    assert_eq!(bounds("ceiling"), (DVec3::new(0.0, 5.488, 0.0), DVec3::new(5.56, 5.488, 5.592)));
    assert_eq!(corners("ceiling").len(), 6, "one quad: no hole behind the light");
}

#[test]
fn materials_carry_the_published_albedos() {
    let text = std::fs::read_to_string(data().join("cornell/cornell.mtl")).unwrap();
    for block in [
        "newmtl white\nKd 0.725 0.71 0.68\n",
        "newmtl red\nKd 0.63 0.065 0.05\n",
        "newmtl green\nKd 0.14 0.45 0.091\n",
        "newmtl light\nKd 1 1 1\nKe 15 15 15\n",
    ] {
        assert!(text.contains(block), "{block}");
    }
}

#[test]
fn penumbra_is_the_closed_form_s_standard_scene_to_the_last_bit() {
    let closed_form = Penumbra::standard(60, 60).unwrap();
    let objects = objects("penumbra");
    let quad = |name: &str| -> Vec<DVec3> {
        let object = objects.iter().find(|o| o.name == name && o.material == name).unwrap();
        let [first, second] = object.triangles[..] else { panic!("{object:?}") };
        vec![first.corners[0], first.corners[1], first.corners[2], second.corners[2]]
    };
    assert_eq!(objects.len(), 3);
    assert_eq!(quad("light"), closed_form.light().corners);
    assert_eq!(quad("blocker"), closed_form.blocker());
    assert!(quad("plane").iter().all(|c| c.y == closed_form.plane().point.y));
    assert_eq!(closed_form.plane().normal, DVec3::Y);
    for number in ["plane", "blocker", "light"].map(quad).into_iter().flatten().flat_map(|c| c.to_array()) {
        assert_eq!(f64::from(number as f32), number, "exact in f32");
    }
    let material = std::fs::read_to_string(data().join("penumbra/penumbra.mtl")).unwrap();
    assert!(material.contains(&format!("newmtl plane\nKd {0} {0} {0}\n", closed_form.plane().albedo)));
}

#[test]
fn penumbra_s_plane_fills_the_picture_and_its_camera_is_the_closed_form_s() {
    let closed_form = Penumbra::standard(60, 60).unwrap();
    for (x, y) in [(0.0, 0.0), (60.0, 0.0), (0.0, 60.0), (60.0, 60.0)] {
        let seen = closed_form.receiver(x, y).point;
        assert!(seen.x.abs() < 8.0 && seen.z.abs() < 8.0, "{seen}");
    }
    let config = std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("configs/penumbra.json")).unwrap();
    let config: serde_json::Value = serde_json::from_str(&config).unwrap();
    let vector = |key: &str| -> Vec<f64> {
        config["camera"][key].as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect()
    };
    let camera = closed_form.camera();
    assert_eq!(vector("pos"), camera.position.to_array());
    assert_eq!(vector("dir"), camera.direction.to_array());
    assert_eq!(vector("up"), camera.up.to_array());
    assert_eq!(config["camera"]["fov"].as_f64(), Some(camera.fov_y_degrees));
    assert_eq!(config["camera"]["lens_radius"].as_f64(), Some(0.0));
    assert_eq!(config["scene"]["materials"][0]["emissive_strength"].as_f64(), Some(closed_form.light().emission));
}

/// The sum of what all of a light's triangles send out: area × luma of the radiance, as lights are chosen by.
fn powers(scene: &Scene) -> Vec<f64> {
    scene.lights.iter().flat_map(LightSet::lights).map(|light| light.power).collect()
}

#[test]
fn each_new_scene_makes_the_decisions_it_is_there_for_and_no_other() {
    for (name, layout, lights) in [
        ("bokeh", "pixel 0–1, lens 2–3, light pick 4, light point 5–6, 7 dimensions in all", 5),
        ("many-lights", "pixel 0–1, light pick 2, light point 3–4, 5 dimensions in all", 72),
        ("horizon", "pixel 0–1, 2 dimensions in all", 0),
    ] {
        let (scene, said) = compiled(name, (32, 18));
        assert_eq!(scene.layout.to_string(), layout, "{name}");
        assert_eq!(powers(&scene).len(), lights, "{name}");
        // Every emitter is named, in one line where they are many, and there is nothing else to say.
        assert_eq!(said.len(), if lights > 8 { 1 } else { lights }, "{name}: {said:?}");
        for light in scene.lights.iter().flat_map(LightSet::lights) {
            assert!(
                said.iter().any(|l| l.contains("emit") && l.contains(&format!("{:?}", light.name))),
                "{}",
                light.name
            );
        }
        assert_eq!(scene.warnings, Vec::<String>::new(), "{name}");
    }
}

#[test]
fn the_three_new_scenes_together_stay_below_one_and_a_half_megabytes() {
    let total: usize = ["bokeh", "many-lights", "horizon"]
        .into_iter()
        .flat_map(|scene| files(&data().join(scene)).into_values().map(|bytes| bytes.len()))
        .sum();
    assert!(total < 1_500_000, "{total} bytes");
}

#[test]
fn the_powers_of_many_lights_fall_geometrically_over_four_and_a_half_orders() {
    let (scene, _) = compiled("many-lights", (32, 18));
    let powers = powers(&scene);
    assert!(scene.lights.iter().flat_map(LightSet::lights).all(|light| light.is_parallelogram()));
    for (i, power) in (0..).zip(&powers) {
        let expected = powers[0] * 10f64.powf(-4.5 * f64::from(i) / 71.0);
        // A colour of three decimals is off by up to 0.5 %.
        assert!((power / expected - 1.0).abs() < 0.01, "lamp {i}: {power} {expected}");
    }
}

#[test]
fn no_lamp_of_many_lights_hangs_in_a_pillar() {
    let objects = objects("many-lights");
    let pillars = &objects.iter().find(|o| o.name == "pillars").unwrap().triangles;
    let lamps: Vec<_> = objects.iter().filter(|o| o.name.starts_with("lamp_")).collect();
    assert_eq!((lamps.len(), pillars.len()), (72, 25 * 10));
    let lids = &objects.iter().find(|o| o.name == "shades").unwrap().triangles;
    assert!(lids.len() == 2 * 72 && lids.iter().all(|t| t.cross().y > 0.0), "a lid over each");
    for lamp in lamps {
        assert!(lamp.triangles.iter().all(|t| t.cross().y < 0.0), "{} looks down", lamp.name);
        for pillar in pillars.chunks(10) {
            let corners = || pillar.iter().flat_map(|t| t.corners);
            let (low, high) = (corners().reduce(DVec3::min).unwrap(), corners().reduce(DVec3::max).unwrap());
            let inside = |c: DVec3| c.x > low.x && c.x < high.x && c.z > low.z && c.z < high.z && c.y < high.y;
            assert!(!lamp.triangles.iter().flat_map(|t| t.corners).any(inside), "{}", lamp.name);
        }
    }
}

/// Of 72 lights the shortcut, which weighs each light by its own probability, must lose most of the light. Seeds are
/// fixed; the two means are about 0.14 and 0.011, with a spread of a few percent.
#[test]
fn the_sheet_s_shortcut_leaves_less_than_half_of_many_lights() {
    let (mut scene, _) = compiled("many-lights", (32, 18));
    let mut mean = |estimator| {
        scene.estimator = estimator;
        let sampler = SamplerSpec::parse("sobol", Preset::Best).unwrap();
        let image = render(&scene, &Sampler::new(sampler, &scene.layout, 64, 1).unwrap()).unwrap().image;
        image.pixels.as_flattened().iter().map(|&c| f64::from(c)).sum::<f64>() / (3.0 * 32.0 * 18.0)
    };
    let (unbiased, sheet) = (mean(Estimator::Unbiased), mean(Estimator::Sheet));
    assert!(unbiased > 0.05 && sheet < 0.5 * unbiased, "{unbiased} {sheet}");
}

#[test]
fn in_bokeh_the_teapot_is_sharp_and_lamps_and_fence_are_far_out_of_focus() {
    let config = std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("configs/bokeh.json")).unwrap();
    let config: serde_json::Value = serde_json::from_str(&config).unwrap();
    let camera = &config["camera"];
    let vector = |key: &str| DVec3::from_array([0, 1, 2].map(|i| camera[key][i].as_f64().unwrap()));
    let (eye, ahead) = (vector("pos"), vector("dir").normalize());
    let number = |key: &str| camera[key].as_f64().unwrap();
    let lens = ThinLens { radius: number("lens_radius"), focal_depth: number("focal_depth") };
    // In an image of 180 rows.
    let blur = |p: DVec3| lens.blur_radius_px((p - eye).dot(ahead), number("fov"), 180.0);
    let objects = objects("bokeh");
    let blurs = |prefix: &str| -> Vec<f64> {
        let corners = objects.iter().filter(|o| o.name.starts_with(prefix)).flat_map(|o| &o.triangles);
        corners.flat_map(|t| t.corners).map(blur).collect()
    };
    let teapot = blurs("teapot");
    assert!(teapot.iter().all(|&b| b < 6.0) && teapot.iter().any(|&b| b < 0.1), "{teapot:?}");
    assert!(blurs("fence").iter().all(|&b| b > 6.0));
    assert!(blurs("twig").iter().all(|&b| b > 2.5));
    let lamps = blurs("lamp_");
    let far = lamps.iter().filter(|&&b| b > 6.0).count();
    assert!(4 * far > 3 * lamps.len() && lamps.iter().any(|&b| b < 1.0), "{far} of {} corners", lamps.len());
}

#[test]
fn horizon_is_the_closed_form_s_standard_scene_to_the_last_bit() {
    let [near, far, spread] = Horizon::STANDARD;
    let objects = objects("horizon");
    let corners: Vec<DVec3> = objects.iter().flat_map(|o| &o.triangles).flat_map(|t| t.corners).collect();
    for number in corners.iter().flat_map(DVec3::to_array) {
        assert_eq!(f64::from(number as f32), number, "exact in f32");
    }
    let plane = objects.iter().find(|o| o.name == "plane").unwrap();
    assert!(plane.triangles.iter().flat_map(|t| t.corners).all(|c| c.y == 0.0 && c.x.abs() == spread * c.z));
    let area: f64 = plane.triangles.iter().map(|t| t.cross().length() / 2.0).sum();
    assert_eq!(area, spread * (far * far - near * near));
    for band in 0..7 {
        let depth = near * f64::from(1 << band);
        assert!([depth, 2.0 * depth].iter().all(|&z| corners.iter().any(|c| c.z == z)), "{depth}");
    }
}

#[test]
fn every_config_loads_with_its_light_as_the_only_thing_to_say() {
    for (name, mesh, radiance) in
        [("a01", "checkerpots", 15.0), ("cornell", "cornell", 15.0), ("penumbra", "penumbra", 10.0)]
    {
        let (scene, said) = compiled(name, (32, 18));
        let [emitter] = &said[..] else { panic!("{name}: {said:?}") };
        assert!(emitter.contains("\"light\" emits"), "{name}: {emitter}");
        assert_eq!(scene.warnings, Vec::<String>::new(), "{name}");
        let triangles: usize = objects(mesh).iter().map(|o| o.triangles.len()).sum();
        assert_eq!(scene.mesh.len(), triangles, "{name}: what the loader sees is what stands in the file");
        let Some(LightSet::One { light, .. }) = &scene.lights else { panic!("{name}: {:?}", scene.lights) };
        assert_eq!(light.emission.to_array(), [radiance; 3], "{name}");
    }
}

#[test]
fn auto_focus_in_a01_finds_the_sheet_s_focal_depth() {
    let (scene, _) = compiled("a01", (1280, 720));
    let found = scene.focal_depth().unwrap();
    // Off by 0.01, a point at depth 4.8 blurs to a disc of radius 0.3 · 0.01 / 4.8, which is 0.07 pixels.
    assert!((found - 4.8008).abs() < 0.01, "{found}");
}
