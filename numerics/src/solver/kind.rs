//! The solvers by name, and what not all of them have.

/// The solvers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SolverKind {
    /// A factorization of the whole matrix.
    Dense,
    /// The nearest points of each query.
    Local,
}

/// What a solver is asked for, where not every solver has it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantity {
    /// The diagonal of `(K + αI)⁻¹`.
    InverseDiagonal,
    /// A matrix with a column for each point.
    DenseMatrix,
    /// Values at queries, which it has no weights for.
    Values,
    /// Normals and curvatures in this dimension.
    Geometry,
}
