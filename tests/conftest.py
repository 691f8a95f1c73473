"""What tests of several folders use."""

import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Callable[[int], Path]]:
    """Mounts a disk of so many KiB, which takes root; test_durable fakes the same faults without."""
    disk = tmp_path / "disk"

    def mount(kib: int) -> Path:
        disk.mkdir()
        command = ["mount", "-t", "tmpfs", "-o", f"size={kib}k", "tmpfs", disk]
        if subprocess.run(command, capture_output=True, check=False).returncode:  # not root
            pytest.skip("mounting a small disk takes root; test_durable fakes its faults without")
        return disk

    yield mount
    subprocess.run(["umount", disk], capture_output=True, check=False)
