//! Ray tree of a sample as text.

use super::TraceReport;
use super::words::{continues, hit_surface, in_world, inside, light, object};
use crate::accel::probe::{Extent, NodeId, Outcome, Visit};
use crate::math::{DVec3, Vec3};
use crate::number::grouped;
use crate::render::Question;
use crate::render::ray_tree::{Class, Event, Query};
use std::fmt::Write;

/// Writes everything, ray by ray.
pub(super) fn write(told: &TraceReport) -> String {
    let mut out = format!("{}\n\n", told.title());
    write_query(told, 0, 0, &mut out);
    let rays = told.ray_tree.queries.len();
    let tests: u64 = told.ray_tree.queries.iter().map(|q| q.counts.n_it).sum();
    let _ =
        writeln!(out, "\n{rays} queries in all, {} ray/prim tests; colour (linear) {}", grouped(tests), told.color());
    out
}

/// Writes a query, its steps and its children, indented by its depth in the tree.
fn write_query(told: &TraceReport, i: usize, depth: usize, out: &mut String) {
    let query = &told.ray_tree.queries[i];
    let margin = "  ".repeat(depth);
    let _ = writeln!(out, "{margin}{}", headline(told, query));
    if i == 0 || told.all_steps {
        for line in steps(told, query) {
            let _ = writeln!(out, "{margin}  {line}");
        }
    }
    let _ = writeln!(out, "{margin}  = {}", ending(told, query));
    let _ = writeln!(out, "{margin}    {}", counts(query));
    query.children.iter().for_each(|&child| write_query(told, child, depth + 1, out));
}

fn headline(told: &TraceReport, query: &Query) -> String {
    let scene = &told.loaded.scene;
    let from = format!("from {} towards {}", place_in(told, query.ray.origin), vector(query.ray.dir));
    match (query.class, query.question) {
        (class, Question::Next) => format!("{} ray goes on behind prim {}", class.name(), query.after.prim),
        (Class::Shadow, Question::Occluded) if query.riser => {
            let light = light(scene, query.light);
            format!("shadow ray up to the rounded surface, where the one to {light} starts, {from}")
        }
        (Class::Shadow, Question::Occluded) => format!("shadow ray to {} {from}", light(scene, query.light)),
        (Class::Shadow, Question::Closest) => "shadow ray looks for what lets light through".into(),
        (Class::Primary, _) => match told.skipped() {
            0.0 => format!("eye ray {from}"),
            skipped => format!("eye ray {from}, where t is 0: the eye is {} farther back", real(skipped)),
        },
        (class, _) => format!("{} ray {from}", class.name()),
    }
}

fn ending(told: &TraceReport, query: &Query) -> String {
    let Some(hit_surface) = hit_surface(told.loaded, told.world, query) else {
        return match query.question {
            Question::Occluded => "nothing in the way stops its light".into(),
            _ if continues(&query.after) => "nothing more".into(),
            _ => "hits nothing".into(),
        };
    };
    if query.question == Question::Occluded {
        let object = object(&told.loaded.scene, told.world, query.hit.prim);
        return format!("blocked by prim {} of {object} at t {}", query.hit.prim, query.hit.t);
    }
    let material = if hit_surface.material.is_empty() {
        hit_surface.material_number.to_string()
    } else {
        format!("'{}'", hit_surface.material)
    };
    format!(
        "hits prim {} of {}, material {material}, at t {}, u {}, v {}, position {}, normal {}",
        query.hit.prim,
        hit_surface.object,
        query.hit.t,
        hit_surface.weights[0],
        hit_surface.weights[1],
        point(hit_surface.position, resolution(told)),
        vector(hit_surface.normal)
    )
}

fn counts(query: &Query) -> String {
    query.counts.named().map(|(name, n)| format!("{name} {n}")).join("  ")
}

/// One line per node or cell, followed by the tests done in it.
fn steps(told: &TraceReport, query: &Query) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    let mut runs = Runs::default();
    for event in &query.events {
        if let Event::Visit(visit) = event {
            runs.end(&mut lines);
            lines.push(self::visit(told, query, visit));
        } else {
            runs.add(event, &mut lines);
        }
    }
    runs.end(&mut lines);
    lines
}

fn visit(told: &TraceReport, query: &Query, visit: &Visit) -> String {
    let numbers = |n: [u32; 3]| format!("{} {} {}", n[0], n[1], n[2]);
    let what = match visit.place {
        NodeId::Cell(cell) => format!("cell {}", numbers(cell)),
        NodeId::OctreeNode(at, level) => format!("octree node {} of side {}", numbers(at), 1u64 << level),
        NodeId::Octant(at, level) => format!("octant {} of side {}", numbers(at), 1u64 << level),
        NodeId::Node(i) => format!("node {i}"),
        NodeId::Leaf(i) => format!("leaf {i}"),
        NodeId::Block(i) => format!("block {i}"),
        NodeId::Run(i) => format!("run {i}"),
        NodeId::Places(i) => format!("node {i} over places"),
        NodeId::PlacedNode(first, i) => format!("node {i} of the object from prim {first} on"),
        NodeId::PlacedBlock(first, i) => format!("block {i} of the object from prim {first} on"),
        NodeId::Object(i) => match visit.extent {
            Extent::Ball { .. } => format!("sphere around object {i}"),
            Extent::Box(_) => format!("box around object {i}"),
        },
    };
    let listed = match visit.listed {
        None => String::new(),
        Some(0) => ", empty".into(),
        Some(1) => ", 1 prim".into(),
        Some(n) => format!(", {} prims", grouped(u64::from(n))),
    };
    let bounds = visit.extent.bounds();
    let inside =
        inside(&visit.extent, &query.ray).map_or(String::new(), |(a, b)| format!(", t {} to {}", real(a), real(b)));
    format!("{what}{listed}{inside}, {} to {}", place_in(told, bounds.lo), place_in(told, bounds.hi))
}

/// Formats a position of the centred frame in world space.
fn place_in(told: &TraceReport, place: Vec3) -> String {
    point(in_world(told.world, place), resolution(told))
}

/// Distance that is significant for positions: a millionth of the scene's extent.
fn resolution(told: &TraceReport) -> f64 {
    let (lo, hi) = told.world.bounds;
    1e-6 * (hi - lo).max_element()
}

/// Collects consecutive tests with the same outcome into one line.
#[derive(Default)]
struct Runs {
    what: String,
    prims: Vec<u32>,
}

impl Runs {
    fn add(&mut self, event: &Event, lines: &mut Vec<String>) {
        let (what, prim) = match event {
            Event::Test(test) => match test.outcome {
                Outcome::Miss | Outcome::LeftOut => (test.outcome.name(), test.prim),
                outcome => {
                    self.end(lines);
                    return lines.push(format!("  {} {}: t {}", outcome.name(), test.prim, test.t));
                }
            },
            Event::Skipped(prim) => ("known to the mailbox", *prim),
            Event::Volumes(1) => return self.note("asks 1 volume".into(), lines),
            Event::Volumes(n) => return self.note(format!("asks {} volumes", grouped(*n as u64)), lines),
            Event::Transforms(n) => return self.note(format!("turns {} points", grouped(*n as u64)), lines),
            Event::Visit(_) => return,
        };
        if self.what != what {
            self.end(lines);
            self.what = what.into();
        }
        self.prims.push(prim);
    }

    fn note(&mut self, text: String, lines: &mut Vec<String>) {
        self.end(lines);
        lines.push(format!("  {text}"));
    }

    fn end(&mut self, lines: &mut Vec<String>) {
        if !self.prims.is_empty() {
            lines.push(format!("  {} {}", self.what, ranges(&self.prims)));
        }
        *self = Self::default();
    }
}

/// Formats numbers in order, with runs of consecutive ones as ranges: `3, 5-9, 12`.
fn ranges(numbers: &[u32]) -> String {
    let mut parts: Vec<(u32, u32)> = Vec::new();
    for &n in numbers {
        match parts.last_mut() {
            Some((_, last)) if last.checked_add(1) == Some(n) => *last = n,
            _ => parts.push((n, n)),
        }
    }
    let part = |(a, b): &(u32, u32)| if a == b { a.to_string() } else { format!("{a}-{b}") };
    parts.iter().map(part).collect::<Vec<_>>().join(", ")
}

fn vector(v: Vec3) -> String {
    point(v.as_dvec3(), f64::INFINITY)
}

/// Formats a point precisely enough to distinguish `resolution`, with at least six digits.
fn point(p: DVec3, resolution: f64) -> String {
    let [x, y, z] = p.to_array().map(|x| resolved(x, resolution));
    format!("({x}, {y}, {z})")
}

/// Formats a number with six digits, without trailing zeros.
fn real(x: f64) -> String {
    resolved(x, f64::INFINITY)
}

/// Formats a number with enough digits to distinguish values that differ by `resolution`, at least six.
fn resolved(x: f64, resolution: f64) -> String {
    if x == 0.0 {
        return "0".into();
    }
    if !x.is_finite() {
        return x.to_string();
    }
    let (whole, finest) = (exponent(x), if resolution > 0.0 { exponent(resolution) } else { i32::MAX });
    // At most as many digits as an `f64` has.
    let digits = (whole - finest).clamp(5, 16);
    let text = match usize::try_from(digits - whole) {
        Ok(places) if whole >= -5 && (whole <= 8 || places > 0) => format!("{x:.places$}"),
        _ if (-5..=8).contains(&whole) => format!("{x:.0}"),
        _ => return format!("{x:.digits$e}", digits = digits.unsigned_abs() as usize),
    };
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

/// Decimal exponent of a number that is not 0.
#[expect(clippy::cast_possible_truncation, reason = "a decimal exponent of f64")]
fn exponent(x: f64) -> i32 {
    if x.is_finite() { x.abs().log10().floor() as i32 } else { i32::MAX / 2 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_of_neighbours_are_written_as_their_ends() {
        assert_eq!(ranges(&[3, 5, 6, 7, 9, 8, 4_294_967_295]), "3, 5-7, 9, 8, 4294967295");
    }

    #[test]
    fn numbers_have_six_digits_at_most() {
        let texts = [0.0, 1.0, -0.123_456_789, 1234.5, 1.5e-7, 123_456_789.0, 2e12].map(real);
        assert_eq!(texts, ["0", "1", "-0.123457", "1234.5", "1.50000e-7", "123456789", "2.00000e12"]);
    }

    #[test]
    fn places_far_away_have_the_digits_that_their_scene_needs() {
        let of = |x: f64, size: f64| resolved(x, 1e-6 * size);
        assert_eq!(
            [of(3_000_000.125, 1.0), of(2_000_000.5, 1.0), of(-1e6, 1.0)],
            ["3000000.125", "2000000.5", "-1000000"]
        );
        assert_eq!([of(0.123_456_789, 1.0), of(1234.5678, 1e9), of(1e-9, 1.0)], ["0.123457", "1234.57", "1.00000e-9"]);
        assert_eq!([of(1.5e12, 1e3), of(123_456_789_012.5, 1e5)], ["1500000000000", "123456789012.5"]);
        assert_eq!([of(1e30, 1.0), of(2e12, 1e13), of(5.0, 0.0)], ["1.0000000000000000e30", "2.00000e12", "5"]);
    }
}
