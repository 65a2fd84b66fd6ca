"""From a recipe to a data set: models, homes, photographs, on one machine or many."""

from ._benchmark import run_synth_benchmark as run_synth_benchmark
from ._benchmark import synth_benchmark_table as synth_benchmark_table
from ._finishes import sample_finishes as sample_finishes
from ._furnished import FurnishedHome as FurnishedHome
from ._furnished import furnished_home as furnished_home
from ._models import DESIGNS as DESIGNS
from ._models import Models as Models
from ._models import add_parametric_models as add_parametric_models
from ._photographs import Extra as Extra
from ._photographs import photograph_home as photograph_home
from ._ray import render_with_ray as render_with_ray
from ._run import RenderProgress as RenderProgress
from ._run import RenderTask as RenderTask
from ._run import begin_run as begin_run
from ._run import follow as follow
from ._run import render_dataset as render_dataset
from ._run import render_home as render_home
from ._split import Part as Part
from ._split import entries_for as entries_for
