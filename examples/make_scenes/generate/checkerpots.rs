//! `a01`: teapots on a checkered marble floor that runs to the horizon.

use std::path::Path;

use glam::DVec3;
use sampler_lab::error::Result;

use super::marble::{Marble, mix};
use super::obj::{Corner, Material, Obj};
use super::solids::{Place, ball, bezier_profile, revolve};
use super::teapot::Teapot;

const ABOUT: &str = "Teapots on a marble floor, y up. The teapot is Martin Newell's (1975), tessellated from its published control points.
Made by examples/make_scenes.";

const MATERIALS: [Material<'static>; 8] = [
    Material { name: "tile_pale", lines: "Kd 1 1 1\nmap_Kd marble_pale.png" },
    Material { name: "tile_dark", lines: "Kd 1 1 1\nmap_Kd marble_dark.png" },
    Material { name: "teapot_diffuse", lines: "Kd 0.56 0.155 0.06" },
    Material { name: "teapot_diffuse.001", lines: "Kd 0.05 0.3 0.31" },
    Material { name: "teapot_specular", lines: "Kd 0 0 0\nKs 0.8 0.72 0.58" },
    Material { name: "vase_glaze", lines: "Kd 0.64 0.34 0.04" },
    Material { name: "ball_lacquer", lines: "Kd 0.3 0.025 0.04" },
    Material { name: "light", lines: "Kd 1 1 1\nKe 10 10 10" },
];

const PALE: Marble = Marble {
    seed: 1,
    stone: [[0.80, 0.76, 0.70], [0.95, 0.93, 0.89]],
    veins: [[0.55, 0.50, 0.46], [0.66, 0.52, 0.36]],
};

const DARK: Marble = Marble {
    seed: 2,
    stone: [[0.10, 0.14, 0.17], [0.24, 0.29, 0.32]],
    veins: [[0.62, 0.63, 0.60], [0.52, 0.45, 0.34]],
};

/// Writes the scene's files into `folder`.
///
/// # Errors
/// Kind `Write` where a file cannot be written.
pub fn write(folder: &Path) -> Result<()> {
    let mut obj = Obj::new(4);
    add_floor(&mut obj);
    add_pots(&mut obj);
    add_vase(&mut obj);
    add_ball(&mut obj);
    add_light(&mut obj);
    PALE.write(&folder.join("marble_pale.png"))?;
    DARK.write(&folder.join("marble_dark.png"))?;
    obj.write(folder, "checkerpots", ABOUT, &MATERIALS)
}

/// Side of a tile, scene units.
const TILE: f64 = 0.8;

/// The tiles that the sheet's camera can see, and a margin for a camera that moves: they widen with the view from behind
/// the camera to a straight horizon.
fn add_floor(obj: &mut Obj) {
    /// Where the camera stands on the floor, and where it looks, to the numbers of its config.
    const FOOT: [f64; 2] = [-0.56543, -4.4922];
    const AHEAD: [f64; 2] = [0.30604, 0.95202];
    let seen = |x: f64, z: f64| {
        let (dx, dz) = (x - FOOT[0], z - FOOT[1]);
        let (ahead, aside) = (dx * AHEAD[0] + dz * AHEAD[1], dx * AHEAD[1] - dz * AHEAD[0]);
        (-8.0..52.0).contains(&ahead) && aside.abs() < 8.0 + 1.35 * ahead.max(0.0)
    };
    for (name, colour) in [("tile_pale", 0), ("tile_dark", 1)] {
        obj.object(name, name);
        for row in -120..=120_i32 {
            for column in -120..=120_i32 {
                let middle = |k: i32| (f64::from(k) + 0.5) * TILE;
                if (row + column).rem_euclid(2) == colour && seen(middle(column), middle(row)) {
                    add_tile(obj, column, row);
                }
            }
        }
    }
}

/// One tile: a window of half the texture, its place and turn drawn by a hash so that no two neighbours are alike.
fn add_tile(obj: &mut Obj, column: i32, row: i32) {
    let bits = mix(column as u32 ^ mix(row as u32));
    let (left, bottom, turn) = (f64::from(bits & 7) / 8.0, f64::from(bits >> 3 & 7) / 8.0, (bits >> 6 & 3) as usize);
    let window = [[0.0, 0.0], [0.5, 0.0], [0.5, 0.5], [0.0, 0.5]];
    // Up is counter-clockwise seen from above: +z before +x.
    let corners = [(0, 0), (0, 1), (1, 1), (1, 0)];
    obj.face(&std::array::from_fn::<Corner, 4, _>(|i| {
        let (dx, dz) = corners[i];
        let [u, v] = window[(i + turn) % 4];
        Corner {
            position: DVec3::new(f64::from(column + dx) * TILE, 0.0, f64::from(row + dz) * TILE),
            normal: None,
            uv: Some([left + u, bottom + v]),
        }
    }));
}

/// Three pots: one where the camera focuses, one behind, one far.
fn add_pots(obj: &mut Obj) {
    let teapot = Teapot::published();
    let mut add = |name: &str, [x, z]: [f64; 2], scale: f64, turn_degrees: f64, steps: usize| {
        obj.object(name, name);
        teapot.add(obj, &Place { origin: DVec3::new(x, 0.0, z), scale, turn_degrees }, steps);
    };
    add("teapot_diffuse", [0.9, -0.1], 0.6, 165.0, 16);
    add("teapot_diffuse.001", [-1.4, 4.7], 0.6, 36.0, 12);
    add("teapot_specular", [7.6, 2.4], 0.6, 200.0, 12);
}

/// A vase with a foot, a belly, a neck and a lip, hollow as far down as one can look.
fn add_vase(obj: &mut Obj) {
    const PROFILE: [[[f64; 2]; 4]; 7] = [
        [[0.0, 0.0], [0.2, 0.0], [0.4, 0.0], [0.5, 0.0]],
        [[0.5, 0.0], [0.56, 0.0], [0.56, 0.1], [0.6, 0.2]],
        [[0.6, 0.2], [0.7, 0.45], [1.0, 0.7], [1.0, 1.2]],
        [[1.0, 1.2], [1.0, 1.8], [0.36, 1.8], [0.36, 2.4]],
        [[0.36, 2.4], [0.36, 2.7], [0.48, 2.9], [0.6, 3.0]],
        [[0.6, 3.0], [0.66, 3.05], [0.62, 3.1], [0.56, 3.04]],
        [[0.56, 3.04], [0.4, 2.88], [0.28, 2.7], [0.28, 2.3]],
    ];
    obj.object("vase", "vase_glaze");
    let place = Place { origin: DVec3::new(5.2, 0.0, 3.2), scale: 0.85, turn_degrees: 0.0 };
    revolve(obj, &place, &bezier_profile(&PROFILE, 10), 64);
}

/// A ball in the foreground.
fn add_ball(obj: &mut Obj) {
    obj.object("ball", "ball_lacquer");
    let place = Place { origin: DVec3::new(-1.3, 0.0, -1.8), scale: 0.45, turn_degrees: 0.0 };
    revolve(obj, &place, &ball(32), 64);
}

/// A rectangle high behind the camera's left shoulder, looking down into the scene.
fn add_light(obj: &mut Obj) {
    let corner = DVec3::new(5.25, 6.75, -7.0);
    let (across, up) = (DVec3::new(3.5, 0.0, 1.75), DVec3::new(-1.25, 3.75, 2.5));
    obj.object("light", "light");
    obj.flat_quad([corner, corner + across, corner + across + up, corner + up]);
}
