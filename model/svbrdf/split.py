"""Which materials are for training, validation and test, by name. Never tune on the test set."""

from pathlib import Path

TEST = (
    "Bricks102", "Metal049A", "Onyx003", "Rock023", "metal_plate_02", "stone_floor",
    "rosewood_veneer1", "clean_pebbles",
)  # fmt: skip
VALIDATION = ("Tiles107", "concrete_wall_001", "grey_roof", "Ground037")
TRAINING = (
    "Bark014", "Grass001", "Metal007", "Metal055A", "Rock020", "Rock058", "concrete_tile_facade",
    "factory_wall", "old_wood_floor",
)  # fmt: skip


def folders(library: Path | None, names: tuple[str, ...]) -> list[Path]:
    """The material folders of a split that exist under the library."""
    return [] if library is None else [p for name in names if (p := library / name).is_dir()]
