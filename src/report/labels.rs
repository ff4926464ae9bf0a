//! Labels that keep out of each other's way.

use super::figure::{Bounds, Place};

/// Where labels of height `height` go that would like to stand at `wanted`: no two closer than a height, all within
/// `low..=high`, the sum of squared moves least, equal wishes in the order given.
///
/// Taking i heights off the i-th label in order turns the task into isotonic regression, which pooling adjacent
/// violators solves exactly (Barlow et al. 1972); clamping that solution keeps it best under the bounds. Where
/// the labels do not fit at all, they are spread evenly over the range, closer than a height.
pub(super) fn spread(wanted: &[f64], height: f64, low: f64, high: f64) -> Vec<f64> {
    let n = wanted.len();
    let height = if n > 1 { height.min((high - low).max(0.0) / (n - 1) as f64) } else { height };
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|&a, &b| wanted[a].total_cmp(&wanted[b]));
    // Blocks of labels that touch: (sum of shifted wishes, labels).
    let mut blocks: Vec<(f64, usize)> = Vec::new();
    for (rank, &i) in order.iter().enumerate() {
        blocks.push((wanted[i] - rank as f64 * height, 1));
        while let [.., before, last] = blocks[..] {
            if before.0 / before.1 as f64 <= last.0 / last.1 as f64 {
                break;
            }
            blocks.pop();
            blocks.pop();
            blocks.push((before.0 + last.0, before.1 + last.1));
        }
    }
    let room = (high - n.saturating_sub(1) as f64 * height).max(low);
    let shifted = blocks.iter().flat_map(|&(sum, count)| std::iter::repeat_n(sum / count as f64, count));
    let mut places = vec![0.0; n];
    for ((rank, &i), at) in order.iter().enumerate().zip(shifted) {
        places[i] = at.clamp(low, room) + rank as f64 * height;
    }
    places
}

/// Which of the labels along an axis to show, `(centre, width)` each in ascending order, so that `gap` pixels stay
/// between neighbours: the last always, before it as many as fit from the left.
pub(super) fn kept_apart(labels: &[(f64, f64)], gap: f64) -> Vec<bool> {
    let mut shown = vec![false; labels.len()];
    let Some(&(last_centre, last_width)) = labels.last() else { return shown };
    let limit = last_centre - last_width / 2.0 - gap;
    let mut free_from = f64::NEG_INFINITY;
    for (i, &(centre, width)) in labels.iter().enumerate() {
        let fits = centre - width / 2.0 >= free_from && centre + width / 2.0 <= limit;
        if fits || i == labels.len() - 1 {
            shown[i] = true;
            free_from = centre + width / 2.0 + gap;
        }
    }
    shown
}

/// The first of `candidates` (a box, and the place its text stands at) that lies in `room` and overlaps nothing in
/// `taken`; `None` where none does.
pub(super) fn first_free(
    candidates: impl IntoIterator<Item = (Bounds, Place)>,
    room: &Bounds,
    taken: &[Bounds],
) -> Option<(Bounds, Place)> {
    candidates.into_iter().find(|(b, _)| b.inside(room) && !taken.iter().any(|t| t.overlaps(b)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use proptest::test_runner::{Config, TestRng, TestRunner};

    fn cost(wanted: &[f64], places: &[f64]) -> f64 {
        wanted.iter().zip(places).map(|(w, p)| (w - p) * (w - p)).sum()
    }

    /// The slow twin: every whole-pixel placement of up to four labels in the order of their wishes.
    fn best_on_a_grid(wanted: &[f64], height: i32, low: i32, high: i32) -> f64 {
        fn go(wanted: &[f64], from: i32, height: i32, high: i32) -> f64 {
            let Some((&first, rest)) = wanted.split_first() else { return 0.0 };
            (from..=high)
                .map(|at| (first - f64::from(at)).powi(2) + go(rest, at + height, height, high))
                .fold(f64::INFINITY, f64::min)
        }
        let mut sorted = wanted.to_vec();
        sorted.sort_by(f64::total_cmp);
        go(&sorted, low, height, high)
    }

    #[test]
    fn labels_that_fit_are_not_moved() {
        assert_eq!(spread(&[50.0, 10.0, 30.0], 12.0, 0.0, 100.0), [50.0, 10.0, 30.0]);
        assert!(spread(&[], 12.0, 0.0, 100.0).is_empty());
        assert_eq!(spread(&[500.0], 12.0, 0.0, 100.0), [100.0]);
    }

    #[test]
    fn spread_labels_keep_their_distance_and_move_no_further_than_the_best_on_a_grid() {
        let config = Config { cases: 200, failure_persistence: None, ..Config::default() };
        let mut runner = TestRunner::new_with_rng(config, TestRng::deterministic_rng(Default::default()));
        let wishes = proptest::collection::vec(-10i32..40, 0..5);
        runner
            .run(&wishes, |wishes| {
                let wanted: Vec<f64> = wishes.iter().map(|&w| f64::from(w)).collect();
                let places = spread(&wanted, 7.0, 0.0, 30.0);
                let mut sorted = places.clone();
                sorted.sort_by(f64::total_cmp);
                prop_assert!(sorted.windows(2).all(|p| p[1] - p[0] > 7.0 - 1e-9), "{places:?}");
                prop_assert!(sorted.iter().all(|p| (-1e-9..=30.0 + 1e-9).contains(p)), "{places:?}");
                let (ours, grid) = (cost(&wanted, &places), best_on_a_grid(&wanted, 7, 0, 30));
                prop_assert!(ours <= grid + 1e-9, "{wanted:?} -> {places:?}: {ours} > {grid}");
                Ok(())
            })
            .unwrap();
    }

    #[test]
    fn too_many_labels_are_spread_evenly() {
        assert_eq!(spread(&[5.0, 5.0, 5.0], 100.0, 0.0, 10.0), [0.0, 5.0, 10.0]);
    }

    #[test]
    fn axis_labels_keep_both_ends_and_drop_what_would_touch() {
        let labels = [(0.0, 10.0), (11.0, 10.0), (30.0, 10.0), (95.0, 10.0), (100.0, 10.0)];
        assert_eq!(kept_apart(&labels, 4.0), [true, false, true, false, true]);
        assert_eq!(kept_apart(&[(3.0, 10.0)], 4.0), [true]);
        assert!(kept_apart(&[], 4.0).is_empty());
    }
}
