//! The standard normal distribution: its cumulative distribution function Φ and the inverse.

use std::f64::consts::{FRAC_1_SQRT_2, SQRT_2, TAU};

/// Limit on the steps of Halley's method. Each step triples the number of correct digits.
const MAX_STEPS: usize = 20;

/// Returns `Φ(x)`, the probability that a standard normal number is at most x.
pub fn cumulative(x: f64) -> f64 {
    0.5 * libm::erfc(-x * FRAC_1_SQRT_2)
}

/// Returns `Φ⁻¹(p)` for p in (0, 1), and NaN elsewhere.
///
/// In the lower half, Halley's method solves `ln Φ(x) = ln p`, where `ln Φ` is concave. The upper half
/// follows by symmetry.
pub fn quantile(p: f64) -> f64 {
    if !(p > 0.0 && p < 1.0) {
        return f64::NAN;
    }
    if p > 0.5 {
        // For p > ½ this difference is exact.
        return -quantile(1.0 - p);
    }
    let target = p.ln();
    // The start is good to a tenth in the tail, from Φ(x) ≈ exp(−x²/2)/(|x|√2π). Near the median it takes the
    // slope at 0.
    let mut x = if p > 0.1 { (p - 0.5) * TAU.sqrt() } else { -(-2.0 * target - (-2.0 * target).ln()).sqrt() };
    for _ in 0..MAX_STEPS {
        let below = cumulative(x);
        let hazard = (-0.5 * x * x).exp() / (TAU.sqrt() * below);
        let off = below.ln() - target;
        // With f = ln Φ − ln p and the hazard h: f′ = h, f″ = −h(x + h).
        let newton = off / hazard;
        let step = newton / (1.0 + 0.5 * newton * (x + hazard));
        x -= step;
        if step.abs() <= 1e-15 * x.abs().max(1.0 / SQRT_2) {
            break;
        }
    }
    x
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_the_textbook_ones() {
        // Abramowitz and Stegun 1964, table 26.5, and scipy.special.ndtri.
        let known: [(f64, f64); 6] = [
            (0.5, 0.0),
            (0.975, 1.959963984540054),
            (0.025, -1.959963984540054),
            (0.9, 1.2815515655446004),
            (1e-10, -6.361340902404056),
            (1e-300, -37.0471),
        ];
        for (p, expected) in known {
            let tolerance = if p < 1e-100 { 1e-4 } else { 2e-15 * f64::max(1.0, expected.abs()) };
            assert!((quantile(p) - expected).abs() <= tolerance, "{p}: {}", quantile(p));
        }
        assert!([0.0, 1.0, -1.0, f64::NAN].into_iter().all(|p| quantile(p).is_nan()));
    }

    #[test]
    fn quantiles_invert_the_distribution() {
        for k in 1..400 {
            let x = -8.0 + 0.04 * f64::from(k);
            let p = cumulative(x);
            // Above the median, p holds few digits of 1 − p.
            let digits = f64::EPSILON * (2.0 + p / ((-0.5 * x * x).exp() / TAU.sqrt()));
            assert!((quantile(p) - x).abs() <= 4.0 * digits * f64::max(1.0, x.abs()), "{x}: {}", quantile(p));
        }
    }
}
