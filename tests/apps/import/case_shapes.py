"""Shapes of a pelvis whose place and volume are known, as contours and as voxels, and what numpy measures on a surface.

Shapes and truth are in patient RAS, mm. A slice frame R has columns along the rows, the columns and the normal of
slices; a plane is at a height along the normal, and its loops are n×2.
"""
import numpy as np

POINTS = 72  # of an outline: the truth is that of the polygon


class Ellipsoid:
    """Half axes along the columns of `turn`."""

    def __init__(self, middle, half, turn=np.eye(3)):
        self.middle, self.half, self.turn = np.array(middle, float), np.array(half, float), np.array(turn)
        self.A = self.turn @ np.diag(1 / self.half ** 2) @ self.turn.T

    def box(self):
        reach = np.sqrt(np.diag(np.linalg.inv(self.A)))
        return self.middle - reach, self.middle + reach

    def holds(self, x):
        d = x - self.middle
        return np.einsum("...i,ij,...j", d, self.A, d) <= 1

    def section(self, R, height, points=POINTS):
        """The loop in the plane, or None."""
        A, c = R.T @ self.A @ R, R.T @ self.middle
        P, q, d = A[:2, :2], A[:2, 2], height - c[2]
        o = -np.linalg.solve(P, q) * d
        rest = 1 - d * d * A[2, 2] - d * q @ o
        if rest <= 1e-4:
            return None
        t = 2 * np.pi * np.arange(points) / points
        circle = np.stack([np.cos(t), np.sin(t)])
        return (c[:2, None] + o[:, None] + np.sqrt(rest) * np.linalg.solve(np.linalg.cholesky(P).T, circle)).T

    def loops(self, R, height):
        loop = self.section(R, height)
        return [] if loop is None else [loop]

    def heights(self, R):
        reach = np.sqrt(R[:, 2] @ np.linalg.inv(self.A) @ R[:, 2])
        at = R[:, 2] @ self.middle
        return at - reach, at + reach


class Shell(Ellipsoid):
    """With a cavity that begins and ends inside."""

    def __init__(self, middle, half, turn=np.eye(3), inner=0.55):
        super().__init__(middle, half, turn)
        self.cavity = Ellipsoid(middle, inner * self.half, turn)

    def holds(self, x):
        return super().holds(x) & ~self.cavity.holds(x)

    def loops(self, R, height):
        return super().loops(R, height) + self.cavity.loops(R, height)


class Tube:
    """About a curve through `middle` that leads mostly along the patient's axis: as a wall with a hole where `wall` is
    given. Its ends lie across the patient's axis, in slices in planes of slices."""

    def __init__(self, middle, half, slope=(0, 0), bend=(0, 0), wall=None):
        self.middle, self.half = np.array(middle, float), np.array(half, float)
        self.slope, self.bend, self.wall = np.array(slope), np.array(bend), wall

    def box(self):
        z = np.linspace(-self.half[2], self.half[2], 41)[:, None]
        way = z * self.slope + z * z * self.bend
        reach = self.half[:2]
        return (np.append(self.middle[:2] + way.min(0) - reach, self.middle[2] - self.half[2]),
                np.append(self.middle[:2] + way.max(0) + reach, self.middle[2] + self.half[2]))

    def holds(self, x):
        z = x[..., 2:] - self.middle[2]
        d = x[..., :2] - self.middle[:2] - z * self.slope - z * z * self.bend
        inside = ((d / self.half[:2]) ** 2).sum(-1) <= 1
        if self.wall:
            inside &= ((d / (self.half[:2] - self.wall)) ** 2).sum(-1) > 1
        return inside & (np.abs(z[..., 0]) <= self.half[2])

    def loops(self, R, height):
        """For slices whose normal is within some 20° of the patient's axis. A slanting plane has the tube's
        section at the height where it meets the curve, at the normal's own sense of height."""
        n = R[:, 2]
        h = height - n @ self.middle
        z = h / n[2]
        for _ in range(20):  # where the curve meets the plane
            z = (h - n[:2] @ (z * self.slope + z * z * self.bend)) / n[2]
        if abs(z) > self.half[2]:
            return []
        at = R.T @ (self.middle + np.append(z * self.slope + z * z * self.bend, z))
        t = 2 * np.pi * np.arange(POINTS) / POINTS
        radii = [self.half[:2]] + ([self.half[:2] - self.wall] if self.wall else [])
        return [at[:2] + r * np.stack([np.cos(t), np.sin(t)], 1) for r in radii]

    def heights(self, R):
        ends = [R[:, 2] @ (self.middle + np.append(z * self.slope + z * z * self.bend, z))
                for z in (-self.half[2], self.half[2])]
        return min(ends), max(ends)


class Fork:
    """Vesicles: one piece below, in Cassini's ovals about two points `apart` mm to either side, parting in two above.
    Across the patient's axis, or in slices near that, as Tube."""

    def __init__(self, middle, half_height, apart):
        self.middle, self.top, self.a = np.array(middle, float), half_height, apart

    def b(self, z):
        return self.a * (1.25 - 0.5 * (z / self.top + 1) / 2)

    def box(self):
        reach = np.array([1.7 * self.a, 1.3 * self.a, self.top])
        return self.middle - reach, self.middle + reach

    def holds(self, x):
        d = x - self.middle
        far = [np.hypot(d[..., 0] + s * self.a, d[..., 1]) for s in (-1, 1)]
        return (far[0] * far[1] <= self.b(d[..., 2]) ** 2) & (np.abs(d[..., 2]) <= self.top)

    def loops(self, R, height):
        z = (height - R[:, 2] @ self.middle) / R[2, 2]
        if abs(z) > self.top:
            return []
        a, b = self.a, self.b(z)
        at = (R.T @ (self.middle + (0, 0, z)))[:2]
        if b > a:
            t = 2 * np.pi * np.arange(2 * POINTS) / (2 * POINTS)
            r = np.sqrt(a * a * np.cos(2 * t) + np.sqrt(b ** 4 - (a * a * np.sin(2 * t)) ** 2))
            return [at + r[:, None] * np.stack([np.cos(t), np.sin(t)], 1)]
        most = 0.5 * np.arcsin(b * b / (a * a))
        t = most * np.sin(np.pi * (np.arange(POINTS // 2) / (POINTS // 2) - 0.5))
        root = np.sqrt(np.maximum(0, b ** 4 - (a * a * np.sin(2 * t)) ** 2))
        far, near = (np.sqrt(np.maximum(0, a * a * np.cos(2 * t) + s * root)) for s in (1, -1))
        r, t = np.concatenate([far, near[::-1]]), np.concatenate([t, t[::-1]])
        loop = r[:, None] * np.stack([np.cos(t), np.sin(t)], 1)
        return [at + loop, at - loop]

    def heights(self, R):
        ends = [R[:, 2] @ (self.middle + (0, 0, z)) for z in (-self.top, self.top)]
        return min(ends), max(ends)


def turned(axis, angle):
    axis = np.asarray(axis, float) / np.linalg.norm(axis)
    K = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    return np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K


def pelvis(rng, at, is_axial):
    """Shapes by what they are. Where slices are not about across the patient's axis, tubes are long ellipsoids."""
    lean = turned(rng.normal(size=3), rng.uniform(0, 0.15))
    half = rng.uniform((17, 13, 15), (28, 22, 26))
    gap = rng.uniform(4, 8)
    long = half[2] + rng.uniform(6, 18)
    rectum = np.array([rng.uniform(11, 17), rng.uniform(10, 16), long])
    bladder = rng.uniform((25, 22, 18), (45, 35, 35))
    bulb = rng.uniform((7, 5, 6), (10, 8, 9))
    head = rng.uniform(20, 25)
    shapes = {"prostate": Ellipsoid(at, half, lean)}
    below = at + (rng.uniform(-3, 3), -half[1] - gap - rectum[1], 0)
    within = at + (0, rng.uniform(-2, 3), 0)
    radius = rng.uniform(2.5, 4.5)
    if is_axial:
        slope = rng.uniform(-0.12, 0.12, 2)
        shapes["urethra"] = Tube(within, (radius, radius, half[2] + 5), slope, rng.uniform(-1, 1, 2) * 0.004)
        shapes["rectum"] = Tube(below, rectum, rng.uniform(-0.1, 0.1, 2), (0, -rng.uniform(0, 0.006)),
                                rng.choice([None, None, 4.0]))
        shapes["seminal_vesicles"] = Fork(at + (0, -half[1] * 0.4, half[2] + 8), rng.uniform(6, 10), rng.uniform(8, 12))
    else:
        shapes["urethra"] = Ellipsoid(within, (radius, radius, half[2] + 8), turned((1, 0, 0), rng.uniform(-0.1, 0.1)))
        shapes["rectum"] = Ellipsoid(below, rectum, turned((1, 0, 0), rng.uniform(-0.2, 0.2)))
    kind = Shell if rng.random() < 0.3 else Ellipsoid
    shapes["bladder"] = kind(at + (0, rng.uniform(4, 12), half[2] + bladder[2] + 3), bladder, lean)
    shapes["penile_bulb"] = Ellipsoid(at + (0, -half[1] / 2, -half[2] - bulb[2] - 10), bulb)
    shapes["left"] = Ellipsoid(at + (-rng.uniform(85, 95), 5, 10), (head, head, head))
    shapes["right"] = Ellipsoid(at + (rng.uniform(85, 95), 5, 10), (head, head, head))
    return shapes


def slice_frame(rng, kind):
    """Rotation to RAS; `kind`: axial, flipped, tilted, or any."""
    axial = np.diag([-1.0, -1, 1])  # rows to the patient's left, columns to the back, as DICOM's
    if kind == "axial":
        return axial
    if kind == "flipped":
        return axial @ np.diag(np.array([[-1, -1, 1], [1, -1, -1], [-1, 1, -1]], float)[rng.integers(3)])
    if kind == "tilted":
        return turned(rng.normal(size=3), rng.uniform(0.05, 0.3)) @ axial
    order, signs = rng.permutation(3), rng.choice([-1, 1], 3)
    R = np.eye(3)[:, order] * signs
    R[:, 2] *= np.sign(np.linalg.det(R))
    return turned(rng.normal(size=3), rng.uniform(0.05, 0.4)) @ R if rng.random() < 0.4 else R


def area_and_middle(polygon):
    start = polygon[0]
    p, q = polygon - start, np.roll(polygon, -1, axis=0) - start
    cross = p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0]
    area = cross.sum() / 2
    return abs(area), start + ((p + q) * cross[:, None]).sum(axis=0) / (6 * area)


def redrawn(rng, polygon):
    """The same contour from another first point, perhaps the other way round, perhaps closed."""
    polygon = np.roll(polygon, int(rng.integers(len(polygon))), axis=0)
    if rng.random() < 0.5:
        polygon = polygon[::-1]
    if rng.random() < 0.2:
        polygon = np.concatenate([polygon, polygon[:1]])
    return polygon


def finer(polygon):
    """With the middles of its edges."""
    middles = (polygon + np.roll(polygon, -1, axis=0)) / 2
    return np.stack([polygon, middles], axis=1).reshape(-1, 2)


def keyhole(outer, hole):
    """One loop that goes to the hole and back along a line."""
    i = int(np.argmin(np.linalg.norm(outer - hole[0], axis=1)))
    hole = hole[::-1]
    j = int(np.argmin(np.linalg.norm(hole - outer[i], axis=1)))
    outer, hole = np.roll(outer, -i, axis=0), np.roll(hole, -j, axis=0)
    return np.concatenate([outer, outer[:1], hole, hole[:1]])


def drawn(rng, shape, R, heights, way):
    """Contours of a shape, n×3 in RAS, in any order; and their truth: what slabs of the loops' areas hold. `way`:
    jitter in mm, twice, keyhole (bools)."""
    spacing = heights[1] - heights[0]
    contours, volume, moment, outlines, planes = [], 0, np.zeros(3), [], []
    for height in heights:
        loops = [loop for loop in shape.loops(R, height) if area_and_middle(loop)[0] > 2]  # pixels
        if not loops:
            continue
        has_hole = len(loops) == 2 and not isinstance(shape, Fork)
        slabs = []
        for n, loop in enumerate(loops):
            area, middle = area_and_middle(loop)
            slabs.append((-1 if has_hole and n == 1 else 1) * area * spacing)
            moment[:2] += slabs[-1] * middle
        if has_hole and way["keyhole"]:
            loops = [keyhole(*loops)]
        for loop in list(loops):
            if way["twice"] and rng.random() < 0.5:
                loops.append(finer(loop) if rng.random() < 0.5 else loop)
        at = [height + way["jitter"] * rng.uniform(-1, 1) for _ in loops]
        contours += [np.column_stack([(p := redrawn(rng, loop)), np.full(len(p), z)]) @ R.T
                     for loop, z in zip(loops, at)]
        volume += sum(slabs)
        moment[2] += sum(slabs) * np.mean(at)
        outlines += loops
        planes.append(height)
    if len(planes) < 4:
        return None
    rng.shuffle(contours)
    every = np.concatenate(outlines)
    return contours, {"cc": volume / 1000, "middle": R @ (moment / volume), "jitter": way["jitter"], "axes": R,
                      "extent": np.append(np.ptp(every, axis=0), planes[-1] - planes[0] + spacing)}


def circle(a, b, middle, points, turn=0.0):
    t = 2 * np.pi * np.arange(points) / points
    x, y = a * np.cos(t), b * np.sin(t)
    c, s = np.cos(turn), np.sin(turn)
    return np.stack([middle[0] + x * c - y * s, middle[1] + x * s + y * c], 1)


class Outlines:
    """Sections in the slices' own frame, by height: ellipsoids, tubes that run as obliquely as 68°, rings with a hole,
    shells whose hole begins and ends inside."""

    def __init__(self, rng, spacing):
        self.kind = ["ellipsoid", "tube", "ring", "shell"][rng.integers(4)]
        points = int(rng.integers(40, 160))
        if self.kind == "tube":
            radius, slope = rng.uniform(1.5, 5), rng.uniform(0, min(2.5, 12 / spacing))
            count = max(4, int(rng.uniform(15, 40) / spacing))
            way = rng.uniform(0, 2 * np.pi)
            self.sections = [(k * spacing, [circle(radius, radius, slope * k * spacing
                                                   * np.array([np.cos(way), np.sin(way)]), points)])
                             for k in range(count)]
            return
        a, b, c = rng.uniform(8, 30, 3)
        count = max(6, int(2 * c / spacing))
        heights = (np.arange(count) - (count - 1) / 2) * spacing
        turn = rng.uniform(0, np.pi)
        top, wall = count * spacing / 2, rng.uniform(2, 6)
        self.sections = []
        for h in heights:
            share = np.sqrt(1 - (h / top) ** 2) if self.kind != "ring" else 1
            loops = [circle(a * share, b * share, (0, 0), points, turn)]
            if self.kind == "ring":
                loops.append(circle(a - wall, b - wall, (0, 0), points, turn))
            elif self.kind == "shell" and abs(h) < 0.5 * top:
                inner = 0.5 * np.sqrt(1 - (h / (0.55 * top)) ** 2)
                loops.append(circle(a * inner, b * inner, (0, 0), points, turn))
            self.sections.append((h, loops))

    def loops(self, _, height):
        return next(loops for h, loops in self.sections if h == height)


class Grid:
    """A grid about shapes, its axes any of RAS's with any signs, turned by `turn` and sheared by `shear`."""

    def __init__(self, shapes, spacing, rng, turn=np.eye(3), shear=0.0, margin=6):
        low = np.min([s.box()[0] for s in shapes.values()], 0) - margin
        high = np.max([s.box()[1] for s in shapes.values()], 0) + margin
        order, signs = rng.permutation(3), rng.choice([-1, 1], 3)
        frame = turn @ np.eye(3)[:, order] * signs
        self.steps = frame * np.asarray(spacing)[order]
        self.steps[:, 2] += shear * self.steps[:, 0]
        corners = np.array(np.meshgrid(*zip(low, high), indexing="ij")).reshape(3, -1)
        at = np.linalg.inv(self.steps) @ corners
        self.size = np.ceil(np.ptp(at, axis=1)).astype(int) + 1
        self.origin = self.steps @ at.min(1)

    def points(self):
        indices = np.stack(np.meshgrid(*(np.arange(n) for n in self.size), indexing="ij"), -1)
        return self.origin + indices @ self.steps.T

    def truth(self, mask):
        count = mask.sum()
        return {"cc": count * abs(np.linalg.det(self.steps)) / 1000,
                "middle": self.origin + self.steps @ np.argwhere(mask).mean(0)}

    def moved(self, transform):
        """`transform`: of points, linear."""
        other = Grid.__new__(Grid)
        other.size, other.origin = self.size, transform(self.origin)
        other.steps = transform(self.steps.T).T
        return other


def surface(path):
    """Vertices and triangles of a PLY that `brachy import` wrote."""
    data = path.read_bytes()
    head, body = data.split(b"end_header\n", 1)
    lines = head.decode().split("\n")
    count = {w[1]: int(w[2]) for w in (line.split() for line in lines) if w[:1] == ["element"]}
    if "format ascii 1.0" in lines:
        rows = body.decode().split("\n")
        v = np.array([row.split()[:3] for row in rows[:count["vertex"]]], float)
        faces = np.array([row.split() for row in rows[count["vertex"]:count["vertex"] + count["face"]]], int)
        assert (faces[:, 0] == 3).all()
        return v, faces[:, 1:]
    wide = any(line.startswith("property double x") for line in lines)
    size = 24 if wide else 12
    v = np.frombuffer(body, "<f8" if wide else "<f4", 3 * count["vertex"]).reshape(-1, 3).astype(float)
    f = np.frombuffer(body[size * count["vertex"]:], np.dtype([("n", "u1"), ("t", "<i4", 3)]), count["face"])["t"]
    return v, f


def measured(v, f):
    """cc and centroid of what a closed surface holds."""
    start = v[0]
    a, b, c = (v[f[:, k]] - start for k in range(3))
    volumes = np.einsum("ij,ij->i", a, np.cross(b, c)) / 6
    return volumes.sum() / 1000, start + (volumes[:, None] * (a + b + c) / 4).sum(axis=0) / volumes.sum()
