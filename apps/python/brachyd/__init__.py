"""brachyd, the brachytherapy simulator: clients of the daemon (net/PROTOCOL.md), and the engine in this process."""
from .client import AsyncClient, Client
from .constants import (ControlAction, ErrorCode, EventKind, ForceFlag, ImageFlag, MessageType, Role, ScannerArray,
                        ScannerFreeze, Subscription)
from .force import LocalForce, ReceivedForce
from .recording import Recording
from .protocol import Protocol, ServerError, unit_pose
from .simulator import Drops, Simulator, Ticks
from .wire import (Certificate, Dose, Error, Event, Force, Forces, Frame, Hello, Image, Limits, LocalModel, Needle,
                   ProtocolError, Scanner, Scene, Seed, State, StructureDose, Topology, Welcome)

__version__ = "0.1.0"
__all__ = ["AsyncClient", "Certificate", "Client", "ControlAction", "Dose", "Drops", "Error", "ErrorCode", "Event",
           "EventKind", "Force", "ForceFlag", "Forces", "Frame", "Hello", "Image", "ImageFlag", "Limits",
           "LocalForce", "LocalModel", "MessageType", "Needle", "Protocol", "ProtocolError", "ReceivedForce",
           "Recording", "Role", "Scanner", "ScannerArray", "ScannerFreeze", "Scene", "Seed", "ServerError",
           "Simulator", "State", "StructureDose", "Subscription", "Ticks", "Topology", "Welcome", "unit_pose"]
