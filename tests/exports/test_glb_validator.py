"""GLB files before the Khronos validator, which comes from npm into a folder outside of git."""

import json
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import NoReturn

import pytest
import torch

from panoscene.exports import write_glb
from panoscene.scene import Scene

HERE = Path(__file__).parent / "validator"


@pytest.fixture(scope="module")
def validator(root: Path, missing: Callable[[str, str], NoReturn]) -> Path:
    """Return the folder of node modules; it is filled once."""
    if shutil.which("node") is None or shutil.which("npm") is None:
        missing("npm", "needs node and npm for the glTF validator")
    folder = root / ".cache" / "gltf-validator"
    lock = (HERE / "package-lock.json").read_text()
    kept = folder / "package-lock.json"
    if not (folder / "node_modules" / "gltf-validator").is_dir() or kept.read_text() != lock:
        folder.mkdir(parents=True, exist_ok=True)
        for name in ("package.json", "package-lock.json", ".npmrc"):
            shutil.copyfile(HERE / name, folder / name)
        command = ["npm", "ci", "--no-audit", "--no-fund", "--ignore-scripts"]
        try:
            subprocess.run(command, cwd=folder, check=True, capture_output=True, timeout=60)
        except (subprocess.CalledProcessError, subprocess.TimeoutExpired) as error:
            shutil.rmtree(folder)
            missing("npm", f"needs the glTF validator, which npm could not fetch: {error}")
    return folder / "node_modules"


@pytest.fixture
def files(
    sample: Scene, room: Scene, empty: Scene, smooth_panorama: torch.Tensor, tmp_path: Path
) -> list[Path]:
    """Return three files: with pictures, with a mesh, without objects."""
    paths = [tmp_path / f"{name}.glb" for name in ("sample", "room", "empty")]
    write_glb(sample, paths[0], image=smooth_panorama)
    write_glb(room, paths[1])
    write_glb(empty, paths[2], image=smooth_panorama)
    return paths


def test_the_validator_finds_nothing(validator: Path, files: list[Path], tmp_path: Path) -> None:
    # the validator itself is put to the test: a file that it must refuse
    broken = tmp_path / "broken.glb"
    broken.write_bytes(files[1].read_bytes().replace(b'"POSITION"', b'"POSITIUM"'))
    command = ["node", str(HERE / "validate.js"), str(validator), *map(str, [*files, broken])]
    result = subprocess.run(command, check=True, capture_output=True, text=True, timeout=60)
    reports = json.loads(result.stdout)
    for report in reports[:3]:
        assert (report["numErrors"], report["numWarnings"]) == (0, 0), report["messages"]
        assert report["numInfos"] == 0, report["messages"]
    assert reports[3]["numErrors"] > 0
