"""The streaming estimator: state = max(state, encode(picture)); maps = decode(state), as bright as seen."""

from svbrdf.maps import Maps
from svbrdf.onnx_model import OnnxModel, WeightsError
from turnlight.errors import ModelError
from turnlight.estimate.brightness import Brightness
from turnlight.picture.front_end import network_input, network_lighting
from turnlight.picture.picture import Picture


class Estimator:
    """Takes pictures of one sample in any order; the maps depend on the set of pictures alone."""

    def __init__(self, threads: int = 2) -> None:
        """Load the shipped weights; ModelError says which file is missing or damaged."""
        try:
            self._model = OnnxModel(threads=threads)
        except WeightsError as error:
            raise ModelError(str(error)) from error
        self.reset()

    def reset(self) -> None:
        """Forget every picture."""
        self._state = self._model.empty()
        self._brightness = Brightness()
        self.count = 0

    def add(self, picture: Picture) -> Maps:
        """Take one more picture; the maps (256, 256, ...) of all so far."""
        seen = network_input(picture, self._model.resolution)
        lighting = network_lighting(picture, self._model.resolution)
        self._state = self._model.encode(self._state, seen, lighting)
        self._brightness.add(picture)
        self.count += 1
        return self.maps()

    def maps(self) -> Maps:
        """Float32 numpy maps of the pictures so far; at least one must have been added."""
        return self._brightness.balanced(self._model.decode(self._state))
