use sampler_lab::check;
#[test]
fn tmp() {
    for c in check::all() {
        let t = std::time::Instant::now();
        let r = check::run(&c, &check::Settings::default());
        println!("{} {} {:?} {:?}", c.name, r.finding.passed, t.elapsed(), r.finding);
    }
}
#[cfg(feature = "mutants")]
#[test]
fn muts() {
    use sampler_lab::mutants::*;
    for &m in Mutant::ALL {
        plant(Some(m));
        let caught: Vec<&str> = check::all()
            .iter()
            .filter(|c| !check::run(c, &check::Settings::default()).finding.passed)
            .map(|c| c.name)
            .collect();
        println!("{} {} {:?}", if caught.contains(&m.caught_by()) { "ok" } else { "MISS" }, m.name(), caught);
    }
}
