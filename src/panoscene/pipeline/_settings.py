"""What the arrangement is told when boxes come from a photo."""

from panoscene.arrange import PRESETS

PHOTO = PRESETS["default"].model_copy(
    update={
        "name": "photo",
        "weights": PRESETS["default"].weights.model_copy(
            update={
                "object_collision": 2.0,
                "wall_collision": 0.2,
                "relative_yaw": 0.03,
                "relative_yaw_wall": 0.1,
                "touching": 0.6,
                "touching_wall": 0.6,
                "on_floor": 2.0,
                "direction": 1.6,
                "distance": 0.3,
                "size": 0.8,
                "yaw": 0.8,
                "reprojection": 0.0,
            }
        ),
        "tolerance": 0.06,
        "size_range": 1.15,
        "doubtful_yield": True,
        "firmness": 0.85,
        "built_in_pace": 0.1,
        "nested_stay": True,
        "safe_by": "object",
    }
)
"""The preset ``default`` for the estimates of networks: boxes move as little as it takes.

``default`` was made for boxes whose BFoVs are exact. Those of a detector are not: the network that
places a box has weighed them already, and following them once more costs accuracy. So boxes are
held where they are, sure ones more than doubtful ones, doors and windows more than what stands
before them, and overlaps are forgiven that the paper's counts forgive too. Found by search on
estimates of the training and the validation part."""
