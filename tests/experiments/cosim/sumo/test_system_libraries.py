"""What the doctor says about a missing system library."""

import pytest

from experiments.cosim.sumo import system_libraries as doctor
from experiments.errors import SimulationError


def test_names_library_and_package():
    error = ImportError(
        "libGL.so.1: cannot open shared object file: No such file or directory"
    )
    words = doctor.explain(error)
    assert "the system library libGL is missing" in words
    assert "apt-get install" in words
    assert "libgl1" in words
    assert "\n" not in words


def test_other_failures_keep_their_words():
    assert "wrong ELF" in doctor.explain(ImportError("wrong ELF\nclass"))
    missing = ModuleNotFoundError("No module named 'libsumo'", name="libsumo")
    assert "make install" in doctor.explain(missing)


def test_report(monkeypatch, capsys):
    def refuse(name):
        raise ImportError("libX11.so.6: cannot open shared object file: No such file")

    monkeypatch.setattr(doctor.importlib, "import_module", refuse)
    with pytest.raises(SimulationError, match="libX11"):
        doctor.check_simulator()
    assert doctor.main() == 2
    assert capsys.readouterr().err.count("\n") == 1
