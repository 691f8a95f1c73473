"""The rig as a service of this computer: a systemd unit, and udev rules for its board and its camera."""

import os
import pwd
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

from turnlight.config import RigConfig
from turnlight.errors import ServiceError
from turnlight.rig.usb import BOARDS, OAK_VENDOR, camera_rule

UNIT = Path("etc/systemd/system/turnlight.service")
RULES = Path("etc/udev/rules.d/70-turnlight.rules")
_UNIT = """\
[Unit]
Description=Turnlight material scanner
Documentation=file://{readme}

[Service]
Type=notify
ExecStart={program} serve --rig {rig} --out {out}
WatchdogSec=60
Restart=on-failure
RestartSec=5
User={user}
SupplementaryGroups=dialout plugdev video
CacheDirectory=turnlight
Environment=NUMBA_CACHE_DIR=/var/cache/turnlight
ReadWritePaths={out} {calibrations}
ProtectSystem=strict
ProtectHome=read-only
PrivateTmp=true
NoNewPrivileges=true
# Nothing in it calls out: whatever tries is cut off.
IPAddressDeny=any
IPAddressAllow=localhost

[Install]
WantedBy=multi-user.target
"""
_BOARD_RULE = (
    'SUBSYSTEM=="tty", ATTRS{{idVendor}}=="{vendor:04x}", ATTRS{{idProduct}}=="{product:04x}", '
    'MODE="0660", GROUP="dialout", TAG+="uaccess", ENV{{ID_MM_DEVICE_IGNORE}}="1"'
)


@dataclass(frozen=True)
class Service:
    """What is installed. rig: the rig's TOML file; out: the folder for sessions; user: who runs it."""

    rig: Path
    out: Path
    user: str

    def unit(self) -> str:
        """The systemd unit. Raises ConfigError or ServiceError if it could not run."""
        RigConfig.load(self.rig)
        try:
            pwd.getpwnam(self.user)
        except KeyError as error:
            raise ServiceError(
                f"There is no user {self.user} on this computer; name one with --user."
            ) from error
        program = Path(sys.executable).with_name("turnlight")
        paths = {"program": program, "rig": self.rig.absolute(), "out": self.out.absolute()}
        for path in paths.values():
            if any(c.isspace() or c in "%\"'\\" for c in str(path)):
                raise ServiceError(f"The path {path} has a blank or % in it; choose a plain one.")
        readme = Path(__file__).parents[2] / "README.md"
        beside = paths["rig"].parent
        return _UNIT.format(**paths, calibrations=beside, user=self.user, readme=readme)


def udev_rules() -> str:
    """Who may open board and camera, and that ModemManager keeps its hands off the board."""
    boards = [_BOARD_RULE.format(vendor=v, product=p) for v, p in sorted(BOARDS)]
    header = "# Turnlight: the camera, and boards that a rig may have."
    return "\n".join([header, camera_rule(OAK_VENDOR), *boards]) + "\n"


def default_user() -> str:
    """Who called sudo, or who runs this."""
    return os.environ.get("SUDO_USER") or pwd.getpwuid(os.getuid()).pw_name


def install(service: Service | None, root: Path = Path("/")) -> list[Path]:
    """Write rules, and unit if there is a service, under `root`; for "/", put them to use at once.

    Returns the files written. Raises ConfigError or ServiceError.
    """
    files = {RULES: udev_rules()}
    if service is not None:
        files[UNIT] = service.unit()
    written = [root / path for path in files]
    try:
        for path, text in files.items():
            (root / path).parent.mkdir(parents=True, exist_ok=True)
            (root / path).write_text(text)
        if service is not None and root == Path("/"):
            service.out.mkdir(parents=True, exist_ok=True)
            shutil.chown(service.out, service.user)
    except OSError as error:
        raise ServiceError(
            f"Cannot write {error.filename}: {(error.strerror or str(error)).lower()}; "
            "run it with sudo."
        ) from error
    if root == Path("/"):
        _put_to_use(service)
    return written


def _put_to_use(service: Service | None) -> None:
    commands = [["udevadm", "control", "--reload"], ["udevadm", "trigger"]]
    if service is not None:
        commands += [
            ["systemctl", "daemon-reload"],
            ["systemctl", "enable", "turnlight"],
            ["systemctl", "restart", "turnlight"],
        ]
    for command in commands:
        try:
            done = subprocess.run(command, capture_output=True, text=True, check=False)
        except OSError as error:
            raise ServiceError(
                f"The files are written, but there is no {command[0]} here; restart the computer."
            ) from error
        if done.returncode:
            raise ServiceError(
                f"The files are written, but `{' '.join(command)}` failed "
                f"({done.stderr.strip().rstrip('.')}); restart the computer."
            )
