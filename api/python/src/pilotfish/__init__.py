"""Client of Pilotfish, the formation planner for a surface craft above underwater vehicles.

`Client` and `AsyncClient` ask a service for plans and keep missions in it. `pilotfish.types` has the shapes of requests
and answers, as the service describes them. Metres, seconds, radians; positions north and east of a datum; headings 0 at
north, positive clockwise.
"""

from importlib.metadata import version

from . import types
from .aio import AsyncClient, AsyncMission
from .client import Client, Mission
from .comparison import Comparison
from .errors import MissionFailed, PilotfishError, Refused, Unreachable
from .orders import RecordFormat
from .stream import Event

__version__ = version("pilotfish")

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
    "types",
]
