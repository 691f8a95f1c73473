"""Exports that a page asks for: made aside, handed over, and not kept."""

import io
import re
import tempfile
import zipfile
from pathlib import Path
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

from turnlight.export.export import LARGEST_PX, SMALLEST_PX, Format, Options, export

_SUFFIX = {Format.GLTF: ".glb", Format.VIEWER: ".html"}


class ExportOrder(BaseModel):
    """What to make of a session. size_px: of the longer side, as it is if None."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    format: Format
    tileable: bool = False
    height: bool = False
    size_px: Annotated[int | None, Field(ge=SMALLEST_PX, le=LARGEST_PX)] = None


def exported(folder: Path, order: ExportOrder) -> tuple[str, bytes]:
    """File name and content. Raises ExportError, SessionError or MaterialError."""
    options = Options(order.tileable, order.size_px, order.height)
    name = re.sub(r"[^\w.-]", "-", folder.name, flags=re.ASCII)
    with tempfile.TemporaryDirectory(prefix="turnlight-") as aside:
        suffix = _SUFFIX.get(order.format, f"-{order.format}")
        path = export(folder, order.format, options, Path(aside) / f"{name}{suffix}").path
        if path.is_file():
            return path.name, path.read_bytes()
        return f"{path.name}.zip", _zipped(path)


def _zipped(folder: Path) -> bytes:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_STORED) as bundle:
        for file in sorted(folder.rglob("*")):
            if file.is_file():
                bundle.write(file, Path(folder.name) / file.relative_to(folder))
    return buffer.getvalue()
