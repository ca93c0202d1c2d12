"""Contains all the data models used in inputs/outputs"""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .alpha_score import AlphaScore
    from .bounding_box import BoundingBox
    from .cloud import Cloud
    from .cloud_input import CloudInput
    from .cloud_list import CloudList
    from .cloud_request import CloudRequest
    from .coarse_request import CoarseRequest
    from .coarse_response import CoarseResponse
    from .curvatures_request import CurvaturesRequest
    from .curvatures_response import CurvaturesResponse
    from .diagnostics import Diagnostics
    from .duplicate_policy import DuplicatePolicy
    from .estimate_request import EstimateRequest
    from .estimate_response import EstimateResponse
    from .factorization_used import FactorizationUsed
    from .family_score import FamilyScore
    from .field_error import FieldError
    from .flag import Flag
    from .flag_reason import FlagReason
    from .free_parameter import FreeParameter
    from .geometry_attribute import GeometryAttribute
    from .health import Health
    from .hyperparameters import Hyperparameters
    from .interpolation_batch_request import InterpolationBatchRequest
    from .interpolation_batch_response import InterpolationBatchResponse
    from .interpolation_request import InterpolationRequest
    from .interpolation_response import InterpolationResponse
    from .job import Job
    from .job_progress import JobProgress
    from .job_status import JobStatus
    from .kernel import Kernel
    from .kernel_description import KernelDescription
    from .kernel_family import KernelFamily
    from .kernel_list import KernelList
    from .kernel_parameter import KernelParameter
    from .kernel_used import KernelUsed
    from .laplace_beltrami_matrix_request import LaplaceBeltramiMatrixRequest
    from .laplace_beltrami_matrix_response import LaplaceBeltramiMatrixResponse
    from .laplace_beltrami_request import LaplaceBeltramiRequest
    from .laplace_beltrami_response import LaplaceBeltramiResponse
    from .laplace_beltrami_sparse_matrix_request import (
        LaplaceBeltramiSparseMatrixRequest,
    )
    from .laplace_beltrami_sparse_matrix_response import (
        LaplaceBeltramiSparseMatrixResponse,
    )
    from .leave_one_out_predictions import LeaveOneOutPredictions
    from .level_set_request import LevelSetRequest
    from .level_set_response import LevelSetResponse
    from .mean_choice import MeanChoice
    from .means_level import MeansLevel
    from .mesh_attribute import MeshAttribute
    from .mesh_bounds import MeshBounds
    from .mesh_part import MeshPart
    from .mesh_quality import MeshQuality
    from .model_selection_request import ModelSelectionRequest
    from .model_selection_response import ModelSelectionResponse
    from .noise_ratio import NoiseRatio
    from .normals_request import NormalsRequest
    from .normals_response import NormalsResponse
    from .operation_name import OperationName
    from .orientation_choice import OrientationChoice
    from .posterior_batch_request import PosteriorBatchRequest
    from .posterior_batch_response import PosteriorBatchResponse
    from .posterior_quantity import PosteriorQuantity
    from .posterior_request import PosteriorRequest
    from .posterior_response import PosteriorResponse
    from .posterior_target import PosteriorTarget
    from .problem import Problem
    from .region import Region
    from .region_adjacency import RegionAdjacency
    from .region_overlap import RegionOverlap
    from .regions_request import RegionsRequest
    from .regions_response import RegionsResponse
    from .sample_options import SampleOptions
    from .selection_criterion import SelectionCriterion
    from .selection_parameter import SelectionParameter
    from .sides_request import SidesRequest
    from .sides_response import SidesResponse
    from .smoothness import Smoothness
    from .solver_choice import SolverChoice
    from .solver_used import SolverUsed
    from .spacing import Spacing
    from .stencil_counts import StencilCounts
    from .surface import Surface
    from .surface_gradient_matrix_request import SurfaceGradientMatrixRequest
    from .surface_gradient_matrix_response import SurfaceGradientMatrixResponse
    from .surface_gradient_request import SurfaceGradientRequest
    from .surface_gradient_response import SurfaceGradientResponse
    from .surface_gradient_sparse_matrix_request import (
        SurfaceGradientSparseMatrixRequest,
    )
    from .surface_gradient_sparse_matrix_response import (
        SurfaceGradientSparseMatrixResponse,
    )
    from .surface_model_choice import SurfaceModelChoice
    from .surface_model_used import SurfaceModelUsed
    from .tile_regions import TileRegions
    from .value_attribute import ValueAttribute
    from .version import Version
    from .vertex_support import VertexSupport
    from .warning import Warning_
    from .warning_code import WarningCode

__all__ = (
    "AlphaScore",
    "BoundingBox",
    "Cloud",
    "CloudInput",
    "CloudList",
    "CloudRequest",
    "CoarseRequest",
    "CoarseResponse",
    "CurvaturesRequest",
    "CurvaturesResponse",
    "Diagnostics",
    "DuplicatePolicy",
    "EstimateRequest",
    "EstimateResponse",
    "FactorizationUsed",
    "FamilyScore",
    "FieldError",
    "Flag",
    "FlagReason",
    "FreeParameter",
    "GeometryAttribute",
    "Health",
    "Hyperparameters",
    "InterpolationBatchRequest",
    "InterpolationBatchResponse",
    "InterpolationRequest",
    "InterpolationResponse",
    "Job",
    "JobProgress",
    "JobStatus",
    "Kernel",
    "KernelDescription",
    "KernelFamily",
    "KernelList",
    "KernelParameter",
    "KernelUsed",
    "LaplaceBeltramiMatrixRequest",
    "LaplaceBeltramiMatrixResponse",
    "LaplaceBeltramiRequest",
    "LaplaceBeltramiResponse",
    "LaplaceBeltramiSparseMatrixRequest",
    "LaplaceBeltramiSparseMatrixResponse",
    "LeaveOneOutPredictions",
    "LevelSetRequest",
    "LevelSetResponse",
    "MeanChoice",
    "MeansLevel",
    "MeshAttribute",
    "MeshBounds",
    "MeshPart",
    "MeshQuality",
    "ModelSelectionRequest",
    "ModelSelectionResponse",
    "NoiseRatio",
    "NormalsRequest",
    "NormalsResponse",
    "OperationName",
    "OrientationChoice",
    "PosteriorBatchRequest",
    "PosteriorBatchResponse",
    "PosteriorQuantity",
    "PosteriorRequest",
    "PosteriorResponse",
    "PosteriorTarget",
    "Problem",
    "Region",
    "RegionAdjacency",
    "RegionOverlap",
    "RegionsRequest",
    "RegionsResponse",
    "SampleOptions",
    "SelectionCriterion",
    "SelectionParameter",
    "SidesRequest",
    "SidesResponse",
    "Smoothness",
    "SolverChoice",
    "SolverUsed",
    "Spacing",
    "StencilCounts",
    "Surface",
    "SurfaceGradientMatrixRequest",
    "SurfaceGradientMatrixResponse",
    "SurfaceGradientRequest",
    "SurfaceGradientResponse",
    "SurfaceGradientSparseMatrixRequest",
    "SurfaceGradientSparseMatrixResponse",
    "SurfaceModelChoice",
    "SurfaceModelUsed",
    "TileRegions",
    "ValueAttribute",
    "Version",
    "VertexSupport",
    "WarningCode",
    "Warning_",
)

if not TYPE_CHECKING:
    _MODULES = {
        "AlphaScore": ".alpha_score",
        "BoundingBox": ".bounding_box",
        "Cloud": ".cloud",
        "CloudInput": ".cloud_input",
        "CloudList": ".cloud_list",
        "CloudRequest": ".cloud_request",
        "CoarseRequest": ".coarse_request",
        "CoarseResponse": ".coarse_response",
        "CurvaturesRequest": ".curvatures_request",
        "CurvaturesResponse": ".curvatures_response",
        "Diagnostics": ".diagnostics",
        "DuplicatePolicy": ".duplicate_policy",
        "EstimateRequest": ".estimate_request",
        "EstimateResponse": ".estimate_response",
        "FactorizationUsed": ".factorization_used",
        "FamilyScore": ".family_score",
        "FieldError": ".field_error",
        "Flag": ".flag",
        "FlagReason": ".flag_reason",
        "FreeParameter": ".free_parameter",
        "GeometryAttribute": ".geometry_attribute",
        "Health": ".health",
        "Hyperparameters": ".hyperparameters",
        "InterpolationBatchRequest": ".interpolation_batch_request",
        "InterpolationBatchResponse": ".interpolation_batch_response",
        "InterpolationRequest": ".interpolation_request",
        "InterpolationResponse": ".interpolation_response",
        "Job": ".job",
        "JobProgress": ".job_progress",
        "JobStatus": ".job_status",
        "Kernel": ".kernel",
        "KernelDescription": ".kernel_description",
        "KernelFamily": ".kernel_family",
        "KernelList": ".kernel_list",
        "KernelParameter": ".kernel_parameter",
        "KernelUsed": ".kernel_used",
        "LaplaceBeltramiMatrixRequest": ".laplace_beltrami_matrix_request",
        "LaplaceBeltramiMatrixResponse": ".laplace_beltrami_matrix_response",
        "LaplaceBeltramiRequest": ".laplace_beltrami_request",
        "LaplaceBeltramiResponse": ".laplace_beltrami_response",
        "LaplaceBeltramiSparseMatrixRequest": ".laplace_beltrami_sparse_matrix_request",
        "LaplaceBeltramiSparseMatrixResponse": ".laplace_beltrami_sparse_matrix_response",
        "LeaveOneOutPredictions": ".leave_one_out_predictions",
        "LevelSetRequest": ".level_set_request",
        "LevelSetResponse": ".level_set_response",
        "MeanChoice": ".mean_choice",
        "MeansLevel": ".means_level",
        "MeshAttribute": ".mesh_attribute",
        "MeshBounds": ".mesh_bounds",
        "MeshPart": ".mesh_part",
        "MeshQuality": ".mesh_quality",
        "ModelSelectionRequest": ".model_selection_request",
        "ModelSelectionResponse": ".model_selection_response",
        "NoiseRatio": ".noise_ratio",
        "NormalsRequest": ".normals_request",
        "NormalsResponse": ".normals_response",
        "OperationName": ".operation_name",
        "OrientationChoice": ".orientation_choice",
        "PosteriorBatchRequest": ".posterior_batch_request",
        "PosteriorBatchResponse": ".posterior_batch_response",
        "PosteriorQuantity": ".posterior_quantity",
        "PosteriorRequest": ".posterior_request",
        "PosteriorResponse": ".posterior_response",
        "PosteriorTarget": ".posterior_target",
        "Problem": ".problem",
        "Region": ".region",
        "RegionAdjacency": ".region_adjacency",
        "RegionOverlap": ".region_overlap",
        "RegionsRequest": ".regions_request",
        "RegionsResponse": ".regions_response",
        "SampleOptions": ".sample_options",
        "SelectionCriterion": ".selection_criterion",
        "SelectionParameter": ".selection_parameter",
        "SidesRequest": ".sides_request",
        "SidesResponse": ".sides_response",
        "Smoothness": ".smoothness",
        "SolverChoice": ".solver_choice",
        "SolverUsed": ".solver_used",
        "Spacing": ".spacing",
        "StencilCounts": ".stencil_counts",
        "Surface": ".surface",
        "SurfaceGradientMatrixRequest": ".surface_gradient_matrix_request",
        "SurfaceGradientMatrixResponse": ".surface_gradient_matrix_response",
        "SurfaceGradientRequest": ".surface_gradient_request",
        "SurfaceGradientResponse": ".surface_gradient_response",
        "SurfaceGradientSparseMatrixRequest": ".surface_gradient_sparse_matrix_request",
        "SurfaceGradientSparseMatrixResponse": ".surface_gradient_sparse_matrix_response",
        "SurfaceModelChoice": ".surface_model_choice",
        "SurfaceModelUsed": ".surface_model_used",
        "TileRegions": ".tile_regions",
        "ValueAttribute": ".value_attribute",
        "Version": ".version",
        "VertexSupport": ".vertex_support",
        "Warning_": ".warning",
        "WarningCode": ".warning_code",
    }

    def __getattr__(name):
        """Imports a model when it is first used"""
        if name not in _MODULES:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        globals()[name] = getattr(import_module(_MODULES[name], __name__), name)
        return globals()[name]

    def __dir__():
        return sorted({*globals(), *_MODULES})
