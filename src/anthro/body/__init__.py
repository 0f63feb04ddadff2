"""The body: anatomy tables, the builder, the Hill muscles and the simulator."""

from anthro.body.model import Body

__all__ = ["Body"]
