"""The networks of the stages: what they are built of, and files with their weights."""

from panoscene._editions import EDITIONS as EDITIONS
from panoscene._editions import Edition as Edition

from ._backbone import Backbone as Backbone
from ._backbone import BackboneName as BackboneName
from ._backbone import build_backbone as build_backbone
from ._circular import CircularConv2d as CircularConv2d
from ._circular import make_circular as make_circular
from ._errors import CheckpointError as CheckpointError
from ._imagenet import imagenet_weights as imagenet_weights
from ._imagenet import read_tensors as read_tensors
from ._weights import WeightsHeader as WeightsHeader
from ._weights import content_hash as content_hash
from ._weights import read_weights as read_weights
from ._weights import read_weights_header as read_weights_header
from ._weights import shipped_weights as shipped_weights
from ._weights import write_weights as write_weights
