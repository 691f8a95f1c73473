"""The rig's microcontroller, as methods: turn the table, light LEDs, fire the strobe."""

import contextlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from turnlight.errors import RigError, TurnlightError
from turnlight.rig.clock import Clock
from turnlight.rig.line import Event
from turnlight.rig.link import RefusedError, SerialLink

PROTOCOL = 2

_POLL_S = 0.02
_HOME_LIMIT_S = 30.0
_MOVE_LIMIT_S = 10.0
_CLEAR_LIMIT_S = 1.0
_ANGLE_TOLERANCE_DEG = 0.05
_TURNING = ("moving", "homing")

_EXPLANATIONS = {
    "stop": "The rig was stopped; see that nothing is in its way and start again.",
    "estop": "The emergency stop is or was pressed; release it and start again.",
    "lease": "The rig switched itself off because this computer fell silent; start again, "
    "and if it happens again free the computer of other work.",
    "index": "Homing did not find the table's mark; check the index sensor and its cable, "
    "and that the table turns freely.",
    "home": "The controller does not know the table's angle; home the table first.",
    "busy": "The table is still turning; wait until it is at rest.",
    "hot": "An LED has been lit for as long as it may; let it rest for ten seconds.",
    "spent": "This shot's strobe has been fired before; use a new shot number.",
    "supply": "So many LEDs at once take more current than their supply gives; light fewer, or "
    "correct the controller's parameter supply_ma.",
    "name": "The controller has no parameter of this name; firmware/PROTOCOL.md lists them.",
    "range": "The controller was asked for a value that it does not have or that does not fit its "
    "other parameters; check that the rig's file describes this rig.",
}
PARAMETERS = (
    "full_steps", "microsteps", "motor_teeth", "table_teeth", "reversed", "start_speed",
    "top_speed", "acceleration", "home_speed", "index_speed", "led_ma", "supply_ma",
    "led_limit_ms", "settle_us",
)  # fmt: skip
_FAULTS = ("stop", "estop", "lease", "index")


@dataclass(frozen=True)
class Hello:
    """Who the controller is. boot_id differs from boot to boot: a new one means a lost angle.

    parameters: "kept" in its memory, "default" because none were set, or "corrupt": what it kept is
    damaged, and it goes by the defaults.
    """

    protocol: int
    firmware: str
    build: str
    board: str
    boot_id: str
    reset_cause: str
    led_count: int
    parameters: str


@dataclass(frozen=True)
class Status:
    """What the controller believes. state: unhomed, ready, moving, homing, or the fault that holds it.

    homed: the angle is known, as far as a fault does not hide it. steps_lost: found by the last
    homing of a homed table; negative if the table was ahead.
    """

    time_us: int
    angle_deg: float
    leds: tuple[int, ...]
    state: str
    homed: bool
    commands_done: int
    broken_lines: int
    steps_lost: int = 0

    @property
    def moving(self) -> bool:
        return self.state in _TURNING


@dataclass(frozen=True)
class Strobe:
    """One strobe pulse: the table's angle, the LEDs lit and the controller's clock as it fired."""

    shot_id: int
    angle_deg: float
    leds: tuple[int, ...]
    time_us: int


@dataclass(frozen=True)
class Parameter:
    """One of the controller's parameters, in the unit that firmware/PROTOCOL.md gives."""

    name: str
    value: int
    lowest: int
    highest: int
    default: int

    def __str__(self) -> str:
        return (
            f"{self.name:<13}{self.value:>8}  "
            f"({self.lowest} to {self.highest}, default {self.default})"
        )


class Controller:
    """Typed commands over a link. Call `hello` first.

    Every method raises RigError when the controller refuses or has a fault, with the cause and the
    remedy, and LinkError when it does not answer. The rig switches off by itself 1 s after the last
    command, so a caller that waits longer than that calls `beat` meanwhile.
    """

    def __init__(self, link: SerialLink, clock: Clock) -> None:
        self._link = link
        self._clock = clock
        self._boot_id: str | None = None
        self._events: list[Event] = []

    def hello(self) -> Hello:
        """Begin a session: shot numbers start anew. Raises RigError for another protocol."""
        fields = self._link.request("hello")
        protocol = int(fields["proto"])
        if protocol != PROTOCOL:
            raise RigError(
                f"The controller speaks protocol {protocol} and this program {PROTOCOL}; "
                "run turnlight firmware flash."
            )
        self._boot_id = fields["boot"]
        return Hello(
            protocol=protocol,
            firmware=fields["firmware"],
            build=fields["build"],
            board=fields["board"],
            boot_id=fields["boot"],
            reset_cause=fields["reset"],
            led_count=int(fields["leds"]),
            parameters=fields["parameters"],
        )

    def home(self, meanwhile: Callable[[], object] = lambda: None) -> None:
        """Turn to the index mark, which is angle 0; returns when the table is at rest.

        A motion that is still under way, as a host that died may have left it, is let come to its end.
        meanwhile: called again and again until then; what it raises ends the waiting, and the lease
        the motion.
        """
        self._rest(_MOVE_LIMIT_S)
        self._ask("home")
        self._wait_for_rest(_HOME_LIMIT_S, meanwhile)

    def check(self, meanwhile: Callable[[], object] = lambda: None) -> int:
        """Home a homed table once more; returns the steps lost since, negative if it was ahead."""
        self.home(meanwhile)
        return self.status().steps_lost

    def move(self, angle_deg: float) -> None:
        """Turn to an absolute angle, the shorter way; returns when the table is at rest."""
        self._ask("move", round(angle_deg * 100) % 36000)
        reached_deg = self._wait_for_rest(_MOVE_LIMIT_S)
        if abs((reached_deg - angle_deg + 180) % 360 - 180) > _ANGLE_TOLERANCE_DEG:
            raise RigError(
                f"The table stopped at {reached_deg:.2f}° instead of {angle_deg % 360:.2f}°; "
                "home the table and start again."
            )

    def light(self, leds: Sequence[int]) -> float:
        """These LEDs at full, all others off; returns the seconds until their light is steady."""
        fields = self._ask("led", 255, f"{sum(1 << led for led in set(leds)):X}")
        return int(fields["settle"]) / 1e6

    def dim(self, led: int, level: int) -> float:
        """This LED at this level, 0 to 255, the others as they are; returns as `light` does."""
        return int(self._ask("lamp", led, level)["settle"]) / 1e6

    def off(self) -> None:
        """All LEDs off; a fault has switched them off already."""
        try:
            self._link.request("off")
        except RefusedError as refused:
            if refused.word not in _FAULTS:
                raise

    def trigger(self, shot_id: int) -> Strobe:
        """Fire the strobe. Shot ids must rise from one `hello` to the next; none fires twice."""
        fields = self._ask("trig", shot_id)
        return Strobe(
            shot_id=int(fields["shot"]),
            angle_deg=int(fields["at"]) / 100,
            leds=_leds(fields["lit"]),
            time_us=int(fields["time"]),
        )

    def status(self) -> Status:
        """What the controller believes; a fault is reported, not raised."""
        fields = self._ask("stat", "all")
        return Status(
            time_us=int(fields["time"]),
            angle_deg=int(fields["at"]) / 100,
            leds=_leds(fields["lit"]),
            state=fields["is"],
            homed=fields["is"] in ("ready", "moving"),
            commands_done=int(fields["done"]),
            broken_lines=int(fields["bad"]),
            steps_lost=int(fields["lost"]),
        )

    def beat(self) -> None:
        """Tell the rig that this computer is alive."""
        self._ask("beat")

    def stop(self) -> None:
        """Stop motor and LEDs at once; the rig stays stopped until `clear`."""
        self._link.stop_now()
        with contextlib.suppress(RefusedError):  # the byte has stopped it already
            self._link.request("stop")

    def clear(self) -> None:
        """Release the rig after a stop or a fault whose cause is gone."""
        deadline_s = self._clock.now_s() + _CLEAR_LIMIT_S
        while True:
            try:
                self._link.request("clear")
                return
            except RefusedError as refused:
                if refused.word != "busy" or self._clock.now_s() > deadline_s:
                    raise _explained(refused) from refused
            self._clock.sleep(_POLL_S)

    def parameter(self, name: str) -> Parameter:
        """One of the controller's parameters. Raises RigError if it has none of this name."""
        return _parameter(name, self._ask("get", name))

    def set_parameter(self, name: str, value: int) -> Parameter:
        """Set it and have it kept through a power cut. Other gears than before want homing."""
        return _parameter(name, self._ask("set", name, value))

    def take_events(self) -> list[Event]:
        """Button presses and faults that the controller has told of since last asked."""
        self._collect_events()
        events, self._events = self._events, []
        return events

    def close(self) -> None:
        """LEDs off if the controller still listens, then close the link."""
        with contextlib.suppress(TurnlightError):
            self.off()
        self._link.close()

    def _ask(self, verb: str, *arguments: int | str) -> dict[str, str]:
        try:
            fields = self._link.request(verb, *arguments)
        except RefusedError as refused:
            self._link.request("stat")  # an event that explains the refusal comes before its reply
            self._collect_events()
            raise _explained(refused) from refused
        self._collect_events()
        return fields

    def _wait_for_rest(
        self, limit_s: float, meanwhile: Callable[[], object] = lambda: None
    ) -> float:
        """The angle, in degrees, that the table stops at."""
        fields = self._rest(limit_s, meanwhile)
        if fields["is"] != "ready":
            raise RigError(_EXPLANATIONS.get(fields["is"], f"The rig reports {fields['is']}."))
        return int(fields["at"]) / 100

    def _rest(
        self, limit_s: float, meanwhile: Callable[[], object] = lambda: None
    ) -> dict[str, str]:
        """What the controller says when the table no longer turns."""
        deadline_s = self._clock.now_s() + limit_s
        while (fields := self._ask("stat"))["is"] in _TURNING:
            if self._clock.now_s() > deadline_s:
                raise RigError(
                    f"The table has not come to rest in {limit_s:.0f} s; "
                    "check that it turns freely and start again."
                )
            meanwhile()
            self._clock.sleep(_POLL_S)
        return fields

    def _collect_events(self) -> None:
        for event in self._link.take_events():
            if event.kind != "boot":
                self._events.append(event)
            elif self._boot_id not in (None, event.fields["boot"]):
                raise RigError(
                    "The controller restarted and has lost the table's angle; "
                    "check its power, home the table and repeat the last shot."
                )


def _leds(digits: str) -> tuple[int, ...]:
    mask = int(digits, 16)
    return tuple(led for led in range(mask.bit_length()) if mask >> led & 1)


def _parameter(name: str, fields: dict[str, str]) -> Parameter:
    return Parameter(
        name,
        int(fields[name]),
        int(fields["lowest"]),
        int(fields["highest"]),
        int(fields["default"]),
    )


def _explained(refused: RefusedError) -> RigError:
    explanation = _EXPLANATIONS.get(refused.word)
    return refused if explanation is None else RigError(explanation)
