"""What a cluster needs, where it is missing."""

import importlib
import sys

import pytest

from experiments.errors import ConfigError

MODULE = "experiments.sweep.executors.cluster"


@pytest.mark.parametrize("missing", ["dask", "distributed"])
def test_missing_package_is_named_in_one_line(missing, monkeypatch):
    monkeypatch.delitem(sys.modules, MODULE, raising=False)
    monkeypatch.setitem(sys.modules, missing, None)
    with pytest.raises(ConfigError, match="pip install distributed") as caught:
        importlib.import_module(MODULE)
    assert "\n" not in str(caught.value)
