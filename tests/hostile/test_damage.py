"""Damaged state files: a sample of what ``python tests/hostile/damage.py 2000`` does."""

from __future__ import annotations

import pytest
from damage import main

pytestmark = pytest.mark.thorough


@pytest.mark.parametrize("seed", [2, 3])
def test_damaged_state_files_end_in_a_message_or_in_the_same_numbers(
    seed: int, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(16, seed) == 0, capsys.readouterr().out
