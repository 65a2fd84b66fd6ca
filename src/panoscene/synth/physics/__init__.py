"""Furnished homes that obey physics: settling with an engine, checks on the meshes."""

from ._check import check_home as check_home
from ._records import Fault as Fault
from ._records import Models as Models
from ._records import ObjectReport as ObjectReport
from ._records import Outcome as Outcome
from ._records import SettleReport as SettleReport
from ._replace import replace_models as replace_models
from ._settle import settle_home as settle_home
from ._shapes import CollisionShape as CollisionShape
from ._shapes import collision_shape as collision_shape
