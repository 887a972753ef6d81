"""What a cluster needs, where it is missing."""

import importlib
import subprocess
import sys

import psutil
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


@pytest.mark.slow
def test_everything_of_a_cluster_listens_on_this_machine_only():
    with subprocess.Popen(
        [sys.executable, "-m", "experiments", "cluster", "--workers", "1"],
        stdout=subprocess.PIPE,
        text=True,
    ) as process:
        try:
            assert process.stdout is not None
            assert process.stdout.readline().startswith("tcp://127.0.0.1:")
            own = psutil.Process(process.pid)
            heard = [
                connection.laddr.ip
                for one in (own, *own.children(recursive=True))
                for connection in one.net_connections()
                if connection.status == psutil.CONN_LISTEN
            ]
            assert len(heard) >= 3  # scheduler, its page, a worker
            assert set(heard) == {"127.0.0.1"}
        finally:
            process.terminate()
