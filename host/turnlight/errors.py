"""What can go wrong. Every message is one sentence for a technician: the cause and what to do next."""


class TurnlightError(Exception):
    """Base of every error a user can meet; `str(error)` is the sentence the user reads."""


class ConfigError(TurnlightError):
    """A rig's TOML file cannot be used."""


class LinkError(TurnlightError):
    """The serial line to the controller does not work."""


class RigError(TurnlightError):
    """The controller refuses, reports a fault, or does not do what was asked."""


class FirmwareError(TurnlightError):
    """The controller's firmware cannot be written, or is not what was written."""


class CameraError(TurnlightError):
    """The camera gave no frame, or not the frame that was asked for."""


class ImageError(TurnlightError):
    """A picture cannot be read, or cannot be used as it is."""


class SessionError(TurnlightError):
    """A session folder cannot be written or read."""


class ModelError(TurnlightError):
    """The trained model cannot be loaded."""


class RunError(TurnlightError):
    """The run is not in a state for what was asked of it."""


class ServiceError(TurnlightError):
    """The service, or its udev rules, cannot be installed."""


class CalibrationError(TurnlightError):
    """A step of the calibration cannot be done."""


class ExportError(TurnlightError):
    """An export cannot hold what it was asked to."""
