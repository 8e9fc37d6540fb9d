//! Results of a comparison, shown as text, JSON, CSV, Markdown or HTML.

pub mod auto;
pub mod cost;
pub mod csv;
pub mod growth;
pub mod html;
pub mod json;
pub mod markdown;
pub mod sweep;
pub mod table;
mod tables;
pub mod text;

use super::clock::Spread;
use super::compare::{Plan, break_even};
use super::machine::Machine;
use super::pruning::Pruning;
use super::rays::{Class, RaySet};
use super::row::{ClassRow, Row};
use crate::accel::auto::Reason;
use crate::accel::{AccelKind, Count};
use crate::generate::Family;
use crate::number::{grouped, so_many};
use crate::render::View;
use std::path::Path;

/// Results of all models of one command.
#[derive(Clone, Debug)]
pub struct Report {
    /// Machine and build of the measurement.
    pub machine: Machine,
    /// Settings of the comparison.
    pub plan: Plan,
    /// Models in the order of measurement; rows of the last one may be missing while it is under way.
    pub models: Vec<Model>,
    /// Family of the models, if they are one family in growing sizes.
    pub family: Option<Family>,
    /// Count at the brightest colour of heat maps; `None`: the maximum of all pixels.
    pub heatmap_max: Option<u32>,
    /// Two structures for the difference image; `None`: the fast ones, or else the first two.
    pub compare: Option<[AccelKind; 2]>,
    /// Whether the measurement is finished.
    pub complete: bool,
}

/// Results of one model.
#[derive(Clone, Debug)]
pub struct Model {
    /// File name as typed.
    pub name: String,
    /// Hash of everything that was read.
    pub hash: u128,
    /// Number of shapes of all kinds: N.
    pub prims: usize,
    /// Number of objects that the shapes belong to, as bounded by `spheres` and `boxes`.
    pub objects: usize,
    /// Number of kept instances, whose triangles are stored once.
    pub kept: usize,
    /// Choice of `auto` with its reason, if evaluated.
    pub auto: Option<Reason>,
    /// Width in pixels of the picture whose rays were recorded.
    pub width: u32,
    /// Height of the picture in pixels.
    pub height: u32,
    /// Samples per pixel.
    pub samples: u32,
    /// Maximum number of bounces after the primary ray.
    pub depth: u32,
    /// Camera in words.
    pub view: String,
    /// Exact camera.
    pub camera: View,
    /// Numbers of rays, by class.
    pub rays: Vec<Rays>,
    /// One row per structure.
    pub rows: Vec<Row>,
    /// Structures not measured: too slow for so many prims, or unable to keep instances.
    pub left_out: Vec<AccelKind>,
    /// Saving of pruning; `None` if not measured.
    pub pruning: Option<Pruning>,
}

/// Numbers of rays of one class.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rays {
    /// Class of the rays.
    pub class: Class,
    /// Rays asked by the picture.
    pub asked: u64,
    /// Rays kept and measured.
    pub kept: usize,
}

impl Rays {
    /// Numbers of a ray set.
    pub fn of(set: &RaySet) -> Self {
        Self { class: set.class, asked: set.asked, kept: set.len() }
    }
}

impl Model {
    /// Seconds per ray, with the classes weighted as in the picture, even if only samples were kept.
    pub fn seconds_per_ray(&self, row: &Row) -> f64 {
        row.seconds_per_ray(&self.mixture(), Spread::median)
    }

    /// The same if every class had its fastest pass at once, and if every class had its slowest.
    pub fn seconds_range(&self, row: &Row) -> [f64; 2] {
        let mixture = self.mixture();
        [Spread::min, Spread::max].map(|pick| row.seconds_per_ray(&mixture, pick))
    }

    fn mixture(&self) -> Vec<u64> {
        self.rays.iter().map(|r| r.asked).collect()
    }

    /// Mean of a count per ray, with the classes weighted as in the picture.
    pub fn per_ray(&self, row: &Row, count: Count) -> f64 {
        self.mean(row, |class| class.per_ray(count))
    }

    /// Mean of a value of each class, with the classes weighted as in the picture.
    fn mean(&self, row: &Row, of: impl Fn(&ClassRow) -> f64) -> f64 {
        let all: u64 = self.rays.iter().map(|r| r.asked).sum();
        let sum: f64 = row.classes.iter().zip(&self.rays).map(|(class, r)| of(class) * r.asked as f64).sum();
        sum / all as f64
    }

    /// Rays after which building has paid off against testing every prim; `None` when it never does, or `none` was not measured.
    pub fn break_even(&self, row: &Row) -> Option<f64> {
        let none = self.rows.iter().find(|r| r.kind == AccelKind::None && r.kind != row.kind)?;
        break_even(row.build.median(), self.seconds_per_ray(row), self.seconds_per_ray(none))
    }

    /// Number of rays whose answer differed between structures.
    pub fn differing(&self) -> u64 {
        self.rows.iter().map(Row::differing).sum()
    }

    /// Structure whose answers are the reference for the others.
    pub fn reference(&self) -> Option<AccelKind> {
        let fast = self.rows.iter().find(|r| !r.kind.is_slow());
        fast.or(self.rows.first()).map(|r| r.kind)
    }

    /// Number of rays that more than one structure got, and whose hits were therefore compared.
    pub fn compared(&self) -> u64 {
        let mut rays: Vec<u64> = self.rows.iter().map(Row::rays).collect();
        rays.sort_unstable();
        rays.iter().rev().nth(1).copied().unwrap_or(0)
    }

    /// Sentence on whether all structures agree.
    pub fn verdict(&self) -> String {
        let (count, differing, compared) = (self.rows.len(), self.differing(), self.compared());
        let reference = self.reference().map_or("", AccelKind::name);
        if differing > 0 {
            let wrong = self.rows.iter().filter(|r| r.differing() > 0);
            let wrong: Vec<String> =
                wrong.map(|r| format!("{} in {} rays", r.name(), grouped(r.differing()))).collect();
            return format!("hits DIFFER from those of {reference}: {}", wrong.join(", "));
        }
        let fewer = self.rows.iter().filter(|r| r.rays() < compared);
        let fewer: Vec<&str> = fewer.map(|r| r.kind.name()).collect();
        let but = if fewer.is_empty() { String::new() } else { format!(" (a sample for {})", fewer.join(", ")) };
        match &self.rows[..] {
            [only] => format!("one structure only, {} rays: nothing to compare its hits with", grouped(only.rays())),
            _ => {
                let rays = grouped(compared);
                format!("hits identical, bit for bit, in all {count} structures: {rays} rays{but}")
            }
        }
    }

    /// Numbers of prims and objects, in words.
    pub fn size(&self) -> String {
        let prims = grouped(self.prims as u64);
        if self.kept > 0 {
            let [objects, kept] = [self.objects, self.kept].map(|n| grouped(n as u64));
            return format!(
                "{prims} prims in {objects} objects, {kept} of which are instances whose triangles are kept once"
            );
        }
        match self.objects {
            0 => format!("{prims} prims in no object"),
            1 => format!("{prims} prims in one object: spheres and boxes can only bound the whole"),
            n => format!("{prims} prims in {} objects", grouped(n as u64)),
        }
    }

    /// Picture whose rays were recorded, in words.
    pub fn picture(&self) -> String {
        let Self { width, height, samples, depth, view, .. } = self;
        let samples = so_many(u64::from(*samples), "sample");
        format!("{width}×{height}, {samples} a pixel, depth {depth}, {view}")
    }
}

impl Report {
    /// Whether times were measured.
    pub fn is_timed(&self) -> bool {
        self.plan.passes > 0
    }

    /// Note to add where the times of two structures are compared: empty if all passes of one beat all of the other.
    fn doubt(&self, model: &Model, a: &Row, b: &Row) -> &'static str {
        let [[low, high], [other_low, other_high]] = [a, b].map(|row| model.seconds_range(row));
        match self.plan.passes {
            0 => "",
            1 => " (one pass only, so of unknown spread)",
            _ if high < other_low || other_high < low => "",
            _ => " (within the spread of the passes)",
        }
    }

    /// Sentence on how times were measured.
    pub fn method(&self) -> String {
        let Plan { passes, threads, seed, slow_tests, .. } = &self.plan;
        let on = if *threads == 1 { "one thread".to_owned() } else { format!("{threads} threads") };
        let times = match *passes {
            0 => "no times were taken".to_owned(),
            1 => format!("times: wall clock of {on}, one pass only, so of unknown spread"),
            n => format!("times: wall clock of {on}, median and range of {n} interleaved passes"),
        };
        let (tests, fewest) = (grouped(*slow_tests), Plan::FEWEST);
        format!(
            "{times}; counts from separate passes; slow structures get a sample of at most {tests} tests a class, but of \
             {fewest} rays at least; seed {seed}"
        )
    }
}

/// Formats of report files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Schema `meshray-bench/1`.
    Json,
    /// One line per structure and class.
    Csv,
    /// Tables for a Markdown document.
    Markdown,
    /// Page with plots.
    Html,
}

impl Format {
    /// Format by the file name's extension.
    pub fn from_path(path: &Path) -> Result<Self, String> {
        let ending = path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
        match ending.as_str() {
            "json" => Ok(Self::Json),
            "csv" => Ok(Self::Csv),
            "md" => Ok(Self::Markdown),
            "html" | "htm" => Ok(Self::Html),
            _ => Err(format!("{}: a report ends in .json, .csv, .md or .html", path.display())),
        }
    }

    /// Writes the report in this format.
    pub fn write(self, report: &Report) -> String {
        match self {
            Self::Json => json::write(report),
            Self::Csv => csv::write(report),
            Self::Markdown => markdown::write(report),
            Self::Html => html::write(report),
        }
    }
}

/// Glossary of the names of counts.
pub const WORDS: [(&str, &str); 16] = [
    ("*", "tests so much that it got an even sample of the rays"),
    ("n_in", "inner nodes"),
    ("n_v", "leaf cells"),
    ("n_ev", "empty ones among them"),
    ("t_b", "time to build"),
    ("n_it", "ray/prim tests a ray"),
    ("n_ts", "nodes and cells visited a ray"),
    ("n_ets", "leaf cells visited a ray"),
    ("n_eets", "empty ones among them"),
    ("n_bit", "ray/volume tests a ray"),
    ("n_mb", "tests saved by the mailbox a ray"),
    ("n_xf", "points transformed a ray: into its axes, or corners of a kept instance to where it stands"),
    ("n_min", "hits a ray: tests that nothing can save"),
    ("culled", "share of all ray/prim tests not done"),
    ("n_oiv", "prims listed in all cells"),
    ("break-even", "rays after which building has paid against testing everything"),
];
