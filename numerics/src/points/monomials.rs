//! Monomials, and the number of nodes of a stencil that reproduces them.

/// Greatest degree of the polynomials that stencils reproduce.
pub(crate) const MAX_STENCIL_DEGREE: usize = 4;

/// Nodes per monomial. Weights oscillate unless there are twice as many nodes as monomials. Rims of
/// neighbourhoods need some more.
pub(crate) const NODES_PER_MONOMIAL: f64 = 2.5;

/// Greatest number of nodes of a stencil over the tangent plane of a hypersurface: 38 in space.
pub(crate) fn n_stencil_nodes(dimension: usize) -> usize {
    (NODES_PER_MONOMIAL * n_monomials(dimension - 1, MAX_STENCIL_DEGREE) as f64).ceil() as usize
}

/// Number of monomials in k variables up to a degree: `(k + degree)! / (k! degree!)`.
pub(crate) fn n_monomials(k: usize, degree: usize) -> usize {
    (1..=k).fold(1, |product, i| product * (degree + i) / i)
}

/// Exponents of the monomials in k variables up to a degree, one list of k per monomial.
pub(crate) fn exponents(k: usize, degree: usize) -> Vec<Vec<usize>> {
    if k == 0 {
        return vec![Vec::new()];
    }
    let with_first = |first: usize| {
        exponents(k - 1, degree - first).into_iter().map(move |rest| {
            let mut powers = vec![first];
            powers.extend(rest);
            powers
        })
    };
    (0..=degree).flat_map(with_first).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn monomials_are_counted() {
        for (k, degree, expected) in [(1, 4, 5), (2, 4, 15), (3, 4, 35), (2, 0, 1)] {
            assert_eq!((n_monomials(k, degree), exponents(k, degree).len()), (expected, expected));
        }
    }
}
