from enum import StrEnum


class FlagReason(StrEnum):
    AMBIGUOUS_SIDE = "ambiguous_side"
    EDGE = "edge"
    FAR_FROM_CLOUD = "far_from_cloud"
    KERNEL_TOO_ROUGH = "kernel_too_rough"
    UNAFFORDABLE_RESCUE = "unaffordable_rescue"
    UNCERTAIN = "uncertain"
    UNDER_RESOLVED = "under_resolved"
    VANISHING_GRADIENT = "vanishing_gradient"

    def __str__(self) -> str:
        return str(self.value)
