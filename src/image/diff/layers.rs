//! Differences of the layers of two EXR files.

use super::distance;
use crate::image::Layers;

/// The difference of one layer that both pictures have.
#[derive(Clone, Debug, PartialEq)]
pub struct LayerDifference {
    /// Name in the file, such as `albedo`, `Z` or `id.prim`.
    pub name: String,
    /// Root mean squared difference, without the pairs of which just one value is finite (such as the depth where only one
    /// picture shows a surface). Ids, such as `id.prim`, that differ count 1.
    pub rmse: f64,
    /// Largest difference; infinite where just one of two values is finite.
    pub max: f64,
    /// Number of values that differ.
    pub differing: u64,
    /// Number of those where one value is finite and the other is not.
    pub of_one: u64,
    /// Number of values compared.
    pub values: u64,
}

/// Differences of the layers that both have, and the names of the layers that only one has.
pub fn layer_differences(expected: &Layers, actual: &Layers) -> (Vec<LayerDifference>, Vec<String>) {
    let (ours, theirs) = (named(expected), named(actual));
    let other = |name: &str| theirs.iter().find(|(other, _)| other == name);
    let mut alone: Vec<String> = Vec::new();
    let mut both = Vec::new();
    for (name, values) in &ours {
        match other(name) {
            Some((_, others)) => both.push(difference(name, values, others)),
            None => alone.push(name.clone()),
        }
    }
    alone.extend(theirs.iter().map(|(name, _)| name).filter(|n| !ours.iter().any(|(o, _)| o == *n)).cloned());
    (both, alone)
}

fn difference(name: &str, expected: &[f64], actual: &[f64]) -> LayerDifference {
    let is_name = LayerDifference::is_name(name);
    let (mut sum, mut max, mut differing, mut of_one) = (0.0, 0.0_f64, 0, 0);
    for (&a, &b) in expected.iter().zip(actual) {
        let d = if is_name { f64::from(u8::from(a != b)) } else { distance(a, b) };
        max = max.max(d);
        differing += u64::from(d > 0.0);
        if d.is_finite() {
            sum += d * d;
        } else {
            of_one += 1;
        }
    }
    let both = (expected.len() as u64 - of_one).max(1);
    let rmse = (sum / both as f64).sqrt();
    LayerDifference { name: name.to_owned(), rmse, max, differing, of_one, values: expected.len() as u64 }
}

impl LayerDifference {
    /// Whether the numbers of a layer are ids: they are equal or not, and their distance means nothing.
    pub fn is_name(layer: &str) -> bool {
        layer.starts_with("id.")
    }
}

/// Every non-empty layer, with its name in the file.
fn named(layers: &Layers) -> Vec<(String, Vec<f64>)> {
    let vectors = |name: &str, values: &[[f32; 3]]| {
        (name.to_owned(), values.as_flattened().iter().copied().map(f64::from).collect())
    };
    let ids = |name: &str, values: &[u32]| (name.to_owned(), values.iter().copied().map(f64::from).collect());
    let mut all: Vec<(String, Vec<f64>)> = vec![
        vectors("albedo", &layers.albedo),
        vectors("N", &layers.normal),
        vectors("P", &layers.position),
        ("Z".to_owned(), layers.depth.iter().copied().map(f64::from).collect()),
        ids("id.prim", &layers.prim),
        ids("id.instance", &layers.instance),
    ];
    all.extend(layers.channels.iter().map(|channel| (channel.name.clone(), channel.values.iter().collect())));
    all.retain(|(_, values)| !values.is_empty());
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::{Channel, Values};

    #[test]
    fn layers_are_compared_by_name_and_what_is_missing_is_named() {
        let a = Layers {
            depth: vec![1.0, f32::INFINITY],
            prim: vec![3, 4],
            channels: vec![Channel { name: "tests.shadow".into(), values: Values::U32(vec![7, 9]) }],
            ..Layers::default()
        };
        let b =
            Layers { depth: vec![1.5, f32::INFINITY], albedo: vec![[0.0; 3]; 2], channels: Vec::new(), ..a.clone() };
        let (both, alone) = layer_differences(&a, &b);
        let names: Vec<&str> = both.iter().map(|layer| layer.name.as_str()).collect();
        assert_eq!(names, ["Z", "id.prim"]);
        assert_eq!((both[0].max, both[0].differing, both[0].values), (0.5, 1, 2));
        assert_eq!((both[1].rmse, both[1].differing), (0.0, 0));
        assert_eq!(alone, ["tests.shadow", "albedo"]);
    }

    #[test]
    fn names_differ_or_not_and_what_one_alone_has_is_counted() {
        let a = Layers { depth: vec![1.0, 2.0, 4.0], prim: vec![3, 4, u32::MAX], ..Layers::default() };
        let b = Layers { depth: vec![1.0, 2.5, f32::INFINITY], prim: vec![3, 9, 5], ..Layers::default() };
        let (both, _) = layer_differences(&a, &b);
        let [depth, prim] = &both[..] else { panic!("{both:?}") };
        assert_eq!((depth.rmse, depth.max), (0.125_f64.sqrt(), f64::INFINITY));
        assert_eq!((depth.differing, depth.of_one), (2, 1));
        assert_eq!((prim.rmse, prim.max), ((2.0_f64 / 3.0).sqrt(), 1.0));
        assert_eq!((prim.differing, prim.of_one), (2, 0));
    }
}
