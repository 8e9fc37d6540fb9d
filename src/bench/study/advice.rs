//! Recommended settings by purpose, with reasons.

use super::Study;
use super::knob::Knob;
use super::measure::Row;
use crate::render::{Quality, Sampling};

/// Recommendation for one purpose.
#[derive(Clone, Debug, PartialEq)]
pub struct Advice {
    /// Purpose.
    pub purpose: Quality,
    /// Index of the recommended row; `None` if no setting is good enough.
    pub row: Option<usize>,
    /// Reason, in a sentence.
    pub why: String,
}

pub(super) fn advice(study: &Study) -> Vec<Advice> {
    Quality::ALL.iter().map(|&purpose| advise(study, purpose)).collect()
}

/// Recommends the program's own choice for a purpose unless a setting that is good enough saves much time.
fn advise(study: &Study, purpose: Quality) -> Advice {
    /// Part of the time that another setting must save to be worth its flags: smaller differences also occur between views of a
    /// model, and the setting was found in only one.
    const WORTH: f64 = 0.4;
    let goal = purpose.good_enough();
    // Time as in the table.
    let time = |i: usize| study.rows[i].cpu.median();
    let good: Vec<usize> = (0..study.rows.len()).filter(|&i| study.rows[i].error.known() <= goal).collect();
    let fastest = good.iter().copied().min_by(|&a, &b| time(a).total_cmp(&time(b)));
    let own = good.iter().copied().find(|&i| is_quality(&study.rows[i], purpose));
    let goal = format!("an error of at most {goal} ({:.1} of 255 steps)", 255.0 * goal);
    let Some(fastest) = fastest else {
        let off = study.reference.error;
        let doubt = match off > purpose.good_enough() {
            true => {
                format!(", as far as the reference can tell, which is {off:.4} off itself: raise --reference-samples")
            }
            false => String::new(),
        };
        return Advice { purpose, row: None, why: format!("no setting that was tried comes to {goal}{doubt}") };
    };
    let row = own.filter(|&own| time(fastest) > (1.0 - WORTH) * time(own)).unwrap_or(fastest);
    let of_own = if own == Some(row) { "the program's own choice" } else { "not the program's own choice" };
    let left = format!("{}, {}", study.rows[row].error.formatted(4), rest(&study.rows[row], study.reference.error));
    let saved = |own: usize| 100.0 * (1.0 - time(fastest) / time(own));
    let why = match own {
        Some(own) if row == own && row != fastest => {
            let flags = &study.rows[fastest].setting.flags;
            format!("{of_own}, with {goal}: {left}; {flags} takes {:.0} % less time in this view", saved(own))
        }
        Some(own) if row != own => format!(
            "{of_own}, the fastest with {goal}: {left}, {:.0} % less time than --quality {purpose}, which is near enough, too",
            saved(own)
        ),
        _ => format!("{of_own}, the fastest with {goal}: {left}"),
    };
    Advice { purpose, row: Some(row), why }
}

/// Kind of the remaining error, given the error of the reference itself.
fn rest(row: &Row, reference: f64) -> &'static str {
    match row.setting.settings.sampling {
        _ if row.error.bias <= row.error.noise => "most of it noise",
        Sampling::Stochastic(_) if row.error.bias <= reference => {
            "of which the reference, as far off itself, does not tell what it is: raise --reference-samples"
        }
        Sampling::Stochastic(_) => "most of it bias, which more samples do not lessen",
        Sampling::Uniform | Sampling::Adaptive(_) => {
            "the same in every rendering, as its rays go through the same places"
        }
    }
}

fn is_quality(row: &Row, purpose: Quality) -> bool {
    row.setting.knob == Knob::Quality && row.setting.flags.ends_with(purpose.name())
}
