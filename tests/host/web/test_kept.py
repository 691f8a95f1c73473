"""What many ask for at once is made once, and what could not be made is tried again."""

import asyncio
import threading
from concurrent.futures import ThreadPoolExecutor

import pytest
from web_service import in_a_loop

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
        going.set()
        assert [one.result() for one in asked] == [7] * 8
    assert made == [1]


def test_who_waits_in_the_loop_takes_no_thread() -> None:
    kept: Kept[int] = Kept(10)
    going, made, waiting = threading.Event(), [], 100

    def make() -> int:
        going.wait(10)
        made.append(1)
        return 7

    async def ask() -> list[int]:
        asked = [asyncio.create_task(kept.soon("key", make)) for _ in range(waiting)]
        gone = asyncio.create_task(kept.soon("key", make))
        await asyncio.sleep(0.05)
        gone.cancel()
        going.set()
        assert threading.active_count() < waiting / 2
        return await asyncio.gather(*asked)

    assert in_a_loop(ask()) == [7] * waiting
    assert made == [1]


def test_what_is_being_made_is_made_though_who_asked_has_gone() -> None:
    kept: Kept[int] = Kept(10)
    going = threading.Event()

    def make() -> int:
        going.wait(10)
        return 7

    async def ask() -> int:
        gone = asyncio.create_task(kept.soon("key", make))
        await asyncio.sleep(0.05)
        gone.cancel()
        going.set()
        return await kept.soon("key", lambda: 8)

    assert in_a_loop(ask()) == 7


def test_a_failure_is_told_and_not_kept() -> None:
    kept: Kept[int] = Kept(10)

    def fail() -> int:
        raise ValueError("no")

    with pytest.raises(ValueError, match="no"):
        kept.once("key", fail)
    with pytest.raises(ValueError, match="no"):
        in_a_loop(kept.soon("key", fail))
    assert kept.once("key", lambda: 3) == 3


def test_the_oldest_goes() -> None:
    kept: Kept[int] = Kept(2)
    for number in range(3):
        kept.once(number, lambda number=number: number)  # type: ignore[misc]
    assert [kept.once(number, lambda: 9) for number in (2, 1, 0)] == [2, 1, 9]
