//! `--profile`: time of a picture by stage, wall clock and CPU.

use super::message::Messages;
use crate::render::{self, CLASS_NAMES};
use crate::stopwatch::{self, Spent, Stopwatch};
use serde_json::{Value, json};
use std::time::Duration;

/// A stage, or a part of one.
#[derive(Clone, Debug, PartialEq)]
struct Row {
    name: &'static str,
    /// Wall-clock time; `None` for parts of a stage whose threads run in parallel.
    wall: Option<Duration>,
    cpu: Duration,
    rays: Option<u64>,
}

/// Stages of one picture, in order.
#[derive(Clone, Debug)]
pub(super) struct Profile {
    watch: Stopwatch,
    rows: Vec<Row>,
}

impl Profile {
    /// Empty profile; the CPU time of the process so far becomes the stage `start`.
    pub(super) fn of_process() -> Self {
        let start = Row { name: "start", wall: None, cpu: stopwatch::processor_since_start(), rays: None };
        Self { rows: vec![start], ..Self::new() }
    }

    /// Empty profile.
    pub(super) fn new() -> Self {
        Self { watch: Stopwatch::of_all_threads(), rows: Vec::new() }
    }

    /// Ends a stage that began where the previous one ended. Repeated names accumulate.
    pub(super) fn done(&mut self, name: &'static str) {
        let spent = self.watch.lap();
        self.add(name, spent);
    }

    /// Ends the loading of a model, with the times of its known parts.
    pub(super) fn loaded(&mut self, reading: Spent, decoding: Spent) {
        let all = self.watch.lap();
        self.add("read", reading);
        self.add("parse", all - reading - decoding);
        if decoding != Spent::default() {
            self.add("decode", decoding);
        }
    }

    /// Ends the rendering, with the times of its parts if it was profiled.
    pub(super) fn rendered(&mut self, parts: &render::Profile) {
        self.watch.lap();
        self.add("prepare", parts.prepare);
        self.rows.push(Row { name: "tiles", wall: Some(parts.tiles.wall), cpu: parts.tiles.cpu, rays: None });
        for ((name, cpu), rays) in CLASS_NAMES.into_iter().zip(parts.trace).zip(parts.rays) {
            if rays > 0 {
                self.rows.push(Row { name, wall: None, cpu, rays: Some(rays) });
            }
        }
        self.rows.push(Row { name: "shade", wall: None, cpu: parts.shade(), rays: None });
    }

    /// Discards the time since the last stage.
    pub(super) fn skip(&mut self) {
        self.watch.lap();
    }

    /// Returns the profile so far, and starts an empty one.
    pub(super) fn take(&mut self) -> Self {
        std::mem::replace(self, Self::new())
    }

    fn add(&mut self, name: &'static str, spent: Spent) {
        match self.rows.iter_mut().find(|row| row.name == name) {
            Some(row) => {
                row.cpu += spent.cpu;
                row.wall = row.wall.map(|wall| wall + spent.wall);
            }
            None => self.rows.push(Row { name, wall: Some(spent.wall), cpu: spent.cpu, rays: None }),
        }
    }

    /// Whether a row is part of the last whole stage before it.
    fn is_part(row: &Row) -> bool {
        row.name == "shade" || CLASS_NAMES.contains(&row.name)
    }

    fn total(&self) -> Spent {
        let whole = self.rows.iter().filter(|row| !Self::is_part(row));
        whole.map(|row| Spent { wall: row.wall.unwrap_or_default(), cpu: row.cpu }).sum()
    }

    /// Writes the profile as a table, one message per line.
    pub(super) fn say(&self, messages: &Messages) {
        self.lines(stopwatch::peak_memory()).into_iter().for_each(|line| messages.info("profile", line));
    }

    fn lines(&self, peak: Option<u64>) -> Vec<String> {
        let total = self.total();
        // Without CPU times there are no shares.
        let share = |cpu: Duration| if total.cpu.is_zero() { 0.0 } else { 100.0 * cpu.div_duration_f64(total.cpu) };
        let line = |name: &str, wall: Option<Duration>, cpu: Duration, note: &str| {
            let wall = wall.map(milliseconds).unwrap_or_default();
            let line = format!("  {name:<12} {wall:>10} {:>10} {:>4.0} %  {note}", milliseconds(cpu), share(cpu));
            line.trim_end().to_owned()
        };
        let mut lines = vec![format!("  {:<12} {:>10} {:>10}", "profile", "wall", "CPU")];
        for row in &self.rows {
            let name = if Self::is_part(row) { format!("  {}", row.name) } else { row.name.into() };
            let each = |rays: u64| format!("{rays} rays, {:.0} ns each", row.cpu.as_secs_f64() * 1e9 / rays as f64);
            lines.push(line(&name, row.wall, row.cpu, &row.rays.map(each).unwrap_or_default()));
        }
        let memory = peak.map(|bytes| format!("peak memory {:.0} MB", bytes as f64 / 1e6)).unwrap_or_default();
        lines.push(line("all", Some(total.wall), total.cpu, &memory));
        lines
    }

    /// JSON for `--stats json`.
    pub(super) fn json(&self) -> Value {
        let row = |row: &Row| {
            let wall = row.wall.map(|wall| wall.as_secs_f64());
            let part_of = Self::is_part(row).then_some("tiles");
            json!({ "stage": row.name, "part_of": part_of, "wall": wall, "cpu": row.cpu.as_secs_f64(), "rays": row.rays })
        };
        let rows: Vec<Value> = self.rows.iter().map(row).collect();
        json!({ "stages": rows, "peak_memory": stopwatch::peak_memory() })
    }
}

fn milliseconds(time: Duration) -> String {
    format!("{:.1} ms", time.as_secs_f64() * 1e3)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ms(n: u64) -> Duration {
        Duration::from_millis(n)
    }

    fn spent(wall: u64, cpu: u64) -> Spent {
        Spent { wall: ms(wall), cpu: ms(cpu) }
    }

    fn sample() -> Profile {
        let row = |name, cpu, rays| Row { name, wall: None, cpu: ms(cpu), rays };
        let mut profile = Profile::new();
        profile.add("read", spent(2, 1));
        profile.add("write", spent(1, 1));
        profile.add("read", spent(3, 1));
        profile.rows.push(Row { wall: Some(ms(10)), ..row("tiles", 17, None) });
        profile.rows.push(row("primary", 5, Some(1_000_000)));
        profile.rows.push(row("shade", 12, None));
        profile
    }

    #[test]
    fn parts_are_told_and_not_added_twice() {
        assert_eq!(sample().total(), spent(16, 20));
    }

    #[test]
    fn every_row_has_its_times_its_share_and_its_rays() {
        let lines = sample().lines(Some(88_000_000));
        let words: Vec<Vec<&str>> = lines.iter().map(|l| l.split_whitespace().collect()).collect();
        assert_eq!(words[1], ["read", "5.0", "ms", "2.0", "ms", "10", "%"]);
        assert_eq!(words[4], ["primary", "5.0", "ms", "25", "%", "1000000", "rays,", "5", "ns", "each"]);
        assert_eq!(words[6], ["all", "16.0", "ms", "20.0", "ms", "100", "%", "peak", "memory", "88", "MB"]);
    }

    #[test]
    fn programs_are_told_which_row_is_part_of_which() {
        let json = sample().json();
        assert_eq!((&json["stages"][2]["stage"], &json["stages"][2]["part_of"]), (&"tiles".into(), &Value::Null));
        assert_eq!((&json["stages"][3]["part_of"], &json["stages"][3]["cpu"]), (&"tiles".into(), &0.005.into()));
    }
}
