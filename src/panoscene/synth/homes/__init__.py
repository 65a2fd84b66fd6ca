"""Furnished homes: floor plans, openings, furniture by rules."""

from ._boards import Board as Board
from ._boards import boards_of as boards_of
from ._boards import has_top as has_top
from ._boxes import PlacedBoxes as PlacedBoxes
from ._boxes import home_scene as home_scene
from ._boxes import placed_boxes as placed_boxes
from ._boxes import room_layouts as room_layouts
from ._furnish import furnish_home as furnish_home
from ._library import ModelLibrary as ModelLibrary
from ._library import ModelSummary as ModelSummary
from ._library import Summary as Summary
from ._library import SummaryLibrary as SummaryLibrary
from ._library import is_kitchen_sink as is_kitchen_sink
from ._library import stand_in_library as stand_in_library
from ._library import summary_library as summary_library
from ._records import Home as Home
from ._records import Opening as Opening
from ._records import OpeningKind as OpeningKind
from ._records import Placed as Placed
from ._records import Room as Room
from ._records import RoomKind as RoomKind
from ._sample import sample_home as sample_home
from ._statistics import HomeStatistics as HomeStatistics
from ._statistics import home_statistics as home_statistics
