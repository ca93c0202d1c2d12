from enum import StrEnum


class WarningCode(StrEnum):
    BRIDGED = "bridged"
    DISAGREES_WITH_NEIGHBOURS = "disagrees_with_neighbours"
    DUPLICATES_MERGED = "duplicates_merged"
    FAR_FROM_CLOUD = "far_from_cloud"
    FAR_VERTICES = "far_vertices"
    ILL_CONDITIONED = "ill_conditioned"
    KERNEL_TOO_ROUGH = "kernel_too_rough"
    NEIGHBOURS_NOT_ENOUGH = "neighbours_not_enough"
    OFFSET_MODEL_USED = "offset_model_used"
    OPEN_CLOUD = "open_cloud"
    ORIENTATION_REPAIRED = "orientation_repaired"
    PARTS_DROPPED = "parts_dropped"
    POOR_FIT = "poor_fit"
    RAW_MESH = "raw_mesh"
    REFINED = "refined"
    REPEATED_ROWS = "repeated_rows"
    SHARP_EDGES = "sharp_edges"
    UNITS_DIFFER = "units_differ"
    VARIANCE_CLAMPED = "variance_clamped"

    def __str__(self) -> str:
        return str(self.value)
