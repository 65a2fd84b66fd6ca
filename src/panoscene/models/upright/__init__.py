"""Upright photos: the camera's tilt from the straight lines of the room, without a network."""

from panoscene.models.upright._estimate import LEAST_CONFIDENCE as LEAST_CONFIDENCE
from panoscene.models.upright._estimate import UprightEstimate as UprightEstimate
from panoscene.models.upright._estimate import upright_rotation as upright_rotation
from panoscene.models.upright._photo_frame import detections_in_photo as detections_in_photo
