//! The Pareto front: points that no other beats in both time and error.

/// Indices of the (time, error) pairs on the front, from least time to least error. Of equal pairs the first is taken; pairs with
/// a non-finite value are never on it.
pub fn front(points: &[(f64, f64)]) -> Vec<usize> {
    let mut order: Vec<usize> =
        (0..points.len()).filter(|&i| points[i].0.is_finite() && points[i].1.is_finite()).collect();
    order.sort_by(|&a, &b| points[a].0.total_cmp(&points[b].0).then(points[a].1.total_cmp(&points[b].1)));
    let mut least = f64::INFINITY;
    order.retain(|&i| {
        let better = points[i].1 < least;
        if better {
            least = points[i].1;
        }
        better
    });
    order
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_nothing_beats_is_on_the_front() {
        let points =
            [(4.0, 1.0), (1.0, 9.0), (2.0, 3.0), (3.0, 3.0), (2.0, 3.0), (5.0, 1.0), (f64::NAN, 0.0), (1.0, 8.0)];
        assert_eq!(front(&points), [7, 2, 0]);
        assert!(front(&[]).is_empty());
    }
}
