//! The pages in a real browser: headless Chromium, driven over its debugging pipe.
//!
//! Where there is no Chromium these tests say so and pass; with `BROWSER_TESTS=required`, as `.ci/run` sets it, they fail
//! then. `CHROMIUM` names the program where it is not on the path.
#![cfg(unix)]

mod accessibility;
mod chromium;
mod report;
mod view;

use chromium::Browser;

#[test]
fn the_harness_loads_types_points_and_looks() {
    let Some(browser) = Browser::start() else { return };
    let page = browser.page();
    page.set_offline();
    page.prefer("dark");
    page.open(
        "data:text/html,<body style='margin:0;background:%23204060'><input autofocus>\
         <button style='position:absolute;left:100px;top:200px;width:80px;height:40px' onclick='window.clicked=1'>b</button>\
         <script>onmousemove=e=>{window.at=e.clientX};onmouseup=e=>{window.up=e.clientY};onwheel=e=>{window.turned=e.deltaY}</script>",
    );
    page.evaluate("document.querySelector('input').focus()");
    page.key("a");
    page.key("7");
    assert_eq!(page.evaluate("document.querySelector('input').value"), "a7");
    page.mouse_move((321.0, 300.0));
    assert_eq!(page.evaluate("window.at"), 321);
    assert_eq!(page.middle("button"), (140.0, 220.0));
    page.click(page.middle("button"), "left");
    page.drag((10.0, 300.0), (90.0, 350.0));
    page.wheel((300.0, 300.0), 120.0);
    let seen = page.evaluate(
        "[window.clicked, window.at, window.up, window.turned, matchMedia('(prefers-color-scheme: dark)').matches]",
    );
    assert_eq!(seen, serde_json::json!([1, 90, 350, 120, true]));
    page.resize(600, 400);
    let picture = page.screenshot();
    assert_eq!((picture.width(), picture.height(), picture.get_pixel(500, 300).0), (600, 400, [0x20, 0x40, 0x60]));
    assert_eq!(page.evaluate("fetch('http://127.0.0.1:9/').then(() => 'sent', () => 'refused')"), "refused");
    assert!(page.requests().iter().any(|url| url.starts_with("http://127.0.0.1:9/")), "the log misses a request");
    assert_eq!(page.errors().len(), 1, "the refused request: {:?}", page.errors());
    let other = browser.page();
    assert!(other.requests().is_empty(), "each page has its own log");
}
