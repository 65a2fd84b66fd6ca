"""Training the stages: recipes, one loop, and what each stage adds to it."""

from ._batch import on_device as on_device
from ._devices import chosen_precision as chosen_precision
from ._devices import fast_bfloat16 as fast_bfloat16
from ._devices import seeded as seeded
from ._errors import TrainError as TrainError
from ._loop import TrainResult as TrainResult
from ._loop import train as train
from ._precompute import precompute as precompute
from ._precompute_estimates import file_hash as file_hash
from ._precompute_estimates import precompute_estimates as precompute_estimates
from ._recipe import STAGES as STAGES
from ._recipe import Stage as Stage
from ._recipe import TrainRecipe as TrainRecipe
from ._recipe import read_train_recipe as read_train_recipe
from ._recipe import recipe_text as recipe_text
from ._task import SELECTION as SELECTION
from ._task import Task as Task
from ._tasks import TASKS as TASKS
from ._tasks import options_of as options_of
