"""What lies on the table next, as the operator has said; it is remembered, and the button uses it."""

from pathlib import Path
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field, StringConstraints, ValidationError

from turnlight import app
from turnlight.capture import durable
from turnlight.capture.run import Job
from turnlight.config import RigConfig
from turnlight.errors import ConfigError
from turnlight.preset import Preset

FILE = ".next-sample.json"
Line = StringConstraints(strip_whitespace=True, max_length=80, pattern=r"^[^\x00-\x1f\x7f]*$")


class NextSample(BaseModel):
    """The sample that the next run captures. Lengths in mm."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    name: Annotated[str, Line, Field(min_length=1)]
    barcode: Annotated[str, Line] = ""
    operator: Annotated[str, Line] = ""
    preset: Annotated[str, Line]
    side_mm: Annotated[float, Field(gt=0, le=1000, allow_inf_nan=False)]
    thickness_mm: Annotated[float, Field(ge=0, le=50, allow_inf_nan=False)]

    def preset_of(self, config: RigConfig) -> Preset:
        """Raises ConfigError if the rig has none of this name."""
        return config.preset_named(self.preset)

    def config(self, config: RigConfig) -> RigConfig:
        """The rig's, for a sample of this size. Raises ConfigError if it covers the markers."""
        largest_mm = largest_side_mm(config)
        if self.side_mm > largest_mm:
            raise ConfigError(
                f"A sample of {self.side_mm:g} mm covers the table's markers; "
                f"cut it to {largest_mm:g} mm or less."
            )
        sample = config.sample.model_copy(update={"side_mm": self.side_mm})
        return config.model_copy(update={"sample": sample})

    def sample(self, material: Path | None) -> app.Sample:
        return app.Sample(
            self.name, self.thickness_mm, material, self.barcode or None, self.operator or None
        )

    def job(self, config: RigConfig, material: Path | None, root: Path) -> Job:
        """A run that captures it into a new folder under `root`. Raises ConfigError."""
        folder = root / app.default_folder(self.name).name
        return app.new_job(
            self.config(config), self.sample(material), self.preset_of(config), folder
        )


def largest_side_mm(config: RigConfig) -> float:
    """The largest sample that leaves the table's markers free."""
    return 2 * (config.platter.marker_offset_mm - config.platter.marker_side_mm / 2)


def remembered(root: Path, config: RigConfig) -> NextSample:
    """What was said last; what the rig file says if nothing was, or not for this rig."""
    try:
        said = NextSample.model_validate_json((root / FILE).read_bytes())
        said.config(config)
        said.preset_of(config)
    except (OSError, ValidationError, ConfigError):
        return NextSample(
            name="sample",
            preset=next(iter(config.preset)),
            side_mm=config.sample.side_mm,
            thickness_mm=config.sample.reference_thickness_mm,
        )
    return said


def remember(root: Path, sample: NextSample) -> None:
    """For the next start. Raises SessionError if the disk refuses."""
    durable.write(root / FILE, sample.model_dump_json().encode())
