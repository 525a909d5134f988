"""Codecs of all messages.

Written by scripts/ci/wire_clients.py from net/protocol.json, and not edited. Fields: net/PROTOCOL.md.
"""
from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any, ClassVar, Dict, List, Optional, Union

import numpy as np
import numpy.typing as npt

from . import wire_views as views
from .constants import (MessageType, ControlFlag, DeviceFlag, ForceFlag, FrameFlag, GoalFlag, HoleFlag, ImageFlag,
                        ImageRequestFlag, ImplausibleLimit, PlanFlag, PlanNeedleFlag, PlayFlag, ScannerFlag, SeedFlag,
                        Subscription)
from .wire_bytes import Array, FloatArray, IndexArray, Reader, Writer, boolean, checked, eye, zeros


@dataclass
class Quantiles:
    count: int = 0
    p50: float = 0.0
    p99: float = 0.0
    p999: float = 0.0
    max: float = 0.0

    @classmethod
    def read(cls, r: Reader) -> Quantiles:
        count, p50, p99, p999, max = r.get("Q4d")
        return cls(count, p50, p99, p999, max)

    def write(self, w: Writer) -> None:
        w.put("Q4d", self.count, self.p50, self.p99, self.p999, self.max)


@dataclass
class TickPose:
    tick: int = 0
    X_WN: Array = field(default_factory=eye)

    @classmethod
    def read(cls, r: Reader) -> TickPose:
        tick, = r.get("Q")
        X_WN = r.pose()
        return cls(tick, X_WN)

    def write(self, w: Writer) -> None:
        w.put("Q", self.tick)
        w.pose(self.X_WN)


@dataclass
class NeedlePoses:
    needle: int = 0
    poses: List[TickPose] = field(default_factory=list)

    @classmethod
    def read(cls, r: Reader) -> NeedlePoses:
        needle, count = r.get("H2xI")
        poses = [TickPose.read(r) for _ in range(r.fits(count, 104))]
        return cls(needle, poses)

    def write(self, w: Writer) -> None:
        w.put("H2xI", self.needle, len(self.poses))
        w.each(self.poses)


@dataclass
class Button:
    needle: int = 0
    count: int = 0
    first_tick: int = 0

    @classmethod
    def read(cls, r: Reader) -> Button:
        needle, count, first_tick = r.get("H2xIQ")
        return cls(needle, count, first_tick)

    def write(self, w: Writer) -> None:
        w.put("H2xIQ", self.needle, self.count, self.first_tick)


@dataclass
class Refusal:
    count: int = 0
    code: int = 0
    text: str = ""

    @classmethod
    def read(cls, r: Reader) -> Refusal:
        count, code = r.get("QH")
        text = r.text()
        return cls(count, code, text)

    def write(self, w: Writer) -> None:
        w.put("QH", self.count, self.code)
        w.text(self.text)


@dataclass
class SafetyCount:
    needle: int = 0
    code: int = 0
    count: int = 0
    text: str = ""

    @classmethod
    def read(cls, r: Reader) -> SafetyCount:
        needle, code, count = r.get("2HQ")
        text = r.text()
        return cls(needle, code, count, text)

    def write(self, w: Writer) -> None:
        w.put("2HQ", self.needle, self.code, self.count)
        w.text(self.text)


@dataclass
class DoseGoal:
    structure: str = ""
    figure: str = ""
    limit: float = 0.0
    flags: GoalFlag = GoalFlag(0)
    source: str = ""

    @classmethod
    def read(cls, r: Reader) -> DoseGoal:
        structure = r.text()
        figure = r.text()
        limit, flags = r.get("dH")
        source = r.text()
        return cls(structure, figure, limit, GoalFlag(flags), source)

    def write(self, w: Writer) -> None:
        w.text(self.structure)
        w.text(self.figure)
        w.put("dH", self.limit, self.flags)
        w.text(self.source)


@dataclass
class PlanNeedle:
    number: int = 0
    flags: PlanNeedleFlag = PlanNeedleFlag(0)
    first_seed: int = 0
    depth_mm: float = 0.0
    hole: str = ""
    train: str = ""

    @classmethod
    def read(cls, r: Reader) -> PlanNeedle:
        number, flags, first_seed, depth_mm = r.get("2HId")
        hole = r.text()
        train = r.text()
        return cls(number, PlanNeedleFlag(flags), first_seed, depth_mm, hole, train)

    def write(self, w: Writer) -> None:
        w.put("2HId", self.number, self.flags, self.first_seed, self.depth_mm)
        w.text(self.hole)
        w.text(self.train)


@dataclass
class StructureColour:
    name: str = ""
    red: int = 0
    green: int = 0
    blue: int = 0

    @classmethod
    def read(cls, r: Reader) -> StructureColour:
        name = r.text()
        red, green, blue = r.get("3B1x")
        return cls(name, red, green, blue)

    def write(self, w: Writer) -> None:
        w.text(self.name)
        w.put("3B1x", self.red, self.green, self.blue)


@dataclass
class ContourSlice:
    slice: int = 0
    tick: int = 0
    probe_depth_mm: float = math.nan
    X_WI: Array = field(default_factory=eye)
    points: Array = field(default_factory=lambda: zeros(np.float64, 0, 2))

    @classmethod
    def read(cls, r: Reader) -> ContourSlice:
        slice, point_count, tick, probe_depth_mm = r.get("iIQd")
        X_WI = r.pose()
        points = r.rows(np.float64, point_count, 2)
        return cls(slice, tick, probe_depth_mm, X_WI, points)

    def write(self, w: Writer) -> None:
        w.put("iIQd", self.slice, len(self.points), self.tick, self.probe_depth_mm)
        w.pose(self.X_WI)
        w.array(self.points, np.float64, 2)


@dataclass
class SliceScore:
    slice: int = 0
    offset_mm: float = 0.0
    outlined_mm2: float = 0.0
    true_mm2: float = 0.0
    dice: float = 0.0
    hausdorff_mm: float = 0.0

    @classmethod
    def read(cls, r: Reader) -> SliceScore:
        slice, offset_mm, outlined_mm2, true_mm2, dice, hausdorff_mm = r.get("i4x5d")
        return cls(slice, offset_mm, outlined_mm2, true_mm2, dice, hausdorff_mm)

    def write(self, w: Writer) -> None:
        w.put("i4x5d", self.slice, self.offset_mm, self.outlined_mm2, self.true_mm2, self.dice, self.hausdorff_mm)


@dataclass
class PlannedNeedle:
    tip: Array = field(default_factory=lambda: zeros(np.float64, 3))
    hole: str = ""

    @classmethod
    def read(cls, r: Reader) -> PlannedNeedle:
        tip = r.numbers(np.float64, 3)
        hole = r.text()
        return cls(tip, hole)

    def write(self, w: Writer) -> None:
        w.array(self.tip, np.float64, 3)
        w.text(self.hole)


@dataclass
class PlannedSeed:
    position: Array = field(default_factory=lambda: zeros(np.float64, 3))
    axis: Array = field(default_factory=lambda: zeros(np.float64, 3))
    needle: int = 0

    @classmethod
    def read(cls, r: Reader) -> PlannedSeed:
        position = r.numbers(np.float64, 3)
        axis = r.numbers(np.float64, 3)
        needle, = r.get("I4x")
        return cls(position, axis, needle)

    def write(self, w: Writer) -> None:
        w.array(self.position, np.float64, 3)
        w.array(self.axis, np.float64, 3)
        w.put("I4x", self.needle)


@dataclass
class SceneStructure:
    name: str = ""
    vertices: FloatArray = field(default_factory=lambda: zeros(np.float32, 0, 3))
    triangles: IndexArray = field(default_factory=lambda: zeros(np.uint32, 0, 3))

    @classmethod
    def read(cls, r: Reader) -> SceneStructure:
        name = r.text()
        vertex_count, triangle_count = r.get("2I")
        vertices = r.rows(np.float32, vertex_count, 3)
        triangles = r.rows(np.uint32, triangle_count, 3)
        return cls(name, vertices, triangles)

    def write(self, w: Writer) -> None:
        w.text(self.name)
        w.put("2I", len(self.vertices), len(self.triangles))
        w.array(self.vertices, np.float32, 3)
        w.array(self.triangles, np.uint32, 3)


@dataclass
class Forces:
    force_n: Array = field(default_factory=lambda: zeros(np.float64, 3))
    tip_torque_nmm: Array = field(default_factory=lambda: zeros(np.float64, 3))
    hub_torque_nmm: Array = field(default_factory=lambda: zeros(np.float64, 3))
    axial_n: float = 0.0
    lateral_n: float = 0.0
    cutting_n: float = 0.0
    friction_n: float = 0.0

    @classmethod
    def read(cls, r: Reader) -> Forces:
        force_n = r.numbers(np.float64, 3)
        tip_torque_nmm = r.numbers(np.float64, 3)
        hub_torque_nmm = r.numbers(np.float64, 3)
        axial_n, lateral_n, cutting_n, friction_n = r.get("4d")
        return cls(force_n, tip_torque_nmm, hub_torque_nmm, axial_n, lateral_n, cutting_n, friction_n)

    def write(self, w: Writer) -> None:
        w.array(self.force_n, np.float64, 3)
        w.array(self.tip_torque_nmm, np.float64, 3)
        w.array(self.hub_torque_nmm, np.float64, 3)
        w.put("4d", self.axial_n, self.lateral_n, self.cutting_n, self.friction_n)


@dataclass
class Needle(views.NeedleView):
    id: int = 0
    contact: int = 0
    present: bool = False
    landmark_count: int = 0
    puncture_count: int = 0
    insertion_depth_mm: float = 0.0
    X_WN: Array = field(default_factory=eye)

    @classmethod
    def read(cls, r: Reader) -> Needle:
        id, contact, present, landmark_count, puncture_count, insertion_depth_mm = r.get("H2B2Id")
        X_WN = r.pose()
        return cls(id, contact, boolean(present), landmark_count, puncture_count, insertion_depth_mm, X_WN)

    def write(self, w: Writer) -> None:
        w.put("H2B2Id", self.id, self.contact, self.present, self.landmark_count, self.puncture_count,
              self.insertion_depth_mm)
        w.pose(self.X_WN)


@dataclass
class NeedleForce:
    needle: int = 0
    input_sequence: int = 0
    input_stamp_ns: int = 0
    forces: Forces = field(default_factory=lambda: Forces())
    tip_depth_mm: float = 0.0

    @classmethod
    def read(cls, r: Reader) -> NeedleForce:
        needle, input_sequence, input_stamp_ns = r.get("H6x2Q")
        forces = Forces.read(r)
        tip_depth_mm, = r.get("d")
        return cls(needle, input_sequence, input_stamp_ns, forces, tip_depth_mm)

    def write(self, w: Writer) -> None:
        w.put("H6x2Q", self.needle, self.input_sequence, self.input_stamp_ns)
        self.forces.write(w)
        w.put("d", self.tip_depth_mm)


@dataclass
class Seed(views.SeedView):
    id: int = 0
    planned: int = 0
    needle: int = 0
    source: int = 0
    flags: SeedFlag = SeedFlag(0)
    tick: int = 0
    t_s: float = 0.0
    air_kerma_strength_u: float = 0.0
    dropped: Array = field(default_factory=lambda: zeros(np.float64, 3))
    dropped_axis: Array = field(default_factory=lambda: zeros(np.float64, 3))
    rest: Array = field(default_factory=lambda: zeros(np.float64, 3))
    rest_axis: Array = field(default_factory=lambda: zeros(np.float64, 3))
    gland_motion: Array = field(default_factory=lambda: zeros(np.float64, 3))
    position: Array = field(default_factory=lambda: zeros(np.float64, 3))
    axis: Array = field(default_factory=lambda: zeros(np.float64, 3))

    @classmethod
    def read(cls, r: Reader) -> Seed:
        id, planned, needle, source, flags, tick, t_s, air_kerma_strength_u = r.get("Ii2HIQ2d")
        dropped = r.numbers(np.float64, 3)
        dropped_axis = r.numbers(np.float64, 3)
        rest = r.numbers(np.float64, 3)
        rest_axis = r.numbers(np.float64, 3)
        gland_motion = r.numbers(np.float64, 3)
        position = r.numbers(np.float64, 3)
        axis = r.numbers(np.float64, 3)
        return cls(id, planned, needle, source, SeedFlag(flags), tick, t_s, air_kerma_strength_u, dropped,
                   dropped_axis, rest, rest_axis, gland_motion, position, axis)

    def write(self, w: Writer) -> None:
        w.put("Ii2HIQ2d", self.id, self.planned, self.needle, self.source, self.flags, self.tick, self.t_s,
              self.air_kerma_strength_u)
        w.array(self.dropped, np.float64, 3)
        w.array(self.dropped_axis, np.float64, 3)
        w.array(self.rest, np.float64, 3)
        w.array(self.rest_axis, np.float64, 3)
        w.array(self.gland_motion, np.float64, 3)
        w.array(self.position, np.float64, 3)
        w.array(self.axis, np.float64, 3)


@dataclass
class NeedleShape:
    needle: int = 0
    tip_axis: Array = field(default_factory=lambda: zeros(np.float64, 3))
    tip_deflection: Array = field(default_factory=lambda: zeros(np.float64, 3))
    points: FloatArray = field(default_factory=lambda: zeros(np.float32, 0, 3))

    @classmethod
    def read(cls, r: Reader) -> NeedleShape:
        needle, point_count = r.get("2H4x")
        checked(point_count, 2, math.inf, "NeedleShape", "point_count")
        tip_axis = r.numbers(np.float64, 3)
        tip_deflection = r.numbers(np.float64, 3)
        points = r.rows(np.float32, point_count, 3)
        return cls(needle, tip_axis, tip_deflection, points)

    def write(self, w: Writer) -> None:
        w.put("2H4x", self.needle, len(self.points))
        w.array(self.tip_axis, np.float64, 3)
        w.array(self.tip_deflection, np.float64, 3)
        w.array(self.points, np.float32, 3)


@dataclass
class StructureDose:
    name: str = ""
    volume_cc: float = 0.0
    mean_gy: float = 0.0
    min_gy: float = 0.0
    max_gy: float = 0.0
    v100_percent: float = 0.0
    v150_percent: float = 0.0
    v200_percent: float = 0.0
    v100_cc: float = 0.0
    d90_gy: float = 0.0
    d30_gy: float = 0.0
    d10_gy: float = 0.0
    d2cc_gy: float = 0.0
    volume_share: FloatArray = field(default_factory=lambda: zeros(np.float32, 0))

    @classmethod
    def read(cls, r: Reader) -> StructureDose:
        name = r.text()
        (volume_cc, mean_gy, min_gy, max_gy, v100_percent, v150_percent, v200_percent, v100_cc, d90_gy, d30_gy,
         d10_gy, d2cc_gy, bin_count) = r.get("12dH")
        volume_share = r.numbers(np.float32, bin_count)
        return cls(name, volume_cc, mean_gy, min_gy, max_gy, v100_percent, v150_percent, v200_percent, v100_cc,
                   d90_gy, d30_gy, d10_gy, d2cc_gy, volume_share)

    def write(self, w: Writer) -> None:
        w.text(self.name)
        w.put("12dH", self.volume_cc, self.mean_gy, self.min_gy, self.max_gy, self.v100_percent, self.v150_percent,
              self.v200_percent, self.v100_cc, self.d90_gy, self.d30_gy, self.d10_gy, self.d2cc_gy,
              len(self.volume_share))
        w.array(self.volume_share, np.float32, 1)


@dataclass
class HelloDevice:
    needle: int = 0
    flags: DeviceFlag = DeviceFlag(0)

    @classmethod
    def read(cls, r: Reader) -> HelloDevice:
        needle, flags = r.get("2H4x")
        return cls(needle, DeviceFlag(flags))

    def write(self, w: Writer) -> None:
        w.put("2H4x", self.needle, self.flags)


@dataclass
class HelloToken:
    token: bytes = bytes(32)

    @classmethod
    def read(cls, r: Reader) -> HelloToken:
        token = bytes(r.take(32))
        return cls(token)

    def write(self, w: Writer) -> None:
        w.raw(self.token, 32)


@dataclass
class HelloSoftware:
    software: str = ""

    @classmethod
    def read(cls, r: Reader) -> HelloSoftware:
        software = r.text()
        return cls(software)

    def write(self, w: Writer) -> None:
        w.text(self.software)


@dataclass
class HelloImages:
    flags: ImageRequestFlag = ImageRequestFlag(0)

    @classmethod
    def read(cls, r: Reader) -> HelloImages:
        flags, = r.get("H6x")
        return cls(ImageRequestFlag(flags))

    def write(self, w: Writer) -> None:
        w.put("H6x", self.flags)


@dataclass
class HelloSections:
    device: Optional[HelloDevice] = None
    token: Optional[HelloToken] = None
    software: Optional[HelloSoftware] = None
    images: Optional[HelloImages] = None

    @classmethod
    def read(cls, r: Reader) -> HelloSections:
        made = cls()
        for number, s in r.sections():
            if number == 1:
                made.device = HelloDevice.read(s)
            elif number == 2:
                made.token = HelloToken.read(s)
            elif number == 3:
                made.software = HelloSoftware.read(s)
            elif number == 4:
                made.images = HelloImages.read(s)
            else:
                continue
            s.finish()
        return made

    def write(self, w: Writer) -> None:
        w.sections([(1, self.device), (2, self.token), (3, self.software), (4, self.images)])


@dataclass
class Hello:
    TYPE: ClassVar[MessageType] = MessageType.HELLO
    role: int = 0
    subscription: Subscription = Subscription(0)
    max_force_n: float = math.nan
    max_stiffness_n_per_mm: float = math.nan
    damping_n_s_per_mm: float = math.nan
    rate_hz: float = math.nan
    name: str = ""
    sections: HelloSections = field(default_factory=lambda: HelloSections())

    @classmethod
    def read(cls, r: Reader) -> Hello:
        role, subscription, max_force_n, max_stiffness_n_per_mm, damping_n_s_per_mm, rate_hz = r.get("H2xI4d")
        name = r.text()
        sections = HelloSections.read(r)
        return cls(role, Subscription(subscription), max_force_n, max_stiffness_n_per_mm, damping_n_s_per_mm, rate_hz,
                   name, sections)

    def write(self, w: Writer) -> None:
        w.put("H2xI4d", self.role, self.subscription, self.max_force_n, self.max_stiffness_n_per_mm,
              self.damping_n_s_per_mm, self.rate_hz)
        w.text(self.name)
        self.sections.write(w)

    def encode(self) -> bytes:
        w = Writer()
        self.write(w)
        return bytes(w.data)


@dataclass
class WelcomeDevice:
    needle: int = 0
    needle_count: int = 0

    @classmethod
    def read(cls, r: Reader) -> WelcomeDevice:
        needle, needle_count = r.get("2H4x")
        return cls(needle, needle_count)

    def write(self, w: Writer) -> None:
        w.put("2H4x", self.needle, self.needle_count)


@dataclass
class WelcomeLimits:
    max_force_n: float = 0.0
    max_stiffness_n_per_mm: float = 0.0
    damping_n_s_per_mm: float = 0.0
    rate_hz: float = 0.0
    not_plausible: ImplausibleLimit = ImplausibleLimit(0)

    @classmethod
    def read(cls, r: Reader) -> WelcomeLimits:
        max_force_n, max_stiffness_n_per_mm, damping_n_s_per_mm, rate_hz, not_plausible = r.get("4dI4x")
        return cls(max_force_n, max_stiffness_n_per_mm, damping_n_s_per_mm, rate_hz, ImplausibleLimit(not_plausible))

    def write(self, w: Writer) -> None:
        w.put("4dI4x", self.max_force_n, self.max_stiffness_n_per_mm, self.damping_n_s_per_mm, self.rate_hz,
              self.not_plausible)


@dataclass
class WelcomeSections:
    device: Optional[WelcomeDevice] = None
    limits: Optional[WelcomeLimits] = None

    @classmethod
    def read(cls, r: Reader) -> WelcomeSections:
        made = cls()
        for number, s in r.sections():
            if number == 1:
                made.device = WelcomeDevice.read(s)
            elif number == 2:
                made.limits = WelcomeLimits.read(s)
            else:
                continue
            s.finish()
        return made

    def write(self, w: Writer) -> None:
        w.sections([(1, self.device), (2, self.limits)])


@dataclass
class Welcome(views.WelcomeView):
    TYPE: ClassVar[MessageType] = MessageType.WELCOME
    session: int = 0
    role: int = 0
    subscription: Subscription = Subscription(0)
    deformation_hz: float = 0.0
    snapshot_hz: float = 0.0
    max_message_bytes: int = 0
    max_poses_per_s: int = 0
    topology_hash: int = 0
    server: str = ""
    units: str = ""
    frame: str = ""
    sections: WelcomeSections = field(default_factory=lambda: WelcomeSections())

    @classmethod
    def read(cls, r: Reader) -> Welcome:
        (session, role, subscription, deformation_hz, snapshot_hz, max_message_bytes, max_poses_per_s,
         topology_hash) = r.get("QH2xI2d2IQ")
        server = r.text()
        units = r.text()
        frame = r.text()
        sections = WelcomeSections.read(r)
        return cls(session, role, Subscription(subscription), deformation_hz, snapshot_hz, max_message_bytes,
                   max_poses_per_s, topology_hash, server, units, frame, sections)

    def write(self, w: Writer) -> None:
        w.put("QH2xI2d2IQ", self.session, self.role, self.subscription, self.deformation_hz, self.snapshot_hz,
              self.max_message_bytes, self.max_poses_per_s, self.topology_hash)
        w.text(self.server)
        w.text(self.units)
        w.text(self.frame)
        self.sections.write(w)

    def encode(self) -> bytes:
        w = Writer()
        self.write(w)
        return bytes(w.data)


@dataclass
class Topology(views.TopologyView):
    TYPE: ClassVar[MessageType] = MessageType.TOPOLOGY
    hash: int = 0
    surface_vertex_count: int = 0
    triangles: IndexArray = field(default_factory=lambda: zeros(np.uint32, 0, 3))
    rest_positions: FloatArray = field(default_factory=lambda: zeros(np.float32, 0, 3))
    name: str = ""

    @classmethod
    def read(cls, r: Reader) -> Topology:
        hash, surface_vertex_count, point_count, triangle_count = r.get("Q3I4x")
        triangles = r.rows(np.uint32, triangle_count, 3)
        rest_positions = r.rows(np.float32, point_count, 3)
        name = r.text()
        r.skip_sections()
        return cls(hash, surface_vertex_count, triangles, rest_positions, name)

    def write(self, w: Writer) -> None:
        w.put("Q3I4x", self.hash, self.surface_vertex_count, len(self.rest_positions), len(self.triangles))
        w.array(self.triangles, np.uint32, 3)
        w.array(self.rest_positions, np.float32, 3)
        w.text(self.name)
        w.sections([])

    def encode(self) -> bytes:
        w = Writer()
        self.write(w)
        return bytes(w.data)


@dataclass
class FrameForce:
    entries: List[NeedleForce] = field(default_factory=list)

    @classmethod
    def read(cls, r: Reader) -> FrameForce:
        count, = r.get("H2x")
        entries = [NeedleForce.read(r) for _ in range(r.fits(count, 136))]
        return cls(entries)

    def write(self, w: Writer) -> None:
        w.put("H2x", len(self.entries))
        w.each(self.entries)


@dataclass
class FrameSeeds:
    seed_count: int = 0
    entries: List[Seed] = field(default_factory=list)

    @classmethod
    def read(cls, r: Reader) -> FrameSeeds:
        seed_count, count = r.get("2I")
        entries = [Seed.read(r) for _ in range(r.fits(count, 208))]
        return cls(seed_count, entries)

    def write(self, w: Writer) -> None:
        w.put("2I", self.seed_count, len(self.entries))
        w.each(self.entries)


@dataclass
class FrameCertificate:
    verdict: int = 0
    substeps: int = 0
    det_bound: float = 0.0
    vertex_det: float = 0.0
    place: Array = field(default_factory=lambda: zeros(np.float64, 3))
    margin_mm: float = 0.0
    held_mm: float = 0.0
    held_n: float = 0.0
    condition: float = 0.0

    @classmethod
    def read(cls, r: Reader) -> FrameCertificate:
        verdict, substeps, det_bound, vertex_det = r.get("B3xI2d")
        place = r.numbers(np.float64, 3)
        margin_mm, held_mm, held_n, condition = r.get("4d")
        return cls(verdict, substeps, det_bound, vertex_det, place, margin_mm, held_mm, held_n, condition)

    def write(self, w: Writer) -> None:
        w.put("B3xI2d", self.verdict, self.substeps, self.det_bound, self.vertex_det)
        w.array(self.place, np.float64, 3)
        w.put("4d", self.margin_mm, self.held_mm, self.held_n, self.condition)


@dataclass
class FramePoseHistory:
    entries: List[TickPose] = field(default_factory=list)

    @classmethod
    def read(cls, r: Reader) -> FramePoseHistory:
        count, = r.get("I")
        entries = [TickPose.read(r) for _ in range(r.fits(count, 104))]
        return cls(entries)

    def write(self, w: Writer) -> None:
        w.put("I", len(self.entries))
        w.each(self.entries)


@dataclass
class FramePosesOfNeedles:
    needles: List[NeedlePoses] = field(default_factory=list)

    @classmethod
    def read(cls, r: Reader) -> FramePosesOfNeedles:
        needle_count, = r.get("H2x")
        needles = [NeedlePoses.read(r) for _ in range(r.fits(needle_count, 8))]
        return cls(needles)

    def write(self, w: Writer) -> None:
        w.put("H2x", len(self.needles))
        w.each(self.needles)


@dataclass
class FrameButtons:
    entries: List[Button] = field(default_factory=list)

    @classmethod
    def read(cls, r: Reader) -> FrameButtons:
        count, = r.get("I")
        entries = [Button.read(r) for _ in range(r.fits(count, 16))]
        return cls(entries)

    def write(self, w: Writer) -> None:
        w.put("I", len(self.entries))
        w.each(self.entries)


@dataclass
class FrameNeedleShapes:
    entries: List[NeedleShape] = field(default_factory=list)

    @classmethod
    def read(cls, r: Reader) -> FrameNeedleShapes:
        count, = r.get("H2x")
        entries = [NeedleShape.read(r) for _ in range(r.fits(count, 56))]
        return cls(entries)

    def write(self, w: Writer) -> None:
        w.put("H2x", len(self.entries))
        w.each(self.entries)


@dataclass
class FrameLag:
    lag_mm: float = 0.0

    @classmethod
    def read(cls, r: Reader) -> FrameLag:
        lag_mm, = r.get("f")
        return cls(lag_mm)

    def write(self, w: Writer) -> None:
        w.put("f", self.lag_mm)


@dataclass
class FrameSections:
    force: Optional[FrameForce] = None
    seeds: Optional[FrameSeeds] = None
    certificate: Optional[FrameCertificate] = None
    pose_history: Optional[FramePoseHistory] = None
    poses_of_needles: Optional[FramePosesOfNeedles] = None
    buttons: Optional[FrameButtons] = None
    needle_shapes: Optional[FrameNeedleShapes] = None
    lag: Optional[FrameLag] = None

    @classmethod
    def read(cls, r: Reader) -> FrameSections:
        made = cls()
        for number, s in r.sections():
            if number == 1:
                made.force = FrameForce.read(s)
            elif number == 2:
                made.seeds = FrameSeeds.read(s)
            elif number == 3:
                made.certificate = FrameCertificate.read(s)
            elif number == 4:
                made.pose_history = FramePoseHistory.read(s)
            elif number == 5:
                made.poses_of_needles = FramePosesOfNeedles.read(s)
            elif number == 6:
                made.buttons = FrameButtons.read(s)
            elif number == 7:
                made.needle_shapes = FrameNeedleShapes.read(s)
            elif number == 8:
                made.lag = FrameLag.read(s)
            else:
                continue
            s.finish()
        return made

    def write(self, w: Writer) -> None:
        w.sections([(1, self.force), (2, self.seeds), (3, self.certificate), (4, self.pose_history),
                    (5, self.poses_of_needles), (6, self.buttons), (7, self.needle_shapes), (8, self.lag)])


@dataclass
class Frame(views.FrameView):
    TYPE: ClassVar[MessageType] = MessageType.FRAME
    topology_hash: int = 0
    tick: int = 0
    sim_time_s: float = 0.0
    snapshot_sequence: int = 0
    base_tick: int = 0
    overruns: int = 0
    publish_ns: int = 0
    input_sequence: int = 0
    input_stamp_ns: int = 0
    input_received_ns: int = 0
    max_displacement_mm: float = 0.0
    step_flags: int = 0
    frame_flags: FrameFlag = FrameFlag(0)
    point_count: int = 0
    moved_vertices: int = 0
    needles: List[Needle] = field(default_factory=list)
    ranges: IndexArray = field(default_factory=lambda: zeros(np.uint32, 0, 2))
    positions: FloatArray = field(default_factory=lambda: zeros(np.float32, 0, 3))
    sections: FrameSections = field(default_factory=lambda: FrameSections())

    @classmethod
    def read(cls, r: Reader) -> Frame:
        (topology_hash, tick, sim_time_s, snapshot_sequence, base_tick, overruns, publish_ns, input_sequence,
         input_stamp_ns, input_received_ns, max_displacement_mm, step_flags, frame_flags, point_count, moved_vertices,
         needle_count) = r.get("2Qd7Qd4IH2x")
        needles = [Needle.read(r) for _ in range(r.fits(needle_count, 116))]
        range_count, = r.get("I")
        ranges = r.rows(np.uint32, range_count, 2)
        positions = r.rows(np.float32, int(ranges[:, 1].sum(dtype=np.uint64)), 3)
        sections = FrameSections.read(r)
        made = cls(topology_hash, tick, sim_time_s, snapshot_sequence, base_tick, overruns, publish_ns,
                   input_sequence, input_stamp_ns, input_received_ns, max_displacement_mm, step_flags,
                   FrameFlag(frame_flags), point_count, moved_vertices, needles, ranges, positions, sections)
        made.after_read()
        return made

    def write(self, w: Writer) -> None:
        w.put("2Qd7Qd4IH2x", self.topology_hash, self.tick, self.sim_time_s, self.snapshot_sequence, self.base_tick,
              self.overruns, self.publish_ns, self.input_sequence, self.input_stamp_ns, self.input_received_ns,
              self.max_displacement_mm, self.step_flags, self.frame_flags, self.point_count, self.moved_vertices,
              len(self.needles))
        w.each(self.needles)
        w.put("I", len(self.ranges))
        w.array(self.ranges, np.uint32, 2)
        w.array(self.positions, np.float32, 3)
        self.sections.write(w)

    def encode(self) -> bytes:
        w = Writer()
        self.write(w)
        return bytes(w.data)


@dataclass
class Pose:
    TYPE: ClassVar[MessageType] = MessageType.POSE
    needle: int = 0
    flags: int = 0
    X_WN: Array = field(default_factory=eye)

    @classmethod
    def read(cls, r: Reader) -> Pose:
        needle, flags = r.get("2H4x")
        X_WN = r.pose()
        return cls(needle, flags, X_WN)

    def write(self, w: Writer) -> None:
        w.put("2H4x", self.needle, self.flags)
        w.pose(self.X_WN)

    def encode(self) -> bytes:
        w = Writer()
        self.write(w)
        return bytes(w.data)


@dataclass
class StateSafety:
    entries: List[SafetyCount] = field(default_factory=list)

    @classmethod
    def read(cls, r: Reader) -> StateSafety:
        count, = r.get("H2x")
        entries = [SafetyCount.read(r) for _ in range(r.fits(count, 14))]
        return cls(entries)

    def write(self, w: Writer) -> None:
        w.put("H2x", len(self.entries))
        w.each(self.entries)


@dataclass
class StateControls:
    kernel: str = ""
    support_radius_mm: float = 0.0
    flags: ControlFlag = ControlFlag(0)

    @classmethod
    def read(cls, r: Reader) -> StateControls:
        kernel = r.text()
        support_radius_mm, flags = r.get("dI")
        return cls(kernel, support_radius_mm, ControlFlag(flags))

    def write(self, w: Writer) -> None:
        w.text(self.kernel)
        w.put("dI", self.support_radius_mm, self.flags)


@dataclass
class StateDrops:
    events_dropped: int = 0

    @classmethod
    def read(cls, r: Reader) -> StateDrops:
        events_dropped, = r.get("Q")
        return cls(events_dropped)

    def write(self, w: Writer) -> None:
        w.put("Q", self.events_dropped)


@dataclass
class StateSections:
    safety: Optional[StateSafety] = None
    controls: Optional[StateControls] = None
    drops: Optional[StateDrops] = None

    @classmethod
    def read(cls, r: Reader) -> StateSections:
        made = cls()
        for number, s in r.sections():
            if number == 1:
                made.safety = StateSafety.read(s)
            elif number == 2:
                made.controls = StateControls.read(s)
            elif number == 3:
                made.drops = StateDrops.read(s)
            else:
                continue
            s.finish()
        return made

    def write(self, w: Writer) -> None:
        w.sections([(1, self.safety), (2, self.controls), (3, self.drops)])


@dataclass
class State(views.StateView):
    TYPE: ClassVar[MessageType] = MessageType.STATE
    ticks: int = 0
    overruns: int = 0
    control_overruns: int = 0
    tick_ms: Quantiles = field(default_factory=lambda: Quantiles())
    lateness_ms: Quantiles = field(default_factory=lambda: Quantiles())
    latency_ms: Quantiles = field(default_factory=lambda: Quantiles())
    poses_accepted: int = 0
    snapshots: int = 0
    snapshots_sent: int = 0
    snapshots_dropped: int = 0
    clients: int = 0
    viewers: int = 0
    refusals: List[Refusal] = field(default_factory=list)
    device_holder: str = ""
    sections: StateSections = field(default_factory=lambda: StateSections())

    @classmethod
    def read(cls, r: Reader) -> State:
        ticks, overruns, control_overruns = r.get("3Q")
        tick_ms = Quantiles.read(r)
        lateness_ms = Quantiles.read(r)
        latency_ms = Quantiles.read(r)
        (poses_accepted, snapshots, snapshots_sent, snapshots_dropped, clients, viewers,
         refusal_count) = r.get("4Q2IH2x")
        refusals = [Refusal.read(r) for _ in range(r.fits(refusal_count, 12))]
        device_holder = r.text()
        sections = StateSections.read(r)
        return cls(ticks, overruns, control_overruns, tick_ms, lateness_ms, latency_ms, poses_accepted, snapshots,
                   snapshots_sent, snapshots_dropped, clients, viewers, refusals, device_holder, sections)

    def write(self, w: Writer) -> None:
        w.put("3Q", self.ticks, self.overruns, self.control_overruns)
        self.tick_ms.write(w)
        self.lateness_ms.write(w)
        self.latency_ms.write(w)
        w.put("4Q2IH2x", self.poses_accepted, self.snapshots, self.snapshots_sent, self.snapshots_dropped,
              self.clients, self.viewers, len(self.refusals))
        w.each(self.refusals)
        w.text(self.device_holder)
        self.sections.write(w)

    def encode(self) -> bytes:
        w = Writer()
        self.write(w)
        return bytes(w.data)


@dataclass
class Event:
    TYPE: ClassVar[MessageType] = MessageType.EVENT
    kind: int = 0
    needle: int = 0
    tick: int = 0
    text: str = ""

    @classmethod
    def read(cls, r: Reader) -> Event:
        kind, needle, tick = r.get("2H4xQ")
        text = r.text()
        return cls(kind, needle, tick, text)

    def write(self, w: Writer) -> None:
        w.put("2H4xQ", self.kind, self.needle, self.tick)
        w.text(self.text)

    def encode(self) -> bytes:
        w = Writer()
        self.write(w)
        return bytes(w.data)


@dataclass
class Error:
    TYPE: ClassVar[MessageType] = MessageType.ERROR
    code: int = 0
    fatal: bool = False
    reason: int = 0
    about_sequence: int = 0
    text: str = ""

    @classmethod
    def read(cls, r: Reader) -> Error:
        code, fatal, reason, about_sequence = r.get("HB1xH2xQ")
        text = r.text()
        return cls(code, boolean(fatal), reason, about_sequence, text)

    def write(self, w: Writer) -> None:
        w.put("HB1xH2xQ", self.code, self.fatal, self.reason, self.about_sequence)
        w.text(self.text)

    def encode(self) -> bytes:
        w = Writer()
        self.write(w)
        return bytes(w.data)


@dataclass
class Ping:
    TYPE: ClassVar[MessageType] = MessageType.PING
    nonce: int = 0
    reply: bool = False
    echoed_stamp_ns: int = 0
    received_ns: int = 0

    @classmethod
    def read(cls, r: Reader) -> Ping:
        nonce, reply, echoed_stamp_ns, received_ns = r.get("QB7x2Q")
        return cls(nonce, boolean(reply), echoed_stamp_ns, received_ns)

    def write(self, w: Writer) -> None:
        w.put("QB7x2Q", self.nonce, self.reply, self.echoed_stamp_ns, self.received_ns)

    def encode(self) -> bytes:
        w = Writer()
        self.write(w)
        return bytes(w.data)


@dataclass
class Force:
    TYPE: ClassVar[MessageType] = MessageType.FORCE
    needle: int = 0
    flags: ForceFlag = ForceFlag(0)
    valid_ms: int = 0
    tick: int = 0
    input_sequence: int = 0
    input_stamp_ns: int = 0
    forces: Forces = field(default_factory=lambda: Forces())

    @classmethod
    def read(cls, r: Reader) -> Force:
        needle, flags, valid_ms, tick, input_sequence, input_stamp_ns = r.get("3H2x3Q")
        forces = Forces.read(r)
        return cls(needle, ForceFlag(flags), valid_ms, tick, input_sequence, input_stamp_ns, forces)

    def write(self, w: Writer) -> None:
        w.put("3H2x3Q", self.needle, self.flags, self.valid_ms, self.tick, self.input_sequence, self.input_stamp_ns)
        self.forces.write(w)

    def encode(self) -> bytes:
        w = Writer()
        self.write(w)
        return bytes(w.data)


@dataclass
class LocalModel:
    TYPE: ClassVar[MessageType] = MessageType.LOCAL_MODEL
    needle: int = 0
    flags: ForceFlag = ForceFlag(1)
    contact: int = 0
    tick: int = 0
    input_sequence: int = 0
    input_stamp_ns: int = 0
    reference_tip: Array = field(default_factory=lambda: zeros(np.float64, 3))
    contact_point: Array = field(default_factory=lambda: zeros(np.float64, 3))
    axis: Array = field(default_factory=lambda: zeros(np.float64, 3))
    axial_stiffness_n_per_mm: float = 0.0
    axial_min_n: float = 0.0
    axial_max_n: float = 0.0
    after_puncture_n: float = 0.0
    lateral_n: Array = field(default_factory=lambda: zeros(np.float64, 3))
    lateral_stiffness_n_per_mm: float = 0.0
    time_to_live_s: float = 0.0
    max_force_n: float = 3.3
    max_stiffness_n_per_mm: float = math.inf
    max_slew_n_per_ms: float = 0.5
    ramp_s: float = 0.5

    @classmethod
    def read(cls, r: Reader) -> LocalModel:
        needle, flags, contact, tick, input_sequence, input_stamp_ns = r.get("3H2x3Q")
        reference_tip = r.numbers(np.float64, 3)
        contact_point = r.numbers(np.float64, 3)
        axis = r.numbers(np.float64, 3)
        axial_stiffness_n_per_mm, axial_min_n, axial_max_n, after_puncture_n = r.get("4d")
        lateral_n = r.numbers(np.float64, 3)
        (lateral_stiffness_n_per_mm, time_to_live_s, max_force_n, max_stiffness_n_per_mm, max_slew_n_per_ms,
         ramp_s) = r.get("6d")
        return cls(needle, ForceFlag(flags), contact, tick, input_sequence, input_stamp_ns, reference_tip,
                   contact_point, axis, axial_stiffness_n_per_mm, axial_min_n, axial_max_n, after_puncture_n,
                   lateral_n, lateral_stiffness_n_per_mm, time_to_live_s, max_force_n, max_stiffness_n_per_mm,
                   max_slew_n_per_ms, ramp_s)

    def write(self, w: Writer) -> None:
        w.put("3H2x3Q", self.needle, self.flags, self.contact, self.tick, self.input_sequence, self.input_stamp_ns)
        w.array(self.reference_tip, np.float64, 3)
        w.array(self.contact_point, np.float64, 3)
        w.array(self.axis, np.float64, 3)
        w.put("4d", self.axial_stiffness_n_per_mm, self.axial_min_n, self.axial_max_n, self.after_puncture_n)
        w.array(self.lateral_n, np.float64, 3)
        w.put("6d", self.lateral_stiffness_n_per_mm, self.time_to_live_s, self.max_force_n,
              self.max_stiffness_n_per_mm, self.max_slew_n_per_ms, self.ramp_s)

    def encode(self) -> bytes:
        w = Writer()
        self.write(w)
        return bytes(w.data)


@dataclass
class Arm:
    TYPE: ClassVar[MessageType] = MessageType.ARM
    needle: int = 0

    @classmethod
    def read(cls, r: Reader) -> Arm:
        needle, = r.get("H6x")
        return cls(needle)

    def write(self, w: Writer) -> None:
        w.put("H6x", self.needle)

    def encode(self) -> bytes:
        w = Writer()
        self.write(w)
        return bytes(w.data)


@dataclass
class Drop:
    TYPE: ClassVar[MessageType] = MessageType.DROP
    needle: int = 0
    pressed: bool = False

    @classmethod
    def read(cls, r: Reader) -> Drop:
        needle, pressed = r.get("HB5x")
        return cls(needle, boolean(pressed))

    def write(self, w: Writer) -> None:
        w.put("HB5x", self.needle, self.pressed)

    def encode(self) -> bytes:
        w = Writer()
        self.write(w)
        return bytes(w.data)


@dataclass
class DoseAtSurface:
    surface_gy: FloatArray = field(default_factory=lambda: zeros(np.float32, 0))

    @classmethod
    def read(cls, r: Reader) -> DoseAtSurface:
        count, = r.get("I4x")
        surface_gy = r.numbers(np.float32, count)
        return cls(surface_gy)

    def write(self, w: Writer) -> None:
        w.put("I4x", len(self.surface_gy))
        w.array(self.surface_gy, np.float32, 1)


@dataclass
class DoseWithPlanned:
    structures: List[StructureDose] = field(default_factory=list)

    @classmethod
    def read(cls, r: Reader) -> DoseWithPlanned:
        structure_count, = r.get("H6x")
        structures = [StructureDose.read(r) for _ in range(r.fits(structure_count, 100))]
        return cls(structures)

    def write(self, w: Writer) -> None:
        w.put("H6x", len(self.structures))
        w.each(self.structures)


@dataclass
class DoseFraction:
    catheters: int = 0
    planned_catheters: int = 0
    dwells: int = 0
    seconds: float = 0.0

    @classmethod
    def read(cls, r: Reader) -> DoseFraction:
        catheters, planned_catheters, dwells, seconds = r.get("3I4xd")
        return cls(catheters, planned_catheters, dwells, seconds)

    def write(self, w: Writer) -> None:
        w.put("3I4xd", self.catheters, self.planned_catheters, self.dwells, self.seconds)


@dataclass
class DoseSections:
    at_surface: Optional[DoseAtSurface] = None
    with_planned: Optional[DoseWithPlanned] = None
    fraction: Optional[DoseFraction] = None

    @classmethod
    def read(cls, r: Reader) -> DoseSections:
        made = cls()
        for number, s in r.sections():
            if number == 1:
                made.at_surface = DoseAtSurface.read(s)
            elif number == 2:
                made.with_planned = DoseWithPlanned.read(s)
            elif number == 3:
                made.fraction = DoseFraction.read(s)
            else:
                continue
            s.finish()
        return made

    def write(self, w: Writer) -> None:
        w.sections([(1, self.at_surface), (2, self.with_planned), (3, self.fraction)])


@dataclass
class Dose(views.DoseView):
    TYPE: ClassVar[MessageType] = MessageType.DOSE
    seeds: int = 0
    prescription_gy: float = 0.0
    air_kerma_strength_u: float = 0.0
    structures: List[StructureDose] = field(default_factory=list)
    sections: DoseSections = field(default_factory=lambda: DoseSections())

    @classmethod
    def read(cls, r: Reader) -> Dose:
        seeds, structure_count, prescription_gy, air_kerma_strength_u = r.get("IH2x2d")
        structures = [StructureDose.read(r) for _ in range(r.fits(structure_count, 100))]
        sections = DoseSections.read(r)
        return cls(seeds, prescription_gy, air_kerma_strength_u, structures, sections)

    def write(self, w: Writer) -> None:
        w.put("IH2x2d", self.seeds, len(self.structures), self.prescription_gy, self.air_kerma_strength_u)
        w.each(self.structures)
        self.sections.write(w)

    def encode(self) -> bytes:
        w = Writer()
        self.write(w)
        return bytes(w.data)


@dataclass
class Control:
    TYPE: ClassVar[MessageType] = MessageType.CONTROL
    action: int = 0
    flags: PlayFlag = PlayFlag(0)
    support_radius_mm: float = math.nan
    kernel: str = ""

    @classmethod
    def read(cls, r: Reader) -> Control:
        action, flags, support_radius_mm = r.get("2H4xd")
        kernel = r.text()
        r.skip_sections()
        return cls(action, PlayFlag(flags), support_radius_mm, kernel)

    def write(self, w: Writer) -> None:
        w.put("2H4xd", self.action, self.flags, self.support_radius_mm)
        w.text(self.kernel)
        w.sections([])

    def encode(self) -> bytes:
        w = Writer()
        self.write(w)
        return bytes(w.data)


@dataclass
class SceneProbe:
    needle: int = 0
    diameter_mm: float = 0.0
    length_mm: float = 0.0
    rectal_wall_mm: float = 0.0

    @classmethod
    def read(cls, r: Reader) -> SceneProbe:
        needle, diameter_mm, length_mm, rectal_wall_mm = r.get("H6x3d")
        return cls(needle, diameter_mm, length_mm, rectal_wall_mm)

    def write(self, w: Writer) -> None:
        w.put("H6x3d", self.needle, self.diameter_mm, self.length_mm, self.rectal_wall_mm)


@dataclass
class SceneGoals:
    goals: List[DoseGoal] = field(default_factory=list)

    @classmethod
    def read(cls, r: Reader) -> SceneGoals:
        goal_count, = r.get("H2x")
        goals = [DoseGoal.read(r) for _ in range(r.fits(goal_count, 16))]
        return cls(goals)

    def write(self, w: Writer) -> None:
        w.put("H2x", len(self.goals))
        w.each(self.goals)


@dataclass
class SceneColours:
    colours: List[StructureColour] = field(default_factory=list)

    @classmethod
    def read(cls, r: Reader) -> SceneColours:
        colour_count, = r.get("H2x")
        colours = [StructureColour.read(r) for _ in range(r.fits(colour_count, 6))]
        return cls(colours)

    def write(self, w: Writer) -> None:
        w.put("H2x", len(self.colours))
        w.each(self.colours)


@dataclass
class SceneHoles:
    flags: HoleFlag = HoleFlag(0)

    @classmethod
    def read(cls, r: Reader) -> SceneHoles:
        flags, = r.get("H6x")
        return cls(HoleFlag(flags))

    def write(self, w: Writer) -> None:
        w.put("H6x", self.flags)


@dataclass
class SceneSections:
    probe: Optional[SceneProbe] = None
    goals: Optional[SceneGoals] = None
    colours: Optional[SceneColours] = None
    holes: Optional[SceneHoles] = None

    @classmethod
    def read(cls, r: Reader) -> SceneSections:
        made = cls()
        for number, s in r.sections():
            if number == 1:
                made.probe = SceneProbe.read(s)
            elif number == 2:
                made.goals = SceneGoals.read(s)
            elif number == 3:
                made.colours = SceneColours.read(s)
            elif number == 4:
                made.holes = SceneHoles.read(s)
            else:
                continue
            s.finish()
        return made

    def write(self, w: Writer) -> None:
        w.sections([(1, self.probe), (2, self.goals), (3, self.colours), (4, self.holes)])


@dataclass
class Scene:
    TYPE: ClassVar[MessageType] = MessageType.SCENE
    needle_length_mm: float = 0.0
    needle_diameter_mm: float = 0.0
    seed_length_mm: float = 0.0
    seed_diameter_mm: float = 0.0
    prescription_gy: float = 0.0
    template_origin: Array = field(default_factory=lambda: zeros(np.float64, 3))
    template_spacing_mm: float = 0.0
    template_columns: int = 0
    template_rows: int = 0
    planned_needles: List[PlannedNeedle] = field(default_factory=list)
    planned_seeds: List[PlannedSeed] = field(default_factory=list)
    structures: List[SceneStructure] = field(default_factory=list)
    kernels: List[str] = field(default_factory=list)
    sections: SceneSections = field(default_factory=lambda: SceneSections())

    @classmethod
    def read(cls, r: Reader) -> Scene:
        needle_length_mm, needle_diameter_mm, seed_length_mm, seed_diameter_mm, prescription_gy = r.get("5d")
        template_origin = r.numbers(np.float64, 3)
        (template_spacing_mm, template_columns, template_rows, planned_needle_count,
         planned_seed_count) = r.get("d2H4x2I")
        planned_needles = [PlannedNeedle.read(r) for _ in range(r.fits(planned_needle_count, 26))]
        planned_seeds = [PlannedSeed.read(r) for _ in range(r.fits(planned_seed_count, 56))]
        structure_count, = r.get("H2x")
        structures = [SceneStructure.read(r) for _ in range(r.fits(structure_count, 10))]
        kernel_count, = r.get("H2x")
        kernels = [r.text() for _ in range(r.fits(kernel_count, 2))]
        sections = SceneSections.read(r)
        return cls(needle_length_mm, needle_diameter_mm, seed_length_mm, seed_diameter_mm, prescription_gy,
                   template_origin, template_spacing_mm, template_columns, template_rows, planned_needles,
                   planned_seeds, structures, kernels, sections)

    def write(self, w: Writer) -> None:
        w.put("5d", self.needle_length_mm, self.needle_diameter_mm, self.seed_length_mm, self.seed_diameter_mm,
              self.prescription_gy)
        w.array(self.template_origin, np.float64, 3)
        w.put("d2H4x2I", self.template_spacing_mm, self.template_columns, self.template_rows,
              len(self.planned_needles), len(self.planned_seeds))
        w.each(self.planned_needles)
        w.each(self.planned_seeds)
        w.put("H2x", len(self.structures))
        w.each(self.structures)
        w.put("H2x", len(self.kernels))
        w.texts(self.kernels)
        self.sections.write(w)

    def encode(self) -> bytes:
        w = Writer()
        self.write(w)
        return bytes(w.data)


@dataclass
class Image(views.ImageView):
    TYPE: ClassVar[MessageType] = MessageType.IMAGE
    array: int = 0
    flags: ImageFlag = ImageFlag(0)
    width: int = 0
    height: int = 0
    image_sequence: int = 0
    tick: int = 0
    newest_tick: int = 0
    publish_ns: int = 0
    spacing_mm: float = 0.0
    X_WI: Array = field(default_factory=eye)
    data: bytes = b""

    @classmethod
    def read(cls, r: Reader) -> Image:
        array, flags, width, height, image_sequence, tick, newest_tick, publish_ns, spacing_mm = r.get("4H4Qd")
        checked(width, 0, 4096, "IMAGE", "width")
        checked(height, 0, 4096, "IMAGE", "height")
        X_WI = r.pose()
        data_bytes, = r.get("I")
        data = bytes(r.take(data_bytes))
        r.skip_sections()
        made = cls(array, ImageFlag(flags), width, height, image_sequence, tick, newest_tick, publish_ns, spacing_mm,
                   X_WI, data)
        made.after_read()
        return made

    def write(self, w: Writer) -> None:
        w.put("4H4Qd", self.array, self.flags, self.width, self.height, self.image_sequence, self.tick,
              self.newest_tick, self.publish_ns, self.spacing_mm)
        w.pose(self.X_WI)
        w.put("I", len(self.data))
        w.raw(self.data)
        w.sections([])

    def encode(self) -> bytes:
        w = Writer()
        self.write(w)
        return bytes(w.data)


@dataclass
class Scanner:
    TYPE: ClassVar[MessageType] = MessageType.SCANNER
    array: int = 0
    freeze: int = 0
    flags: ScannerFlag = ScannerFlag(0)
    tick: int = 0
    depth_mm: float = math.nan
    gain_db: float = math.nan
    dynamic_range_db: float = math.nan
    tgc_extra_db_per_cm: float = math.nan
    focus_mm: float = math.nan
    probe_depth_mm: float = math.nan
    probe_rotation_deg: float = math.nan

    @classmethod
    def read(cls, r: Reader) -> Scanner:
        (array, freeze, flags, tick, depth_mm, gain_db, dynamic_range_db, tgc_extra_db_per_cm, focus_mm,
         probe_depth_mm, probe_rotation_deg) = r.get("2HIQ7d")
        r.skip_sections()
        return cls(array, freeze, ScannerFlag(flags), tick, depth_mm, gain_db, dynamic_range_db, tgc_extra_db_per_cm,
                   focus_mm, probe_depth_mm, probe_rotation_deg)

    def write(self, w: Writer) -> None:
        w.put("2HIQ7d", self.array, self.freeze, self.flags, self.tick, self.depth_mm, self.gain_db,
              self.dynamic_range_db, self.tgc_extra_db_per_cm, self.focus_mm, self.probe_depth_mm,
              self.probe_rotation_deg)
        w.sections([])

    def encode(self) -> bytes:
        w = Writer()
        self.write(w)
        return bytes(w.data)


@dataclass
class Load:
    TYPE: ClassVar[MessageType] = MessageType.LOAD
    needle: int = 0
    plan_needle: int = 0

    @classmethod
    def read(cls, r: Reader) -> Load:
        needle, plan_needle = r.get("2H4x")
        return cls(needle, plan_needle)

    def write(self, w: Writer) -> None:
        w.put("2H4x", self.needle, self.plan_needle)

    def encode(self) -> bytes:
        w = Writer()
        self.write(w)
        return bytes(w.data)


@dataclass
class Plan:
    TYPE: ClassVar[MessageType] = MessageType.PLAN
    kind: int = 0
    flags: PlanFlag = PlanFlag(0)
    change: int = 0
    air_kerma_strength_u: float = 0.0
    by: str = ""
    needles: List[PlanNeedle] = field(default_factory=list)

    @classmethod
    def read(cls, r: Reader) -> Plan:
        kind, flags, change, air_kerma_strength_u = r.get("2HId")
        by = r.text()
        needle_count, = r.get("H2x")
        checked(needle_count, 0, 4096, "PLAN", "needle_count")
        needles = [PlanNeedle.read(r) for _ in range(r.fits(needle_count, 20))]
        r.skip_sections()
        return cls(kind, PlanFlag(flags), change, air_kerma_strength_u, by, needles)

    def write(self, w: Writer) -> None:
        w.put("2HId", self.kind, self.flags, self.change, self.air_kerma_strength_u)
        w.text(self.by)
        w.put("H2x", len(self.needles))
        w.each(self.needles)
        w.sections([])

    def encode(self) -> bytes:
        w = Writer()
        self.write(w)
        return bytes(w.data)


@dataclass
class Exercise:
    TYPE: ClassVar[MessageType] = MessageType.EXERCISE
    file: str = ""
    trainee: str = ""

    @classmethod
    def read(cls, r: Reader) -> Exercise:
        file = r.text()
        trainee = r.text()
        r.skip_sections()
        return cls(file, trainee)

    def write(self, w: Writer) -> None:
        w.text(self.file)
        w.text(self.trainee)
        w.sections([])

    def encode(self) -> bytes:
        w = Writer()
        self.write(w)
        return bytes(w.data)


@dataclass
class ContourScore:
    dice: float = 0.0
    outlined_cm3: float = 0.0
    true_cm3: float = 0.0
    same_planes_cm3: float = 0.0
    volume_error_percent: float = 0.0
    hausdorff_mm: float = 0.0
    hausdorff_95_mm: float = 0.0
    mean_mm: float = 0.0
    step_mm: float = 0.0
    missed: int = 0
    beyond: int = 0
    planes: List[SliceScore] = field(default_factory=list)

    @classmethod
    def read(cls, r: Reader) -> ContourScore:
        (dice, outlined_cm3, true_cm3, same_planes_cm3, volume_error_percent, hausdorff_mm, hausdorff_95_mm, mean_mm,
         step_mm, missed, beyond, plane_count) = r.get("9d3H2x")
        planes = [SliceScore.read(r) for _ in range(r.fits(plane_count, 48))]
        return cls(dice, outlined_cm3, true_cm3, same_planes_cm3, volume_error_percent, hausdorff_mm, hausdorff_95_mm,
                   mean_mm, step_mm, missed, beyond, planes)

    def write(self, w: Writer) -> None:
        w.put("9d3H2x", self.dice, self.outlined_cm3, self.true_cm3, self.same_planes_cm3, self.volume_error_percent,
              self.hausdorff_mm, self.hausdorff_95_mm, self.mean_mm, self.step_mm, self.missed, self.beyond,
              len(self.planes))
        w.each(self.planes)


@dataclass
class ContourSections:
    score: Optional[ContourScore] = None

    @classmethod
    def read(cls, r: Reader) -> ContourSections:
        made = cls()
        for number, s in r.sections():
            if number == 1:
                made.score = ContourScore.read(s)
            else:
                continue
            s.finish()
        return made

    def write(self, w: Writer) -> None:
        w.sections([(1, self.score)])


@dataclass
class Contour:
    TYPE: ClassVar[MessageType] = MessageType.CONTOUR
    about_sequence: int = 0
    slices: List[ContourSlice] = field(default_factory=list)
    sections: ContourSections = field(default_factory=lambda: ContourSections())

    @classmethod
    def read(cls, r: Reader) -> Contour:
        about_sequence, slice_count = r.get("QH2x")
        slices = [ContourSlice.read(r) for _ in range(r.fits(slice_count, 120))]
        sections = ContourSections.read(r)
        return cls(about_sequence, slices, sections)

    def write(self, w: Writer) -> None:
        w.put("QH2x", self.about_sequence, len(self.slices))
        w.each(self.slices)
        self.sections.write(w)

    def encode(self) -> bytes:
        w = Writer()
        self.write(w)
        return bytes(w.data)


ServerMessage = Union[Welcome, Topology, Frame, State, Event, Error, Ping, Force, LocalModel, Dose, Scene, Image,
                      Scanner, Plan, Contour]
# Of each type.
MESSAGES: Dict[int, Any] = {
    MessageType.HELLO: Hello,
    MessageType.WELCOME: Welcome,
    MessageType.TOPOLOGY: Topology,
    MessageType.FRAME: Frame,
    MessageType.POSE: Pose,
    MessageType.STATE: State,
    MessageType.EVENT: Event,
    MessageType.ERROR: Error,
    MessageType.PING: Ping,
    MessageType.FORCE: Force,
    MessageType.LOCAL_MODEL: LocalModel,
    MessageType.ARM: Arm,
    MessageType.DROP: Drop,
    MessageType.DOSE: Dose,
    MessageType.CONTROL: Control,
    MessageType.SCENE: Scene,
    MessageType.IMAGE: Image,
    MessageType.SCANNER: Scanner,
    MessageType.LOAD: Load,
    MessageType.PLAN: Plan,
    MessageType.EXERCISE: Exercise,
    MessageType.CONTOUR: Contour,
}
