//! The discrete Fourier transform of any length, in a fixed order of operations.

/// A complex number, real and imaginary part.
pub type Complex = [f64; 2];

fn product(a: Complex, b: Complex) -> Complex {
    [a[0] * b[0] - a[1] * b[1], a[0] * b[1] + a[1] * b[0]]
}

/// F(ν) = Σ_x f(x) e^(−2πi ν x/n), not normalised, for one length n.
///
/// Cooley & Tukey (1965) by prime factors: n · (sum of the prime factors of n) products, so n² for a prime.
pub struct Fourier {
    /// e^(−2πi k/n).
    roots: Vec<Complex>,
}

impl Fourier {
    /// For `n` ≥ 1 values.
    pub fn new(n: usize) -> Self {
        assert!(n > 0, "a transform needs a value");
        let root = |k: usize| {
            let angle = -std::f64::consts::TAU * k as f64 / n as f64;
            [libm::cos(angle), libm::sin(angle)]
        };
        Self { roots: (0..n).map(root).collect() }
    }

    /// The transform of `values`.
    ///
    /// # Panics
    /// Where there are not n of them.
    pub fn transform(&self, values: &[Complex]) -> Vec<Complex> {
        assert_eq!(values.len(), self.roots.len(), "a transform of another length");
        let (mut out, mut scratch) = (vec![[0.0; 2]; values.len()], Vec::new());
        self.step(values, 1, &mut out, &mut scratch);
        out
    }

    /// The transform of every `stride`-th of `values`, as many as `out` holds.
    fn step(&self, values: &[Complex], stride: usize, out: &mut [Complex], scratch: &mut Vec<Complex>) {
        let n = out.len();
        if n == 1 {
            out[0] = values[0];
            return;
        }
        let factor = (2..).take_while(|p| p * p <= n).find(|&p| n.is_multiple_of(p)).unwrap_or(n);
        let part = n / factor;
        for (r, out) in out.chunks_exact_mut(part).enumerate() {
            self.step(&values[r * stride..], stride * factor, out, scratch);
        }
        // One power of the root of unity of order n is `stride` of ours.
        let root = |k: usize| self.roots[k % n * stride];
        for k in 0..part {
            scratch.clear();
            scratch.extend((0..factor).map(|r| product(out[r * part + k], root(r * k))));
            for q in 0..factor {
                out[q * part + k] = (0..factor).fold([0.0; 2], |sum, r| {
                    let term = product(scratch[r], root(r * q * part));
                    [sum[0] + term[0], sum[1] + term[1]]
                });
            }
        }
    }
}

/// The transform in the plane of `width` × `height` values, row by row: F(ν) at `ν_y · width + ν_x`.
pub fn transform_2d(values: &[Complex], width: usize) -> Vec<Complex> {
    let height = values.len() / width;
    assert_eq!(width * height, values.len(), "rows of unequal length");
    let (along_x, along_y) = (Fourier::new(width), Fourier::new(height));
    let mut out: Vec<Complex> = values.chunks_exact(width).flat_map(|row| along_x.transform(row)).collect();
    for x in 0..width {
        let column: Vec<Complex> = out[x..].iter().step_by(width).copied().collect();
        let transformed = along_y.transform(&column);
        out[x..].iter_mut().step_by(width).zip(transformed).for_each(|(out, v)| *out = v);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers without a pattern.
    fn values(n: usize) -> Vec<Complex> {
        (0..n).map(|i| [libm::sin((i * i) as f64 + 0.3), libm::cos(1.7 * (i * i) as f64)]).collect()
    }

    #[test]
    fn it_is_the_sum_of_its_definition_for_every_length() {
        for n in (1..=40).chain([45, 60, 64, 77, 80, 97]) {
            let f = values(n);
            let found = Fourier::new(n).transform(&f);
            for (nu, found) in found.iter().enumerate() {
                let term = |x: usize| {
                    let angle = -std::f64::consts::TAU * (nu * x % n) as f64 / n as f64;
                    product(f[x], [libm::cos(angle), libm::sin(angle)])
                };
                let sum = (0..n).map(term).fold([0.0; 2], |s, t| [s[0] + t[0], s[1] + t[1]]);
                assert!((0..2).all(|i| (found[i] - sum[i]).abs() < 1e-12 * n as f64), "{n}, {nu}: {found:?} {sum:?}");
            }
        }
    }

    #[test]
    fn in_the_plane_it_keeps_the_sum_of_squares_and_finds_a_wave() {
        let (width, height) = (12, 10);
        let f = values(width * height);
        let square = |v: &[Complex]| v.iter().map(|c| c[0] * c[0] + c[1] * c[1]).sum::<f64>();
        let ratio = square(&transform_2d(&f, width)) / square(&f) / (width * height) as f64;
        assert!((ratio - 1.0).abs() < 1e-13, "{ratio}");
        let wave = |p: usize| {
            let phase = 3.0 * (p % width) as f64 / width as f64 + 2.0 * (p / width) as f64 / height as f64;
            [libm::cos(std::f64::consts::TAU * phase), libm::sin(std::f64::consts::TAU * phase)]
        };
        let found = transform_2d(&(0..width * height).map(wave).collect::<Vec<_>>(), width);
        for (at, v) in found.iter().enumerate() {
            let expected = if at == 2 * width + 3 { (width * height) as f64 } else { 0.0 };
            assert!((v[0] - expected).abs() < 1e-11 && v[1].abs() < 1e-11, "{at}: {v:?}");
        }
    }
}
