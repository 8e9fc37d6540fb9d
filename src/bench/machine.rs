//! Machine and build of a measurement.

use crate::math::simd::Level;
use crate::threads;
use std::fs;

/// Properties that times depend on; counts do not.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Machine {
    /// Name of the processor.
    pub cpu: String,
    /// Number of hardware threads available to the process.
    pub cores: usize,
    /// Operating system and CPU architecture.
    pub system: String,
    /// Instruction set level that the kernels use.
    pub simd: String,
    /// Compiler version.
    pub compiler: &'static str,
    /// Compiler flags.
    pub flags: &'static str,
    /// Version of meshray.
    pub version: &'static str,
}

impl Machine {
    /// Describes this machine and build.
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

    /// Summary in one line.
    pub fn line(&self) -> String {
        let Self { cpu, cores, system, simd, compiler, flags, version } = self;
        format!("meshray {version}, {compiler}, {flags}; {cpu}, {cores} cores, {simd}, {system}")
    }
}

/// Name of the processor; only Linux offers it in a file.
fn cpu() -> Option<String> {
    let text = fs::read_to_string("/proc/cpuinfo").ok()?;
    let line = text.lines().find(|l| l.starts_with("model name"))?;
    Some(line.split_once(':')?.1.trim().to_owned())
}
