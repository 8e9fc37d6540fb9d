//! `--fail-if`: limits on the figures of a difference.

use super::Compared;
use crate::bench::baseline::sides;
use std::fmt;
use std::str::FromStr;

/// A figure that can be limited: its name, and the function that reads it.
type Figure = (&'static str, fn(&Compared) -> f64);

const FIGURES: [Figure; 9] = [
    ("rmse", |c| c.difference.rmse),
    ("relative-rmse", |c| c.difference.relative_rmse),
    ("bias", |c| c.difference.bias),
    ("max", |c| c.difference.max),
    ("psnr", |c| c.difference.psnr),
    ("flip", |c| c.looks.mean),
    ("flip-max", |c| c.looks.max),
    ("pixels", |c| c.difference.over as f64),
    (OF_LAYERS, Compared::layer_max),
];

const OF_LAYERS: &str = "layer-max";

/// Limit on a figure, such as `rmse>0.01` or `psnr<40`.
#[derive(Clone, Copy, Debug)]
pub(in crate::cli) struct Limit {
    figure: Figure,
    /// Whether a figure above the bound breaks the limit; otherwise one below does.
    above: bool,
    bound: f64,
}

impl FromStr for Limit {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let names = FIGURES.map(|(name, _)| name).join(", ");
        let wrong = || format!("{text:?}: write a figure and its limit, such as 'rmse>0.01'; figures: {names}");
        let (name, above, bound) = sides(text).ok_or_else(wrong)?;
        let figure = FIGURES.into_iter().find(|(known, _)| *known == name).ok_or_else(wrong)?;
        let bound = bound.parse::<f64>().ok().filter(|b| b.is_finite()).ok_or_else(wrong)?;
        Ok(Self { figure, above, bound })
    }
}

impl Limit {
    /// Whether the limit concerns layers, which only EXR files have.
    pub(super) fn is_of_layers(&self) -> bool {
        self.figure.0 == OF_LAYERS
    }

    /// Message if the figure is beyond the limit. NaN is always beyond it.
    pub(super) fn broken_by(&self, compared: &Compared) -> Option<String> {
        let value = (self.figure.1)(compared);
        let kept = if self.above { value <= self.bound } else { value >= self.bound };
        let told = if value.is_infinite() { "infinite".into() } else { value.to_string() };
        (!kept).then(|| format!("{} is {told}, which is beyond the limit {self}", self.figure.0))
    }
}

impl fmt::Display for Limit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}{}{}", self.figure.0, if self.above { '>' } else { '<' }, self.bound)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_are_read_and_wrong_ones_name_the_figures() {
        for text in ["rmse>0.01", " psnr < 40", "flip-max>1", "layer-max>0"] {
            let limit: Limit = text.parse().unwrap();
            assert_eq!(limit.to_string(), text.replace(' ', ""));
        }
        for text in ["rmse", "rmse>", "rmse>x", "ssim>1", ">1", "rmse>inf"] {
            let error = text.parse::<Limit>().unwrap_err();
            assert!(error.contains("relative-rmse, bias, max, psnr"), "{error}");
        }
    }
}
