"""Parametric furniture: models made from a kind and a seed, and variations of any model."""

from ._catalogue import DECORATION_KINDS as DECORATION_KINDS
from ._catalogue import PARAMETRIC_KINDS as PARAMETRIC_KINDS
from ._catalogue import make_model as make_model
from ._vary import scale_model as scale_model
from ._vary import size_jitter_of as size_jitter_of
from ._vary import vary_model as vary_model
