//! Findings of `meshray verify`, as text and as JSON.

use super::super::version::SHORT;
use crate::accel::{AccelKind, IntersectorKind};
use crate::bench::aim::Aim;
use crate::bench::verify::tally::{Rate, Tally};
use crate::bench::verify::{Findings, Plan, Row, Section};
use crate::number::{grouped, hash, short};
use serde_json::{Value, json};
use std::fmt::Write;

/// Contents of the report.
pub(super) struct Report<'a> {
    /// File name as typed.
    pub name: &'a str,
    /// Hash of everything that was read.
    pub hash: u128,
    /// Number of instances left out.
    pub unjudged: usize,
    /// Settings of the verification.
    pub plan: &'a Plan,
    /// Findings.
    pub findings: &'a Findings,
}

/// Sentence on the rays that were sent.
pub(super) fn rays(plan: &Plan) -> String {
    format!(
        "Rays at {}, {} of each for the mesh as it is, scaled, and moved far from the origin; times are of one thread",
        Aim::ALL.map(Aim::name).join(", "),
        grouped(plan.rays as u64)
    )
}

impl Report<'_> {
    /// Tables and a verdict as text.
    pub(super) fn text(&self) -> String {
        let mut text = String::new();
        // Writing to a string cannot fail.
        let _ = self.write(&mut text);
        text
    }

    fn write(&self, out: &mut String) -> std::fmt::Result {
        let f = self.findings;
        let rays = self.plan.rays * Aim::ALL.len();
        let aims = Aim::ALL.map(Aim::name).join(", ");
        writeln!(out, "{}: {} triangles", self.name, count(f.triangles))?;
        if f.others > 0 {
            writeln!(out, "{} polygons, spheres, cones and planes are not judged", count(f.others))?;
        }
        if self.unjudged > 0 {
            let left_out = count(self.unjudged);
            writeln!(
                out,
                "each mesh is judged in its first place; {left_out} more places are too large for the memory allowed"
            )?;
        }
        writeln!(out, "{} rays for each place and size, {} each at: {aims}", count(rays), count(self.plan.rays))?;
        let structures: Vec<&str> =
            f.sections.first().into_iter().flat_map(|s| &s.rows).map(|r| r.accel.name()).collect();
        let mut named: Vec<&str> = Vec::new();
        structures.into_iter().for_each(|s| {
            if !named.contains(&s) {
                named.push(s)
            }
        });
        writeln!(out, "through {}; those that came out the same share a line", named.join(", "))?;
        writeln!(out, "wrong answers per million rays, by exact arithmetic; < n: none seen, fewer than n at 95 %")?;
        for section in &f.sections {
            write_section(out, section)?;
        }
        self.write_aims(out)?;
        self.write_costs(out)?;
        writeln!(out)?;
        writeln!(out, "{}", self.verdict())
    }

    /// Table of misses by aim: the default structure, all variations together.
    fn write_aims(&self, out: &mut String) -> std::fmt::Result {
        writeln!(
            out,
            "\nmissed per million, by what was aimed at, all places and sizes together, {}",
            AccelKind::DEFAULT
        )?;
        write!(out, "  {:24}", "intersector")?;
        Aim::ALL.iter().try_for_each(|aim| write!(out, "{:>14}", aim.name()))?;
        writeln!(out)?;
        for test in IntersectorKind::ALL {
            write!(out, "  {test:24}")?;
            for aim in 0..Aim::ALL.len() {
                let tally = self.by_aim(test, aim);
                write!(out, "{:>14}", rate(tally.missed, tally.rays))?;
            }
            writeln!(out)?;
        }
        Ok(())
    }

    fn by_aim(&self, test: IntersectorKind, aim: usize) -> Tally {
        let rows = self.findings.sections.iter().flat_map(|s| &s.rows);
        let rows = rows.filter(|r| r.test == test && r.accel == AccelKind::DEFAULT);
        rows.fold(Tally::default(), |sum, r| sum + r.tallies[aim])
    }

    fn write_costs(&self, out: &mut String) -> std::fmt::Result {
        let (accel, exact) = (AccelKind::DEFAULT, IntersectorKind::Exact);
        writeln!(
            out,
            "\ntime of these rays on one thread, {accel}, against {exact}, which alone tests eight triangles at once"
        )?;
        for cost in &self.findings.costs {
            let ns = cost.per_ray.map(|seconds| 1e9 * seconds);
            writeln!(
                out,
                "  {:24}{:>10.1} ns a ray ({:.1}..{:.1}) {:>8.2}",
                cost.test.name(),
                ns.median(),
                ns.min(),
                ns.max(),
                self.ratio(cost.test)
            )?;
        }
        Ok(())
    }

    /// Time of a test relative to the exact one.
    fn ratio(&self, test: IntersectorKind) -> f64 {
        let time = |test| {
            let cost = self.findings.costs.iter().find(|c| c.test == test);
            cost.map_or(f64::NAN, |c| c.per_ray.median())
        };
        time(test) / time(IntersectorKind::Exact)
    }

    /// Fastest test without a wrong answer in enough rays; the exact one if there is none.
    fn choice(&self) -> IntersectorKind {
        /// No wrong answer in this many rays means fewer than 30 per million, at 95 % confidence.
        const ENOUGH: usize = 100_000;
        let is_trusted = |test: &IntersectorKind| {
            let total = self.findings.total(*test);
            total.is_clean() && (*test == IntersectorKind::Exact || total.rays >= ENOUGH)
        };
        let clean = IntersectorKind::ALL.into_iter().filter(is_trusted);
        clean.min_by(|&a, &b| self.ratio(a).total_cmp(&self.ratio(b))).unwrap_or_default()
    }

    fn verdict(&self) -> String {
        if self.findings.total(IntersectorKind::Exact).hits == 0 {
            return "Nothing is known of this mesh: none of its triangles can be hit, by exact arithmetic.".into();
        }
        let choice = self.choice();
        let total = self.findings.total(choice);
        let other = match choice {
            IntersectorKind::MollerTrumbore => IntersectorKind::Exact,
            _ => IntersectorKind::MollerTrumbore,
        };
        let compared = self.findings.total(other);
        let apart = self.findings.sections.iter().filter(|section| !section.centred);
        let started: usize = apart.map(|section| section.spawned.self_hits + section.spawned.slips).sum();
        let elsewhere = match started {
            0 => String::new(),
            n => format!(
                " Moved in f32 alone, {} secondary rays began on the wrong side of a face: scenes that are rendered are \
                 centred first.",
                count(n)
            ),
        };
        format!(
            "Choose {choice} for this mesh: {} wrong answers in {} rays ({} per million); {other} gave {} ({} per million) \
             in {:.2} times its time.{elsewhere}",
            count(total.wrong()),
            count(total.rays),
            rate(total.wrong(), total.rays),
            count(compared.wrong()),
            rate(compared.wrong(), compared.rays),
            self.ratio(other) / self.ratio(choice),
        )
    }

    /// JSON report in one line.
    pub(super) fn json(&self) -> String {
        let f = self.findings;
        let costs: Vec<Value> = f
            .costs
            .iter()
            .map(|c| (c.test.name(), c.per_ray.map(|seconds| 1e9 * seconds)))
            .map(|(name, ns)| {
                let (median, least, most) = (ns.median(), ns.min(), ns.max());
                json!({
                    "intersector": name, "ns_per_ray": median, "ns_per_ray_min": least, "ns_per_ray_max": most,
                })
            })
            .collect();
        let value = json!({
            "schema": "meshray-verify/1", "version": SHORT, "file": self.name,
            "hash": hash(self.hash), "triangles": f.triangles, "others": f.others,
            "rays": self.plan.rays, "seed": self.plan.seed,
            "variations": f.sections.iter().map(section_json).collect::<Vec<_>>(),
            "costs": costs, "choose": self.choice().name(), "trusted": f.trusted(),
            "unjudged_instances": self.unjudged,
        });
        format!("{value}\n")
    }
}

fn write_section(out: &mut String, section: &Section) -> std::fmt::Result {
    let amount = if section.amount == 0.0 { String::new() } else { format!(" by {:e}", section.amount) };
    writeln!(out, "\n{}{amount}", section.variation)?;
    if section.collapsed > 0 {
        writeln!(out, "  {} triangles collapsed by rounding", count(section.collapsed))?;
    }
    let title = ["rays", "missed", "false", "wrong order", "t max ulp", "t rms ulp"];
    write!(out, "  {:24}{:16}", "intersector", "accel")?;
    title.iter().try_for_each(|t| write!(out, "{t:>12}"))?;
    writeln!(out)?;
    for (rows, t) in alike(&section.rows) {
        let rates = [t.missed, t.false_hits, t.wrong_order].map(|n| rate(n, t.rays));
        write!(out, "  {:24}{:16}{:>12}", rows[0].test.name(), label(&rows), count(t.rays))?;
        rates.iter().try_for_each(|r| write!(out, "{r:>12}"))?;
        writeln!(out, "{:>12}{:>12}", short(t.max_ulps), short(t.rms_ulps()))?;
    }
    let s = &section.spawned;
    writeln!(
        out,
        "  exact: {} rays differ between structures; of {} shadow rays {} hit their own surface, {} slipped past a face \
         beside it, {} leaked, {} were stopped by nothing",
        count(section.disagreements),
        count(s.rays),
        count(s.self_hits),
        count(s.slips),
        count(s.leaks),
        count(s.false_shadows)
    )
}

/// Groups rows of one test with the same results in several structures, as most have.
fn alike(rows: &[Row]) -> Vec<(Vec<&Row>, Tally)> {
    let mut groups: Vec<(Vec<&Row>, Tally)> = Vec::new();
    for row in rows {
        let same =
            |(others, _): &&mut (Vec<&Row>, Tally)| others[0].test == row.test && others[0].tallies == row.tallies;
        match groups.iter_mut().find(same) {
            Some((others, _)) => others.push(row),
            None => groups.push((vec![row], row.total())),
        }
    }
    groups
}

/// Name of a group of rows.
fn label(rows: &[&Row]) -> String {
    match rows {
        [row] => row.accel.name().to_owned(),
        rows => format!("{} structures", rows.len()),
    }
}

fn section_json(section: &Section) -> Value {
    let s = &section.spawned;
    json!({
        "what": section.variation, "amount": section.amount, "collapsed": section.collapsed,
        "disagreements": section.disagreements,
        "spawned": {
            "rays": s.rays, "self_hits": s.self_hits, "slips": s.slips, "leaks": s.leaks, "false_shadows": s.false_shadows,
        },
        "rows": section.rows.iter().map(row_json).collect::<Vec<_>>(),
    })
}

fn row_json(row: &Row) -> Value {
    let aims = Aim::ALL.iter().zip(&row.tallies).map(|(aim, t)| (aim.name().to_owned(), tally_json(t)));
    json!({
        "intersector": row.test.name(), "accel": row.accel.name(), "all": tally_json(&row.total()),
        "aims": aims.collect::<serde_json::Map<_, _>>(),
    })
}

fn tally_json(t: &Tally) -> Value {
    json!({
        "rays": t.rays, "hits": t.hits, "missed": t.missed, "false_hits": t.false_hits, "wrong_order": t.wrong_order,
        "t_ulps_max": t.max_ulps, "t_ulps_rms": t.rms_ulps(),
    })
}

fn count(n: usize) -> String {
    grouped(n as u64)
}

/// Formats a rate per million.
fn rate(n: usize, rays: usize) -> String {
    match Rate::new(n, rays) {
        Rate::Seen(rate) => short(rate),
        Rate::Below(bound) => format!("< {}", short(bound)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bench::verify::verify;
    use crate::load::{LoadOptions, load_bytes};

    /// Closed box, twisted so that no face is axis-aligned.
    const BOX: &str = "[[meshes]]\npositions=[[0,0,0],[2,0.1,0],[2,1,0.2],[0,1,0],[0.1,0,1],[2,0,1.1],[2,1.3,1],[0,1,1]]\n\
                       faces=[[0,2,1],[0,3,2],[4,5,6],[4,6,7],[0,1,5],[0,5,4],[3,7,6],[3,6,2],[0,4,7],[0,7,3],[1,2,6],[1,6,5]]\n";

    fn findings(plan: &Plan) -> Findings {
        let loaded = load_bytes("box.toml".as_ref(), BOX.into(), &LoadOptions::default()).unwrap();
        verify(&loaded.scene, plan, |_, _| true).unwrap()
    }

    #[test]
    fn the_exact_test_is_clean_everywhere_and_the_others_are_not() {
        let plan = Plan { rays: 300, ..Plan::DEFAULT };
        let findings = findings(&plan);
        assert!(findings.trusted());
        let exact = findings.total(IntersectorKind::Exact);
        assert!(exact.is_clean() && exact.max_ulps <= 0.5 && exact.hits > exact.rays / 2, "{exact:?}");
        assert!(findings.total(IntersectorKind::MollerTrumbore).missed > 0);
        // The exact test through every structure, the others through two.
        let rows = AccelKind::ALL.len() + 2 * (IntersectorKind::ALL.len() - 1);
        assert!(findings.sections.iter().all(|s| s.rows.len() == rows) && findings.sections[0].spawned.rays > 100);

        let report = Report { name: "box.toml", hash: 7, unjudged: 0, plan: &plan, findings: &findings };
        let text = report.text();
        assert!(
            text.contains("as it is") && text.contains("moved in f32 by 1e9") && text.contains("Choose "),
            "{text}"
        );
        let json: Value = serde_json::from_str(&report.json()).unwrap();
        assert_eq!(
            (&json["triangles"], &json["trusted"], &json["hash"]),
            (&12.into(), &true.into(), &format!("{:032x}", 7).into())
        );
        assert_eq!(json["variations"][0]["rows"][0]["aims"]["corners"]["rays"], 300);
    }

    #[test]
    fn a_judge_can_be_stopped() {
        let loaded = load_bytes("box.toml".as_ref(), BOX.into(), &LoadOptions::default()).unwrap();
        assert!(verify(&loaded.scene, &Plan::DEFAULT, |done, _| done < 1).is_none());
    }

    #[test]
    fn rates_say_how_much_is_known() {
        assert_eq!([rate(0, 12_000), rate(3, 12_000), rate(0, 3_000_000)], ["< 250", "250", "< 1.00"]);
    }
}
