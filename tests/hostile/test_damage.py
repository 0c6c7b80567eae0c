"""Damaged state files and caches: samples of what ``damage.py 2000`` and ``caches.py 200`` in this folder do."""

from __future__ import annotations

import caches
import damage
import pytest

pytestmark = pytest.mark.thorough


@pytest.mark.parametrize("seed", [2, 3])
def test_damaged_state_files_end_in_a_message_or_in_the_same_numbers(
    seed: int, capsys: pytest.CaptureFixture[str]
) -> None:
    assert damage.main(16, seed) == 0, capsys.readouterr().out


def test_commands_work_to_the_same_bytes_with_damaged_caches(capsys: pytest.CaptureFixture[str]) -> None:
    assert caches.main(16, 2) == 0, capsys.readouterr().out
