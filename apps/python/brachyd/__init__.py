"""Client of brachyd, the brachytherapy simulator: viewers, devices and operators. The wire: net/PROTOCOL.md."""
from .client import AsyncClient, Client
from .constants import ControlAction, ErrorCode, EventKind, ForceFlag, MessageType, Role, Subscription
from .force import LocalForce
from .recording import Recording
from .protocol import Protocol, ServerError, unit_pose
from .wire import (Certificate, Dose, Error, Event, Force, Forces, Frame, Hello, Limits, LocalModel, Needle,
                   ProtocolError, Scene, Seed, State, StructureDose, Topology, Welcome)

__version__ = "0.1.0"
__all__ = ["AsyncClient", "Certificate", "Client", "ControlAction", "Dose", "Error", "ErrorCode", "Event",
           "EventKind", "Force", "ForceFlag", "Forces", "Frame", "Hello", "Limits", "LocalForce",
           "LocalModel", "MessageType", "Needle", "Protocol", "ProtocolError", "Recording", "Role", "Scene", "Seed",
           "ServerError", "State", "StructureDose", "Subscription", "Topology", "Welcome", "unit_pose"]
