"""A small convolutional network, as a features extractor of Stable-Baselines3 for images.

This network has layers of 16 and 32 channels and 128 units; NatureCNN has 32, 64 and 64 channels and 512
units.

A model.zip contains only the name of this class, so Stable-Baselines3 can load the file if this package is
installed. If the file contained the class as byte code, only the same version of Python could read it.
"""

from __future__ import annotations

import math

import torch
from gymnasium import spaces
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor
from torch import nn


class SmallCnn(BaseFeaturesExtractor):
    """Two convolutions and one layer of units, each with ReLU.

    Args:
        observation_space: images with channels first.
        features_dim: number of units of the last layer.
    """

    def __init__(self, observation_space: spaces.Box, features_dim: int = 128) -> None:
        super().__init__(observation_space, features_dim)
        channels, height, width = observation_space.shape
        places = math.prod(((side - 8) // 4 - 3) // 2 + 1 for side in (height, width))
        self.layers = nn.Sequential(
            nn.Conv2d(channels, 16, kernel_size=8, stride=4),
            nn.ReLU(),
            nn.Conv2d(16, 32, kernel_size=4, stride=2),
            nn.ReLU(),
            nn.Flatten(),
            nn.Linear(32 * places, features_dim),
            nn.ReLU(),
        )

    def forward(self, observations: torch.Tensor) -> torch.Tensor:
        """Return the features of a batch of images, shape (images, features_dim)."""
        features: torch.Tensor = self.layers(observations)
        return features
