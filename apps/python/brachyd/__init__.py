"""Client of brachyd, the brachytherapy simulator: viewers, devices and operators. The wire: net/PROTOCOL.md."""
from .client import AsyncClient, Client
from .constants import (ControlAction, ErrorCode, EventKind, ForceFlag, ImageFlag, MessageType, Role, ScannerArray,
                        ScannerFreeze, Subscription)
from .force import LocalForce
from .recording import Recording
from .protocol import Protocol, ServerError, unit_pose
from .wire import (Certificate, Dose, Error, Event, Force, Forces, Frame, Hello, Image, Limits, LocalModel, Needle,
                   ProtocolError, Scanner, Scene, Seed, State, StructureDose, Topology, Welcome)

__version__ = "0.1.0"
__all__ = ["AsyncClient", "Certificate", "Client", "ControlAction", "Dose", "Error", "ErrorCode", "Event",
           "EventKind", "Force", "ForceFlag", "Forces", "Frame", "Hello", "Image", "ImageFlag", "Limits", "LocalForce",
           "LocalModel", "MessageType", "Needle", "Protocol", "ProtocolError", "Recording", "Role", "Scanner",
           "ScannerArray", "ScannerFreeze", "Scene", "Seed",
           "ServerError", "State", "StructureDose", "Subscription", "Topology", "Welcome", "unit_pose"]
