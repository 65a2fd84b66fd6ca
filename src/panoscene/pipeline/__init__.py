"""From a photo to a scene: the stages in order, each of which can be given or left out."""

from ._clock import Clock as Clock
from ._load import load as load
from ._load import load_stages as load_stages
from ._load import load_steps as load_steps
from ._pipeline import Pipeline as Pipeline
from ._records import Flag as Flag
from ._records import FlagCode as FlagCode
from ._records import Given as Given
from ._records import Reconstruction as Reconstruction
from ._settings import PHOTO as PHOTO
from ._sphere import SphereGaps as SphereGaps
from ._sphere import sphere_gaps as sphere_gaps
from ._stages import Stages as Stages
