"""Furnished homes: floor plans, openings, furniture by rules."""

from ._records import Home as Home
from ._records import Opening as Opening
from ._records import OpeningKind as OpeningKind
from ._records import Placed as Placed
from ._records import Room as Room
from ._records import RoomKind as RoomKind
