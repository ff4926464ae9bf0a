//! Scene files: what is accepted means what its documentation says, and each bad input is an error that names place, expected and found.

use std::path::PathBuf;

use glam::{Vec2, Vec3};
use sampler_lab::error::ErrorKind;
use sampler_lab::scene::load::{LoadedScene, OpenOptions, open};
use tempfile::TempDir;

/// A folder with scene files, gone after the test.
struct Folder(TempDir);

impl Folder {
    fn new(files: &[(&str, &str)]) -> Self {
        let folder = Self(tempfile::tempdir().unwrap());
        for (name, text) in files {
            folder.write(name, text.as_bytes());
        }
        folder
    }

    fn write(&self, name: &str, bytes: &[u8]) {
        let path = self.path(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, bytes).unwrap();
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn open(&self, sets: &[&str]) -> sampler_lab::error::Result<LoadedScene> {
        let sets = sets.iter().map(|s| (*s).to_owned()).collect();
        open(&self.path("a.json"), &OpenOptions { data: vec![], sets })
    }

    /// The message of the error, which must be bad input; without this machine's folder.
    fn error(&self, sets: &[&str]) -> String {
        let error = self.open(sets).unwrap_err();
        assert_eq!((error.kind, error.exit_code()), (ErrorKind::Input, 2));
        error.to_string().replace(&format!("{}/", self.0.path().display()), "")
    }
}

const MTL: &str = "newmtl wall\nKd 0.5 0.25 0.125\nnewmtl light\nKd 1 1 1\nKe 15 15 15\n";
const OBJ: &str = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nusemtl wall\nf 1 2 3\nusemtl light\nf 1 2 3 4\n";
const ONE: &str = r#"{"scene": {"mesh_files": ["a.obj"]}}"#;

/// A scene of one OBJ and the usual MTL.
fn with_obj(obj: &str) -> Folder {
    Folder::new(&[("a.json", ONE), ("a.obj", obj), ("a.mtl", MTL)])
}

/// A scene of the usual OBJ and one MTL.
fn with_mtl(mtl: &str) -> Folder {
    Folder::new(&[("a.json", ONE), ("a.obj", OBJ), ("a.mtl", mtl)])
}

fn json_error(json: &str) -> String {
    Folder::new(&[("a.json", json)]).error(&[])
}

/// The usual OBJ with `line` in place of its line `number`.
fn obj_error(number: usize, line: &str) -> String {
    let lines: Vec<&str> = OBJ.lines().enumerate().map(|(i, old)| if i + 1 == number { line } else { old }).collect();
    with_obj(&lines.join("\n")).error(&[])
}

#[track_caller]
fn assert_has(message: &str, parts: &[&str]) {
    for part in parts {
        assert!(message.contains(part), "{part:?} is missing in: {message}");
    }
}

// Bad scene files.

#[test]
fn an_unknown_key_is_refused_with_the_nearest_one() {
    assert_has(
        &json_error(r#"{"camera": {"lens_radus": 1}}"#),
        &["a.json: camera.lens_radus: expected", "found an unknown key", "did you mean \"lens_radius\"?"],
    );
    assert_has(
        &json_error(r#"{"scene": {"materials": [{"name": "x", "albedo": 1}]}}"#),
        &["a.json: scene.materials[0].albedo:"],
    );
    assert_has(&json_error(r#"{"lens_radius": 1}"#), &["a.json: lens_radius: ", "it belongs in camera"]);
}

#[test]
fn a_wrong_type_is_refused() {
    for (json, place, expected, found) in [
        (r#"{"camera": {"fov": "70"}}"#, "camera.fov", "an angle", r#"found "70""#),
        (r#"{"camera": {"pos": [1, 2]}}"#, "camera.pos", "three numbers", "found [1, 2]"),
        (r#"{"camera": {"pos": [1, null, 2]}}"#, "camera.pos[1]", "a number", "found null"),
        (r#"{"camera": 4}"#, "camera", "an object", "found 4"),
        (r#"{"auto_focus": 1}"#, "auto_focus", "true or false", "found 1"),
        (r#"{"framebuffer": {"sppx": 1.5}}"#, "framebuffer.sppx", "a whole number", "found 1.5"),
        (r#"{"scene": {"mesh_files": "a.obj"}}"#, "scene.mesh_files", "an array", r#"found "a.obj""#),
        (r#"{"scene": {"materials": [{"type": "x"}]}}"#, "scene.materials[0]", r#"the key "name""#, "found none"),
        (r#"{"shading": "albdo"}"#, "shading", r#""direct" or "albedo""#, r#"did you mean "albedo""#),
    ] {
        assert_has(&json_error(json), &[&format!("a.json: {place}: expected "), expected, found]);
    }
}

#[test]
fn a_number_that_is_not_finite_is_refused() {
    assert_has(&json_error(r#"{"camera": {"fov": NaN}}"#), &["a.json: line 1, column 20"]);
    assert_has(&json_error(r#"{"camera": {"fov": 1e999}}"#), &["a.json: line 1", "out of range"]);
    assert_has(
        &json_error(r#"{"camera": {"focal_depth": 1e39}}"#),
        &["camera.focal_depth", "below 3.4e38", "found 1e+39"],
    );
    assert_has(&json_error(r#"{"camera": {"pos": [0, -1e39, 0]}}"#), &["camera.pos[1]", "found -1e+39"]);
}

#[test]
fn values_outside_their_range_are_refused() {
    for (json, parts) in [
        (r#"{"camera": {"lens_radius": -0.1}}"#, ["camera.lens_radius", "0 (a pinhole) or above", "found -0.1"]),
        (r#"{"camera": {"dir": [0, 0, 0]}}"#, ["camera.dir", "of length 1e-12", "found [0, 0, 0]"]),
        (r#"{"camera": {"up": [-2, 0, 0]}}"#, ["camera.up", "not parallel to dir [1, 0, 0]", "found [-2, 0, 0]"]),
        (r#"{"camera": {"fov": 0}}"#, ["camera.fov", "between 0 and 180", "found 0"]),
        (r#"{"camera": {"fov": 180}}"#, ["camera.fov", "between 0 and 180", "found 180"]),
        (r#"{"camera": {"focal_depth": 0}}"#, ["camera.focal_depth", "a length above 0", "found 0"]),
        (r#"{"framebuffer": {"sppx": 0}}"#, ["framebuffer.sppx", "from 1 to 16777216", "found 0"]),
        (r#"{"framebuffer": {"sppx": 16777217}}"#, ["framebuffer.sppx", "from 1 to 16777216", "found 16777217"]),
        (r#"{"framebuffer": {"res_w": 0}}"#, ["framebuffer.res_w", "from 1 to", "found 0"]),
        (
            r#"{"framebuffer": {"res_w": 8193, "res_h": 8192}}"#,
            ["framebuffer", "at most 67108864 pixels", "8193 times 8192"],
        ),
        (r#"{"framebuffer": {"exposure": -1}}"#, ["framebuffer.exposure", "0 or above", "found -1"]),
        (
            r#"{"scene": {"materials": [{"name": "x", "albedo_col": [0, -1, 0]}]}}"#,
            ["albedo_col", "0 or above", "[0, -1, 0]"],
        ),
        (
            r#"{"scene": {"materials": [{"name": "x", "emissive_strength": -1}]}}"#,
            ["emissive_strength", "0 or above", "found -1"],
        ),
        (
            r#"{"scene": {"materials": [{"name": "x"}, {"name": "x"}]}}"#,
            ["scene.materials[1].name", "each name once", "\"x\" again"],
        ),
    ] {
        assert_has(&json_error(json), &parts);
    }
}

#[test]
fn a_duplicate_key_is_refused_with_its_line() {
    assert_has(
        &json_error("{\"camera\": {\n\"fov\": 70,\n\"fov\": 70}}"),
        &["a.json: line 3", "the key \"fov\" twice"],
    );
}

#[test]
fn what_is_not_modelled_is_refused_with_the_remedy() {
    let sky = Folder::new(&[(
        "a.json",
        r#"{"scene": {"sky": {"file": "noon.hdr"}, "volume_file": "x"}, "algorithm": "PathTracer"}"#,
    )]);
    assert_has(&sky.error(&[]), &["a.json: scene.sky", "--set scene.sky=null"]);
    assert_has(&sky.error(&["scene.sky=null"]), &["a.json: scene.volume_file", "--set scene.volume_file=null"]);
    assert_has(
        &sky.error(&["scene.sky=null", "scene.volume_file=null"]),
        &["a.json: algorithm", "--set algorithm=SimpleRenderer", "PathTracer"],
    );
    let sets = ["scene.sky=null", "scene.volume_file=null", "algorithm=SimpleRenderer"];
    assert!(sky.open(&sets).unwrap().mesh.is_empty());
}

#[test]
fn a_missing_scene_file_is_refused() {
    assert_has(&Folder::new(&[]).error(&[]), &["a.json: expected a readable scene file", "found"]);
}

// Bad meshes and materials.

#[test]
fn a_missing_mesh_is_refused_with_every_place_looked_in() {
    let folder = Folder::new(&[("configs/a.json", ONE)]);
    let options = OpenOptions { data: vec!["elsewhere".into()], sets: vec![] };
    let message = open(&folder.path("configs/a.json"), &options).unwrap_err().to_string();
    let looked = ["configs", "configs/data", "data"].map(|place| folder.path(place).display().to_string());
    assert_has(
        &message,
        &["scene.mesh_files[0]: expected the mesh file \"a.obj\"", &looked[0], &looked[1], &looked[2], "elsewhere"],
    );
}

#[test]
fn a_missing_material_library_is_refused() {
    assert_has(&obj_error(1, "mtllib b.mtl"), &["a.obj:1: expected the material library \"b.mtl\", found"]);
}

#[test]
fn a_missing_or_torn_texture_is_refused() {
    let folder = with_mtl("newmtl wall\nmap_Kd tiles.png\nnewmtl light\nKd 1 1 1");
    assert_has(&folder.error(&[]), &["a.mtl:2: expected the texture \"tiles.png\"", "found"]);
    folder.write("tiles.png", b"\x89PNG\r\n\x1a\nnot really");
    assert_has(&folder.error(&[]), &["a.mtl:2: expected a PNG or JPEG image in \"tiles.png\", found"]);
    folder.write("tiles.png", b"plain text");
    assert_has(&folder.error(&[]), &["a.mtl:2: expected a PNG or JPEG image in \"tiles.png\", found"]);
}

#[test]
fn usemtl_of_an_unknown_material_is_refused() {
    assert_has(
        &obj_error(6, "usemtl wal"),
        &["a.obj:6: expected usemtl of one of the 2 materials", "\"wal\"; did you mean \"wall\"?"],
    );
    assert_has(
        &obj_error(1, "# no library"),
        &["a.obj:6: expected usemtl of a material of an mtllib above", "\"wall\""],
    );
    assert_has(&obj_error(6, "usemtl"), &["a.obj:6: expected usemtl with a material's name, found nothing"]);
}

#[test]
fn a_face_of_fewer_than_three_vertices_is_refused() {
    assert_has(&obj_error(7, "f 1 2"), &["a.obj:7: expected a face of at least 3 corners, found 2"]);
    assert_has(&obj_error(7, "f"), &["a.obj:7: expected a face of at least 3 corners, found 0"]);
}

#[test]
fn a_file_without_faces_is_refused() {
    assert_has(
        &with_obj("v 0 0 0\nv 1 0 0\nv 0 1 0\n").error(&[]),
        &["a.obj: expected at least one face (f), found none in 3 lines"],
    );
    assert_has(&with_obj("").error(&[]), &["a.obj: expected at least one face"]);
}

#[test]
fn an_index_out_of_range_is_refused() {
    assert_has(&obj_error(7, "f 1 2 5"), &["a.obj:7: expected an index of a position (v) from 1 to 4", "found 5"]);
    assert_has(&obj_error(7, "f 1 2 0"), &["a.obj:7", "found 0"]);
    assert_has(&obj_error(7, "f 1 2 -5"), &["a.obj:7", "found -5"]);
    assert_has(&obj_error(7, "f 1/1 2/1 3/1"), &["a.obj:7: expected no texture coordinate (vt)", "found 1"]);
    assert_has(&obj_error(7, "f 1//1 2//1 3//1"), &["a.obj:7: expected no normal (vn)", "found 1"]);
    assert_has(&obj_error(7, "f 1 2 99999999999999999999"), &["a.obj:7: expected a corner", "99999999999999999999"]);
    assert_has(&obj_error(7, "f 1 2 x"), &["a.obj:7: expected a corner", "\"x\""]);
    assert_has(&obj_error(7, "f 1///1 2 3"), &["a.obj:7: expected a corner", "\"1///1\""]);
}

#[test]
fn a_coordinate_that_is_no_finite_number_is_refused() {
    for bad in ["nan", "NaN", "inf", "-infinity", "1e39", "1,5", "x", "1..2", "-", "."] {
        assert_has(
            &obj_error(3, &format!("v 0 {bad} 0")),
            &["a.obj:3: expected v with 3 finite coordinates", &format!("found {bad:?}")],
        );
    }
    assert_has(&obj_error(3, "v 0 0"), &["a.obj:3", "found 2 numbers"]);
    assert_has(&obj_error(3, "v 0 0 0 0 0"), &["a.obj:3", "found 5 numbers"]);
    assert_has(&obj_error(3, "v 1 0 0 0"), &["a.obj:3: expected a weight", "found 0"]);
    assert_has(&obj_error(3, "vt nan 0"), &["a.obj:3: expected vt", "found \"nan\""]);
    assert_has(&obj_error(3, "vn 0 0"), &["a.obj:3: expected vn with 3 finite numbers, found 2 numbers"]);
}

#[test]
fn corners_of_different_form_in_one_face_are_refused() {
    let obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\nf 1//1 2 3\n";
    assert_has(&with_obj(obj).error(&[]), &["a.obj:5: expected corners of one form", "found \"1//1 2 3\""]);
}

#[test]
fn a_black_material_that_emits_is_refused_by_name() {
    let black = "newmtl wall\nKd 1 1 1\nnewmtl light\nKd 0 0 0\nKs 0 0 0\nKe 1 1 1\n";
    assert_has(
        &with_mtl(black).error(&[]),
        &["a.mtl:3: expected a colour for what emits", "found black in material \"light\""],
    );
    let patched = with_mtl(black).open(&[r#"scene.materials=[{"name": "light", "albedo_col": [1, 0.5, 0]}]"#]).unwrap();
    assert_eq!(patched.mesh.materials[1].emission, Vec3::new(1.0, 0.5, 0.0));
}

#[test]
fn bad_lines_of_a_material_library_are_refused() {
    for (mtl, parts) in [
        ("Kd 1 1 1\n", ["a.mtl:1: expected newmtl first", "found \"Kd\""]),
        ("newmtl\n", ["a.mtl:1: expected newmtl with a name", "found nothing"]),
        ("newmtl x\nKd 1 1\n", ["a.mtl:2: expected a colour", "found \"1 1\""]),
        ("newmtl x\nKd 1 -1 1\n", ["a.mtl:2: expected a colour", "found \"1 -1 1\""]),
        ("newmtl x\nKe nan 1 1\n", ["a.mtl:2: expected a colour", "found \"nan 1 1\""]),
        (
            "newmtl x\nmap_Kd -s 2 2 2 a.png\n",
            ["a.mtl:2: expected map_Kd with a file name alone", "\"-s 2 2 2 a.png\""],
        ),
        ("newmtl x\nnewmtl x\n", ["a.mtl:2: expected each name once", "\"x\" again, first at a.mtl:1"]),
    ] {
        assert_has(&with_mtl(mtl).error(&[]), &parts);
    }
}

// What is accepted.

#[test]
fn materials_follow_the_rules_of_the_format() {
    let mtl = "newmtl plain\nKd .5 .25 .125\nnewmtl mirror\nKd 0 0 0\nKs .9 .8 .7\nillum 5\nnewmtl lamp\nKd .5 1 1\nKe 4 4 4\n\
               newmtl Ceiling_LIGHT\nKd .2 .2 .2\nnewmtl glow\nKd .5\n";
    let obj = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl plain\nf 1 2 3\nusemtl mirror\nf 1 2 3\nusemtl lamp\nf 1 2 3\n\
               usemtl Ceiling_LIGHT\nf 1 2 3\nusemtl glow\nf 1 2 3\n";
    let json = r#"{"scene": {"mesh_files": ["a.obj"], "materials": [{"name": "glow", "type": "Emissive"}, {"name": "plian"},
        {"name": "plain", "type": "glass"}]}}"#;
    let folder = Folder::new(&[("a.json", json), ("a.obj", obj), ("a.mtl", mtl)]);
    let scene = folder.open(&[]).unwrap();
    let found: Vec<_> =
        scene.mesh.materials.iter().map(|m| (m.name.as_str(), m.albedo, m.emission, m.is_emitter)).collect();
    assert_eq!(
        found,
        [
            ("plain", Vec3::new(0.5, 0.25, 0.125), Vec3::ZERO, false),
            ("mirror", Vec3::new(0.9, 0.8, 0.7), Vec3::ZERO, false),
            ("lamp", Vec3::new(0.5, 1.0, 1.0), Vec3::new(2.0, 4.0, 4.0), true),
            ("Ceiling_LIGHT", Vec3::splat(0.2), Vec3::splat(2.0), true),
            ("glow", Vec3::splat(0.5), Vec3::splat(5.0), true),
        ]
    );
    assert_eq!(scene.mesh.material_of, [0, 1, 2, 3, 4]);
    assert_has(
        &scene.warnings.join("\n"),
        &[
            "a.mtl:1: \"plain\" (type \"glass\") is rendered as diffuse",
            "a.mtl:3: \"mirror\" (illum 5) is rendered as diffuse",
            "scene.materials[1].name: no material is called \"plian\"; did you mean \"plain\"?",
            "a.obj: \"lamp\" emits radiance [2, 4, 4] from 1 triangles",
            "a.obj: \"Ceiling_LIGHT\" emits radiance [2, 2, 2] from 1 triangles",
        ],
    );
    let off = folder.open(&[r#"scene.materials=[{"name": "Ceiling_LIGHT", "emissive_strength": 0}]"#]).unwrap();
    assert!(!off.mesh.materials[3].is_emitter, "a given strength of 0 is given");
}

#[test]
fn quads_and_polygons_become_triangles_and_keep_smooth_normals_and_uvs() {
    let obj = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv -.5 .5 0\nvt 0 0\nvt 1 0 0\nvt .5\nvn 0 0 2\nvn 3 0 0\n\
               f 1//1 2//2 3//1 4//1\nf 1/1 2/2 3/3\nf -5 -4 -3 -2 -1\nf 1/1/1 \\\n2/2/1 3/3/2 # a comment\n";
    let mesh = with_obj(obj).open(&[]).unwrap().mesh;
    assert_eq!(mesh.len(), 2 + 1 + 3 + 1);
    let [o, x, xy, y] = [Vec3::ZERO, Vec3::X, Vec3::new(1.0, 1.0, 0.0), Vec3::Y];
    assert_eq!(mesh.positions[..3], [[o, x, xy], [o, xy, y], [o, x, xy]]);
    assert_eq!(mesh.normals[0], [Vec3::Z, Vec3::X, Vec3::Z], "normalised, per corner");
    assert_eq!(mesh.normals[2], [Vec3::Z; 3], "the winding normal where there is none");
    assert_eq!(mesh.uvs[0], [Vec2::ZERO; 3]);
    assert_eq!(mesh.uvs[2], [Vec2::ZERO, Vec2::X, Vec2::new(0.5, 0.0)]);
    assert_eq!((mesh.normals[6], mesh.uvs[6]), ([Vec3::Z, Vec3::Z, Vec3::X], mesh.uvs[2]), "a joined line");
}

#[test]
fn what_a_material_cannot_show_is_said() {
    let mtl = "newmtl wall\nKd 0 0 0\nmap_Kd t.png\nmap_bump b.png\nnewmtl light\nKd 1 1 1\nKe 1 0 0\nmap_Kd t.png\n";
    let folder = with_mtl(mtl);
    sampler_lab::film::write_png_rgb8(&folder.path("t.png"), 1, 1, &[9, 9, 9]).unwrap();
    let scene = folder.open(&[]).unwrap();
    assert_eq!(scene.mesh.materials[1].emission, Vec3::splat(0.2126), "luma of red, Rec. 709");
    assert_has(
        &scene.warnings.join("\n"),
        &[
            "a.mtl: not modelled and left out: map_bump",
            "a.mtl:1: \"wall\" has a texture that does not show",
            "a.mtl:5: \"light\" has a coloured Ke",
            "a.mtl:5: \"light\" has a texture that does not change what it emits",
        ],
    );
    let bright =
        folder.open(&[r#"scene.materials=[{"name": "light", "albedo_col": [2, 0, 0], "emissive_strength": 1e38}]"#]);
    assert!(
        bright.unwrap().warnings[0].contains("scene.materials[0].albedo_col: [2, 0, 0] reflects more than it receives")
    );
    let too_bright =
        folder.error(&[r#"scene.materials=[{"name": "light", "albedo_col": [9, 0, 0], "emissive_strength": 1e38}]"#]);
    assert_has(&too_bright, &["a.mtl:5: expected an emission below 3.4e38"]);
}

/// Twice the area, signed by the z axis.
fn area_z([a, b, c]: [Vec3; 3]) -> f32 {
    (b - a).cross(c - a).z
}

#[test]
fn a_concave_polygon_is_covered_once() {
    // An arrow head: only fans from its tip or from its notch cover it.
    let scene = with_obj("v 0 0 0\nv 2 -1 0\nv 1 0 0\nv 2 1 0\nf 2 3 4 1\n").open(&[]).unwrap();
    let areas: Vec<f32> = scene.mesh.positions.iter().map(|t| area_z(*t)).collect();
    assert_eq!(areas.len(), 2);
    assert!(areas.iter().all(|a| *a > 0.0) || areas.iter().all(|a| *a < 0.0), "{areas:?}");
    assert_eq!(areas.iter().sum::<f32>().abs(), 2.0);
}

#[test]
fn what_is_left_out_is_said() {
    let obj = "v 0 0 0 1 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 0\nl 1 2 3\nusmtl wall\nf 1 2 3\nf 1 1 2\nf 1//1 2//1 3//1\n";
    let scene = with_obj(obj).open(&[]).unwrap();
    assert_eq!(scene.mesh.len(), 2, "neither the line nor the triangle without area");
    assert_eq!(scene.mesh.normals[1], [Vec3::Z; 3]);
    assert_eq!(scene.mesh.materials[0].albedo, Vec3::splat(0.8));
    assert_has(
        &scene.warnings.join("\n"),
        &[
            "a.obj:5: the statement \"l\" is not modelled, left out",
            "a.obj:6: unknown statement \"usmtl\"; did you mean \"usemtl\"?",
            "a.obj:7: faces before any usemtl have the default material",
            "a.obj: 1 triangles without area left out",
            "a.obj: 3 normals of length 0 replaced",
        ],
    );
}

#[test]
fn a_texture_is_decoded_once_and_multiplies_the_colour() {
    let mtl = "newmtl wall\nKd 0.5 0.5 0.5\nmap_Kd img\\tiles.png\nnewmtl light\nmap_Kd img/tiles.png\nKe 0 0 0\n";
    let folder = with_mtl(mtl);
    let path = folder.path("img/tiles.png");
    sampler_lab::film::write_png_rgb8(&path, 2, 1, &[0, 188, 255, 255, 255, 255]).unwrap();
    let mesh = folder.open(&[]).unwrap().mesh;
    assert_eq!((mesh.materials[0].texture, mesh.materials[1].texture), (Some(0), Some(0)));
    assert_eq!((mesh.materials[0].albedo, mesh.materials[1].albedo), (Vec3::splat(0.5), Vec3::ONE));
    let [r, g, b] = mesh.textures[0].texel(0, 0);
    assert_eq!((mesh.textures[0].width, mesh.textures[0].height, r, b), (2, 1, 0.0, 1.0));
    // 188/255 is the sRGB code nearest to linear one half (IEC 61966-2-1): 0.50289.
    assert!((g - 0.50289).abs() < 1e-5, "{g}");
}

#[test]
fn several_mesh_files_add_up_and_are_found_beside_above_and_in_data() {
    let json = r#"{"scene": {"mesh_files": ["near.obj", "sub/above.obj", "far.obj"], "materials": [{"name": "light", "emissive_strength": 2}]}}"#;
    let folder = Folder::new(&[
        ("repo/configs/a.json", json),
        ("repo/configs/near.obj", OBJ),
        ("repo/configs/a.mtl", MTL),
        ("repo/data/sub/above.obj", OBJ),
        ("repo/data/sub/a.mtl", MTL),
        ("far/far.obj", OBJ),
        ("far/a.mtl", MTL),
    ]);
    let options = OpenOptions { data: vec![folder.path("far")], sets: vec!["camera.lens_radius=0".to_owned()] };
    let scene = open(&folder.path("repo/configs/a.json"), &options).unwrap();
    assert_eq!(scene.mesh.len(), 9);
    assert_eq!(scene.mesh.material_of, [0, 1, 1, 2, 3, 3, 4, 5, 5]);
    let files: Vec<u32> = scene.mesh.materials.iter().map(|m| m.file).collect();
    assert_eq!(files, [0, 0, 1, 1, 2, 2]);
    assert!(scene.mesh.materials.iter().filter(|m| m.name == "light").all(|m| m.emission == Vec3::splat(2.0)));
    assert_eq!(scene.config.camera.lens_radius, 0.0);
}

#[test]
fn the_content_hash_follows_what_is_read_and_not_where_it_lies() {
    let [a, b] = [with_obj(OBJ), with_obj(OBJ)].map(|folder| folder.open(&[]).unwrap());
    assert_eq!(a.content_sha256(), b.content_sha256());
    let names: Vec<&str> = a.inputs.iter().map(|i| i.name.as_str()).collect();
    assert_eq!(names, ["a.json", "a.obj", "a.mtl"]);
    let spaced = Folder::new(&[
        ("a.json", "{\"scene\":\n{\"mesh_files\": [\"a.obj\"]}, \"auto_focus\": true}"),
        ("a.obj", OBJ),
        ("a.mtl", MTL),
    ]);
    assert_eq!(
        spaced.open(&[]).unwrap().content_sha256(),
        a.content_sha256(),
        "layout and explicit defaults do not count"
    );
    assert_ne!(with_obj(OBJ).open(&["camera.fov=60"]).unwrap().content_sha256(), a.content_sha256());
    assert_ne!(with_mtl(&MTL.replace("15", "16")).open(&[]).unwrap().content_sha256(), a.content_sha256());
    // FIPS 180-4: SHA-256 of the empty message.
    let empty = Folder::new(&[
        ("a.json", ONE),
        ("a.obj", &OBJ.replace("mtllib a.mtl", "mtllib a.mtl b.mtl")),
        ("a.mtl", MTL),
        ("b.mtl", ""),
    ]);
    let inputs = empty.open(&[]).unwrap().inputs;
    assert_eq!(inputs[3].sha256, "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
}

#[test]
fn the_exported_config_loads_to_the_same_scene() {
    let json = r#"{"camera": {"pos": [-0.56543, 3.2923, -4.4922], "dir": [0.2526, -0.56456, 0.78579], "up": [0.17297, 0.82539, 0.5374],
        "fov": 70, "lens_radius": 0.3, "focal_depth": 4.8008}, "framebuffer": {"sppx": 26, "hdr": true}, "rr_depth": 3,
        "scene": {"mesh_files": ["a.obj"], "materials": [{"name": "light", "emissive_strength": 0.1, "ior": 1.5}]}}"#;
    let folder = Folder::new(&[("a.json", json), ("a.obj", OBJ), ("a.mtl", MTL)]);
    let scene = folder.open(&[]).unwrap();
    folder.write("a.json", scene.config.to_json().as_bytes());
    let again = folder.open(&[]).unwrap();
    assert_eq!((&again.config, &again.mesh, &again.warnings), (&scene.config, &scene.mesh, &scene.warnings));
    assert_eq!(again.content_sha256(), scene.content_sha256());
}

#[test]
fn windows_files_and_odd_bytes_load_like_plain_ones() {
    let plain = with_obj(OBJ).open(&[]).unwrap();
    let folder = Folder::new(&[("a.json", ONE), ("a.mtl", &format!("\u{feff}{}", MTL.replace('\n', "\r\n")))]);
    let mut obj = b"\xef\xbb\xbf# caf\xe9 \\\r\n".to_vec();
    obj.extend_from_slice(OBJ.replace('\n', "  \r\n").replace("usemtl ", "\tusemtl\t").as_bytes());
    folder.write("a.obj", &obj);
    assert_eq!(folder.open(&[]).unwrap().mesh, plain.mesh);
}

/// Bytes changed at random places of all three files: an answer or an error of kind `Input`, never a panic.
#[test]
fn damaged_files_never_panic() {
    use proptest::prelude::*;
    use proptest::test_runner::{RngAlgorithm, TestRng, TestRunner};
    let obj = format!("{OBJ}vt 0 0\nvn 0 0 1\nf 1/1/1 2/1/1 3/1/1 -1/-1/-1\n");
    let json = r#"{"camera": {"fov": 70, "up": [0, 1, 0]}, "scene": {"mesh_files": ["a.obj"], "materials": [{"name": "wall"}]}}"#;
    let strategy = prop::collection::vec(
        (0..3usize, 0..200usize, prop::sample::select(&b"\0\n\r\\ /-#.019ef,\"{}\xff"[..])),
        1..6,
    );
    let config = ProptestConfig { cases: 300, failure_persistence: None, ..Default::default() };
    TestRunner::new_with_rng(config, TestRng::from_seed(RngAlgorithm::ChaCha, &[5; 32]))
        .run(&strategy, |changes| {
            let mut files = [json.as_bytes().to_vec(), obj.as_bytes().to_vec(), MTL.as_bytes().to_vec()];
            for (file, at, byte) in changes {
                let n = files[file].len();
                files[file][at % n] = byte;
            }
            let folder = Folder::new(&[]);
            for (name, bytes) in ["a.json", "a.obj", "a.mtl"].iter().zip(&files) {
                folder.write(name, bytes);
            }
            if let Err(error) = folder.open(&[]) {
                prop_assert_eq!(error.kind, ErrorKind::Input);
            }
            Ok(())
        })
        .unwrap();
}
