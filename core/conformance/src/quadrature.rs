//! Deterministic integrals that statistical estimates are compared with.

/// Nodes on [−1, 1] and weights of Gauss-Legendre quadrature with 5 points, exact for polynomials of degree 9.
const GAUSS5: [(f64, f64); 5] = [
    (-0.906_179_845_938_664, 0.236_926_885_056_189_08),
    (-0.538_469_310_105_683_1, 0.478_628_670_499_366_47),
    (0.0, 0.568_888_888_888_888_9),
    (0.538_469_310_105_683_1, 0.478_628_670_499_366_47),
    (0.906_179_845_938_664, 0.236_926_885_056_189_08),
];

/// Nodes in `a..b` and their weights, which add up to `b − a`.
pub fn gauss(a: f64, b: f64) -> impl Iterator<Item = (f64, f64)> {
    let (middle, half) = (0.5 * (a + b), 0.5 * (b - a));
    GAUSS5
        .iter()
        .map(move |&(x, w)| (middle + half * x, half * w))
}

/// ∫ f over `a..b` with `panels` panels of 5 points.
pub fn integrate(a: f64, b: f64, panels: usize, f: impl Fn(f64) -> f64) -> f64 {
    let h = (b - a) / panels as f64;
    (0..panels)
        .map(|i| {
            gauss(a + i as f64 * h, a + (i + 1) as f64 * h)
                .map(|(x, w)| w * f(x))
                .sum::<f64>()
        })
        .sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exact_for_degree_nine() {
        let v = integrate(-1.0, 2.0, 1, |x| x.powi(9) - 3.0 * x.powi(4));
        assert!((v - (1023.0 / 10.0 - 99.0 / 5.0)).abs() < 1e-11);
    }

    #[test]
    fn converges_on_an_exponential() {
        let v = integrate(0.0, 5.0, 20, |x| (-x).exp());
        assert!((v + (-5.0f64).exp_m1()).abs() < 1e-12);
    }
}
