from enum import StrEnum


class OperationName(StrEnum):
    ASSEMBLE_LAPLACE_BELTRAMI_MATRIX = "assemble_laplace_beltrami_matrix"
    ASSEMBLE_LAPLACE_BELTRAMI_SPARSE_MATRIX = "assemble_laplace_beltrami_sparse_matrix"
    ASSEMBLE_SURFACE_GRADIENT_MATRIX = "assemble_surface_gradient_matrix"
    ASSEMBLE_SURFACE_GRADIENT_SPARSE_MATRIX = "assemble_surface_gradient_sparse_matrix"
    COMPUTE_CURVATURES = "compute_curvatures"
    COMPUTE_INTERPOLATION = "compute_interpolation"
    COMPUTE_INTERPOLATION_BATCH = "compute_interpolation_batch"
    COMPUTE_LAPLACE_BELTRAMI = "compute_laplace_beltrami"
    COMPUTE_LEVEL_SET = "compute_level_set"
    COMPUTE_NORMALS = "compute_normals"
    COMPUTE_POSTERIOR = "compute_posterior"
    COMPUTE_POSTERIOR_BATCH = "compute_posterior_batch"
    COMPUTE_REGIONS = "compute_regions"
    COMPUTE_SURFACE_GRADIENT = "compute_surface_gradient"
    SELECT_MODEL = "select_model"

    def __str__(self) -> str:
        return str(self.value)
