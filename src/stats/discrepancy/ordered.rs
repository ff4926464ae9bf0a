//! Sums over all pairs of points on a line or in the plane in O(n log n), by order.
//!
//! Every kernel of an L2 discrepancy is a sum of products of single terms, apart from one multiple of |x − y|:
//! K(x, y) = c + g(x) + g(y) + h x y + β |x − y|. Products of single terms sum by moments; |x − x'| times single terms by
//! moments of the points before, in the order of x; |x − x'| |y − y'| by those in a tree over the order of y (Fenwick
//! 1994). Heinrich 1996 has the same order of cost in any dimension.
//!
//! All sums have twice the digits of f64, so that what cancels leaves more than f64 can hold.

use super::Points;
use super::double::Double;

/// One axis of a kernel: K(x, y) = c + g(x) + g(y) + h x y + β |x − y|.
pub struct Kernel<G: Fn(f64) -> Double> {
    pub c: Double,
    pub g: G,
    pub h: Double,
    pub beta: Double,
}

/// The points by rising x and by rising y.
pub struct Order {
    /// Coordinates by rising first coordinate: x and y, where y is 0 on the line.
    by_x: Vec<[f64; 2]>,
    /// The same by rising second coordinate, axes exchanged; empty on the line.
    by_y: Vec<[f64; 2]>,
    /// Σ_ij |x_i − x_j| |y_i − y_j|; not needed on the line.
    both: Double,
}

impl Order {
    /// Sorts points of the line or the plane, and sums what depends on both orders.
    ///
    /// # Panics
    /// In three or more dimensions.
    pub fn new(points: &Points) -> Self {
        assert!(points.dimension() <= 2, "points of the line or the plane");
        // Not negative, so the bits are ordered as the numbers are; ties by the other coordinate.
        let on_line = points.dimension() == 1;
        let mut by_x: Vec<[f64; 2]> = points.iter().map(|p| [p[0], if on_line { 0.0 } else { p[1] }]).collect();
        by_x.sort_unstable_by_key(|p| p.map(f64::to_bits));
        if on_line {
            return Self { by_x, by_y: Vec::new(), both: Double::from(0.0) };
        }
        let mut order: Vec<(u64, u32)> = by_x.iter().map(|p| p[1].to_bits()).zip(0..).collect();
        order.sort_unstable();
        let mut rank = vec![0_u32; order.len()];
        order.iter().zip(1..).for_each(|((_, i), place)| rank[*i as usize] = place);
        let by_y = order.iter().map(|(_, i)| by_x[*i as usize]).map(|[x, y]| [y, x]).collect();
        let both = both_distances(&by_x, &rank);
        Self { by_x, by_y, both }
    }

    /// Σ_ij Π_k K(x_ik, x_jk).
    pub fn sum_over_pairs<G: Fn(f64) -> Double + Sync>(&self, kernel: &Kernel<G>) -> Double {
        if self.by_y.is_empty() {
            let (separate, distance) = (kernel.separate_on_line(&self.by_x), distances(&self.by_x));
            return separate.plus(kernel.beta.times(distance));
        }
        let (along_x, along_y) = rayon::join(
            || kernel.separate_in_plane(&self.by_x).plus(kernel.beta.times(kernel.one_distance(&self.by_x))),
            || kernel.beta.times(kernel.one_distance(&self.by_y)),
        );
        along_x.plus(along_y).plus(kernel.beta.times(kernel.beta).times(self.both))
    }
}

fn total(terms: impl Iterator<Item = Double>) -> Double {
    terms.fold(Double::from(0.0), Double::plus)
}

impl<G: Fn(f64) -> Double> Kernel<G> {
    /// Σ_ij (c + g_i + g_j + h x_i x_j).
    fn separate_on_line(&self, points: &[[f64; 2]]) -> Double {
        let n = Double::from(points.len() as f64);
        let g = total(points.iter().map(|p| (self.g)(p[0])));
        let x = total(points.iter().map(|p| Double::from(p[0])));
        n.times(n).times(self.c).plus(n.times(g).scaled(2.0)).plus(self.h.times(x).times(x))
    }

    /// Σ_ij (c + g(x_i) + g(x_j) + h x_i x_j)(c + g(y_i) + g(y_j) + h y_i y_j).
    fn separate_in_plane(&self, points: &[[f64; 2]]) -> Double {
        let zero = Double::from(0.0);
        let [mut x, mut y, mut gx, mut gy, mut xy, mut gx_y, mut x_gy, mut gx_gy] = [zero; 8];
        for p in points {
            let (g0, g1) = ((self.g)(p[0]), (self.g)(p[1]));
            x = x.plus(Double::from(p[0]));
            y = y.plus(Double::from(p[1]));
            gx = gx.plus(g0);
            gy = gy.plus(g1);
            gx_gy = gx_gy.plus(g0.times(g1));
            xy = xy.plus(Double::product(p[0], p[1]));
            gx_y = gx_y.plus(g0.times_single(p[1]));
            x_gy = x_gy.plus(g1.times_single(p[0]));
        }
        let n = Double::from(points.len() as f64);
        let (c, h) = (self.c, self.h);
        let constant = n.times(n).times(c).times(c);
        let single = c.times(n).times(gx.plus(gy)).plus(n.times(gx_gy)).plus(gx.times(gy)).scaled(2.0);
        let squares = c.times(h).times(x.times(x).plus(y.times(y)));
        let mixed = h.times(gx_y.times(y).plus(x_gy.times(x))).scaled(2.0);
        constant.plus(single).plus(squares).plus(mixed).plus(h.times(h).times(xy).times(xy))
    }

    /// Σ_ij |x_i − x_j| (c + g(y_i) + g(y_j) + h y_i y_j), of points by rising x.
    fn one_distance(&self, by_x: &[[f64; 2]]) -> Double {
        let zero = Double::from(0.0);
        let [mut x, mut y, mut g, mut xy, mut xg, mut sum] = [zero; 6];
        for (before, p) in by_x.iter().enumerate() {
            let gi = (self.g)(p[1]);
            let alone = self.c.plus(gi);
            let hy = self.h.times_single(p[1]);
            let counted = alone.times_single(before as f64).plus(g).plus(hy.times(y));
            let weighted = alone.times(x).plus(xg).plus(hy.times(xy));
            sum = sum.plus(counted.times_single(p[0]).minus(weighted));
            x = x.plus(Double::from(p[0]));
            y = y.plus(Double::from(p[1]));
            g = g.plus(gi);
            xy = xy.plus(Double::product(p[0], p[1]));
            xg = xg.plus(gi.times_single(p[0]));
        }
        sum.scaled(2.0)
    }
}

/// Σ_ij |x_i − x_j|, of points by rising x.
fn distances(by_x: &[[f64; 2]]) -> Double {
    let (mut x, mut sum) = (Double::from(0.0), Double::from(0.0));
    for (before, p) in by_x.iter().enumerate() {
        sum = sum.plus(Double::product(p[0], before as f64).minus(x));
        x = x.plus(Double::from(p[0]));
    }
    sum.scaled(2.0)
}

/// Count, Σx, Σy and Σxy of some points, the sums in units of 2^-92: whole numbers add without rounding, in any order.
type Moments = [i128; 4];

/// Digits after the binary point: room for 2^34 points before it.
const FRACTION: i32 = 92;

/// Σ_ij |x_i − x_j| |y_i − y_j|, of points by rising x with their places from 1 by rising y: points enter one by one, and
/// those below in y and those above have opposite signs.
fn both_distances(by_x: &[[f64; 2]], places: &[u32]) -> Double {
    let mut tree: Vec<Moments> = vec![[0; 4]; by_x.len() + 1];
    let mut all: Moments = [0; 4];
    let mut sum = Double::from(0.0);
    for (&[x, y], &place) in by_x.iter().zip(places) {
        let mut below: Moments = [0; 4];
        let mut node = place as usize;
        while node > 0 {
            add(&mut below, &tree[node]);
            node &= node - 1;
        }
        // Σ ± (x − x_j)(y − y_j) = xy Σ±1 − x Σ±y_j − y Σ±x_j + Σ±x_j y_j.
        let signed: [i128; 4] = std::array::from_fn(|k| 2 * below[k] - all[k]);
        let [sx, sy, sxy] = [signed[1], signed[2], signed[3]].map(from_fixed);
        let xy = Double::product(x, y);
        let counted = xy.times_single(signed[0] as i64 as f64);
        sum = sum.plus(counted.minus(sy.times_single(x)).minus(sx.times_single(y)).plus(sxy));
        let own = [1, to_fixed(Double::from(x)), to_fixed(Double::from(y)), to_fixed(xy)];
        add(&mut all, &own);
        let mut node = place as usize;
        while node < tree.len() {
            add(&mut tree[node], &own);
            node += node & node.wrapping_neg();
        }
    }
    sum.scaled(2.0)
}

fn add(sums: &mut Moments, terms: &Moments) {
    sums.iter_mut().zip(terms).for_each(|(sum, term)| *sum += term);
}

/// Half of [`FRACTION`] as a factor: 2^46.
const HALF: f64 = (1_u64 << (FRACTION / 2)) as f64;

/// A number in [0, 1] in units of 2^-92, cut off below.
fn to_fixed(value: Double) -> i128 {
    let scaled = value.high * HALF;
    let high = scaled as i64;
    let rest = ((scaled - high as f64) + value.low * HALF) * HALF;
    (i128::from(high) << (FRACTION / 2)) + i128::from(rest as i64)
}

/// Units of 2^-92 as a number, to the last of about 106 digits.
fn from_fixed(units: i128) -> Double {
    // Three parts of at most 48 digits, each exact in f64.
    const PART: i64 = (1 << 40) - 1;
    let [high, middle, low] = [(units >> 80) as i64, (units >> 40) as i64 & PART, units as i64 & PART];
    let unit = 1.0 / (HALF * HALF);
    let two_to_40 = (1_u64 << 40) as f64;
    Double::sum(high as f64 * (two_to_40 * two_to_40), middle as f64 * two_to_40)
        .plus(Double::from(low as f64))
        .scaled(unit)
}

#[cfg(test)]
mod tests {
    use super::super::testing::runner;
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn fixed_numbers_keep_92_digits() {
        for x in [0.0, 1.0, 0.5, 1.0 / 3.0, f64::MIN_POSITIVE, 1.0 - f64::EPSILON / 2.0, 1e-20] {
            let square = Double::product(x, x);
            for value in [Double::from(x), square] {
                let back = from_fixed(to_fixed(value)).minus(value);
                assert!(back.value().abs() <= 1.0 / (HALF * HALF), "{x:e}: {:e}", back.value());
            }
        }
        let sum: i128 = (0..1 << 20).map(|_| to_fixed(Double::from(1.0))).sum();
        assert_eq!(from_fixed(sum).high, 1_048_576.0);
        assert_eq!(from_fixed(-sum).high, -1_048_576.0);
    }

    /// Twin: all pairs in Double. Ties, ends of the interval and neighbouring numbers among ordinary ones.
    #[test]
    fn sums_by_order_are_those_over_all_pairs() {
        let coordinate = || {
            prop_oneof![
                (0..=4_u8).prop_map(|k| f64::from(k) / 4.0),
                Just(0.5 + f64::EPSILON / 2.0),
                Just(1e-30),
                0.0..=1.0_f64
            ]
        };
        let case = (1..=2_usize, prop::collection::vec([coordinate(), coordinate()], 1..40));
        runner(200)
            .run(&case, |(dimension, set)| {
                let kernel = Kernel {
                    c: Double::ratio(7.0, 5.0),
                    g: |x| Double::product(x, x).times_single(0.3).minus(Double::from(x)),
                    h: Double::ratio(-5.0, 7.0),
                    beta: Double::ratio(-1.0, 3.0),
                };
                let k = |x: f64, y: f64| {
                    let distance = Double::sum(x, -y).abs();
                    let separate = kernel.c.plus((kernel.g)(x)).plus((kernel.g)(y));
                    separate.plus(kernel.h.times(Double::product(x, y))).plus(kernel.beta.times(distance))
                };
                let flat: Vec<f64> = set.iter().flat_map(|p| p[..dimension].to_vec()).collect();
                let ours = Order::new(&Points::new(dimension, flat).expect("valid")).sum_over_pairs(&kernel);
                let mut twin = Double::from(0.0);
                for p in &set {
                    for q in &set {
                        twin = twin.plus((0..dimension).fold(Double::from(1.0), |f, a| f.times(k(p[a], q[a]))));
                    }
                }
                // 1600 pairs of products up to 10, each known to 2^-90.
                prop_assert!(ours.minus(twin).value().abs() <= 16_000.0 * 2_f64.powi(-90));
                Ok(())
            })
            .expect("equal");
    }
}
