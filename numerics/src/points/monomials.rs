//! Monomials, and how many nodes determine what they reproduce.

/// Degree of the polynomials that stencils reproduce, at most.
pub(crate) const MAX_STENCIL_DEGREE: usize = 4;

/// Nodes per monomial: twice as many are needed for weights that do not oscillate, some more for the rims of neighbourhoods.
pub(crate) const NODES_PER_MONOMIAL: f64 = 2.5;

/// Nodes of a stencil over the tangent plane of a hypersurface, at most: 38 in space.
pub(crate) fn n_stencil_nodes(dimension: usize) -> usize {
    (NODES_PER_MONOMIAL * n_monomials(dimension - 1, MAX_STENCIL_DEGREE) as f64).ceil() as usize
}

/// Monomials in k variables up to a degree: `(k + degree)! / (k! degree!)`.
pub(crate) fn n_monomials(k: usize, degree: usize) -> usize {
    (1..=k).fold(1, |product, i| product * (degree + i) / i)
}

/// Exponents of the monomials in k variables up to a degree.
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
