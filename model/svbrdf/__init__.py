"""The method: SVBRDF maps, their renderer, materials, network, training and evaluation."""

import os

# Read by onnxruntime when it is imported, by whichever module of this package comes first.
os.environ["ORT_DISABLE_TELEMETRY"] = "1"
