//! Nets in base 2 and the smallest distance between points.

use super::Points;

/// The t of a (t, m, d)-net in base 2: the smallest t for which every elementary interval of volume 2^(t−m) holds 2^t points.
///
/// An elementary interval is Π [a_k 2^−e_k, (a_k + 1) 2^−e_k) with Σ e_k = m − t; a point's interval has the keys
/// ⌊x_k 2^e_k⌋, exact in f64. All C(m − t + d − 1, d − 1) shapes are tested, from t = 0 up, O(n) each: for d = 2 that is
/// O(n log² n) in all. t = m always passes. `None` where n is no power of two or a coordinate is 1, which lies in no interval.
pub fn t_value(points: &Points) -> Option<u32> {
    let n = points.n();
    if !n.is_power_of_two() || points.iter().flatten().any(|x| *x >= 1.0) {
        return None;
    }
    let m = n.trailing_zeros();
    let mut counts = vec![0_u32; n];
    (0..=m).find(|&t| {
        let mut shape = vec![0; points.dimension()];
        every_shape(&mut shape, 0, m - t, &mut |shape| is_even(points, shape, m - t, &mut counts))
    })
}

/// Does `holds` accept every way of splitting `left` over the axes from `axis` on? Stops at the first that it does not.
fn every_shape(shape: &mut [u32], axis: usize, left: u32, holds: &mut impl FnMut(&[u32]) -> bool) -> bool {
    if axis + 1 == shape.len() {
        shape[axis] = left;
        return holds(shape);
    }
    (0..=left).all(|exponent| {
        shape[axis] = exponent;
        every_shape(shape, axis + 1, left - exponent, holds)
    })
}

/// Does each of the 2^`bits` intervals of this shape hold equally many points? `counts` is scratch space.
fn is_even(points: &Points, shape: &[u32], bits: u32, counts: &mut [u32]) -> bool {
    let cells = &mut counts[..1 << bits];
    cells.fill(0);
    let share = (points.n() >> bits) as u32;
    points.iter().all(|point| {
        let mut key = 0_usize;
        for (x, &exponent) in point.iter().zip(shape) {
            // A product with a power of two is exact, so the floor is the mathematical one.
            key = (key << exponent) | (x * (1_u64 << exponent) as f64) as usize;
        }
        cells[key] += 1;
        cells[key] <= share
    })
}

/// Smallest distance between two points on the torus, where 0 and 1 are the same place; `None` for a single point.
///
/// Euclidean, in [0, √d/2]; exact duplicates give 0. Points are swept by their first coordinate and compared only while
/// that alone is closer than the best pair so far: O(n^(2−1/d)) for even sets, O(n²) at worst.
/// In the plane, dividing by √(2/(√3 n)) gives the share of the densest packing's distance.
pub fn min_toroidal_distance(points: &Points) -> Option<f64> {
    if points.n() < 2 {
        return None;
    }
    let mut sorted: Vec<&[f64]> = points.iter().collect();
    sorted.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let n = sorted.len();
    let mut nearest = f64::INFINITY;
    for (i, from) in sorted.iter().enumerate() {
        for step in 1..n {
            let to = sorted[(i + step) % n];
            let ahead = if i + step < n { to[0] - from[0] } else { to[0] - from[0] + 1.0 };
            // A pair more than half a turn ahead is met from its other end. The comparison with the squared best is
            // padded by a rounding, so that no equal distance is lost to it.
            if ahead > 0.5 || ahead * ahead > nearest * (1.0 + 4.0 * f64::EPSILON) {
                break;
            }
            nearest = nearest.min(squared_distance(from, to));
        }
    }
    Some(nearest.sqrt())
}

/// Squared Euclidean distance on the torus.
fn squared_distance(a: &[f64], b: &[f64]) -> f64 {
    let along = |(a, b): (&f64, &f64)| {
        let t = (a - b).abs();
        let t = t.min(1.0 - t);
        t * t
    };
    a.iter().zip(b).map(along).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use proptest::test_runner::{Config, RngAlgorithm, TestRng, TestRunner};

    fn runner(cases: u32) -> TestRunner {
        let config = Config { cases, failure_persistence: None, ..Config::default() };
        TestRunner::new_with_rng(config, TestRng::from_seed(RngAlgorithm::ChaCha, &[3; 32]))
    }

    fn plane(points: &[[f64; 2]]) -> Points {
        Points::new_2d(points).expect("in the unit square")
    }

    /// Coordinates on a coarse lattice and anywhere: duplicates, ends of the interval and ordinary numbers.
    fn coordinate() -> impl Strategy<Value = f64> {
        prop_oneof![(0..=8_u8).prop_map(|k| f64::from(k) / 8.0), 0.0..1.0_f64, Just(1.0 - f64::EPSILON / 2.0)]
    }

    /// Twin of the t-value: intervals written out, points found by comparison, nothing shared but the definition.
    fn t_by_definition(points: &[[f64; 2]]) -> u32 {
        let m = points.len().trailing_zeros();
        let holds = |t: u32| {
            (0..=m - t).all(|e| {
                let (w, h) = (0.5_f64.powi(e as i32), 0.5_f64.powi((m - t - e) as i32));
                (0..1 << e).all(|a| {
                    (0..1 << (m - t - e)).all(|b| {
                        let (x0, y0) = (f64::from(a) * w, f64::from(b) * h);
                        let inside = |p: &&[f64; 2]| x0 <= p[0] && p[0] < x0 + w && y0 <= p[1] && p[1] < y0 + h;
                        points.iter().filter(inside).count() == 1 << t
                    })
                })
            })
        };
        (0..=m).find(|&t| holds(t)).unwrap_or(m)
    }

    #[test]
    fn t_equals_its_definition_on_random_and_structured_sets() {
        let points = (0..5_u32).prop_flat_map(|m| {
            let below_one = || coordinate().prop_map(|x| if x < 1.0 { x } else { 0.0 });
            prop::collection::vec([below_one(), below_one()], 1 << m)
        });
        runner(200)
            .run(&points, |points| {
                prop_assert_eq!(t_value(&plane(&points)), Some(t_by_definition(&points)));
                Ok(())
            })
            .expect("equal");
        for m in 0..8 {
            let hammersley: Vec<[f64; 2]> = (0..1_u32 << m)
                .map(|i| [f64::from(i) / f64::from(1 << m), f64::from(i.reverse_bits()) / 4_294_967_296.0])
                .collect();
            assert_eq!(t_value(&plane(&hammersley)), Some(0), "Hammersley is a (0, {m}, 2)-net");
        }
    }

    #[test]
    fn no_power_of_two_and_no_point_at_one_has_a_t() {
        assert_eq!(t_value(&plane(&[[0.1, 0.2], [0.3, 0.4], [0.6, 0.9]])), None);
        assert_eq!(t_value(&plane(&[[0.1, 0.2], [0.3, 1.0]])), None);
        assert_eq!(t_value(&plane(&[[0.1, 0.2]])), Some(0));
        assert_eq!(t_value(&plane(&[[0.1, 0.2]; 16])), Some(4));
    }

    /// A shape of many axes, most of them with exponent 0: only the diagonal's halves are distinguished.
    #[test]
    fn t_in_many_dimensions_tests_every_shape() {
        let diagonal = Points::new(6, [[0.25; 6], [0.75; 6]].as_flattened().to_vec()).expect("valid");
        assert_eq!(t_value(&diagonal), Some(0));
        let four: Vec<f64> = (0..4).flat_map(|i| [f64::from(i) / 4.0; 3]).collect();
        assert_eq!(t_value(&Points::new(3, four).expect("valid")), Some(1));
    }

    fn distance_by_definition(points: &[[f64; 2]]) -> f64 {
        let mut best = f64::INFINITY;
        for (i, a) in points.iter().enumerate() {
            for b in &points[..i] {
                for dx in [-1.0, 0.0, 1.0] {
                    for dy in [-1.0, 0.0, 1.0] {
                        best = best.min(libm::hypot(a[0] - b[0] + dx, a[1] - b[1] + dy));
                    }
                }
            }
        }
        best
    }

    /// Differences of coordinates round at 2^-54 where a turn is added: the twins agree to 4e-16 absolute.
    #[test]
    fn the_smallest_distance_equals_its_definition_on_nine_copies() {
        let points = prop::collection::vec([coordinate(), coordinate()], 2..60);
        runner(400)
            .run(&points, |points| {
                let ours = min_toroidal_distance(&plane(&points)).expect("two points");
                prop_assert!((ours - distance_by_definition(&points)).abs() <= 4e-16);
                Ok(())
            })
            .expect("equal");
    }

    #[test]
    fn the_smallest_distance_of_special_sets() {
        assert_eq!(min_toroidal_distance(&plane(&[[0.3, 0.4]])), None);
        assert_eq!(min_toroidal_distance(&plane(&[[0.3, 0.4], [0.9, 0.1], [0.3, 0.4]])), Some(0.0));
        assert_eq!(min_toroidal_distance(&plane(&[[0.0, 0.0], [1.0, 1.0]])), Some(0.0));
        // A 40 x 40 grid, above any size where all pairs would be looked at.
        let grid: Vec<[f64; 2]> = (0..1600).map(|i| [f64::from(i % 40) / 40.0, f64::from(i / 40) / 40.0]).collect();
        let distance = min_toroidal_distance(&plane(&grid)).expect("many points");
        assert!((distance - 0.025).abs() < 1e-16 * 4.0);
    }
}
