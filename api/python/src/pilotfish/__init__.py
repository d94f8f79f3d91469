"""Client of Pilotfish, the formation planner for a surface craft above underwater vehicles.

`Client` and `AsyncClient` get plans from a service and run missions in it. `pilotfish.types` has the types of requests
and answers. Metres, seconds, radians; positions north and east of a datum; headings 0 at
north, positive clockwise.
"""

from . import types
from .aio import AsyncClient, AsyncMission
from .client import Client, Mission
from .comparison import Comparison
from .core import RecordFormat, __version__
from .errors import MissionFailed, PilotfishError, Refused, Unreachable
from .stream import Event

__all__ = [
    "AsyncClient",
    "AsyncMission",
    "Client",
    "Comparison",
    "Event",
    "Mission",
    "MissionFailed",
    "PilotfishError",
    "RecordFormat",
    "Refused",
    "Unreachable",
    "__version__",
    "types",
]
