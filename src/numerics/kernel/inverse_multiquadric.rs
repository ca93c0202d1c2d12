//! Inverse multiquadric: φ(q) = (1 + q)^{−½}.

/// φ = (1+q)^{−½}, φ′ = −½(1+q)^{−3/2}, φ″ = ¾(1+q)^{−5/2}.
#[inline(always)]
pub(super) fn profile(q: f64) -> [f64; 3] {
    let inverse = 1.0 / (1.0 + q);
    let phi = inverse.sqrt();
    let first = 0.5 * phi * inverse;
    [phi, -first, 1.5 * first * inverse]
}
