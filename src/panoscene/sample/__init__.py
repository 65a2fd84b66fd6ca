"""Samples that come with the package: a furnished room, and a photo with its truth."""

from panoscene.sample._photo import sample_photo_path as sample_photo_path
from panoscene.sample._photo import sample_photo_truth_path as sample_photo_truth_path
from panoscene.sample._room import sample_room_path as sample_room_path
