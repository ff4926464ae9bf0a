//! Pictures that grow and scenes that are revised end with the bits of those made at once.

use super::*;

#[test]
fn a_picture_that_grows_ends_with_the_bits_of_render() {
    let open = |sets: &[&str]| {
        let sets = sets.iter().map(|s| (*s).to_owned()).collect();
        load::open(&config("a01.json"), &OpenOptions { data: Vec::new(), sets }).unwrap()
    };
    let size = (29, 19);
    let loaded = open(&[]);
    let scene = Scene::new(&loaded.config, loaded.mesh.clone(), size, Stage::Final).unwrap();
    for (text, asked) in [("sobol", 9), ("stratified", 7), ("halton:sheet", 1), ("hammersley", 20), ("uniform", 33)] {
        let set = SamplerSet::parse(text, Preset::Best).unwrap();
        let sampler = Sampler::new(set, &scene.layout, asked, 5).unwrap();
        let whole = render(&scene, &sampler).unwrap();
        let mut growing = Growing::new(size);
        // Also in memory that another picture has left.
        for blocks in [&[8, 4, 2, 1][..], &[16, 1], &[1]] {
            growing.clear(size);
            assert_eq!(growing.block(), None);
            for &block in blocks {
                assert!(growing.begin(&scene, &sampler, block, &|| true).unwrap().is_whole);
                assert_eq!(growing.block(), Some(block));
            }
            for to in [2, 3, 17, sampler.samples()] {
                if to > growing.samples() && to <= sampler.samples() {
                    growing.add(&scene, &sampler, to, &|| true).unwrap();
                }
            }
            assert_eq!(
                (growing.image(), growing.samples()),
                (whole.image.clone(), sampler.samples()),
                "{text} {blocks:?}"
            );
        }
        // Stopped again and again, each time after a tile or so of each thread: nothing is lost, and the bits are the same.
        growing.clear(size);
        let mut stops = 0;
        let asked = AtomicUsize::new(0);
        let now_and_then = || asked.fetch_add(1, Ordering::Relaxed).is_multiple_of(2);
        growing.begin(&scene, &sampler, 4, &|| true).unwrap();
        assert!(!growing.begin(&scene, &sampler, 2, &|| false).unwrap().is_whole);
        assert_eq!(growing.block(), Some(4), "{text}: what was known is");
        let first = growing.mean(8, 8);
        while growing.block() != Some(1) {
            stops += u32::from(!growing.begin(&scene, &sampler, 1, &now_and_then).unwrap().is_whole);
            assert_eq!(growing.mean(8, 8), first);
        }
        for to in [2, 5, sampler.samples()].into_iter().filter(|&to| to <= sampler.samples()) {
            while growing.samples() < to {
                let before = growing.samples();
                stops += u32::from(!growing.add(&scene, &sampler, to, &now_and_then).unwrap().is_whole);
                assert!(
                    growing.samples() >= before
                        && growing.image().pixels.iter().all(|p| p.iter().all(|c| c.is_finite()))
                );
            }
        }
        assert!(stops > 0, "{text}");
        assert_eq!(
            (growing.image(), growing.samples()),
            (whole.image, sampler.samples()),
            "{text}: after {stops} stops"
        );
    }
}

#[test]
fn a_scene_that_is_revised_is_the_scene_that_is_made_anew() {
    let open = |sets: &[&str]| {
        let sets = sets.iter().map(|s| (*s).to_owned()).collect();
        load::open(&config("many-lights.json"), &OpenOptions { data: Vec::new(), sets }).unwrap()
    };
    let mut loaded = open(&[]);
    let mut scene = Scene::new(&loaded.config, loaded.mesh.clone(), (24, 16), Stage::Final).unwrap();
    let image = |scene: &Scene| {
        let sampler = Sampler::new(SamplerSet::parse("ld", Preset::Best).unwrap(), &scene.layout, 4, 1).unwrap();
        render(scene, &sampler).unwrap().image
    };
    // Far away and back: the tree is built for another reach and built again.
    for sets in [
        &["camera.fov=40"][..],
        &["camera.lens_radius=0"],
        &["camera.lens_radius=0.1", "auto_focus=false", "camera.focal_depth=3"],
        &["camera.pos=[0, 300, 0]", "camera.dir=[0, -1, 0]", "camera.up=[1, 0, 0]"],
        &["shading=albedo"],
        &["estimator=sheet"],
        &[],
    ] {
        let new = open(sets);
        let made = Scene::new(&new.config, new.mesh.clone(), (30, 20), Stage::Final).unwrap();
        loaded.repaint(new.config.clone()).unwrap();
        assert_eq!((&loaded.mesh.materials, &loaded.warnings), (&new.mesh.materials, &new.warnings));
        scene.revise(&new.config, &loaded.mesh.materials, (30, 20), Stage::Final, Tree::Roomy).unwrap();
        // Every hit is found, whatever the boxes are padded for.
        let (rough, exact) = (image(&scene), image(&made));
        let near = |(a, b): (&f32, &f32)| (a - b).abs() <= 1e-3 * (1.0 + b.abs());
        let same = rough.pixels.as_flattened().iter().zip(exact.pixels.as_flattened()).filter(|p| near(*p)).count();
        assert!(same * 100 >= exact.pixels.len() * 300 - 300 * 2, "{sets:?}: {same} of {}", exact.pixels.len() * 3);
        scene.revise(&new.config, &loaded.mesh.materials, (30, 20), Stage::Final, Tree::Exact).unwrap();
        assert_eq!(image(&scene), exact, "{sets:?}");
        assert!(scene.has_exact_tree());
    }
    let before = image(&scene);
    let bad = open(&["camera.focal_depth=1e-30", "camera.lens_radius=1", "auto_focus=false"]).config;
    let refused = scene.revise(&bad, &loaded.mesh.materials, (30, 20), Stage::Final, Tree::Exact);
    assert!(refused.unwrap_err().to_string().starts_with("camera.focal_depth: expected at least "));
    assert_eq!(image(&scene), before, "on an error nothing changes");
}
