"""The folder of sessions that the page shows."""

import contextlib
import json
from pathlib import Path

import pytest

from turnlight.errors import SessionError
from turnlight.web.library import Library


def test_what_was_photographed_by_hand_is_told_from_what_is_damaged(tmp_path: Path) -> None:
    for name, content in (("oak", json.dumps({"kind": "handheld"})), ("broken", "{")):
        (tmp_path / name).mkdir()
        (tmp_path / name / "session.json").write_text(content)
    with contextlib.closing(Library(tmp_path)) as library:
        with pytest.raises(SessionError, match="photographed by hand"):
            library.manifest("oak")
        with pytest.raises(SessionError, match="damaged"):
            library.manifest("broken")
