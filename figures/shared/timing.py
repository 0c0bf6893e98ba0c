"""Times of calls that take turns, and rows of a table that holds them."""

import os
import statistics
import time
from collections.abc import Callable, Hashable, Mapping
from typing import Any, NamedTuple, TypeVar

import jax
from shared.style import Table, progress

Key = TypeVar("Key", bound=Hashable)

HEADER = (
    "quantity",
    "form",
    "setting",
    "dtype",
    "case",
    "width",
    "error",
    "ns_per_value",
    "device",
    "jax",
)


class Row(NamedTuple):
    """One point: what is computed, how, where, its error and seconds per value."""

    quantity: str
    form: str
    setting: str
    dtype: str
    case: str
    width: float
    error: float
    seconds: float


def seconds(call: Callable[[], Any], clock: Callable[[], float]) -> float:
    """Duration of one call."""
    start = clock()
    jax.block_until_ready(call())
    return clock() - start


def medians(
    calls: Mapping[Key, Callable[[], Any]],
    rounds: int,
    at_least: float = 0.0,
    clock: Callable[[], float] = time.perf_counter,
) -> dict[Key, float]:
    """Median seconds of each call, which has run before.

    In every round each is called once, or as often as takes `at_least` seconds: what
    slows the machine for a while slows all. By `time.process_time` for a clock, what
    others do on it counts for less.
    """
    times = {key: [] for key in calls}
    for k in range(rounds):
        progress(f"times, round {k + 1} of {rounds}")
        for key, call in calls.items():
            taken = [seconds(call, clock)]
            while sum(taken) < at_least:
                taken.append(seconds(call, clock))
            times[key].append(statistics.median(taken))
    return {key: statistics.median(found) for key, found in times.items()}


def machine() -> str:
    """What calls run on by default."""
    device = jax.devices()[0]
    cpu = device.platform == "cpu"
    return f"{os.cpu_count()} CPU cores" if cpu else device.device_kind


def table(rows: list[Row]) -> Table:
    """The rows as text, with the machine and JAX's version."""
    where = machine(), jax.__version__
    return Table(
        HEADER,
        [
            (
                *row[:5],
                f"{row.width:g}",
                f"{row.error:.6e}",
                f"{1e9 * row.seconds:.4g}",
                *where,
            )
            for row in rows
        ],
    )
