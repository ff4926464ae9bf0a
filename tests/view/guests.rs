//! Who and what comes in: pages, tabs, requests, files and scenes of strangers, and that nothing brings the server down.

use super::*;

#[test]
fn only_its_own_page_with_the_token_is_let_in() {
    let server = small();
    let (port, token) = (server.port, server.token().to_owned());
    let get = |path: &str, host: &str, more: &str| format!("GET {path} HTTP/1.1\r\nHost: {host}\r\n{more}\r\n");
    let here = format!("127.0.0.1:{port}");
    let socket = |origin: &str| {
        format!(
            "{origin}Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n\
             Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n"
        )
    };
    let own = socket(&format!("Origin: http://{here}\r\n"));
    let page = server.ask(&get(&format!("/?token={token}"), &here, ""));
    assert!(page.starts_with("HTTP/1.1 200 ") && page.contains("<title>sampler-lab"), "{page}");
    assert!(page.contains("Content-Security-Policy: default-src 'none'"), "{page}");
    // A tunnel may end at another port and be called localhost.
    for host in ["localhost:9000", "127.0.0.1:1", "localhost"] {
        assert!(server.ask(&get(&format!("/?token={token}"), host, "")).starts_with("HTTP/1.1 200 "), "{host}");
    }
    let live = format!("/live?token={token}");
    let wrong = format!("/live?token={}", "0".repeat(32));
    for (what, request) in [
        ("page without token", get("/", &here, "")),
        ("page with another token", get(&format!("/?token={}", "0".repeat(32)), &here, "")),
        ("name of another site that leads here", get(&format!("/?token={token}"), "evil.example:80", "")),
        ("no host", format!("GET /?token={token} HTTP/1.1\r\n\r\n")),
        ("socket without origin", get(&live, &here, &socket(""))),
        ("socket of another site", get(&live, &here, &socket("Origin: https://evil.example\r\n"))),
        ("socket of a file", get(&live, &here, &socket("Origin: null\r\n"))),
        ("socket of another port", get(&live, &here, &socket("Origin: http://127.0.0.1:1\r\n"))),
        ("socket with two origins", get(&live, &here, &format!("Origin: http://evil\r\n{own}"))),
        ("socket without token", get("/live", &here, &own)),
        ("socket with another token", get(&wrong, &here, &own)),
        ("socket under another name", get(&live, "evil.example", &socket("Origin: http://evil.example\r\n"))),
    ] {
        let answer = server.ask(&request);
        assert!(answer.starts_with("HTTP/1.1 403 "), "{what}: {answer}");
    }
    for (status, request) in [
        ("404", get("/../Cargo.toml", &here, "")),
        ("404", get("/%2e%2e/etc/passwd", &here, "")),
        ("405", format!("POST /?token={token} HTTP/1.1\r\nHost: {here}\r\nContent-Length: 2\r\n\r\nhi")),
        ("426", get(&live, &here, "")),
        ("400", "nonsense\r\n\r\n".to_owned()),
        ("400", "\u{0}\u{1}\r\n\r\n".to_owned()),
        ("431", get(&"a".repeat(20_000), &here, "")),
        ("101", get(&live, &here, &own)),
    ] {
        // The last one is let in, and its client goes away without a word.
        let mut stream = TcpStream::connect(("127.0.0.1", port)).unwrap();
        stream.write_all(request.as_bytes()).unwrap();
        let mut start = [0u8; 12];
        stream.read_exact(&mut start).unwrap();
        assert_eq!(&start[9..], status.as_bytes(), "{}", &request[..request.len().min(80)]);
    }
    server.tab().finished();
}

#[test]
fn bad_requests_are_refused_with_their_place_and_the_last_good_picture_stays() {
    let server = small();
    let mut tab = server.tab();
    tab.finished();
    let good = tab.download("document");
    let set = |text: &str| json!({"ask": "set", "sets": [text]});
    let document = |text: &str| json!({"ask": "document", "name": "mine.json", "text": text});
    let most = MAX_VIEW_PIXELS.to_string();
    for (request, needle) in [
        (set("camera.fov=200"), "camera.fov: expected an angle between 0 and 180"),
        (set("camera.fvo=20"), "did you mean \"fov\"?"),
        (set("camera.pos=[0, 0]"), "camera.pos: expected a position"),
        (set("camera.fov=1e999"), "camera.fov"),
        (set("nonsense"), "expected KEY=VALUE"),
        (set("framebuffer.res_w=1000000"), most.as_str()),
        (set("framebuffer.res_w=99999999999"), "whole number"),
        (set("framebuffer.sppx=0"), "framebuffer.sppx"),
        (set("sampler=\"haltn\""), "did you mean \"halton\""),
        (set("sampler=\"center\""), "center"),
        (set("seed=-1"), "seed"),
        (set(&format!("scene.mesh_files=[\"{}etc/passwd\"]", "../".repeat(40))), "in a folder of this scene"),
        (set("scene.mesh_files=[\"/etc/passwd\"]"), "in a folder of this scene"),
        (set("scene.mesh_files=[\"absent.obj\"]"), "absent.obj"),
        (set("camera.pos=[1e30, 0, 0]"), "reach"),
        (document("{"), "mine.json: line 1"),
        (document("[]"), "mine.json: expected an object"),
        (document("{\"a\": 1, \"a\": 2}"), "twice"),
        (document(&"[".repeat(100_000)), "recursion"),
        (document("{\"framebuffer\": {\"res_w\": 8192, \"res_h\": 8192}}"), "sampler-lab render"),
        (json!({"ask": "load", "name": "../Cargo.toml"}), "expected one of the scene files"),
        (json!({"ask": "load", "name": "experiments"}), "expected one of the scene files"),
        (json!({"ask": "save", "name": "a"}), "--data DIR"),
        (json!({"ask": "probe", "x": 32, "y": 0}), "expected one of 32 times 24"),
        (json!({"ask": "pick", "x": 0, "y": 4_000_000_000u32}), "expected one of 32 times 24"),
        (json!({"ask": "points", "x": 0, "y": 0, "decision": "colour"}), "expected a decision"),
        (set("view.second=\"sobol:sheet\""), "view.second: sampler"),
        (set("view.seconds=1e12"), "view.seconds: expected seconds, 0.1 to 3600"),
        (json!({"ask": "download", "what": "png", "panel": 7}), "download"),
        (json!({"ask": "format-disk"}), "expected a request of the page"),
        (json!([1, 2]), "expected a request of the page"),
    ] {
        let error = tab.error(&request);
        assert!(error.contains(needle), "{request}: {error}");
    }
    tab.socket.send(Message::text("no JSON at all \u{0}")).unwrap();
    assert!(tab.until("error").0["text"].as_str().unwrap().contains("message: expected a request"));
    tab.socket.send(Message::binary(vec![0xff; 100])).unwrap();
    assert!(tab.until("error").0["text"].as_str().unwrap().contains("upload: expected a file"));
    assert_eq!(tab.download("document"), good);
    tab.say(&json!({"ask": "restart"}));
    tab.finished();
}

const TRIANGLE: &str = "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl red\nf 1 2 3\n";

#[test]
fn uploads_stay_in_their_folder_and_go_with_the_tab() {
    let server = small();
    let folders = || {
        let entries =
            std::fs::read_dir(std::env::temp_dir()).unwrap().filter_map(|e| e.ok()?.file_name().into_string().ok());
        entries.filter(|name| name.starts_with("sampler-lab-view-")).collect::<Vec<_>>()
    };
    let before = folders();
    let mut tab = server.tab();
    tab.finished();
    let good = tab.download("document");
    for name in
        ["../evil.obj", "/tmp/evil.obj", "a/../../evil.obj", ".profile", "", "a\\..\\b.obj", "C:evil.obj", "a\u{0}.obj"]
    {
        tab.upload(1, name, true, b"x");
        let error = tab.until("error").0["text"].as_str().unwrap().to_owned();
        assert!(error.contains("expected a plain file name"), "{name:?}: {error}");
    }
    tab.upload(2, "a.obj", false, TRIANGLE.as_bytes());
    tab.upload(2, "a.obj", true, b"again");
    assert!(tab.until("error").0["text"].as_str().unwrap().contains("each name once"));
    // What a mesh refers to has to be there, and within reach.
    for library in ["../../../../../../etc/passwd", "/etc/passwd", "absent.mtl"] {
        tab.upload(3, "evil.obj", true, TRIANGLE.replace("m.mtl", library).as_bytes());
        let error = tab.until("error").0["text"].as_str().unwrap().to_owned();
        assert!(
            error.contains("evil.obj:1") && error.contains("in a folder of this scene") && !error.contains("root:"),
            "{error}"
        );
    }
    tab.upload(4, "texture.obj", false, TRIANGLE.as_bytes());
    tab.upload(4, "m.mtl", true, b"newmtl red\nKd 1 0 0\nmap_Kd /etc/hostname\n");
    assert!(tab.until("error").0["text"].as_str().unwrap().contains("in a folder of this scene"));
    for (name, bytes, needle) in [
        ("bad.obj", &b"f 1 2 3\n"[..], "bad.obj"),
        ("bad.json", b"\xff\xfe", "bad.json"),
        ("bad.csv", b"0.5,0.5\n0.5,nan\n", "bad.csv: line 2"),
        ("photo.heic", b"?", "expected a config (.json), a mesh"),
    ] {
        tab.upload(5, name, true, bytes);
        let error = tab.until("error").0["text"].as_str().unwrap().to_owned();
        assert!(error.contains(needle), "{name}: {error}");
    }
    assert_eq!(tab.download("document"), good, "nothing changed so far");
    // A good one, with its material, is looked at from outside.
    tab.upload(6, "tri.obj", false, TRIANGLE.as_bytes());
    tab.upload(6, "m.mtl", true, b"newmtl red\nKd 1 0 0\n");
    let (state, _) = tab.find("the mesh", |m| m["is"] == "state" && m["name"] == "dropped.json");
    assert_eq!((&state["triangles"], &state["config"]["shading"]), (&json!(1), &json!("albedo")));
    let (_, bytes) = tab.finished();
    assert!(bytes.chunks(3).any(|p| p[0] > 50 && p[1] == 0), "red is seen");
    // A point set is measured.
    tab.upload(7, "mine.csv", true, b"x,y\n0.25,0.75\n0.75,0.25\n");
    let (points, _) = tab.until("points");
    assert_eq!(points["sets"][0]["points"], json!([[0.25, 0.75], [0.75, 0.25]]));
    assert!(points["sets"][0]["measured"]["star"]["value"].as_f64().unwrap() > 0.4);
    // Too many.
    for i in 0..MAX_UPLOAD_FILES {
        tab.upload(100 + i as u64, "m.mtl", false, b"");
    }
    assert!(tab.until("error").0["text"].as_str().unwrap().contains("at most 64 files"));

    let made: Vec<String> = folders().into_iter().filter(|f| !before.contains(f)).collect();
    assert!(!made.is_empty());
    drop(tab);
    drop(server);
    // Other tests run at the same time: those of this server are gone with it.
    let left = |f: &String| std::env::temp_dir().join(f).join("1").join("6").join("tri.obj").exists();
    assert!(!made.iter().any(left));
}

#[test]
fn a_message_that_is_too_large_is_refused_in_words_before_it_is_kept() {
    let server = small();
    let mut tab = server.tab();
    tab.upload(1, "huge.obj", true, &vec![b' '; MAX_UPLOAD_BYTES + (1 << 20)]);
    let (refused, _) = tab.until("refused");
    assert!(refused["text"].as_str().unwrap().contains("expected one of bounded size"), "{refused}");
    server.tab().finished();
}

#[test]
fn scenes_of_strangers_stay_within_their_folders_and_bounds() {
    let loaded = load::open(&config("a01.json"), &OpenOptions::default()).unwrap();
    let texels: u64 = loaded.mesh.textures.iter().map(|t| u64::from(t.width) * u64::from(t.height)).sum();
    let (triangles, data) = (loaded.mesh.len(), vec![config("../data")]);
    let open =
        |triangles, texels| load::open_within(loaded.config.clone(), "a01", &data, load::Limits { triangles, texels });
    assert_eq!(open(triangles, texels).unwrap().mesh, loaded.mesh);
    let what = |error: sampler_lab::error::Error| error.to_string();
    assert!(what(open(triangles - 1, texels).unwrap_err()).contains(&format!("at most {} triangles", triangles - 1)));
    assert!(what(open(triangles, texels - 1).unwrap_err()).contains(&format!("at most {} texels", texels - 1)));
    // A link out of the folder is followed before it is judged.
    #[cfg(unix)]
    {
        let folder = tempfile::tempdir().unwrap();
        std::os::unix::fs::symlink(config("../data/checkerpots/checkerpots.obj"), folder.path().join("link.obj"))
            .unwrap();
        let mut linked = loaded.config.clone();
        linked.mesh_files = vec!["link.obj".to_owned()];
        let limits = load::Limits { triangles, texels };
        let error = load::open_within(linked, "linked", &[folder.path().to_owned()], limits).unwrap_err();
        assert!(error.to_string().contains("in a folder of this scene"), "{error}");
    }
}

#[test]
fn tabs_are_counted_and_one_that_vanishes_frees_its_place() {
    let server =
        start("cornell.json", &["framebuffer.res_w=640", "framebuffer.res_h=360", "framebuffer.sppx=100000"], &[]);
    let mut tabs: Vec<Tab> = (0..MAX_TABS).map(|_| server.tab()).collect();
    let (refused, _) = server.socket().next();
    assert!(refused["is"] == "refused" && refused["text"].as_str().unwrap().contains("tabs at a time"), "{refused}");
    // In the middle of its work, without a good-bye.
    drop(tabs.pop());
    let started = Instant::now();
    loop {
        let mut tab = server.socket();
        let (first, _) = tab.next();
        if first["is"] == "hello" {
            break;
        }
        assert!(started.elapsed() < PATIENCE, "a place is free again");
        std::thread::sleep(Duration::from_millis(50));
    }
}

#[test]
fn the_scene_that_cannot_be_shown_is_refused_before_the_port_is_taken() {
    let bind = |scene: &str, sets: &[&str]| {
        let sets = sets.iter().map(|s| (*s).to_owned()).collect();
        Server::bind(&Options { scene: Some(config(scene)), data: Vec::new(), sets, port: 0 }).map(|_| ()).unwrap_err()
    };
    for (scene, sets, needle) in [
        ("absent.json", &[][..], "absent.json"),
        ("cornell.json", &["framebuffer.res_w=8000", "framebuffer.res_h=8000"], "pixels in the view"),
        ("cornell.json", &["sampler=nonsense"], "nonsense"),
        ("cornell.json", &["scene.mesh_files=[\"absent.obj\"]"], "absent.obj"),
    ] {
        let error = bind(scene, sets);
        assert!(error.exit_code() == 2 && error.to_string().contains(needle), "{error}");
    }
    let taken = small();
    let again = Options { scene: Some(config("cornell.json")), port: taken.port, ..Options::default() };
    let error = Server::bind(&again).map(|_| ()).unwrap_err().to_string();
    assert!(error.contains("--port: expected a port that is free"), "{error}");
}
