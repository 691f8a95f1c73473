"""The method: SVBRDF maps, their renderer, materials, network, training and evaluation."""
