//! `cargo bench`: rays a second by kernel, kind of ray and way of asking, medians with their spread.
//!
//! `cargo bench -- WORDS` takes parts of names as `sampler-lab bench` does, and a number for the seconds; else all rays on the
//! landscape of 200 000 triangles for half a minute.

use std::rc::Rc;
use std::time::Duration;

use sampler_lab::bench::{self, Lab};
use sampler_lab::error::Result;

fn main() -> Result<()> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    // `cargo test --benches` does not ask for measurements.
    if !words.iter().any(|word| word == "--bench") {
        return Ok(());
    }
    let (mut names, mut seconds) = (Vec::new(), 30.0);
    for word in words.into_iter().filter(|word| !word.starts_with('-')) {
        match word.parse::<f64>() {
            Ok(number) if number > 0.0 && number < 86_400.0 => seconds = number,
            _ => names.push(word),
        }
    }
    if names.is_empty() {
        names.push("rays/landscape-200k".to_owned());
    }
    let lab = Rc::new(Lab::default());
    println!("{}", bench::host());
    for (_, cases) in bench::select(&lab, &names)? {
        println!("\n{}", bench::table(&bench::run(cases, Duration::from_secs_f64(seconds), &mut |_| ())?));
    }
    Ok(())
}
