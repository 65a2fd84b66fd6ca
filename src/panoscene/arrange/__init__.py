"""The arrangement optimiser: move boxes to agree with physics, relations and the image."""

from panoscene.arrange._arrange import Arrangement as Arrangement
from panoscene.arrange._arrange import arrange as arrange
from panoscene.arrange._arrange import arrange_scenes as arrange_scenes
from panoscene.arrange._arrange import energy as energy
from panoscene.arrange._arrange import optimise_boxes as optimise_boxes
from panoscene.arrange._arrange import solver_states as solver_states
from panoscene.arrange._batch import ArrangementBatch as ArrangementBatch
from panoscene.arrange._batch import collate_scenes as collate_scenes
from panoscene.arrange._certificate import Certificate as Certificate
from panoscene.arrange._certificate import Violations as Violations
from panoscene.arrange._settings import COLLISION_TERMS as COLLISION_TERMS
from panoscene.arrange._settings import OBSERVATION_TERMS as OBSERVATION_TERMS
from panoscene.arrange._settings import PRESETS as PRESETS
from panoscene.arrange._settings import RELATION_TERMS as RELATION_TERMS
from panoscene.arrange._settings import TERM_NAMES as TERM_NAMES
from panoscene.arrange._settings import ArrangementSettings as ArrangementSettings
from panoscene.arrange._settings import TermWeights as TermWeights
from panoscene.arrange._settings import Thresholds as Thresholds
