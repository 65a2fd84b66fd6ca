"""Panoramas whose pictures are the ones that were written."""

from ._errors import DatasetError
from ._maps import INSTANCE
from ._read import PanoramaItem, SynthDataset
from ._write import file_hash


def sound_items(dataset: SynthDataset) -> list[PanoramaItem]:
    """Return the panoramas of a set once photos and instances of all of them are found sound.

    Decoders read many a damaged picture without a word; hashes tell. All are looked at before
    anything is made of the first.

    Raises:
        DatasetError: A file is missing or damaged.
    """
    for item in dataset:
        written = item.labels().files
        for path in (item.image_file(), item.folder / INSTANCE):
            if not path.is_file():
                raise DatasetError(path, f"expected a file of {item.name}, found none")
            if file_hash(path) != written.get(path.name):
                raise DatasetError(path, "expected the file that was written, found another")
    return list(dataset)
