"""A real OAK as a node: its colour sensor at full resolution, raw, on the camera's own pipeline."""

import depthai as dai

from turnlight.errors import CameraError
from turnlight.rig.camera.oak_process import CameraNode, OakOptions, run
from turnlight.rig.camera.still import CameraInfo

SOCKET = dai.CameraBoardSocket.CAM_A
FAST_PER_S, SLOW_PER_S = 10.0, 2.0
"""A raw picture has 15 MB: USB 3 takes ten a second with ease, USB 2 takes two."""


def open_device(options: OakOptions) -> CameraNode:
    """Connect to the camera. Raises CameraError if it is not there, is in use or has another sensor."""
    device = _connect(options.device)
    speed = device.getUsbSpeed()
    fast = speed in (dai.UsbSpeed.SUPER, dai.UsbSpeed.SUPER_PLUS)
    frames_per_s = options.frames_per_s(FAST_PER_S if fast else SLOW_PER_S)
    size = (options.width_px, options.height_px)
    sensor = next((s for s in device.getConnectedCameraFeatures() if s.socket == SOCKET), None)
    if sensor is None or (sensor.width, sensor.height) != size:
        found = f"{sensor.width} x {sensor.height} pixels" if sensor else "no colour sensor"
        raise CameraError(
            f"The camera has {found} and the rig file says {size[0]} x {size[1]}; "
            "correct width_px and height_px."
        )
    pipeline = dai.Pipeline(device)
    camera = pipeline.create(dai.node.Camera).build(SOCKET, size, frames_per_s)
    # The sensor's controls are applied by the image processor, which runs only if it has work.
    camera.requestOutput((640, 480), fps=frames_per_s).createOutputQueue(maxSize=1, blocking=False)
    info = CameraInfo(
        name=f"{device.getProductName()} {device.getDeviceId()}",
        usb_speed=speed.name,
        focal_px=_focal_px(device, size),
        frames_per_s=frames_per_s,
    )
    return CameraNode(pipeline, camera.raw, camera.inputControl, info)


def _connect(device_id: str) -> dai.Device:
    try:
        return dai.Device(dai.DeviceInfo(device_id)) if device_id else dai.Device()
    except RuntimeError as error:
        which = f"OAK camera {device_id}" if device_id else "OAK camera"
        raise CameraError(
            f"No {which} answers; plug it into a USB 3 port, close what else uses it, "
            "and run turnlight doctor, which names a missing permission."
        ) from error


def _focal_px(device: dai.Device, size: tuple[int, int]) -> tuple[float, float] | None:
    try:
        matrix = device.readCalibration().getCameraIntrinsics(SOCKET, *size)
    except RuntimeError:
        return None
    return matrix[0][0], matrix[1][1]


if __name__ == "__main__":
    run(open_device)
