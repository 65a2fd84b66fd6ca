"""Every command explains itself."""

import subprocess
import sys
from pathlib import Path

import pytest

from panoscene import cli


@pytest.mark.parametrize("command", sorted(cli.COMMANDS))
def test_help_renders(
    command: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, "argv", ["panoscene", *command.split(), "--help"])
    with pytest.raises(SystemExit) as exit_:
        cli.main()
    assert exit_.value.code in {0, None}
    printed = capsys.readouterr().out
    assert f"panoscene {command}" in printed
    # a sentence about the command and one for each of its options, not only a list of flags
    assert len(printed.split()) > 30


def test_installed_command_lists_all_commands() -> None:
    program = Path(sys.executable).parent / "panoscene"
    result = subprocess.run([program, "--help"], check=False, capture_output=True, text=True)
    assert result.returncode == 0, result.stderr
    assert [name for name in cli.COMMANDS if name.split()[0] not in result.stdout] == []


def test_a_group_lists_its_commands(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as exit_:
        cli.main(["eval", "--help"])
    assert exit_.value.code in {0, None}
    printed = capsys.readouterr().out
    names = [name.split()[1] for name in cli.COMMANDS if name.startswith("eval ")]
    assert len(names) == 4
    assert [name for name in names if name not in printed] == []
