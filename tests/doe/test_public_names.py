"""The study package's door: names that exist, and an import that stays light and alone."""

import subprocess
import sys

import pytest

import trainmj.doe


@pytest.mark.parametrize("name", trainmj.doe.__all__)
def test_every_public_name_exists_and_says_what_it_is(name):
    assert getattr(trainmj.doe, name).__doc__


def test_import_brings_neither_the_engine_nor_slow_libraries():
    slow = ("mujoco", "numba", "pandas", "sklearn", "scipy.stats")
    code = f"import sys, trainmj.doe; print(*(m for m in {slow} if m in sys.modules))"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert run.stdout.split() == []
