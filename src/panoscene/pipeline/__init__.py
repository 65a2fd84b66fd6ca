"""From a photo to a scene: the stages in order, each of which can be given or left out."""

from ._load import load as load
from ._pipeline import Pipeline as Pipeline
from ._records import Given as Given
from ._records import Reconstruction as Reconstruction
from ._stages import Stages as Stages
