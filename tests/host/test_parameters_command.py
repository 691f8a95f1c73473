"""`turnlight firmware parameters`, on the simulated rig."""

import json

from typer.testing import CliRunner

from turnlight import cli
from turnlight.rig.controller import PARAMETERS


def _parameters(*arguments: str) -> tuple[int, str, str]:
    result = CliRunner().invoke(cli.commands, ["firmware", "parameters", *arguments])
    return result.exit_code, result.stdout, result.stderr


def test_all_are_shown() -> None:
    code, stdout, _ = _parameters("--json")
    assert code == 0
    shown = {parameter["name"]: parameter for parameter in json.loads(stdout)}
    assert tuple(shown) == PARAMETERS
    assert all(p["value"] == p["default"] for p in shown.values())


def test_one_is_set() -> None:
    code, stdout, _ = _parameters("--set", "microsteps", "32")
    assert (code, stdout.split()[:2]) == (0, ["microsteps", "32"])


def test_what_does_not_fit_is_refused_in_one_sentence() -> None:
    for setting, word in ((("microsteps", "64"), "does not fit"), (("gears", "2"), "no parameter")):
        code, _, stderr = _parameters("--set", *setting)
        assert code != 0
        assert word in stderr
