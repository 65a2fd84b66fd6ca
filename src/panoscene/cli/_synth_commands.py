# ruff: noqa: PLC0415
# The imports stand inside the functions: help and wrong options should not wait for torch.
"""The commands of data sets: functions whose parameters are the options, docstrings the help."""

from pathlib import Path
from typing import Annotated, Literal

from tyro.conf import Positional, arg
from tyro.constructors import PrimitiveConstructorSpec

from panoscene.cli._options import Cache, Count, Flag, OptionalCount, Output

Sources = Annotated[
    Positional[tuple[Path, ...]], arg(metavar="[SOURCE ...]", help_behavior_hint="")
]
Folder = Annotated[Positional[Path], arg(metavar="DIR")]
Format = Annotated[
    Positional[Literal["coco", "horizonnet", "crops"]], arg(metavar="{coco,horizonnet,crops}")
]
Address = Annotated[
    str | None,
    arg(metavar="[ADDRESS]", help_behavior_hint=""),
    PrimitiveConstructorSpec(
        nargs=(0, 1),
        metavar="[ADDRESS]",
        instance_from_str=lambda words: words[0] if words else "",
        is_instance=lambda value: value is None or isinstance(value, str),
        str_from_instance=lambda value: [value] if value else [],
    ),
]


def assets(
    sources: Sources = (),
    *,
    cache: Cache = None,
    shapes: Flag = False,
    designs: Count = 12,
    processes: Count = 2,
    json: Flag = False,
) -> int:
    """Get the furniture models that homes are furnished with, and keep them in a cache.

    Without sources, the free libraries of Sweet Home 3D are downloaded once with apt-get, as the
    Debian packages sweethome3d and sweethome3d-furniture; nothing is installed and no root is
    needed. Designs of our own are added to every category that the libraries lack. Run again, it
    does only what is missing. Takes some minutes; needs pip install 'panoscene[synth]'.

    For example:

        panoscene synth assets
        panoscene synth assets Scopia.sh3f my/models --cache models

    Prints the models of each category, how many shapes they are (recoloured copies count once),
    and how many models are kept for the test with unseen shapes. The makers of the models are
    named in the file ATTRIBUTION of the cache.

    Args:
        sources: Libraries (.sh3f, .jar, .deb), folders of them, or folders of .glb and .obj files
            with a table models.csv, instead of the download.
        cache: Folder of the cache; panoscene/assets in the user's cache folder without it.
        shapes: Also sample signed distances of every model, for networks of shapes; takes half
            an hour, and goes on where it was stopped.
        designs: Designs of our own of each kind.
        processes: How many work side by side.
        json: Print the table as JSON.
    """
    from panoscene.cli._synth_make import run_assets

    return run_assets(
        sources, cache, shapes=shapes, designs=designs, processes=processes, as_json=json
    )


def render(
    recipe: Annotated[Positional[Path], arg(metavar="RECIPE")],
    output: Annotated[Positional[Path], arg(metavar="OUT")],
    *,
    limit: OptionalCount = None,
    processes: Count = 2,
    cache: Cache = None,
    ray: Address = None,
    no_glb: Flag = False,
) -> int:
    """Render furnished homes as panoramas with exact labels, as a recipe says.

    May be stopped at any time, also by a crash: the same command goes on where it was. The same
    recipe and models give the same labels, whatever the number of processes. Exit code 1 if homes
    could not be made. Needs panoscene synth assets first. For example:

        panoscene synth render configs/synth/tiny.yaml tiny
        panoscene synth render configs/synth/full.yaml data --limit 400
        panoscene synth render configs/synth/full.yaml /shared/data --ray

    The first one takes about a minute and shows whether everything works. OUT/README.md describes
    what is there, OUT/ATTRIBUTION names the makers of the models.

    Args:
        recipe: A .yaml file, such as those in configs/synth.
        output: Folder of the set.
        limit: Stop when this many panoramas are there; they have the splits of the whole.
        processes: How many work side by side; each takes up to 2 GiB of memory.
        cache: Folder of the models; where panoscene synth assets puts them without it.
        ray: Spread the work over a Ray cluster whose computers share OUT and the cache: the one
            at this address, or the running one; without any, over this computer. Needs pip
            install 'panoscene[ray]'.
        no_glb: Do not write the scene as scene.glb.
    """
    from panoscene.cli._synth_make import run_render

    return run_render(
        recipe, output, limit=limit, processes=processes, cache=cache, ray=ray, glb=not no_glb
    )


def stats(folder: Folder, *, json: Flag = False) -> int:
    """Count what is in a rendered set: objects per category, rooms, relations, occlusion.

    For example:

        panoscene synth stats data
        panoscene synth stats data --json | jq .visible_objects_mean

    Args:
        folder: Folder of the set.
        json: Print everything as JSON instead of the main figures.
    """
    from panoscene.cli._synth import run_stats

    return run_stats(folder, as_json=json)


def preview(folder: Folder, *, output: Output, each: Count = 20) -> int:
    """Draw a rendered set for people: the data card, contact sheets, a sheet per category.

    The folder gets README.md (the data card), rgb-000.jpg and so on (panoramas side by side),
    objects-000.jpg (the same with the outlines and names of the objects) and
    category-chair.jpg and so on: views of the objects of one category with their boxes, whose
    fronts are red. For example:

        panoscene synth preview data -o data-preview

    Args:
        folder: Folder of the set.
        output: Folder for the pictures.
        each: Panoramas on one contact sheet.
    """
    from panoscene.cli._synth import run_preview

    return run_preview(folder, output, each)


def check(folder: Folder, *, cache: Cache = None, json: Flag = False) -> int:
    """Check that the labels of a rendered set are right, panorama by panorama.

    Distances against the walls of the layout, masks against boxes, boxes against the points of
    the distance map, relations against what the boxes say, left and right, the seam, exposure,
    hashes, splits, that no two are alike, and that homes differ. Exit code 1 if anything fails.
    For example:

        panoscene synth check data
        panoscene synth check data --cache ~/.cache/panoscene/assets --json | jq .failures

    Args:
        folder: Folder of the set.
        cache: Folder of the models that the set was made with: boxes and relations are then
            checked against their meshes too.
        json: Print the number of failures of every check as JSON, and what they are.
    """
    from panoscene.cli._synth import run_check

    return run_check(folder, cache, as_json=json)


def export(
    folder: Folder,
    form: Format,
    output: Annotated[Positional[Path], arg(metavar="OUT")],
) -> int:
    """Write the labels of a rendered set in the format of other programs.

    coco: instances_SPLIT.json with masks, for detectors and segmenters. horizonnet: pictures and
    label_cor files of the cameras' rooms, for layout networks. crops: crops_SPLIT.jsonl, a list of
    views of single objects, for shape networks. For example:

        panoscene synth export data coco data-coco
        panoscene synth export data horizonnet data-layout

    Args:
        folder: Folder of the set.
        form: What to write.
        output: Folder for the files.
    """
    from panoscene.cli._synth import run_export

    return run_export(folder, form, output)
