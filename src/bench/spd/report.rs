//! Comparison of our counts with the published ones, in every report format.

use super::measure::{Measured, Row};
use super::published::{Figures, HainesRays};
use crate::bench::machine::Machine;
use crate::bench::report::table::Table;
use crate::bench::report::{Format, html};
use crate::number::{grouped, hash, short};
use serde_json::{Value, json};

/// Schema of the JSON report.
pub const SCHEMA: &str = "meshray-spd/1";

/// Relative difference up to which a count passes as equal: 15 %.
pub const NEAR: f64 = 0.15;

/// Relative difference up to which Haines' numbers of rays pass as equal: 0.5 %.
const NEAR_RAYS: f64 = 0.005;

/// Results of all measured scenes.
#[derive(Clone, Debug)]
pub struct Report {
    /// Machine and build of the measurement.
    pub machine: Machine,
    /// Approximate limit of ray/object tests per structure.
    pub tests: u64,
    /// Seed of the sampling.
    pub seed: u64,
    /// Scenes in the requested order.
    pub scenes: Vec<Measured>,
}

/// Notes on how to read a report.
pub const NOTES: [&str; 5] = [
    "Published: E. Haines' counts of rays (in the notes to his databases); V. Havran and F. Sixta, Comparison of \
     Hierarchical Grids, and V. Havran, Comparison of Octree Traversal Algorithms (variant Octree84-C), 1999",
    "Their rules are switched on: eye rays through pixel corners, five generations, objects assigned to cells by their \
     boxes, no mailbox, one object a leaf, and shadow rays ask only whether anything is in the way",
    "n_it, n_ets, n_eets and n_ts are per ray. But n_it of the octrees is per required hit (hits of all rays together), \
     which is what the published column divides by: so divided it agrees at every depth, and per ray nowhere; the \
     grids' column is per ray",
    "n_ts is defined differently by every program and is only printed",
    "Thick faces: boxes that reach beyond faces along their normals by a length that was found by trying, as nothing is \
     published about it (gears 0.0222, mount 0.0008); with it gears has the published numbers of nodes and of empty \
     cells, while tetra has every octree exactly as published without",
];

impl Report {
    /// Results, one sentence each.
    pub fn verdicts(&self) -> Vec<String> {
        if self.scenes.is_empty() {
            return Vec::new();
        }
        let differing: u64 = self.scenes.iter().flat_map(|s| &s.rows).map(|r| r.differing).sum();
        let rays: u64 = self.scenes.iter().flat_map(|s| &s.rows).map(|r| r.rays).sum();
        let agree = match differing {
            0 => format!("every structure found the same hits, bit for bit: {} answers compared", grouped(rays)),
            n => format!("{} of {} answers DIFFER between structures", grouped(n), grouped(rays)),
        };
        vec![agree, self.eye_verdict(), self.haines_verdict(), self.structure_verdict(), self.cells_verdict()]
    }

    fn eye_verdict(&self) -> String {
        let equal = self.scenes.iter().filter(|s| s.eye_hits_off() == 0).count();
        let others: Vec<String> = self
            .scenes
            .iter()
            .filter(|s| s.eye_hits_off() != 0)
            .map(|s| format!("{} {:+}", s.published.name, s.eye_hits_off()))
            .collect();
        let but = if others.is_empty() { String::new() } else { format!("; {}", others.join(", ")) };
        format!("eye rays that hit: equal to Havran and Sixta's in {equal} of {} scenes{but}", self.scenes.len())
    }

    fn haines_verdict(&self) -> String {
        let off = |s: &Measured| {
            let pairs = haines_pairs(s).into_iter().skip(1);
            pairs
                .filter_map(|(what, ours, theirs)| Some((s.published.name, what, off(ours as f64, theirs? as f64)?)))
                .collect::<Vec<_>>()
        };
        let all: Vec<_> = self.scenes.iter().flat_map(off).collect();
        let far: Vec<String> = all
            .iter()
            .filter(|(_, _, off)| off.abs() > NEAR_RAYS)
            .map(|(scene, what, off)| format!("{scene}, {what} {}", percent(*off)))
            .collect();
        let but = if far.is_empty() { String::new() } else { format!("; {}", far.join(", ")) };
        format!(
            "Haines' reflected, refracted and shadow rays: {} of {} counts within 0.5 %{but}",
            all.len() - far.len(),
            all.len()
        )
    }

    fn structure_verdict(&self) -> String {
        let near = |octree: bool, thick: bool| {
            let rows = self.rows().filter(|(_, r)| r.setting.is_octree() == octree && (r.thickness > 0.0) == thick);
            let (near, far): (Vec<_>, Vec<_>) = rows.partition(|(s, r)| is_near(s, r));
            let names: Vec<String> =
                far.iter().map(|(s, r)| format!("{} {}", s.published.name, r.short_name())).collect();
            let but = if names.is_empty() { String::new() } else { format!(" (not: {})", names.join(", ")) };
            format!("{} of {}{but}", near.len(), near.len() + far.len())
        };
        let thick = match self.rows().any(|(_, r)| r.thickness > 0.0) {
            true => format!("; with thick faces octrees {}, grids {}", near(true, true), near(false, true)),
            false => String::new(),
        };
        format!("n_it and n_ets within 15 %: octrees {}; grids {}{thick}", near(true, false), near(false, false))
    }

    fn cells_verdict(&self) -> String {
        let octrees = self.rows().map(|(_, r)| r).filter(|r| r.setting.is_octree() && r.thickness == 0.0);
        let rows: Vec<&Row> = octrees.collect();
        let same = |of: fn(&Figures) -> u64| rows.iter().filter(|r| of(&r.ours) == of(&r.theirs)).count();
        format!(
            "octrees with exactly the published number of cells: {} of {n}, of references: {} of {n}",
            same(|c| c.n_v),
            same(|c| c.n_oiv),
            n = rows.len()
        )
    }

    fn rows(&self) -> impl Iterator<Item = (&Measured, &Row)> {
        self.scenes.iter().flat_map(|s| s.rows.iter().map(move |r| (s, r)))
    }

    /// Whether all structures agree, the number of primary hits is within 2 of the published one, and that of objects is equal.
    pub fn is_right(&self) -> bool {
        let agree = self.scenes.iter().flat_map(|s| &s.rows).all(|r| r.differing == 0);
        agree && self.scenes.iter().all(|s| s.eye_hits_off().abs() <= 2 && s.objects == s.published.objects as usize)
    }

    /// Writes the report in a format.
    pub fn write(&self, format: Format) -> String {
        match format {
            Format::Json => format!("{:#}\n", self.json()),
            Format::Csv => self.csv(),
            Format::Markdown => {
                let tables: String = self.tables().iter().map(|t| format!("\n{}", t.markdown())).collect();
                format!("# meshray bench --spd\n\n{}\n{tables}\n{}\n", bullets(&self.verdicts()), self.notes())
            }
            Format::Html => {
                let said: String = self.verdicts().iter().map(|v| html::paragraph(v)).collect();
                let tables: String = self.tables().iter().map(html::table).collect();
                let notes: String = self.note_lines().iter().map(|n| html::paragraph(n)).collect();
                let body = format!("{said}{tables}<section><h2>How to read it</h2>{notes}</section>");
                html::page("Standard Procedural Databases, ours beside the figures of 1999", &body)
            }
        }
    }

    fn tables(&self) -> Vec<Table> {
        self.scenes.iter().flat_map(tables).collect()
    }

    /// Notes on how to read the report and where it was made.
    pub fn notes(&self) -> String {
        bullets(&self.note_lines())
    }

    fn note_lines(&self) -> Vec<String> {
        let sample = format!(
            "a structure gets as many rays, spread evenly, as {} tests allow by the published figures; seed {}",
            grouped(self.tests),
            self.seed
        );
        NOTES.iter().map(|n| (*n).to_owned()).chain([sample, self.machine.line()]).collect()
    }

    fn json(&self) -> Value {
        let m = &self.machine;
        json!({
            "schema": SCHEMA, "version": m.version, "verdicts": self.verdicts(),
            "machine": { "cpu": m.cpu, "cores": m.cores, "system": m.system, "compiler": m.compiler, "flags": m.flags },
            "settings": { "tests": self.tests, "seed": self.seed },
            "scenes": self.scenes.iter().map(scene_json).collect::<Vec<_>>(),
        })
    }

    fn csv(&self) -> String {
        let counts = ["n_in", "n_v", "n_ev", "n_oiv", "n_it", "n_ets", "n_eets", "n_ts"];
        let pairs: Vec<String> = counts.iter().flat_map(|c| [format!("{c}_ours"), format!("{c}_1999")]).collect();
        let mut out = format!("scene,structure,rays,differing,{}\n", pairs.join(","));
        for (scene, row) in self.scenes.iter().flat_map(|s| s.rows.iter().map(move |r| (s, r))) {
            let both = values(scene.comparable(row)).into_iter().zip(values(row.theirs));
            let cells: Vec<String> = both.flat_map(|(a, b)| [a.to_string(), b.to_string()]).collect();
            out += &format!(
                "{},{},{},{},{}\n",
                scene.published.name,
                row.short_name(),
                row.rays,
                row.differing,
                cells.join(",")
            );
        }
        out
    }
}

/// Tables of a scene: rays, then structures.
pub fn tables(scene: &Measured) -> [Table; 2] {
    [ray_table(scene), structure_table(scene)]
}

fn ray_table(scene: &Measured) -> Table {
    let (p, o) = (scene.published.rays, scene.outward);
    let name = scene.published.name;
    let row = |what: &str, ours: u64, theirs: Option<u64>, source: &str| {
        let off = theirs.and_then(|t| off(ours as f64, t as f64)).map_or("-".into(), percent);
        vec![what.into(), grouped(ours), theirs.map_or("-".into(), grouped), off, source.into()]
    };
    let mut rows: Vec<Vec<String>> =
        haines_pairs(scene).into_iter().map(|(what, ours, theirs)| row(what, ours, theirs, "Haines")).collect();
    if scene.published.haines.is_none() {
        rows.clear();
    }
    rows.extend(
        [
            ("eye rays", o.primary, p.primary),
            ("that hit", o.primary_hits, p.primary_hits),
            ("reflected and refracted", o.secondary(), p.secondary),
            ("that hit", o.secondary_hits, p.secondary_hits),
            ("shadow, from outsides only", o.shadow, p.shadow),
            ("that meet something", o.shadow_hits, p.shadow_hits),
        ]
        .map(|(what, ours, theirs)| row(what, ours, Some(theirs), "Havran, Sixta")),
    );
    let [objects, theirs] = [scene.objects as u64, u64::from(scene.published.objects)].map(grouped);
    let title = format!("{name}: {objects} objects ({theirs} published); rays");
    Table { title, columns: ["rays", "ours", "published", "off", "by"].map(String::from).to_vec(), rows }
}

/// Haines' counts: name, ours, his.
fn haines_pairs(scene: &Measured) -> Vec<(&'static str, u64, Option<u64>)> {
    let t = scene.turned;
    let of = |get: fn(HainesRays) -> u64| scene.published.haines.map(get);
    vec![
        ("eye rays that hit", t.primary_hits, of(|h| h.primary_hits)),
        ("reflected", t.reflected, of(|h| h.reflected)),
        ("refracted", t.refracted, of(|h| h.refracted)),
        ("shadow", t.shadow, of(|h| h.shadow)),
    ]
}

fn structure_table(scene: &Measured) -> Table {
    let columns = ["structure", "rays", "n_in", "n_v", "n_ev", "n_oiv", "n_it", "n_ets", "n_eets", "n_ts"];
    let rows = scene.rows.iter().flat_map(|row| {
        let (ours, theirs) = (scene.comparable(row), row.theirs);
        let shown = |c: Figures| {
            let whole = [c.n_in, c.n_v, c.n_ev, c.n_oiv].map(grouped);
            let rates =
                [c.n_it, c.n_ets, c.n_eets, c.n_ts].map(|x| if x < 1000.0 { format!("{x:.2}") } else { short(x) });
            whole.into_iter().chain(rates)
        };
        let [a, b] = [values(ours), values(theirs)];
        let offs: [String; 8] = std::array::from_fn(|i| off(a[i], b[i]).map_or("-".into(), percent));
        let line = |first: String, second: String, rest: Vec<String>| [vec![first, second], rest].concat();
        [
            line(row.name(), grouped(row.rays), shown(ours).collect()),
            line("  1999".into(), String::new(), shown(theirs).collect()),
            line("  off".into(), String::new(), offs.to_vec()),
        ]
    });
    let title = format!("{}: structures", scene.published.name);
    Table { title, columns: columns.map(String::from).to_vec(), rows: rows.collect() }
}

/// Figures in the order n_in, n_v, n_ev, n_oiv, n_it, n_ets, n_eets, n_ts.
fn values(c: Figures) -> [f64; 8] {
    let [n_in, n_v, n_ev, n_oiv] = [c.n_in, c.n_v, c.n_ev, c.n_oiv].map(|n| n as f64);
    [n_in, n_v, n_ev, n_oiv, c.n_it, c.n_ets, c.n_eets, c.n_ts]
}

/// Relative difference; `None` if the published value is 0 and ours is not.
fn off(ours: f64, theirs: f64) -> Option<f64> {
    match theirs {
        0.0 => (ours == 0.0).then_some(0.0),
        _ => Some(ours / theirs - 1.0),
    }
}

/// Whether tests and visited cells per ray are within [`NEAR`] of the published ones.
fn is_near(scene: &Measured, row: &Row) -> bool {
    let ours = scene.comparable(row);
    let near = |a, b| off(a, b).is_some_and(|off| off.abs() <= NEAR);
    near(ours.n_it, row.theirs.n_it) && near(ours.n_ets, row.theirs.n_ets)
}

fn percent(off: f64) -> String {
    match off * 100.0 {
        0.0 => "=".into(),
        p if p.abs() < 0.095 => format!("{p:+.2}%"),
        p => format!("{p:+.1}%"),
    }
}

fn bullets<S: AsRef<str>>(lines: &[S]) -> String {
    lines.iter().map(|line| format!("* {}.\n", line.as_ref())).collect()
}

fn scene_json(scene: &Measured) -> Value {
    let tally = |t: super::rules::Tally| {
        json!({
            "primary": t.primary, "primary_hits": t.primary_hits, "reflected": t.reflected, "refracted": t.refracted,
            "secondary_hits": t.secondary_hits, "shadow": t.shadow, "shadow_hits": t.shadow_hits,
        })
    };
    let cost = |c: Figures| {
        json!({
            "n_in": c.n_in, "n_v": c.n_v, "n_ev": c.n_ev, "n_oiv": c.n_oiv,
            "n_it": c.n_it, "n_ts": c.n_ts, "n_ets": c.n_ets, "n_eets": c.n_eets,
        })
    };
    let row = |row: &Row| {
        json!({
            "structure": row.short_name(), "thickness": row.thickness, "rays": row.rays, "differing": row.differing,
            "ours": cost(scene.comparable(row)), "n_it_per_ray": row.ours.n_it, "published": cost(row.theirs),
        })
    };
    json!({
        "scene": scene.published.name, "hash": hash(scene.hash), "objects": scene.objects,
        "rays": { "both_sides": tally(scene.turned), "outsides": tally(scene.outward) },
        "published_rays": scene.published.rays.to_json(),
        "haines_rays": scene.published.haines.map(|h| json!({
            "primary_hits": h.primary_hits, "reflected": h.reflected, "refracted": h.refracted, "shadow": h.shadow,
        })),
        "structures": scene.rows.iter().map(row).collect::<Vec<_>>(),
    })
}

impl super::published::Rays {
    fn to_json(self) -> Value {
        json!({
            "primary": self.primary, "primary_hits": self.primary_hits, "secondary": self.secondary,
            "secondary_hits": self.secondary_hits, "shadow": self.shadow, "shadow_hits": self.shadow_hits,
        })
    }
}
