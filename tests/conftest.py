"""Strict settings for every test: float64, and no silent promotion of dtypes."""

import re
from pathlib import Path

import jax
import pytest

jax.config.update("jax_enable_x64", True)
jax.config.update("jax_numpy_dtype_promotion", "strict")

MAPS = Path("/proc/self/maps")
MANY = 20_000


def pytest_collection_modifyitems(items):
    """Scripts that are run again first: the longest, which would end alone."""
    items.sort(key=lambda item: not re.search("_rerun|_refit|_runs", item.name))


@pytest.fixture(autouse=True)
def _room_for_programs():
    """Forgets what was compiled before there is too much of it.

    Every compiled program takes some hundred mappings of memory. Linux gives a process
    65,530, and where there are no more the compiler crashes.
    """
    yield
    if MAPS.exists() and MAPS.read_bytes().count(b"\n") > MANY:
        jax.clear_caches()
