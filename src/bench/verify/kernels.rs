//! Speed against error of ray/triangle tests: plots our tests, and those of other programs if given.

use super::Findings;
use super::tally::{Rate, Tally};
use crate::bench::machine::Machine;
use crate::bench::report::html::svg::{Scale, open, plain, rule, words};
use crate::bench::report::html::{escaped, page, paragraph};
use crate::number::{grouped, short};
use std::fmt::Write;

/// Measured speed and error of one way to find hits.
#[derive(Clone, Debug)]
pub struct Kernel {
    /// Name.
    pub name: String,
    /// Whether the kernel is one of this program's.
    pub is_ours: bool,
    /// Seconds per ray on one thread.
    pub seconds_per_ray: f64,
    /// Answers as judged by exact arithmetic.
    pub tally: Tally,
}

impl Kernel {
    /// Millions of rays per second.
    pub fn rate(&self) -> f64 {
        1e-6 / self.seconds_per_ray
    }

    /// Wrong answers per 10⁹ rays; if none was seen, their upper bound at 95 % confidence.
    pub fn wrong_in_a_billion(&self) -> Rate {
        match Rate::new(self.tally.wrong(), self.tally.rays) {
            Rate::Seen(million) => Rate::Seen(million * 1e3),
            Rate::Below(million) => Rate::Below(million * 1e3),
        }
    }
}

/// Kernels of a verified mesh: each test through the default structure, over all variations.
pub fn of(findings: &Findings) -> Vec<Kernel> {
    let kernel = |cost: &super::TestTime| Kernel {
        name: cost.test.name().to_owned(),
        is_ours: true,
        seconds_per_ray: cost.per_ray.median(),
        tally: findings.total(cost.test),
    };
    findings.costs.iter().map(kernel).collect()
}

/// HTML page with the plot and its numbers.
pub fn html(name: &str, rays: &str, kernels: &[Kernel]) -> String {
    let mut out = format!("<section><h2>{}</h2>\n", escaped(name));
    out += &paragraph(rays);
    out += &format!(
        "<figure><h3>Wrong answers against speed</h3><figcaption>To the right is faster, down is nearer to the truth. An arrow: \
         none was seen; the true rate lies below its upper end at 95 % confidence.</figcaption>{}</figure>\n",
        plot(kernels)
    );
    out += &table(kernels);
    out += "</section>\n";
    out += &paragraph(&Machine::here().line());
    page("Speed against error of ray/triangle tests", &out)
}

/// Value of a rate, and whether it was seen rather than a bound.
fn number(rate: Rate) -> (f64, bool) {
    match rate {
        Rate::Seen(x) => (x, true),
        Rate::Below(x) => (x, false),
    }
}

fn plot(kernels: &[Kernel]) -> String {
    const LEFT: f64 = 52.0;
    // Leaves room for the longest name.
    const RIGHT: f64 = 272.0;
    const TOP: f64 = 14.0;
    const BOTTOM: f64 = 270.0;
    let x = Scale::fitting(kernels.iter().map(Kernel::rate), LEFT, RIGHT);
    let wrong = |kernel: &Kernel| number(kernel.wrong_in_a_billion()).0;
    let y = Scale::around(kernels.iter().map(wrong), BOTTOM - 24.0, TOP);
    let mut svg = open(BOTTOM + 42.0, "Wrong answers in a billion rays against millions of rays a second");
    for tick in x.ticks() {
        rule(&mut svg, [x.at(tick), TOP], [x.at(tick), BOTTOM], "");
        words(&mut svg, x.at(tick), BOTTOM + 15.0, "middle", "soft", plain(&short(tick)));
    }
    for tick in y.ticks() {
        rule(&mut svg, [LEFT, y.at(tick)], [RIGHT, y.at(tick)], "");
        words(&mut svg, LEFT - 5.0, y.at(tick) + 4.0, "end", "soft", &format!("{tick:.0e}"));
    }
    words(&mut svg, LEFT, BOTTOM + 34.0, "start", "soft", "million rays a second; up: wrong answers in 10⁹ rays");
    let mut order: Vec<&Kernel> = kernels.iter().collect();
    order.sort_by(|a, b| y.at(wrong(a)).total_cmp(&y.at(wrong(b))));
    let places: Vec<f64> = order.iter().map(|kernel| y.at(wrong(kernel))).collect();
    let labels = crate::bench::report::html::svg::spread_out(&places, 15.0, BOTTOM);
    for ((kernel, place), label) in order.into_iter().zip(places).zip(labels) {
        let (px, (_, seen)) = (x.at(kernel.rate()), number(kernel.wrong_in_a_billion()));
        rule(&mut svg, [px, place], [RIGHT + 6.0, label], "");
        words(&mut svg, RIGHT + 8.0, label + 4.0, "start", "", &escaped(&kernel.name));
        let class = if kernel.is_ours { "reflected" } else { "diffuse" };
        // A disc for seen rates, a bar with a down arrow for upper bounds.
        let shape = if seen {
            "M-4.5 0a4.5 4.5 0 1 0 9 0a4.5 4.5 0 1 0-9 0z"
        } else {
            "M-5-1.5h10v3h-3.5v9h3l-4.5 7l-4.5-7h3v-9h-3.5z"
        };
        // Writing to a string does not fail, here and below.
        let _ = write!(
            svg,
            "<path class=\"{class}\" transform=\"translate({px:.1} {place:.1})\" d=\"{shape}\"><title>{}</title></path>",
            escaped(&kernel.name)
        );
    }
    svg + "</svg>"
}

fn table(kernels: &[Kernel]) -> String {
    let mut out = "<div class=\"wide\"><table><thead><tr><th>test</th><th>Mrays/s</th><th>rays</th><th>missed</th><th>false</th>\
                   <th>wrong order</th><th>wrong in 10⁹</th><th>t, ulp (rms)</th><th>t, ulp (max)</th></tr></thead><tbody>\n"
        .to_owned();
    for kernel in kernels {
        let (tally, (wrong, seen)) = (kernel.tally, number(kernel.wrong_in_a_billion()));
        let counts = [tally.rays, tally.missed, tally.false_hits, tally.wrong_order].map(|n| grouped(n as u64));
        let _ = writeln!(
            out,
            "<tr><th>{}</th><td>{}</td><td>{}</td><td>{}{}</td><td>{}</td><td>{}</td></tr>",
            escaped(&kernel.name),
            short(kernel.rate()),
            counts.join("</td><td>"),
            if seen { "" } else { "&lt; " },
            short(wrong),
            short(tally.rms_ulps()),
            short(tally.max_ulps)
        );
    }
    out + "</tbody></table></div>\n"
}

#[cfg(test)]
mod tests {
    use super::*;

    fn kernel(name: &str, wrong: usize) -> Kernel {
        let tally = Tally { rays: 3_000_000, hits: 2_000_000, missed: wrong, ..Tally::default() };
        Kernel { name: name.into(), is_ours: wrong == 0, seconds_per_ray: 2e-7, tally }
    }

    #[test]
    fn what_was_not_seen_is_a_bound() {
        assert_eq!(kernel("exact", 0).wrong_in_a_billion(), Rate::Below(1000.0));
        assert_eq!(kernel("other", 6).wrong_in_a_billion(), Rate::Seen(2000.0));
        assert!((kernel("exact", 0).rate() - 5.0).abs() < 1e-9);
    }

    #[test]
    fn the_page_has_every_kernel_once_in_plot_and_table() {
        let page = html("a<b>", "rays", &[kernel("exact", 0), kernel("fast & loose", 60)]);
        assert_eq!(page.matches("<title>exact</title>").count(), 1);
        assert!(page.contains("fast &amp; loose") && page.contains("a&lt;b&gt;") && page.contains("&lt; 1 000"));
    }
}
