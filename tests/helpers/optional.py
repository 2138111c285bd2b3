"""Libraries without which tests are skipped."""

import pytest


def reader_of_step():
    """gmsh, or a test that is skipped: it rests on libraries of the system that draw."""
    try:
        import gmsh
    except (ImportError, OSError) as error:
        pytest.skip(f"gmsh cannot be loaded: {error}")
    return gmsh
