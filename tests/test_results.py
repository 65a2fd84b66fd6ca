"""The pages of results are what the files of scores give."""

from pathlib import Path

from panoscene.cli import main


def test_the_pages_of_results_are_up_to_date(root: Path) -> None:
    page, readme = str(root / "RESULTS.md"), str(root / "README.md")
    arguments = ["eval", "report", str(root / "results"), "-o", page, "--readme", readme]
    assert main([*arguments, "--check"]) == 0
