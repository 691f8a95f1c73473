"""What many ask for at once is made once, and what could not be made is tried again."""

import threading
from concurrent.futures import ThreadPoolExecutor

import pytest

from turnlight.web.kept import Kept


def test_who_comes_meanwhile_waits_for_the_first() -> None:
    kept: Kept[int] = Kept(10)
    going, made = threading.Event(), []

    def make() -> int:
        going.wait(10)
        made.append(1)
        return 7

    with ThreadPoolExecutor(8) as pool:
        asked = [pool.submit(kept.once, "key", make) for _ in range(8)]
        assert kept.now("key") is None
        going.set()
        assert [one.result() for one in asked] == [7] * 8
    assert made == [1]
    assert kept.now("key") == 7


def test_a_failure_is_told_and_not_kept() -> None:
    kept: Kept[int] = Kept(10)

    def fail() -> int:
        raise ValueError("no")

    with pytest.raises(ValueError, match="no"):
        kept.once("key", fail)
    assert kept.now("key") is None
    assert kept.once("key", lambda: 3) == 3


def test_the_oldest_goes() -> None:
    kept: Kept[int] = Kept(2)
    for number in range(3):
        kept.once(number, lambda number=number: number)  # type: ignore[misc]
    assert [kept.now(number) for number in range(3)] == [None, 1, 2]
