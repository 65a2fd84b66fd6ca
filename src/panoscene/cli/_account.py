"""How a reconstruction came about."""

from typing import Any

from panoscene.pipeline import Reconstruction


def account(result: Reconstruction) -> dict[str, Any]:
    """Return how a result came about, for programs."""
    return {
        "flags": [flag.as_dict() for flag in result.flags],
        "doubts": list(result.doubts),
        "timings": result.timings,
        "certificate": None if result.certificate is None else result.certificate.as_dict(),
    }
