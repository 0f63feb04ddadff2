"""Anthro: anatomy tables become a body, the body makes data, the data make networks that move it."""

__version__ = "0.1.0"
