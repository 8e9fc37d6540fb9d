//! Where and by what a measurement was made.

use crate::math::simd::Level;
use crate::threads;
use std::fs;

/// What times depend on; counts do not.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Machine {
    /// The processor as it calls itself.
    pub cpu: String,
    /// Threads that it runs at once, as far as we may use them.
    pub cores: usize,
    /// Operating system and instruction set.
    pub system: String,
    /// What the kernels found there.
    pub simd: String,
    /// The compiler.
    pub compiler: &'static str,
    /// How it was told to compile.
    pub flags: &'static str,
    /// Of meshray.
    pub version: &'static str,
}

impl Machine {
    /// This one.
    pub fn here() -> Self {
        Self {
            cpu: cpu().unwrap_or_else(|| "unknown".into()),
            cores: threads::available(),
            system: format!("{} {}", std::env::consts::OS, std::env::consts::ARCH),
            simd: Level::best().name().to_owned(),
            compiler: env!("MESHRAY_COMPILER"),
            flags: env!("MESHRAY_FLAGS"),
            version: env!("CARGO_PKG_VERSION"),
        }
    }

    /// One line.
    pub fn line(&self) -> String {
        let Self { cpu, cores, system, simd, compiler, flags, version } = self;
        format!("meshray {version}, {compiler}, {flags}; {cpu}, {cores} cores, {simd}, {system}")
    }
}

/// Only Linux tells in a file.
fn cpu() -> Option<String> {
    let text = fs::read_to_string("/proc/cpuinfo").ok()?;
    let line = text.lines().find(|l| l.starts_with("model name"))?;
    Some(line.split_once(':')?.1.trim().to_owned())
}
