"""The message about a missing system library."""

import builtins

import pytest

from experiments.cosim.sumo import system_libraries
from experiments.errors import SimulationError


def test_names_library_and_package():
    error = ImportError(
        "libGL.so.1: cannot open shared object file: No such file or directory"
    )
    words = system_libraries.explain(error)
    assert "the system library libGL is missing" in words
    assert "apt-get install" in words
    assert "libgl1" in words
    assert "\n" not in words


def test_other_failures_keep_their_words():
    assert "wrong ELF" in system_libraries.explain(ImportError("wrong ELF\nclass"))
    missing = ModuleNotFoundError("No module named 'libsumo'", name="libsumo")
    assert "make install" in system_libraries.explain(missing)


def test_report(monkeypatch, capsys):
    real = builtins.__import__

    def refuse(name, *args, **kwargs):
        if name == "libsumo":
            words = "libX11.so.6: cannot open shared object file: No such file"
            raise ImportError(words)
        return real(name, *args, **kwargs)

    monkeypatch.setattr(builtins, "__import__", refuse)
    with pytest.raises(SimulationError, match="libX11"):
        system_libraries.load_libsumo()
    assert system_libraries.main() == 2
    assert capsys.readouterr().err.count("\n") == 1
