//! Problems of clouds, kernels and solvers.

pub use gramian_host::problem::catalogue::*;

gramian_host::catalogue! {
    INVALID_CLOUD "invalid-cloud" UNPROCESSABLE_ENTITY "The points do not form a cloud"
        "A cloud has at least one point, and all its points have the same number of finite coordinates. The geometry \
        of a hypersurface needs at least two coordinates.";
    DUPLICATE_POINTS "duplicate-points" UNPROCESSABLE_ENTITY "Points coincide and alpha is 0"
        "No function takes two values at one point. Set alpha above 0 to treat them as repeated observations, or set \
        duplicates to merge to average their values. point_indices lists them.";
    DIMENSION_MISMATCH "dimension-mismatch" UNPROCESSABLE_ENTITY "Points of different dimension"
        "Queries, normals and the cloud of the geometry have the dimension of the cloud.";
    LENGTH_MISMATCH "length-mismatch" UNPROCESSABLE_ENTITY "One entry per point is needed"
        "values, noise_variances and normals have one entry per point of their cloud, in the order of the points.";
    KERNEL_NOT_SMOOTH "kernel-not-smooth" UNPROCESSABLE_ENTITY "The kernel has no derivatives here"
        "The Laplace kernel with epsilon 0 and the Matérn kernel with nu 0.5 have a kink at every point of the cloud. \
        Use laplace with epsilon above 0 or matern with nu of 1.5 or more, or query other places.";
    KERNEL_NOT_POSITIVE_DEFINITE "kernel-not-positive-definite" UNPROCESSABLE_ENTITY "The kernel is not positive definite in this dimension"
        "Wendland kernels are positive definite up to dimension 3. Choose another family.";
    NOT_POSITIVE_DEFINITE "not-positive-definite" UNPROCESSABLE_ENTITY "The Gram matrix is not positive definite in float64"
        "The kernel is too smooth or too wide for this cloud at this alpha: no honest answer exists in float64. Set \
        alpha to minimum_alpha or more, shorten the length_scale, or use a rougher kernel.";
    NOT_CONVERGED "not-converged" UNPROCESSABLE_ENTITY "The iteration ended above the tolerance"
        "The solver iterative found no weights whose relative residual is within the tolerance; the detail has the one \
        that it reached. Set a larger tolerance or alpha, take a rougher kernel or a shorter length_scale, or take \
        another solver.";
    UNSUPPORTED_BY_SOLVER "unsupported-by-solver" UNPROCESSABLE_ENTITY "The solver does not serve what was asked for"
        "The local solver answers each query from the points nearest to it: values and their variances, and the geometry \
        of surfaces in dimensions 2 to 4, for which it chooses kernel and noise by itself. Covariance, likelihood and matrices \
        need the dense solver, or landmarks; the iterative solver has covariances too. The detail names what to leave out, or which solver to take.";
    UNKNOWN_CLOUD "unknown-cloud" NOT_FOUND "No such cloud"
        "The cloud was never posted with this key, was deleted, or was dropped as the least recently used. Post its \
        points again: the id stays the same.";
}
