"""firmware/PROTOCOL.md against a board of every kind: every verb, refusal, state and parameter."""

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from terminal import Terminal, seal

from turnlight.simulation.board import SimulatedBoard

_VECTORS = Path(__file__).parents[2] / "firmware" / "protocol_vectors.txt"

_VERBS = {
    "hello": "hello", "stat": "stat", "stat all": "stat all", "clear": "clear", "beat": "beat",
    "ack": "ack 9", "get": "get reversed", "set": "set reversed 0", "home": "home",
    "move": "move 100", "led": "led 255 1", "lamp": "lamp 2 9", "trig": "trig 5", "off": "off",
    "stop": "stop",
}  # fmt: skip
_ALLOWED_IN_FAULT = {"hello", "stat", "stat all", "clear"}
_FAULTS = ("stop", "estop", "lease", "index")
_REFUSALS = {
    "unhomed": {"move": "home"},
    "ready": {},
    "homing": {"home": "busy", "move": "busy", "set": "busy"},
    "moving": {"home": "busy", "move": "busy", "set": "busy"},
} | {fault: dict.fromkeys(_VERBS.keys() - _ALLOWED_IN_FAULT, fault) for fault in _FAULTS}


@pytest.fixture
def terminal(board: SimulatedBoard) -> Iterator[Terminal]:
    with Terminal(board) as terminal:
        yield terminal


def test_every_exchange_of_the_vectors(power_up: Callable[[], SimulatedBoard]) -> None:
    rows = [row.split("|") for row in _VECTORS.read_text().splitlines() if row and row[0] != "#"]
    terminal: Terminal | None = None
    for kind, sent, answer in (row for row in rows if row[0] in ("exchange", "then")):
        if kind == "exchange":
            terminal = Terminal(power_up())
        assert terminal is not None
        assert terminal.say(sent) == answer


@pytest.mark.parametrize("state", _REFUSALS)
def test_every_verb_in_every_state(state: str, terminal: Terminal) -> None:
    for verb, command in _VERBS.items():
        if terminal.state() != state:
            _bring(terminal, state)
        assert terminal.state() == state
        expected = _REFUSALS[state].get(verb)
        answer = terminal.ask(command)
        assert answer == f"err {expected}" if expected else answer.startswith("ok"), command
        assert verb == "clear" or not expected or terminal.state() == state


def _bring(terminal: Terminal, state: str) -> None:
    board = terminal.board
    board.reset()
    if state == "unhomed":
        return
    board.hide_mark(state == "index")
    terminal.ask("home")
    if state == "homing":
        return
    assert terminal.settle() in ("ready", "index")
    board.hide_mark(False)
    if state in ("moving", "lease"):
        terminal.ask("move 18000")
    if state == "lease":
        board.advance(1800)
    if state == "estop":
        board.press_estop(True)
        board.advance(2)
        board.press_estop(False)
    if state == "stop":
        terminal.ask("stop")


def test_a_pressed_emergency_stop_refuses_to_be_cleared(terminal: Terminal) -> None:
    terminal.board.press_estop(True)
    assert terminal.ask("home") == "err estop"
    assert terminal.ask("clear") == "err estop"
    terminal.board.press_estop(False)
    assert terminal.ask("home") == "err estop"
    assert terminal.ask("clear") == "ok"
    assert terminal.ask("home") == "ok"


def test_a_braking_table_refuses_to_be_cleared(terminal: Terminal) -> None:
    terminal.ask("home")
    terminal.settle()
    terminal.ask("move 18000")
    terminal.board.advance(1000)
    assert terminal.state() == "lease"
    assert terminal.ask("clear") == "err busy"
    terminal.board.advance(400)
    assert terminal.ask("clear") == "ok"
    assert terminal.state() == "ready"


@pytest.mark.parametrize(
    ("command", "word"),
    [
        ("dance", "verb"), ("hello 1", "count"), ("stat all 1", "count"), ("stat some", "range"),
        ("move 36000", "range"), ("move -1", "range"), ("led 256 1", "range"), ("led -1 1", "range"),
        ("led 1 1000000000", "range"), ("led 1 a", "range"), ("lamp 36 1", "range"),
        ("lamp 0 256", "range"), ("lamp 0", "count"), ("trig 1000000000", "range"),
        ("trig -1", "range"), ("ack 0", "range"), ("ack 256", "range"), ("get gears", "name"),
        ("get", "count"), ("set gears 1", "name"), ("set reversed", "count"),
        ("set reversed 2", "range"), ("set reversed x", "range"), ("move 0", "home"),
    ],
)  # fmt: skip
def test_refusals(command: str, word: str, terminal: Terminal) -> None:
    assert terminal.ask(command) == f"err {word}"


def test_arguments_at_their_limits(terminal: Terminal) -> None:
    assert terminal.fields("led 255 FFFFFFFFF")["lit"] == "FFFFFFFFF"
    assert terminal.board.state().leds == (255,) * 36
    assert terminal.fields("led 1 800000000")["lit"] == "800000000"
    assert terminal.board.state().leds[35] == 1
    assert terminal.fields("lamp 0 255")["lit"] == "800000001"
    assert terminal.fields("led 0 FFFFFFFFF")["lit"] == "000000000"
    assert terminal.fields("trig 0")["shot"] == "0"
    assert terminal.fields("trig 999999999")["shot"] == "999999999"
    assert terminal.ask("trig 999999999") == "err spent"
    assert terminal.board.state().strobes == 2
    assert terminal.ask("ack 255") == "ok"
    terminal.ask("home")
    terminal.settle()
    for centidegrees in (0, 35999, 0):
        assert terminal.ask(f"move {centidegrees}") == "ok"
        terminal.settle()
        off_deg = (terminal.board.state().angle_deg - centidegrees / 100 + 180) % 360 - 180
        assert abs(off_deg) < 0.02


def test_sequence_numbers_and_line_lengths_at_their_limits(terminal: Terminal) -> None:
    for number, answer in ((1, "1 ok"), (65535, "65535 ok"), (0, "0 err form")):
        assert terminal.say(seal(f"{number} beat")) == seal(answer)
    assert terminal.say(seal("65536 beat")) == seal("0 err form")
    longest = seal("7 get " + "x" * 49)
    assert len(longest) == 63
    assert terminal.say(longest) == seal("7 err name")
    assert terminal.say(seal("7 get " + "x" * 50)) == seal("0 err long")


def test_lines_that_cannot_be_read(terminal: Terminal) -> None:
    for text in ("7 beat", "7 beat *06FFFF", "move 100", "7  beat", "\x7f"):
        assert terminal.say(text) == seal("0 err check")
    assert terminal.say(seal("7 led 1 2 3 4")) == seal("0 err form")
    assert terminal.fields("stat all")["bad"] == "6"


def test_typed_lines(terminal: Terminal) -> None:
    assert terminal.say("hello").startswith("0 ok proto=2 firmware=")
    assert terminal.say("stat") == seal("0 ok is=unhomed at=0")
    assert terminal.say("off") == seal("0 ok")
    assert terminal.say("stop") == seal("0 ok")
    assert terminal.say("off") == seal("0 err stop")
    assert terminal.say("home") == seal("0 err check")


def test_a_repeated_line_is_answered_and_not_done(terminal: Terminal) -> None:
    first = terminal.say(seal("9 trig 4"))
    terminal.board.advance(50)
    assert terminal.say(seal("9 trig 4")) == first
    assert terminal.board.state().strobes == 1


def test_the_stop_byte_stops_even_inside_a_line(terminal: Terminal) -> None:
    terminal.ask("home")
    terminal.settle()
    terminal.ask("led 255 FFF")
    terminal.ask("move 18000")
    terminal.board.advance(300)
    terminal.send(b"12 be\x18")
    terminal.say("")
    steps = terminal.board.advance(100).steps
    assert terminal.board.advance(100).steps == steps
    assert not any(terminal.board.state().leds)
    assert terminal.state() == "stop"
    assert terminal.ask("clear") == "ok"
    assert terminal.state() == "unhomed"


def test_the_lease_ends_after_one_second(terminal: Terminal) -> None:
    terminal.ask("led 255 1")
    assert terminal.board.advance(990).leds[0] == 255
    assert terminal.ask("beat") == "ok"
    assert terminal.board.advance(990).leds[0] == 255
    assert terminal.board.advance(20).leds[0] == 0
    assert terminal.state() == "lease"


def test_an_led_goes_dark_at_its_limit_and_rests(terminal: Terminal) -> None:
    terminal.ask("set led_limit_ms 500")
    terminal.ask("led 255 3")
    assert terminal.board.advance(485).leds[:2] == (255, 255)
    assert terminal.board.advance(16).leds[:2] == (0, 0)
    assert terminal.ask("lamp 0 1") == "err hot"
    assert terminal.ask("led 255 4").startswith("ok")
    terminal.board.advance(260)
    assert terminal.ask("lamp 0 1").startswith("ok")


def test_the_supplys_limit(terminal: Terminal) -> None:
    terminal.ask("set supply_ma 120")
    assert terminal.ask("led 255 7") == "err supply"
    assert terminal.ask("led 255 3").startswith("ok")
    assert terminal.ask("lamp 2 1") == "err supply"
    assert terminal.ask("led 170 7").startswith("ok")


@pytest.mark.parametrize(("slip_deg", "steps"), [(0, 0), (-1.8, 80), (1.8, -80), (-45, 2000)])
def test_homing_a_homed_table_tells_the_steps_lost(
    slip_deg: float, steps: int, terminal: Terminal
) -> None:
    terminal.ask("home")
    terminal.settle()
    terminal.ask("move 9000")
    terminal.settle()
    terminal.board.slip(slip_deg)
    terminal.ask("home")
    assert terminal.settle() == "ready"
    assert terminal.fields("stat all")["lost"] == str(steps)
    assert terminal.board.state().angle_deg == 0


def test_a_strobe_reports_angle_and_light(terminal: Terminal) -> None:
    terminal.ask("home")
    terminal.settle()
    terminal.ask("move 4500")
    terminal.settle()
    terminal.ask("led 255 101")
    fields = terminal.fields("trig 3")
    assert (fields["shot"], fields["at"], fields["lit"]) == ("3", "4500", "000000101")
    assert (
        abs(terminal.board.state().time_us - int(fields["time"])) < 10_000
    )  # since boot, power-up


def test_a_button_press_is_told_until_it_is_acknowledged(terminal: Terminal) -> None:
    _silence_boot(terminal)
    _press(terminal, 10)
    assert terminal.take_events() == []
    _press(terminal, 60)
    terminal.board.advance(600)
    terminal.ask("beat")
    assert terminal.take_events() == ["!2 button", "!2 button"]
    terminal.ask("ack 2")
    terminal.board.advance(600)
    assert terminal.take_events() == []


def test_a_long_press_means_stop(terminal: Terminal) -> None:
    _silence_boot(terminal)
    terminal.ask("led 255 1")
    terminal.board.press_button(True)
    terminal.board.advance(900)
    terminal.ask("beat")
    assert terminal.board.state().leds[0] == 255
    assert terminal.board.advance(200).leds[0] == 0
    terminal.board.press_button(False)
    terminal.board.advance(100)
    assert terminal.state() == "stop"
    assert set(terminal.take_events()) == {"!2 fault fault=stop"}


def test_a_person_stops_a_rig_that_a_silent_host_has_stopped_already(terminal: Terminal) -> None:
    _silence_boot(terminal)
    terminal.ask("led 255 1")
    terminal.board.advance(1100)
    assert terminal.state() == "lease"
    terminal.board.press_button(True)
    terminal.board.advance(1200)
    terminal.board.press_button(False)
    assert terminal.state() == "stop"


def _silence_boot(terminal: Terminal) -> None:
    terminal.ask("hello")
    (event, *_) = terminal.take_events()
    assert event.startswith("!1 boot boot=")
    terminal.ask("ack 1")


def _press(terminal: Terminal, ms: float) -> None:
    terminal.board.press_button(True)
    terminal.board.advance(ms)
    terminal.board.press_button(False)
    terminal.board.advance(60)


def test_a_restart_is_told_and_leaves_everything_off(terminal: Terminal) -> None:
    before = terminal.fields("hello")
    assert before["reset"] == "power"
    terminal.ask("led 255 FFF")
    assert not any(terminal.board.reset().leds)
    after = terminal.fields("hello")
    assert after["reset"] == "watchdog"
    assert after["boot"] != before["boot"]
    assert terminal.state() == "unhomed"


_FAST = ("microsteps 8", "acceleration 1000000", "top_speed 72000", "home_speed 72000",
         "start_speed 72000")  # fmt: skip
_SLOW = ("start_speed 1000", "home_speed 1000", "top_speed 1000", "microsteps 57")
_CRAWL = ("index_speed 100", "start_speed 100", "home_speed 100")

# What must be set before each parameter can take its lowest, and its highest, value.
_PARAMETERS: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "full_steps": ((), ()),
    "microsteps": ((), ("table_teeth 15",)),
    "motor_teeth": (("table_teeth 12",), ("table_teeth 200",)),
    "table_teeth": (("table_teeth 12", "motor_teeth 1"), ("motor_teeth 21",)),
    "reversed": ((), ()),
    "start_speed": (_CRAWL, _FAST),
    "top_speed": (_CRAWL, _FAST),
    "acceleration": (_SLOW, ()),
    "home_speed": (_CRAWL, _FAST),
    "index_speed": ((), _FAST),
    "led_ma": ((), ()),
    "supply_ma": ((), ()),
    "led_limit_ms": ((), ()),
    "settle_us": ((), ()),
}


@pytest.mark.parametrize("name", _PARAMETERS)
def test_a_parameter_at_its_limits(name: str, power_up: Callable[[], SimulatedBoard]) -> None:
    for limit, prelude in zip(("lowest", "highest"), _PARAMETERS[name], strict=True):
        with Terminal(power_up()) as terminal:
            beyond = -1 if limit == "lowest" else 1
            value = int(terminal.fields(f"get {name}")[limit])
            for setting in prelude:
                assert terminal.ask(f"set {setting}").startswith("ok"), setting
            assert terminal.ask(f"set {name} {value + beyond}") == "err range"
            assert terminal.fields(f"set {name} {value}")[name] == str(value)
            terminal.board.reset()
            assert terminal.fields("hello")["parameters"] == "kept"
            assert terminal.fields(f"get {name}")[name] == str(value)


def test_parameters_are_not_set_in_the_light(terminal: Terminal) -> None:
    terminal.ask("lamp 0 1")
    assert terminal.ask("set reversed 0") == "err busy"
    assert terminal.ask("off") == "ok"
    assert terminal.ask("set reversed 0").startswith("ok")


def test_every_parameter_has_its_default_on_a_new_board(terminal: Terminal) -> None:
    assert terminal.fields("hello")["parameters"] == "default"
    for name in _PARAMETERS:
        fields = terminal.fields(f"get {name}")
        assert fields[name] == fields["default"]


@pytest.mark.parametrize(
    "setting",
    [
        "microsteps 64", "start_speed 9001", "index_speed 4501", "home_speed 18001",
        "top_speed 45003", "acceleration 30000", "table_teeth 2",
    ],
)  # fmt: skip
def test_parameters_that_do_not_go_together_are_refused(setting: str, terminal: Terminal) -> None:
    assert terminal.ask(f"set {setting}") == "err range"
    assert terminal.fields("hello")["parameters"] == "default"


@pytest.mark.parametrize("address", [0, 1, 30, 57, 58])
def test_a_corrupt_block_falls_back_and_says_so(address: int, terminal: Terminal) -> None:
    terminal.ask("set microsteps 8")
    terminal.board.spoil(address)
    terminal.board.reset()
    assert terminal.fields("hello")["parameters"] == "corrupt"
    assert terminal.fields("get microsteps")["microsteps"] == "16"
    terminal.ask("set microsteps 8")
    terminal.board.reset()
    assert terminal.fields("hello")["parameters"] == "kept"
