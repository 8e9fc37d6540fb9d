//! What a comparison found, and how it is shown: as text, JSON, CSV, Markdown or a page for a browser.

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

/// All models of one command.
#[derive(Clone, Debug)]
pub struct Report {
    /// Where it was made.
    pub machine: Machine,
    /// How.
    pub plan: Plan,
    /// In the order they were measured; the last one's rows may be missing while it is under way.
    pub models: Vec<Model>,
    /// What the models are, where they are one family in growing sizes.
    pub family: Option<Family>,
    /// What the brightest colour of heat maps stands for; `None`: the most tests of any pixel.
    pub heatmap_max: Option<u32>,
    /// Two structures for the difference image; `None`: the fast ones, or the first two.
    pub compare: Option<[AccelKind; 2]>,
    /// Whether everything is done.
    pub complete: bool,
}

/// One model.
#[derive(Clone, Debug)]
pub struct Model {
    /// The file as typed.
    pub name: String,
    /// Of everything that was read.
    pub hash: u128,
    /// Shapes of all kinds: N.
    pub prims: usize,
    /// Objects that they belong to, as `spheres` and `boxes` have them.
    pub objects: usize,
    /// Instances that are kept, so that their triangles are stored once.
    pub kept: usize,
    /// What `auto` would choose and why, where that was asked.
    pub auto: Option<Reason>,
    /// Columns of the picture whose rays were recorded.
    pub width: u32,
    /// Its rows.
    pub height: u32,
    /// Samples a pixel.
    pub samples: u32,
    /// Bounces after the eye ray.
    pub depth: u32,
    /// Seen from where, in words, …
    pub view: String,
    /// … and exactly.
    pub camera: View,
    /// The rays.
    pub rays: Vec<Rays>,
    /// One for each structure.
    pub rows: Vec<Row>,
    /// Slow structures that could not bear so many prims, or those that cannot keep instances.
    pub left_out: Vec<AccelKind>,
    /// What is saved by leaving out what the scene does not need; `None`: not measured.
    pub pruning: Option<Pruning>,
}

/// How many rays there were of a class.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rays {
    /// The class.
    pub class: Class,
    /// Asked by the picture.
    pub asked: u64,
    /// Kept and measured.
    pub kept: usize,
}

impl Rays {
    /// Of a set.
    pub fn of(set: &RaySet) -> Self {
        Self { class: set.class, asked: set.asked, kept: set.len() }
    }
}

impl Model {
    /// Seconds for a ray of the picture's mixture, of whose classes a part may be kept.
    pub fn seconds_per_ray(&self, row: &Row) -> f64 {
        row.seconds_per_ray(&self.mixture(), Spread::median)
    }

    /// The same if every class had its fastest pass at once, and its slowest.
    pub fn seconds_range(&self, row: &Row) -> [f64; 2] {
        let mixture = self.mixture();
        [Spread::min, Spread::max].map(|pick| row.seconds_per_ray(&mixture, pick))
    }

    fn mixture(&self) -> Vec<u64> {
        self.rays.iter().map(|r| r.asked).collect()
    }

    /// A count for a ray of the picture's mixture.
    pub fn per_ray(&self, row: &Row, count: Count) -> f64 {
        self.mean(row, |class| class.per_ray(count))
    }

    /// What is known of each class, for a ray of the picture's mixture.
    fn mean(&self, row: &Row, of: impl Fn(&ClassRow) -> f64) -> f64 {
        let all: u64 = self.rays.iter().map(|r| r.asked).sum();
        let sum: f64 = row.classes.iter().zip(&self.rays).map(|(class, r)| of(class) * r.asked as f64).sum();
        sum / all as f64
    }

    /// Rays after which building has paid against testing everything; `None` when it never does, or `none` was not
    /// measured.
    pub fn break_even(&self, row: &Row) -> Option<f64> {
        let none = self.rows.iter().find(|r| r.kind == AccelKind::None && r.kind != row.kind)?;
        break_even(row.build.median(), self.seconds_per_ray(row), self.seconds_per_ray(none))
    }

    /// Rays whose answer differed between structures.
    pub fn differing(&self) -> u64 {
        self.rows.iter().map(Row::differing).sum()
    }

    /// The structure whose answers the others must have.
    pub fn reference(&self) -> Option<AccelKind> {
        let fast = self.rows.iter().find(|r| !r.kind.is_slow());
        fast.or(self.rows.first()).map(|r| r.kind)
    }

    /// Rays that more than one structure got, which are the ones whose hits were compared.
    pub fn compared(&self) -> u64 {
        let mut rays: Vec<u64> = self.rows.iter().map(Row::rays).collect();
        rays.sort_unstable();
        rays.iter().rev().nth(1).copied().unwrap_or(0)
    }

    /// Whether all structures agree, in a sentence.
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

    /// Its prims and objects.
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

    /// What picture the rays are from.
    pub fn picture(&self) -> String {
        let Self { width, height, samples, depth, view, .. } = self;
        let samples = so_many(u64::from(*samples), "sample");
        format!("{width}×{height}, {samples} a pixel, depth {depth}, {view}")
    }
}

impl Report {
    /// Whether times were taken.
    pub fn is_timed(&self) -> bool {
        self.plan.passes > 0
    }

    /// What to add where the times of two structures are told apart: nothing, where all passes of one beat all of the other.
    fn doubt(&self, model: &Model, a: &Row, b: &Row) -> &'static str {
        let [[low, high], [other_low, other_high]] = [a, b].map(|row| model.seconds_range(row));
        match self.plan.passes {
            0 => "",
            1 => " (one pass only, so of unknown spread)",
            _ if high < other_low || other_high < low => "",
            _ => " (within the spread of the passes)",
        }
    }

    /// How times were taken, in a sentence.
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

/// Types of report files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Schema `meshray-bench/1`.
    Json,
    /// One line for each structure and class.
    Csv,
    /// Tables for a document.
    Markdown,
    /// A page with plots.
    Html,
}

impl Format {
    /// By the ending of a file's name.
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

    /// The report in this format.
    pub fn write(self, report: &Report) -> String {
        match self {
            Self::Json => json::write(report),
            Self::Csv => csv::write(report),
            Self::Markdown => markdown::write(report),
            Self::Html => html::write(report),
        }
    }
}

/// What the names of counts mean, a line each.
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
