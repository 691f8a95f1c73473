"""kill -9 at random moments: no saved shot is lost, the run goes on, and the maps are bit for bit the same."""

import random
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from turnlight.capture.events import Finished
from turnlight.capture.session import Session
from turnlight.capture.state import State
from turnlight.frame import Exposure, Frame
from turnlight.preset import Preset

SCRIPT = Path(__file__).with_name("killable_run.py")
LATEST_S = 0.5
SHOTS = 24


class Killed:
    """A session whose runs are killed one after the other."""

    def __init__(self, folder: Path, rig: Path, shots: int) -> None:
        self.folder, self._rig, self._shots = folder, rig, shots
        self.saved: set[int] = set()

    def run(self, wanted: State, after_s: float) -> None:
        """Run until `wanted` is reached and after_s longer, then kill."""
        command = [sys.executable, SCRIPT, self.folder, self._rig, str(self._shots), wanted]
        exposed, before = 0, len(self.saved)
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
            for word, value in self._lines(process):
                exposed += word == "exposed"
                if word == "saved":
                    self.saved.add(int(value))
                if (word, value) == ("state", wanted):
                    time.sleep(after_s)
                    process.kill()
        assert process.returncode == -9
        lost = exposed - (len(self.saved) - before)
        assert lost <= 1
        self.assert_nothing_lost()

    def assert_nothing_lost(self) -> None:
        if not self.saved:
            return
        session = Session.open(self.folder)
        on_disk = {saved.record.shot.index + 1 for saved in session.saved()}  # checks every hash
        assert self.saved <= on_disk
        assert len(on_disk - self.saved) <= 1  # saved, and killed before saying so
        self.saved = on_disk

    def resume(self) -> None:
        program = Path(sys.executable).with_name("turnlight")
        done = subprocess.run(
            [program, "resume", self.folder], capture_output=True, text=True, check=False
        )
        assert done.returncode == 0, done.stderr
        manifest = Session.open(self.folder).manifest
        assert [r.shot.index for r in manifest.used] == list(range(self._shots))
        assert manifest.finished is not None

    @staticmethod
    def _lines(process: subprocess.Popen[str]) -> Iterator[tuple[str, str]]:
        assert process.stdout is not None
        for line in process.stdout:
            word, value = line.split()
            yield word, value


class Replay:
    """A camera that gives a session's own frames again, for the table's angle and the LEDs lit."""

    description = "replay"

    def __init__(self, session: Session, board) -> None:
        self._session, self._board = session, board

    def capture(self, exposure: Exposure) -> Frame:
        state = self._board.state()
        self._board.advance(exposure.exposure_us / 1000)
        lit = tuple(led for led, level in enumerate(state.leds) if level)
        frame = self._frame(lit, state.angle_deg) if lit else self._dark(exposure)
        return Frame(frame.pixels, frame.bit_depth, frame.gamma, exposure, state.time_us)

    def recover(self) -> None: ...

    def close(self) -> None: ...

    def _dark(self, exposure: Exposure) -> Frame:
        record = self._session.dark_record(exposure)
        assert record is not None
        return self._session.dark_frame(record)

    def _frame(self, lit: tuple[int, ...], angle_deg: float) -> Frame:
        for record in self._session.manifest.used:
            apart_deg = (record.shot.angle_deg - angle_deg + 180) % 360 - 180
            if record.shot.leds == lit and abs(apart_deg) < 1:
                return self._session.load(record).frame
        raise AssertionError((lit, angle_deg))


def assert_as_undisturbed(bench, killed: Killed) -> None:
    """The maps equal, bit for bit, those of a run of the same frames that nobody disturbed."""
    bench.camera = Replay(Session.open(killed.folder), bench.board)
    shots = len(Session.open(killed.folder).manifest.plan)
    bench.start(Preset(shots=shots, exposure="fixed", enough_change=0))
    bench.until(Finished)
    for path in (killed.folder / "maps").glob("*.png"):
        assert path.read_bytes() == (bench.folder / "maps" / path.name).read_bytes(), path.name


@pytest.mark.timeout(600)
def test_a_run_that_is_killed_in_every_state(bench, tmp_path: Path) -> None:
    killed = Killed(tmp_path / "killed", tmp_path / "rig.toml", SHOTS)
    seed = random.SystemRandom().randrange(10**6)
    print(f"seed {seed}")
    moments = random.Random(seed)
    for state in State:
        killed.run(state, moments.uniform(0, LATEST_S))
    killed.resume()
    assert_as_undisturbed(bench, killed)


@pytest.mark.bench
@pytest.mark.timeout(1800)
def test_fifty_kills(bench, tmp_path: Path) -> None:
    seed = random.SystemRandom().randrange(10**6)
    moments = random.Random(seed)
    killed = Killed(tmp_path / "killed", tmp_path / "rig.toml", 150)
    began_s = time.monotonic()
    for _ in range(50):
        killed.run(State(moments.choice(list(State)[1:])), moments.uniform(0, 3 * LATEST_S))
    killed.resume()
    assert_as_undisturbed(bench, killed)
    print(
        f"\n50 kills (seed {seed}): no saved shot lost, at most one repeated each, maps bit for bit "
        f"those of an undisturbed run; {time.monotonic() - began_s:.0f} s"
    )
