//! The machine that timings come from, as far as the system tells.

/// Operating system, architecture, processor and the number of threads that it offers. Names no host.
pub fn describe() -> String {
    let threads = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    let processor = std::fs::read_to_string("/proc/cpuinfo").ok().and_then(|text| {
        let line = text.lines().find(|line| line.starts_with("model name"))?;
        Some(line.split_once(':')?.1.trim().to_owned())
    });
    let processor = processor.map(|name| format!(", {name}")).unwrap_or_default();
    format!("{} {}{processor}, {threads} threads", std::env::consts::OS, std::env::consts::ARCH)
}

/// Load average of the last minute.
pub fn load() -> Option<f64> {
    std::fs::read_to_string("/proc/loadavg").ok()?.split_whitespace().next()?.parse().ok()
}
