# ruff: noqa: PLC0415
# The imports stand inside the functions: help and wrong options should not wait for torch.
"""The commands: functions whose parameters are the options and whose docstrings are the help."""

from pathlib import Path
from typing import Annotated, Literal

from tyro.conf import Positional, arg

from panoscene.cli._options import (
    Cache,
    Count,
    Flag,
    Number,
    OptionalCount,
    OptionalFile,
    OptionalNumber,
    OptionalOutput,
    Output,
    SceneFile,
    Subject,
    Trial,
)


def demo(*, output: Output = Path("demo"), seed: Count = 0, json: Flag = False) -> int:
    """Disturb a furnished sample room, repair it, and draw it from above before and after.

    Needs no files and no network, and takes seconds. For example:

        panoscene demo
        panoscene demo -o demo --seed 7

    Args:
        output: Folder for the pictures, the scenes and the certificate.
        seed: Seed of the disturbance: another one, another mess.
        json: Print the names of the files and the figures as JSON.
    """
    from panoscene.cli._demo import run_and_tell

    return run_and_tell(output, seed, as_json=json)


def arrange(
    scenes: Annotated[
        Positional[tuple[str, ...]],
        arg(metavar="SCENE [SCENE ...]", help_behavior_hint="(required)"),
    ],
    *,
    output: Output,
    preset: Literal["default", "released", "paper"] = "default",
    settings: OptionalFile = None,
    steps: OptionalCount = None,
    picture: Flag = False,
    report: Flag = False,
    animation: Flag = False,
    json: Flag = False,
) -> int:
    """Repair scenes: move objects out of each other, back into the room, and onto the floor.

    Boxes move, turn and grow as little as is needed to agree with physics, with the relations in
    the file (or those that follow from its boxes) and with where the photo shows each object.
    Next to each repaired scene NAME.json stands NAME.certificate.json with the energy, collisions
    and excursions from the room before and after. The default preset returns a scene as it came
    rather than anything worse.

    For example:

        panoscene arrange room.json -o repaired.json
        panoscene arrange rooms/ more/*.json -o repaired --picture
        panoscene arrange room.json -o repaired --json | jq '.[].certificate.after.energy'

    A file that cannot be used is reported and left out; the others are still repaired, and the
    exit code is then 2.

    Args:
        scenes: scene.json files, folders with such files, or quoted patterns such as
            'rooms/**/*.json'.
        output: Where the results go: for one scene a name in .json, else a folder.
        preset: default is ours and never worse than its input; released and paper are the two
            published forms of the method, for comparison.
        settings: File with settings that differ from the preset's, such as
            {"weights": {"touching": 0.5}, "clearance": 0.01}.
        steps: Steps of the descent, instead of the preset's.
        picture: Also draw each room from above before and after, in NAME.before-after.png.
        report: Also write a page to look around in, before and after, as NAME.report.html.
        animation: Also show the boxes moving, in NAME.repair.webp; takes half a minute each.
        json: Print one list with everything instead of a table.
    """
    from panoscene.cli._scene_files import all_gone

    if all_gone(scenes, as_json=json):
        return 2
    from panoscene.cli._arrange import Extras, arrange_files
    from panoscene.cli._settings import chosen_settings

    chosen = chosen_settings(preset, settings, steps)
    extras = Extras(picture=picture, report=report, animation=animation)
    return arrange_files(scenes, output, chosen, extras, as_json=json)


def relations(
    scene: SceneFile,
    *,
    output: OptionalOutput = None,
    threshold: Number = 0.5,
    keep: Flag = False,
    everything: Annotated[bool, arg(name="all", help_behavior_hint="")] = False,
    json: Flag = False,
) -> int:
    """Derive and show the relations of a scene: what touches, stands, hangs, faces what.

    The relations follow from the boxes and the room with the tolerances of the paper (10 cm for a
    contact). For example:

        panoscene relations room.json
        panoscene relations room.json -o room.graphml
        panoscene relations room.json --all | grep 'faces wall-2'

    prints sentences such as "chair-3 touches table-1", draws the graph's file for Gephi or yEd,
    and finds what looks at one wall.

    Args:
        scene: A scene.json file.
        output: Write a file instead of sentences: .graphml or .relations.json for the graph of
            the relations, any other .json for the scene with its relations.
        threshold: Only relations with at least this probability, above 0 and up to 1. Matters with
            --keep: derived relations are certain. A written scene holds all.
        keep: Use the relations in the file instead of deriving them.
        everything: Also print which object is farther from the camera and how objects are turned
            to each other and to the walls; there are many of these. Files and --json have all.
        json: Print the graph of the relations as JSON: nodes and edges.
    """
    from panoscene.cli._scene_files import check_scene

    check_scene(scene)
    from panoscene.cli._relations import show_relations

    return show_relations(
        scene, output, threshold=threshold, keep=keep, everything=everything, as_json=json
    )


def convert(
    input: Annotated[Positional[Path], arg(metavar="INPUT")],
    *,
    output: Output,
    room: Annotated[str | None, arg(metavar='"X,Y X,Y X,Y ..."', help_behavior_hint="")] = None,
    ceiling: OptionalNumber = None,
    camera_height: OptionalNumber = None,
    name: Annotated[str | None, arg(metavar="NAME", help_behavior_hint="")] = None,
    cube: Flag = False,
    view: Annotated[str | None, arg(metavar="LON,LAT,FOV", help_behavior_hint="")] = None,
    yaw_deg: OptionalNumber = None,
    size: OptionalCount = None,
    photo: OptionalFile = None,
) -> int:
    """Convert boxes, scenes and panoramas; the names of the files say from what to what.

    A table of boxes and a floor plan become a scene. The table has the columns category, x, y, z
    (the centre), width, depth, height and yaw_deg (or yaw in radians), in metres: the origin is on
    the floor under the camera, y points to the photo's centre column, x to its right; yaw turns
    counter-clockwise seen from above and is 0 for what faces along y.

        panoscene convert boxes.csv -o room.json --room "-2,-1 3,-1 3,4 -2,4"

    A scene becomes a table, the graph of its relations, or a scene file in canonical form.

        panoscene convert room.json -o boxes.csv
        panoscene convert room.json -o room.graphml

    It also becomes a model for other programs (.glb for engines and Blender, with the photo on
    its walls; .obj), a floor plan with dimensions (.svg, .dxf), or a page to look around in
    (.html). A .glb made here, and edited elsewhere, becomes a scene again.

        panoscene convert room.json -o room.glb --photo photo.jpg
        panoscene convert room.json -o plan.dxf
        panoscene convert room.glb -o edited.json

    A panorama becomes the six faces of a cube, what a pinhole camera would see, or itself turned.

        panoscene convert photo.jpg -o faces --cube
        panoscene convert photo.jpg -o door.png --view 90,-10,60
        panoscene convert photo.jpg -o turned.jpg --yaw-deg 30

    Args:
        input: boxes .csv, scene .json, model .glb, or a 2:1 panorama (.jpg .png .webp .tif .bmp).
        output: The file to write, or for --cube the folder.
        room: Corners of the floor plan in order, either way round, in metres.
        ceiling: Height of the ceiling in metres; 2.6 for a table.
        camera_height: Height of the camera in metres; 1.6 for a table.
        name: Name of the scene; for a table that of its file.
        cube: Make the six faces of a cube.
        view: Make a square view towards LON, LAT (degrees to the right of the photo's centre and
            above the horizon) that is FOV degrees wide.
        yaw_deg: Turn the camera by this many degrees to the left; the picture moves to the right.
        size: Width of each face or view in pixels; without it as sharp as the panorama.
        photo: For .glb and .html: the panorama, instead of the one that the scene names.
    """
    from panoscene.cli._scene_files import check_scene

    if input.suffix.lower() == ".json":
        check_scene(input)
    from panoscene.cli._convert import SceneOptions, convert_file
    from panoscene.cli._pictures import PanoramaOptions

    scene_options = SceneOptions(room, ceiling, camera_height, name)
    panorama_options = PanoramaOptions(cube or None, view, yaw_deg, size)
    return convert_file(input, output, scene_options, panorama_options, photo)


def schema() -> int:
    """Print the JSON Schema of scene.json.

    Programs in any language can check scene files with it, and editors complete the names of
    fields. For example:

        panoscene schema > scene.schema.json
    """
    from panoscene.cli._terminal import say_json
    from panoscene.scene import scene_json_schema

    say_json(scene_json_schema())
    return 0


def bench(subject: Subject, *, repeats: Count = 5, cache: Cache = None, json: Flag = False) -> int:
    """Measure how fast this machine is, in several repeats.

    For arrange: one scene of 20 objects, a batch of 64 of them, one of 200 objects, and how soon
    the default preset is better than the released one at its end. Takes about a minute.

    For score: 500 scenes of 20 objects from disk to every metric. Takes some minutes.

    For synth: seconds and memory of rendering panoramas of the full set with two processes, each
    of which makes one home first and then as many as there are repeats. Takes about ten minutes
    and the models of panoscene synth assets.

    For stages: the detector, the layout, poses and shapes of 20 objects in one panorama. For
    pipeline: the whole way from a panorama to a scene with 20 objects, each of its stages, and the
    command panoscene reconstruct from its start to its end. Takes some minutes. For example:

        panoscene bench arrange
        panoscene bench arrange --repeats 3 --json | jq .scene_20_ms
        panoscene bench synth --json | jq .panorama_s
        panoscene bench pipeline --json | jq .total_s

    Args:
        subject: What to measure.
        repeats: How often each measurement is repeated; the median counts, the mean for synth.
        cache: For synth, the folder of the models; where panoscene synth assets puts them without.
        json: Print the figures and the machine they are from as JSON.
    """
    if subject == "synth":
        from panoscene.cli._measure_synth import run_synth_bench

        return run_synth_bench(cache, repeats, as_json=json)
    if subject in ("stages", "pipeline"):
        from panoscene.cli._measure_pipeline import run_pipeline_bench

        return run_pipeline_bench(subject, repeats, as_json=json)
    from panoscene.cli._measure import run_bench

    return run_bench(subject, repeats, as_json=json)


def experiment(
    subject: Trial,
    *,
    output: OptionalOutput = None,
    scenes: OptionalCount = None,
    seed: Count = 0,
    json: Flag = False,
) -> int:
    """Run an experiment on random furnished rooms and print its table.

    For arrange: rooms are disturbed as an imperfect network would, and each preset repairs them
    with true and with corrupted relations; then the default without collisions, relations or
    observations. The table compares boxes with the truth before and after.

    For safety: scenes without any sense go through the default preset, which promises to make
    none of them worse. For example:

        panoscene experiment arrange
        panoscene experiment arrange --scenes 20 --seed 1 -o results
        panoscene experiment safety --scenes 1000

    Args:
        subject: What to examine.
        output: Folder that also gets the table and all figures, as arrange.md and arrange.json
            (safety.md and safety.json).
        scenes: How many rooms: 100 unless you say otherwise, or ten thousand in the safety trial.
        seed: Seed of everything random: the same seed gives the same rooms.
        json: Print the rows and the conditions as JSON.
    """
    from panoscene.cli._measure import run_experiment

    return run_experiment(subject, output, scenes=scenes, seed=seed, as_json=json)
