"""Numbers of the wire: net/PROTOCOL.md. Written by scripts/ci/wire_constants.py from net/protocol.json."""
from enum import IntEnum, IntFlag

PROTOCOL_VERSION = 1
MAGIC = 1497584194  # the bytes 42 52 43 59, little-endian
HEADER_BYTES = 32
MAX_NAME_BYTES = 64
MAX_TEXT_BYTES = 512
ANY_NEEDLE = 65535
TOKEN_BYTES = 32


class MessageType(IntEnum):
    HELLO = 1
    WELCOME = 2
    TOPOLOGY = 3
    FRAME = 4
    POSE = 5
    STATE = 6
    EVENT = 7
    ERROR = 8
    PING = 9
    FORCE = 10
    LOCAL_MODEL = 11
    ARM = 12
    DROP = 13
    DOSE = 14
    CONTROL = 15
    SCENE = 16
    IMAGE = 17
    SCANNER = 18
    LOAD = 19
    PLAN = 20
    CONTOUR = 21
    EXERCISE = 22


class Role(IntEnum):
    VIEWER = 1
    DEVICE = 2
    OPERATOR = 3


class EventKind(IntEnum):
    NOTE = 1
    CONTACT = 2
    PUNCTURE = 3
    RESET = 4
    DEVICE_ATTACHED = 5
    DEVICE_DETACHED = 6
    WARNING = 7
    SAFETY = 8
    SEED = 9
    STRUCTURE = 10
    SEED_LOST = 11


class ErrorCode(IntEnum):
    PROTOCOL = 1
    VERSION = 2
    TOO_LARGE = 3
    BUSY = 4
    DEVICE_BUSY = 5
    NOT_DEVICE = 6
    POSE_REFUSED = 7
    POSE_RATE = 8
    TIMEOUT = 9
    SHUTDOWN = 10
    NO_NEEDLE = 11
    NOT_OPERATOR = 12
    CONTROL_REFUSED = 13
    UNAUTHORISED = 14
    SCANNER_REFUSED = 15
    PLAN_REFUSED = 16
    LOAD_REFUSED = 17
    CONTOUR_REFUSED = 18
    EXERCISE_REFUSED = 19


class PlanKind(IntEnum):
    FILE = 1
    OPTIMISED = 2
    EDITED = 3


class ControlAction(IntEnum):
    PLAY = 1
    STOP = 2
    RESET = 3
    MODEL = 4


class FrameSection(IntEnum):
    FORCE = 1
    SEEDS = 2
    CERTIFICATE = 3
    POSE_HISTORY = 4
    POSES_OF_NEEDLES = 5
    BUTTONS = 6
    NEEDLE_SHAPES = 7
    LAG = 8


class ScannerArray(IntEnum):
    AS_IT_IS = 0
    TRANSVERSE = 1
    SAGITTAL = 2
    END_FIRE = 3
    BIPLANE = 4


class ScannerFreeze(IntEnum):
    AS_IT_IS = 0
    LIVE = 1
    FROZEN = 2


class PoseRefusal(IntEnum):
    RATE = 65281
    NEEDLE = 65282
    NOT_DEVICE = 65283


class Subscription(IntFlag):
    FULL_FRAMES = 1
    POSE_HISTORY = 2
    SURFACE = 4
    NO_MESH = 8
    SCENE = 16
    ULTRASOUND = 32
    PLAN = 64


class DeviceFlag(IntFlag):
    EVALUATES_LOCAL_MODEL = 1


class ImageRequestFlag(IntFlag):
    TAKES_ZLIB = 1
    SCANNER_ONLY = 2


class ImageFlag(IntFlag):
    HELD = 1
    FROZEN = 2
    ZLIB = 4
    UNCERTIFIED = 8


class ScannerFlag(IntFlag):
    PROBE_HAS_DEVICE = 1
    PROBE_IS_STEPPED = 2


class ForceFlag(IntFlag):
    ARMED = 1
    RAMPING = 2
    LATCHED = 4
    LIMITED = 8
    EXPIRED = 16


class ControlFlag(IntFlag):
    SCRIPT_IS_THERE = 1
    SCRIPT_PLAYS = 2
    SCRIPT_LOOPS = 4
    PREPARES_MODEL = 8


class FrameFlag(IntFlag):
    FULL = 1


class SeedFlag(IntFlag):
    CERTIFIED = 1
    OUTSIDE = 2


class GoalFlag(IntFlag):
    ABOVE = 1
    OF_PLAN = 2


class HoleFlag(IntFlag):
    FROM_RIGHT = 1
    HALF_STEPS = 2


class PlanFlag(IntFlag):
    OPTIMISING = 1


class PlanNeedleFlag(IntFlag):
    BEGUN = 1


class PlayFlag(IntFlag):
    LOOP = 1


class ImplausibleLimit(IntFlag):
    FORCE_NOT_PLAUSIBLE = 1
    STIFFNESS_NOT_PLAUSIBLE = 2
    DAMPING_NOT_PLAUSIBLE = 4
    RATE_NOT_PLAUSIBLE = 8
