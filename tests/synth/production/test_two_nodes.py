"""A Ray cluster of two nodes on this computer: they share homes to render and photos.

The cluster takes seconds to start, so that both commands are tried on one. Copies stand for
rendered pictures, and stages that know the truth for networks.
"""

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
import torch
from PIL import Image as Pillow

from panoscene.cli._reconstruct import Choice, reconstruct_files
from panoscene.pipeline import Pipeline, Stages
from panoscene.sample import sample_photo_path, sample_room_path
from panoscene.scene import read_scene, select
from panoscene.synth.dataset import Recipe, open_dataset
from panoscene.synth.production import RenderProgress, RenderTask, render_with_ray

pytestmark = [
    pytest.mark.slow,
    # ray leaves sockets and log files of its processes to the interpreter
    pytest.mark.filterwarnings("ignore::ResourceWarning"),
    pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning"),
    pytest.mark.filterwarnings("ignore::DeprecationWarning"),
    pytest.mark.filterwarnings("ignore::FutureWarning"),
]
CHOICE = Choice(1.6, 64, True)


@pytest.fixture(scope="module")
def cluster() -> Iterator[Any]:
    """Two nodes with one core each."""
    ray = pytest.importorskip("ray")
    from ray.cluster_utils import Cluster  # noqa: PLC0415

    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("RAY_USAGE_STATS_ENABLED", "0")
        # its workers would wait for the other tests
        patch.setenv("RAY_worker_niceness", "0")
        small: dict[str, Any] = {"num_cpus": 1, "object_store_memory": 80 * 2**20}
        cluster = Cluster(True, head_node_args=small | {"include_dashboard": False})
        cluster.add_node(**small)
        yield cluster
        ray.shutdown()
        cluster.shutdown()


def noting_nodes(render: Callable[[RenderTask], None]) -> Callable[[RenderTask], None]:
    """Return a task that also writes down which node it ran on."""

    def noted(task: RenderTask) -> None:
        import time  # noqa: PLC0415

        import ray  # noqa: PLC0415

        time.sleep(0.3)  # so that the second node gets its share
        render(task)
        nodes = task.root / "nodes"
        nodes.mkdir(exist_ok=True)
        (nodes / task.job.home).write_text(ray.get_runtime_context().get_node_id())

    return noted


def test_two_nodes_share_the_homes_and_failures_are_told(
    cluster: Any,
    tmp_path: Path,
    recipe: Recipe,
    cache: Path,
    copy_sample: Callable[[RenderTask], None],
) -> None:
    root = tmp_path / "set"
    (root / "broken" / "home0002").mkdir(parents=True)
    told: list[RenderProgress] = []
    options: dict[str, Any] = {"address": cluster.address, "told": told.append}
    render = noting_nodes(copy_sample)
    done = render_with_ray(root, recipe, cache, render=render, **options)
    assert (done.done, done.wanted, done.made) == (6, 8, 6)
    assert done.failed == (("home0002", "home0002: found no room for 2 cameras"),)
    assert [progress.done for progress in told][-1] == 6
    nodes = {file.read_text() for file in (root / "nodes").iterdir()}
    assert len(nodes) == 2
    # the same call goes on with what is missing
    (root / "broken" / "home0002").rmdir()
    done = render_with_ray(root, recipe, cache, render=render, **options)
    assert (done.done, done.made, done.failed) == (8, 2, ())
    assert len(open_dataset(root)) == 8
    assert (root / "README.md").is_file()


def knowing_maker(notes: Path) -> Callable[[], Pipeline]:
    """Return what makes a pipeline that finds three objects, and notes where it was made."""

    def make() -> Pipeline:
        import ray  # noqa: PLC0415

        from panoscene.models.layout import LayoutPrediction  # noqa: PLC0415
        from panoscene.scene import Detections  # noqa: PLC0415

        context = ray.get_runtime_context()
        (notes / f"{context.get_node_id()}-{context.get_worker_id()}").touch()
        truth = select(read_scene(sample_room_path()), torch.arange(3))
        seen = truth.objects
        found = Detections(seen.bfov, seen.category, seen.score)

        def layout(image: Any, *, camera_height: float | None = None) -> LayoutPrediction:
            import time  # noqa: PLC0415

            time.sleep(0.5)  # so that the second node gets its share
            return LayoutPrediction(truth.layout, False, torch.zeros(2, 1024), torch.zeros(1024))

        stages = Stages(
            lambda image: found, layout, lambda image, detections, layout, camera_height: seen
        )
        return Pipeline(stages, settings=None)

    return make


@pytest.fixture
def photos(tmp_path: Path) -> list[Path]:
    folder = tmp_path / "photos"
    folder.mkdir()
    with Pillow.open(sample_photo_path()) as picture:
        small = picture.resize((128, 64))
    files = [folder / f"photo{k}.jpg" for k in range(3)]
    for file in files:
        small.save(file)
    files[1].write_bytes(b"none")
    return files


def test_two_nodes_share_the_photos_and_one_that_fails_is_told(
    cluster: Any, photos: list[Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    notes = tmp_path / "notes"
    notes.mkdir()
    output, make = tmp_path / "rooms", knowing_maker(notes)
    code = reconstruct_files(make, photos, output, CHOICE, as_json=True, ray=cluster.address)
    out, err = capsys.readouterr()
    told = json.loads(out)
    assert code == 2
    assert [entry["ok"] for entry in told] == [True, False, True]
    assert [entry["photo"] for entry in told] == [str(photo) for photo in photos]
    assert f"error: {photos[1]}" in err
    assert len({file.name.split("-")[0] for file in notes.iterdir()}) == 2
    assert read_scene(output / "photo2" / "scene.json").name == "photo2"
    # the same again: only what is missing
    assert reconstruct_files(make, photos, output, CHOICE, as_json=True, ray=cluster.address) == 2
    told = json.loads(capsys.readouterr().out)
    assert [entry.get("new") for entry in told] == [False, None, False]
