//! Exact sums: numbers as sums of `f64` terms that do not overlap.
//!
//! After J. R. Shewchuk, *Adaptive Precision Floating-Point Arithmetic and Fast Robust Geometric Predicates*, 1997. Limited
//! to the needs of the shape tests: differences and products of `f32` inputs, up to six factors deep. Those are multiples of
//! 2⁻⁶⁰⁰ below 2⁵²⁵, so that no product here under- or overflows and every result is exact.

/// Up to `N` terms in order of growing magnitude, none zero; their exact sum is the value. Adding n scalars needs n.
#[derive(Clone, Copy, Debug)]
pub struct Expansion<const N: usize> {
    terms: [f64; N],
    len: usize,
}

impl<const N: usize> Expansion<N> {
    /// Zero.
    pub const ZERO: Self = Self { terms: [0.0; N], len: 0 };

    /// Nonzero terms, by growing magnitude.
    pub fn terms(&self) -> &[f64] {
        &self.terms[..self.len]
    }

    /// Adds one number (Shewchuk's GROW-EXPANSION, without zero terms).
    pub fn add(&mut self, x: f64) {
        let mut carry = x;
        let mut kept = 0;
        for i in 0..self.len {
            let (sum, error) = two_sum(carry, self.terms[i]);
            if error != 0.0 {
                self.terms[kept] = error;
                kept += 1;
            }
            carry = sum;
        }
        if carry != 0.0 {
            self.terms[kept] = carry;
            kept += 1;
        }
        self.len = kept;
    }

    /// Adds `sign` · `a` · `b`, `sign` being 1 or −1.
    pub fn add_product(&mut self, a: &[f64], b: &[f64], sign: f64) {
        for &x in a {
            for &y in b {
                let (product, error) = two_product(x, y);
                self.add(sign * error);
                self.add(sign * product);
            }
        }
    }

    /// Sign of the value: −1, 0 or 1.
    pub fn sign(&self) -> i32 {
        match self.terms().last() {
            Some(&x) if x > 0.0 => 1,
            Some(_) => -1,
            None => 0,
        }
    }

    /// Value with a relative error of at most 2 u.
    pub fn approximate(&self) -> f64 {
        self.terms().iter().sum()
    }
}

impl Expansion<2> {
    /// a − b.
    pub fn difference(a: f32, b: f32) -> Self {
        let (sum, error) = two_sum(f64::from(a), -f64::from(b));
        let mut e = Self::ZERO;
        e.add(error);
        e.add(sum);
        e
    }
}

/// Three exact coordinates.
pub type Exact3 = [Expansion<2>; 3];

/// p − q, exactly.
pub fn difference(p: [f32; 3], q: [f32; 3]) -> Exact3 {
    // Filled in place: mapping an array of such numbers would copy each several times.
    let mut difference = [Expansion::ZERO; 3];
    for (k, e) in difference.iter_mut().enumerate() {
        *e = Expansion::difference(p[k], q[k]);
    }
    difference
}

/// p × q, exactly.
pub fn cross(p: &Exact3, q: &Exact3) -> [Expansion<16>; 3] {
    let mut cross = [Expansion::ZERO; 3];
    for (k, e) in cross.iter_mut().enumerate() {
        let (i, j) = ((k + 1) % 3, (k + 2) % 3);
        e.add_product(p[i].terms(), q[j].terms(), 1.0);
        e.add_product(p[j].terms(), q[i].terms(), -1.0);
    }
    cross
}

/// n · d, exactly.
pub fn dot_f32(n: &[Expansion<16>; 3], d: [f32; 3]) -> Expansion<96> {
    let mut e = Expansion::ZERO;
    for k in 0..3 {
        e.add_product(n[k].terms(), &[f64::from(d[k])], 1.0);
    }
    e
}

/// n · p, exactly.
pub fn dot(n: &[Expansion<16>; 3], p: &Exact3) -> Expansion<192> {
    let mut e = Expansion::ZERO;
    for k in 0..3 {
        e.add_product(n[k].terms(), p[k].terms(), 1.0);
    }
    e
}

/// a + b = sum + error exactly (Knuth).
pub(super) fn two_sum(a: f64, b: f64) -> (f64, f64) {
    let sum = a + b;
    let b_part = sum - a;
    let a_part = sum - b_part;
    (sum, (a - a_part) + (b - b_part))
}

/// a · b = product + error exactly (Veltkamp's split, Dekker's product; no fused operation is needed).
pub(super) fn two_product(a: f64, b: f64) -> (f64, f64) {
    let product = a * b;
    let (a_hi, a_lo) = split(a);
    let (b_hi, b_lo) = split(b);
    let error = a_lo * b_lo - (((product - a_hi * b_hi) - a_lo * b_hi) - a_hi * b_lo);
    (product, error)
}

/// Splits into the upper 26 bits and the rest.
fn split(a: f64) -> (f64, f64) {
    const SPLITTER: f64 = (1u64 << 27) as f64 + 1.0;
    let c = SPLITTER * a;
    let hi = c - (c - a);
    (hi, a - hi)
}

#[cfg(test)]
mod tests {
    use super::*;
    use dashu::rational::RBig;
    use proptest::prelude::*;

    fn exact(x: f64) -> RBig {
        RBig::try_from(x).unwrap_or_default()
    }

    fn hostile() -> impl Strategy<Value = f32> {
        (any::<i32>(), -149i32..96).prop_map(|(m, e)| m as f32 * 2f32.powi(e.max(-120)) * 2f32.powi(e.min(-120) + 120))
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]
        #[test]
        fn a_triple_product_is_exact(v in prop::array::uniform9(hostile())) {
            let (p, q, d) = ([v[0], v[1], v[2]], [v[3], v[4], v[5]], [v[6], v[7], v[8]]);
            let o = [v[8], v[0], v[4]];
            let got = dot_f32(&cross(&difference(p, o), &difference(q, o)), d);
            let r = |x: f32| exact(f64::from(x));
            let diff = |a: [f32; 3]| [0, 1, 2].map(|k| r(a[k]) - r(o[k]));
            let (p, q) = (diff(p), diff(q));
            let want = (0..3).fold(RBig::ZERO, |sum, k| {
                let (i, j) = ((k + 1) % 3, (k + 2) % 3);
                sum + r(d[k]) * (&p[i] * &q[j] - &p[j] * &q[i])
            });
            let sum = got.terms().iter().fold(RBig::ZERO, |s, &x| s + exact(x));
            prop_assert_eq!(sum, want);
        }
    }

    #[test]
    fn terms_that_cancel_leave_zero() {
        let mut e = Expansion::<8>::ZERO;
        for x in [1e30, 1.0, -1e30, 1e-30, -1.0, -1e-30] {
            e.add(x);
        }
        assert_eq!((e.sign(), e.terms().len()), (0, 0));
    }
}
