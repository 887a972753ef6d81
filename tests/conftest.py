"""Hypothesis profiles: the same examples on every run of CI, no deadlines anywhere."""

import gc
import os

from hypothesis import settings

# The first example of a compiled function takes its compilation too.
settings.register_profile("local", deadline=None)
settings.register_profile("ci", deadline=None, derandomize=True)
settings.load_profile("ci" if os.environ.get("CI") else "local")


# What is imported makes no garbage, and most of it lives to the end: looking through it
# again and again took a tenth of the time.
gc.disable()


def pytest_collection_finish():
    gc.set_threshold(50_000)
    gc.enable()


def pytest_collection_modifyitems(items):
    """Put slow tests first, so that no worker is left with a long one at the end."""
    items.sort(key=lambda item: item.get_closest_marker("slow") is None)


def pytest_addoption(parser):
    parser.addoption(
        "--seeds", type=int, default=4, help="seeds of each road in the acceptance test"
    )
    parser.addoption(
        "--kills",
        type=int,
        default=3,
        help="kill -9 of a sweep in the test of resuming",
    )
    parser.addoption(
        "--turns", type=int, default=30, help="random bends that a path is planned for"
    )
    parser.addoption(
        "--mutations", type=int, default=400, help="damaged inputs for the readers"
    )
    parser.addoption(
        "--episodes", type=int, default=10, help="episodes of the random campaign"
    )
