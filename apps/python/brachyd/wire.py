"""Bytes to messages and back: net/PROTOCOL.md. Lengths mm, forces N, times s or ns, frame W = patient RAS."""
from __future__ import annotations

import math
import struct
import zlib
from dataclasses import dataclass, field
from typing import Callable, Dict, List, Optional, Tuple, Union

import numpy as np
import numpy.typing as npt

from .constants import (ANY_NEEDLE, HEADER_BYTES, MAGIC, PROTOCOL_VERSION, ControlAction, DeviceFlag, ForceFlag,
                        FrameSection, ImageFlag, ImageRequestFlag, MessageType, Role, ScannerArray, ScannerFreeze,
                        Subscription)

Array = npt.NDArray[np.float64]
FloatArray = npt.NDArray[np.float32]
HEADER = struct.Struct("<IHHIIQQ")
NOT_STATED = math.nan


class ProtocolError(Exception):
    """The other side broke net/PROTOCOL.md."""


class Reader:
    """A body, read from its begin to its end."""

    def __init__(self, data: Union[bytes, memoryview]) -> None:
        self.data = memoryview(data)
        self.at = 0

    def take(self, count: int) -> memoryview:
        if self.at + count > len(self.data):
            raise ProtocolError("a body ends too early")
        self.at += count
        return self.data[self.at - count:self.at]

    def get(self, form: str) -> Tuple[int, ...]:
        return struct.unpack("<" + form, self.take(struct.calcsize("<" + form)))

    def u8(self) -> int:
        return self.get("B")[0]

    def u16(self) -> int:
        return self.get("H")[0]

    def u32(self) -> int:
        return self.get("I")[0]

    def u64(self) -> int:
        return self.get("Q")[0]

    def f64(self) -> float:
        return float(self.get("d")[0])

    def text(self) -> str:
        return bytes(self.take(self.u16())).decode("utf-8")

    def vector(self, count: int = 3) -> Array:
        return np.frombuffer(self.take(8 * count), "<f8").astype(np.float64)

    def floats(self, count: int) -> FloatArray:
        return np.frombuffer(self.take(4 * count), "<f4")

    def pose(self) -> Array:
        """4×4, mm."""
        X = np.eye(4)
        X[:3] = self.vector(12).reshape(3, 4)
        return X

    def sections(self, on_section: Callable[[int, "Reader"], None]) -> None:
        """Hands over each section; the callback skips those that it does not know."""
        count = self.u16()
        self.u16()
        for _ in range(count):
            number = self.u16()
            self.u16()
            on_section(number, Reader(self.take(self.u32())))

    def finish(self) -> None:
        if self.at != len(self.data):
            raise ProtocolError("a body is too long")


@dataclass
class Header:
    type: int
    length: int
    sequence: int
    stamp_ns: int


def decode_header(data: Union[bytes, memoryview]) -> Header:
    magic, version, kind, _, length, sequence, stamp = HEADER.unpack_from(data)
    if magic != MAGIC:
        raise ProtocolError("this is no brachyd message: the magic is wrong")
    if version != PROTOCOL_VERSION:
        raise ProtocolError(f"the server speaks version {version}, this client {PROTOCOL_VERSION}")
    return Header(kind, length, sequence, stamp)


def encode_message(kind: int, body: bytes, sequence: int, stamp_ns: int) -> bytes:
    return HEADER.pack(MAGIC, PROTOCOL_VERSION, kind, 0, len(body), sequence, stamp_ns) + body


def text_bytes(text: str) -> bytes:
    data = text.encode("utf-8")
    return struct.pack("<H", len(data)) + data


def sections_bytes(sections: Dict[int, bytes]) -> bytes:
    out = struct.pack("<HH", len(sections), 0)
    for number, payload in sections.items():
        out += struct.pack("<HHI", number, 0, len(payload)) + payload
    return out


@dataclass
class Hello:
    """Who connects. NaN: not stated; the server then takes a default."""
    role: Role = Role.VIEWER
    name: str = "python"
    subscription: Subscription = Subscription(0)
    max_force_n: float = NOT_STATED
    max_stiffness_n_per_mm: float = NOT_STATED
    damping_n_s_per_mm: float = NOT_STATED
    rate_hz: float = NOT_STATED
    needle: int = ANY_NEEDLE
    evaluates_local_model: bool = False
    token: Optional[bytes] = None
    software: str = ""
    takes_zlib: bool = False  # pixels of images may come compressed

    def encode(self) -> bytes:
        sections: Dict[int, bytes] = {}
        flags = DeviceFlag.EVALUATES_LOCAL_MODEL if self.evaluates_local_model else 0
        if self.needle != ANY_NEEDLE or flags:
            sections[1] = struct.pack("<HHI", self.needle, flags, 0)
        if self.token is not None:
            sections[2] = self.token
        if self.software:
            sections[3] = text_bytes(self.software)
        if self.takes_zlib:
            sections[4] = struct.pack("<HHI", ImageRequestFlag.TAKES_ZLIB, 0, 0)
        return (struct.pack("<HHIdddd", self.role, 0, self.subscription, self.max_force_n, self.max_stiffness_n_per_mm,
                            self.damping_n_s_per_mm, self.rate_hz) + text_bytes(self.name) + sections_bytes(sections))


@dataclass
class Limits:
    """What was negotiated with a device."""
    max_force_n: float
    max_stiffness_n_per_mm: float
    damping_n_s_per_mm: float
    rate_hz: float
    not_plausible: int


@dataclass
class Welcome:
    session: int
    role: int
    subscription: int
    deformation_hz: float
    snapshot_hz: float
    max_message_bytes: int
    max_poses_per_s: int
    topology_hash: int
    server: str
    units: str
    frame: str
    needle: int = ANY_NEEDLE
    needle_count: int = 1
    limits: Optional[Limits] = None


def decode_welcome(r: Reader) -> Welcome:
    session, role, _, subscription = r.get("QHHI")
    deformation_hz, snapshot_hz = r.f64(), r.f64()
    body, poses, topology = r.get("IIQ")
    server, units, frame = r.text(), r.text(), r.text()
    welcome = Welcome(session, role, subscription, deformation_hz, snapshot_hz, body, poses, topology, server, units,
                      frame)

    def on_section(number: int, s: Reader) -> None:
        if number == 1:
            welcome.needle, welcome.needle_count, _ = s.get("HHI")
        elif number == 2:
            welcome.limits = Limits(s.f64(), s.f64(), s.f64(), s.f64(), s.u32())

    r.sections(on_section)
    return welcome


@dataclass
class Topology:
    """Points at rest (n×3, mm), the first `surface_vertex_count` of them the surface's; triangles (m×3)."""
    hash: int
    surface_vertex_count: int
    triangles: npt.NDArray[np.uint32]
    rest: FloatArray
    name: str


def decode_topology(r: Reader) -> Topology:
    number, surface, points, triangles, _ = r.get("QIIII")
    faces = np.frombuffer(r.take(12 * triangles), "<u4").reshape(-1, 3)
    rest = r.floats(3 * points).reshape(-1, 3)
    topology = Topology(number, surface, faces, rest, r.text())
    r.sections(lambda number, section: None)
    return topology


@dataclass
class Forces:
    """Of the tissue on one needle; N, N·mm, frame W."""
    force_n: Array
    tip_torque_nmm: Array
    hub_torque_nmm: Array
    axial_n: float
    lateral_n: float
    cutting_n: float
    friction_n: float


def decode_forces(r: Reader) -> Forces:
    return Forces(r.vector(), r.vector(), r.vector(), r.f64(), r.f64(), r.f64(), r.f64())


@dataclass
class Needle:
    id: int
    contact: int
    present: bool
    landmark_count: int
    puncture_count: int
    insertion_depth_mm: float
    X_WN: Array
    forces: Optional[Forces] = None
    input_sequence: int = 0
    input_stamp_ns: int = 0
    tip_depth_mm: float = 0.0
    shape: Optional[FloatArray] = None  # of a needle that bends: points hub … tip, n×3


@dataclass
class Seed:
    id: int
    planned: int
    needle: int
    source: int
    is_certified: bool
    tick: int
    t_s: float
    air_kerma_strength_u: float
    dropped: Array
    dropped_axis: Array
    rest: Array
    rest_axis: Array
    gland_motion: Array
    position: Array
    axis: Array


@dataclass
class Certificate:
    verdict: int
    substeps: int
    det_bound: float
    vertex_det: float
    place: Array
    margin_mm: float
    held_mm: float
    held_n: float
    condition: float


@dataclass
class Frame:
    topology_hash: int
    tick: int
    sim_time_s: float
    snapshot_sequence: int
    base_tick: int
    overruns: int
    publish_ns: int
    input_sequence: int
    input_stamp_ns: int
    input_received_ns: int
    max_displacement_mm: float
    step_flags: int
    is_full: bool
    point_count: int
    moved_vertices: int
    needles: List[Needle]
    ranges: npt.NDArray[np.uint32]  # n×2: first, count
    positions: FloatArray           # of the ranges, in order; n×3
    seed_count: int = 0
    seeds: List[Seed] = field(default_factory=list)
    certificate: Optional[Certificate] = None


def decode_seed(r: Reader) -> Seed:
    number, planned, needle, source, flags, tick = r.get("IiHHIQ")
    return Seed(number, planned, needle, source, bool(flags & 1), tick, r.f64(), r.f64(),
                *[r.vector() for _ in range(7)])


def decode_frame(r: Reader) -> Frame:
    topology, tick = r.get("QQ")
    sim_time = r.f64()
    snapshot, base, overruns, publish, sequence, stamp, received = r.get("QQQQQQQ")
    displacement = r.f64()
    step_flags, frame_flags, points, moved, needle_count, _ = r.get("IIIIHH")
    needles = []
    for _ in range(needle_count):
        number, contact, present, landmarks, punctures = r.get("HBBII")
        needles.append(Needle(number, contact, present == 1, landmarks, punctures, r.f64(), r.pose()))
    ranges = np.frombuffer(r.take(8 * r.u32()), "<u4").reshape(-1, 2)
    moved_points = int(ranges[:, 1].sum(dtype=np.uint64))
    positions = r.floats(3 * moved_points).reshape(-1, 3)
    frame = Frame(topology, tick, sim_time, snapshot, base, overruns, publish, sequence, stamp, received, displacement,
                  step_flags, bool(frame_flags & 1), points, moved, needles, ranges, positions)
    by_id = {needle.id: needle for needle in needles}

    def on_section(number: int, s: Reader) -> None:
        if number == FrameSection.FORCE:
            count = s.u16()
            s.u16()
            for _ in range(count):
                of, _, _ = s.get("HHI")
                needle = by_id[of]
                needle.input_sequence, needle.input_stamp_ns = s.get("QQ")
                needle.forces = decode_forces(s)
                needle.tip_depth_mm = s.f64()
        elif number == FrameSection.SEEDS:
            frame.seed_count = s.u32()
            frame.seeds = [decode_seed(s) for _ in range(s.u32())]
        elif number == FrameSection.CERTIFICATE:
            verdict, _, _, substeps = s.get("BBHI")
            dets, place = (s.f64(), s.f64()), s.vector()
            frame.certificate = Certificate(verdict, substeps, *dets, place, s.f64(), s.f64(), s.f64(), s.f64())
        elif number == FrameSection.NEEDLE_SHAPES:
            count = s.u16()
            s.u16()
            for _ in range(count):
                of, points_of, _ = s.get("HHI")
                s.vector(6)
                by_id[of].shape = s.floats(3 * points_of).reshape(-1, 3)

    r.sections(on_section)
    return frame


@dataclass
class State:
    ticks: int
    overruns: int
    poses_accepted: int
    snapshots: int
    snapshots_sent: int
    snapshots_dropped: int
    clients: int
    viewers: int
    refusals: Dict[int, Tuple[int, str]]  # code → count and the last one's text
    device_holder: str
    kernel: str = ""
    support_radius_mm: float = 0.0
    control_flags: int = 0


def decode_state(r: Reader) -> State:
    ticks, overruns, _ = r.get("QQQ")
    for _ in range(3):
        r.take(40)
    accepted, snapshots, sent, dropped, clients, viewers, count, _ = r.get("QQQQIIHH")
    refusals = {}
    for _ in range(count):
        times = r.u64()
        code = r.u16()
        refusals[code] = (times, r.text())
    state = State(ticks, overruns, accepted, snapshots, sent, dropped, clients, viewers, refusals, r.text())

    def on_section(number: int, s: Reader) -> None:
        if number == 2:
            state.kernel, state.support_radius_mm, state.control_flags = s.text(), s.f64(), s.u32()

    r.sections(on_section)
    return state


@dataclass
class Event:
    kind: int
    needle: int
    tick: int
    text: str


def decode_event(r: Reader) -> Event:
    kind, needle, _, tick = r.get("HHIQ")
    return Event(kind, needle, tick, r.text())


@dataclass
class Error:
    code: int
    fatal: bool
    reason: int
    about_sequence: int
    text: str


def decode_error(r: Reader) -> Error:
    code, fatal, _, reason, _, about = r.get("HBBHHQ")
    return Error(code, fatal == 1, reason, about, r.text())


@dataclass
class Ping:
    nonce: int
    is_reply: bool
    echoed_stamp_ns: int
    received_ns: int

    def encode(self) -> bytes:
        return struct.pack("<QB7xQQ", self.nonce, self.is_reply, self.echoed_stamp_ns, self.received_ns)


def decode_ping(r: Reader) -> Ping:
    nonce, reply = r.get("QB")
    r.take(7)
    return Ping(nonce, reply == 1, *r.get("QQ"))


@dataclass
class Force:
    """What the hand is to get now."""
    needle: int
    flags: ForceFlag
    valid_ms: int
    tick: int
    input_sequence: int
    input_stamp_ns: int
    forces: Forces


def decode_force(r: Reader) -> Force:
    needle, flags, valid, _, tick, sequence, stamp = r.get("HHHHQQQ")
    return Force(needle, ForceFlag(flags & 31), valid, tick, sequence, stamp, decode_forces(r))


@dataclass
class LocalModel:
    """One needle's contact around one pose; brachyd.LocalForce evaluates it."""
    contact: int
    reference_tip: Array
    contact_point: Array
    axis: Array
    axial_stiffness_n_per_mm: float
    axial_min_n: float
    axial_max_n: float
    after_puncture_n: float
    lateral_n: Array
    lateral_stiffness_n_per_mm: float
    time_to_live_s: float
    needle: int = 0
    flags: ForceFlag = ForceFlag.ARMED
    tick: int = 0
    input_sequence: int = 0
    input_stamp_ns: int = 0
    max_force_n: float = 3.3
    max_stiffness_n_per_mm: float = math.inf
    max_slew_n_per_ms: float = 0.5
    ramp_s: float = 0.5


def decode_local_model(r: Reader) -> LocalModel:
    needle, flags, contact, _, tick, sequence, stamp = r.get("HHHHQQQ")
    return LocalModel(contact, r.vector(), r.vector(), r.vector(), r.f64(), r.f64(), r.f64(), r.f64(), r.vector(),
                      r.f64(), r.f64(), needle, ForceFlag(flags & 31), tick, sequence, stamp,
                      r.f64(), r.f64(), r.f64(), r.f64())


@dataclass
class StructureDose:
    name: str
    volume_cc: float
    mean_gy: float
    min_gy: float
    max_gy: float
    v100_percent: float
    v150_percent: float
    v200_percent: float
    v100_cc: float
    d90_gy: float
    d30_gy: float
    d10_gy: float
    d2cc_gy: float
    volume_share: FloatArray  # with at least 0, 1, 2, … % of the prescription


@dataclass
class Dose:
    seeds: int
    prescription_gy: float
    air_kerma_strength_u: float
    structures: List[StructureDose]
    surface_gy: Optional[FloatArray] = None


def decode_dose(r: Reader) -> Dose:
    seeds, count, _ = r.get("IHH")
    dose = Dose(seeds, r.f64(), r.f64(), [])
    for _ in range(count):
        structure = StructureDose(r.text(), r.f64(), r.f64(), r.f64(), r.f64(), r.f64(), r.f64(), r.f64(), r.f64(),
                                  r.f64(), r.f64(), r.f64(), r.f64(), r.floats(r.u16()))
        dose.structures.append(structure)

    def on_section(number: int, s: Reader) -> None:
        if number == 1:
            count = s.u32()
            s.u32()
            dose.surface_gy = s.floats(count)

    r.sections(on_section)
    return dose


@dataclass
class Structure:
    name: str
    vertices: FloatArray
    triangles: npt.NDArray[np.uint32]


@dataclass
class Scene:
    """What surrounds the tissue; a plan's needles are (tip, hole), its seeds (position, axis, needle)."""
    needle_length_mm: float
    needle_diameter_mm: float
    seed_length_mm: float
    seed_diameter_mm: float
    prescription_gy: float
    template_origin: Array
    template_spacing_mm: float
    template_columns: int
    template_rows: int
    planned_needles: List[Tuple[Array, str]]
    planned_seeds: List[Tuple[Array, Array, int]]
    structures: List[Structure]
    kernels: List[str]


def decode_scene(r: Reader) -> Scene:
    needle_length, needle_diameter, seed_length, seed_diameter, prescription = (r.f64() for _ in range(5))
    origin, spacing = r.vector(), r.f64()
    columns, rows, _, needle_count, seed_count = r.get("HHIII")
    needles = [(r.vector(), r.text()) for _ in range(needle_count)]
    seeds = []
    for _ in range(seed_count):
        position, axis = r.vector(), r.vector()
        seeds.append((position, axis, r.get("II")[0]))
    structures = []
    count, _ = r.get("HH")
    for _ in range(count):
        name = r.text()
        vertices, triangles = r.get("II")
        structures.append(Structure(name, r.floats(3 * vertices).reshape(-1, 3),
                                    np.frombuffer(r.take(12 * triangles), "<u4").reshape(-1, 3)))
    count, _ = r.get("HH")
    kernels = [r.text() for _ in range(count)]
    r.sections(lambda number, section: None)
    return Scene(needle_length, needle_diameter, seed_length, seed_diameter, prescription, origin, spacing, columns,
                 rows, needles, seeds, structures, kernels)


@dataclass
class Image:
    """An ultrasound image. `pixels`: height×width gray values (uint8), row 0 farthest from the probe. X_WI (4×4, mm)
    maps (column · spacing, row · spacing, 0) to the world W."""
    array: int
    flags: ImageFlag
    sequence: int
    tick: int
    newest_tick: int
    publish_ns: int
    spacing_mm: float
    X_WI: Array
    pixels: npt.NDArray[np.uint8]

    def place(self, column: npt.ArrayLike, row: npt.ArrayLike) -> Array:
        """Where pixels are in W, mm: …×3."""
        at = np.stack(np.broadcast_arrays(np.asarray(column, float), np.asarray(row, float)), axis=-1)
        return np.asarray(at @ (self.spacing_mm * self.X_WI[:3, :2].T) + self.X_WI[:3, 3], dtype=np.float64)


def inflated(data: bytes, size: int) -> bytes:
    """Exactly `size` bytes, of a server that is not trusted."""
    stream = zlib.decompressobj()
    try:
        out = stream.decompress(data, size + 1)
    except zlib.error as error:
        raise ProtocolError(f"an image's pixels are damaged: {error}") from error
    if len(out) != size or not stream.eof or stream.unused_data:
        raise ProtocolError("an image has not as many pixels as its size says")
    return out


def decode_image(r: Reader) -> Image:
    array, flags, width, height, sequence, tick, newest_tick, publish_ns = r.get("HHHHQQQQ")
    if max(width, height) > 4096:
        raise ProtocolError("an image is larger than 4096×4096 pixels")
    spacing_mm, X_WI = r.f64(), r.pose()
    data = bytes(r.take(r.u32()))
    r.sections(lambda number, section: None)
    if flags & ImageFlag.ZLIB:
        data = inflated(data, width * height)
    if len(data) != width * height:
        raise ProtocolError("an image has not as many pixels as its size says")
    pixels = np.frombuffer(data, np.uint8).reshape(height, width)
    return Image(array, ImageFlag(flags & 7), sequence, tick, newest_tick, publish_ns, spacing_mm, X_WI, pixels)


@dataclass
class Scanner:
    """What is set at the ultrasound scanner and the probe's stepper. In a request AS_IT_IS and NaN change nothing."""
    array: int = ScannerArray.AS_IT_IS
    freeze: int = ScannerFreeze.AS_IT_IS
    flags: int = 0
    tick: int = 0
    depth_mm: float = NOT_STATED
    gain_db: float = NOT_STATED
    dynamic_range_db: float = NOT_STATED
    tgc_extra_db_per_cm: float = NOT_STATED
    focus_mm: float = NOT_STATED
    probe_depth_mm: float = NOT_STATED
    probe_rotation_deg: float = NOT_STATED

    def encode(self) -> bytes:
        return struct.pack("<HHIQ7d", self.array, self.freeze, self.flags, self.tick, self.depth_mm, self.gain_db,
                           self.dynamic_range_db, self.tgc_extra_db_per_cm, self.focus_mm, self.probe_depth_mm,
                           self.probe_rotation_deg) + sections_bytes({})


def decode_scanner(r: Reader) -> Scanner:
    array, freeze, flags, tick = r.get("HHIQ")
    scanner = Scanner(array, freeze, flags, tick, *(r.f64() for _ in range(7)))
    r.sections(lambda number, section: None)
    return scanner


Message = Union[Welcome, Topology, Frame, State, Event, Error, Ping, Force, LocalModel, Dose, Scene, Image, Scanner]
DECODERS: Dict[int, Callable[[Reader], Message]] = {
    MessageType.WELCOME: decode_welcome, MessageType.TOPOLOGY: decode_topology, MessageType.FRAME: decode_frame,
    MessageType.STATE: decode_state, MessageType.EVENT: decode_event, MessageType.ERROR: decode_error,
    MessageType.PING: decode_ping, MessageType.FORCE: decode_force, MessageType.LOCAL_MODEL: decode_local_model,
    MessageType.DOSE: decode_dose, MessageType.SCENE: decode_scene,
    MessageType.IMAGE: decode_image, MessageType.SCANNER: decode_scanner}


def encode_pose(needle: int, X_WN: npt.ArrayLike) -> bytes:
    """X_WN: 4×4 or 3×4, needle to world, mm."""
    matrix = np.ascontiguousarray(np.asarray(X_WN, dtype="<f8")[:3, :4])
    if matrix.shape != (3, 4):
        raise ValueError("a pose is a 4×4 or 3×4 matrix")
    return struct.pack("<HHI", needle, 0, 0) + matrix.tobytes()


def encode_control(action: ControlAction, loop: bool = False, kernel: str = "",
                   support_radius_mm: float = NOT_STATED) -> bytes:
    return struct.pack("<HHId", action, int(loop), 0, support_radius_mm) + text_bytes(kernel) + sections_bytes({})
