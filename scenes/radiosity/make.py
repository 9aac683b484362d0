"""Makes the meshes and pictures of scenes/radiosity, with Python's standard library only:

    python scenes/radiosity/make.py

Lengths are metres, z is up. What is flat has quads that are parallelograms wherever it can: each is one patch.
"""
import math
import random
import struct
import zlib
from pathlib import Path

here = Path(__file__).parent
meshes, textures = here / "../meshes", here / "../textures"
TURN = 2 * math.pi


def add(a, b, s=1.0):
    return tuple(x + s * y for x, y in zip(a, b))


def minus(a, b):
    return add(a, b, -1.0)


def scaled(a, s):
    return tuple(x * s for x in a)


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def unit(a):
    return scaled(a, 1 / math.sqrt(sum(x * x for x in a)))


def polar(r, a, z):
    return (r * math.cos(a), r * math.sin(a), z)


class Mesh:
    """Triangles with shared vertices; corners are given counterclockwise as seen from the front."""

    def __init__(self):
        self.index, self.faces = {}, []

    def at(self, p):
        key = struct.pack("<3f", *(round(x, 5) + 0.0 for x in p))
        return self.index.setdefault(key, len(self.index))

    def polygon(self, *corners):
        k = [self.at(p) for p in corners]
        for i in range(1, len(k) - 1):
            if len({k[0], k[i], k[i + 1]}) == 3:
                self.faces.append((k[0], k[i], k[i + 1]))

    def box(self, low, high, without=""):
        """A box with normals outwards; `without` names sides to leave out: of -x +x -y +y -z +z."""
        x, y, z = zip(low, high)
        sides = {
            "-x": [(0, 1, 0), (0, 0, 0), (0, 0, 1), (0, 1, 1)],
            "+x": [(1, 0, 0), (1, 1, 0), (1, 1, 1), (1, 0, 1)],
            "-y": [(0, 0, 0), (1, 0, 0), (1, 0, 1), (0, 0, 1)],
            "+y": [(1, 1, 0), (0, 1, 0), (0, 1, 1), (1, 1, 1)],
            "-z": [(0, 1, 0), (1, 1, 0), (1, 0, 0), (0, 0, 0)],
            "+z": [(0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)],
        }
        for name, corners in sides.items():
            if name not in without.split():
                self.polygon(*((x[i], y[j], z[k]) for i, j, k in corners))

    def ring(self, profile, around, centre=(0, 0), start=0.0):
        """What a profile of (r, z) sweeps about a vertical axis; the front is to the right of its direction."""
        for (r, z), (s, t) in zip(profile, profile[1:]):
            for i in range(around):
                a, b = (start + TURN * (i + k) / around for k in (0, 1))
                c = (*centre, 0)
                self.polygon(*(add(c, p) for p in (polar(r, a, z), polar(r, b, z), polar(s, b, t), polar(s, a, t))))

    def recess(self, o, u, v, margins, depth, panel=None):
        """A rectangle o, u, v with a rectangular recess: left, right, low and high margins, and a depth.

        Its bottom goes to the mesh `panel`. The front is that of u x v.
        """
        left, right, low, high = margins
        w, h = (math.sqrt(sum(x * x for x in e)) for e in (u, v))
        p = lambda x, y, z=0.0: add(add(add(o, unit(u), x), unit(v), y), unit(cross(u, v)), -z)
        quad = lambda *c: self.polygon(*(p(*x) for x in c))
        x0, x1, y0, y1 = left, w - right, low, h - high
        if low > 0:
            quad((0, 0), (w, 0), (w, y0), (0, y0))
        if high > 0:
            quad((0, y1), (w, y1), (w, h), (0, h))
        if left > 0:
            quad((0, y0), (x0, y0), (x0, y1), (0, y1))
        if right > 0:
            quad((x1, y0), (w, y0), (w, y1), (x1, y1))
        corners = [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]
        for a, b in zip(corners, corners[1:] + corners[:1]):
            quad(a, b, (*b, depth), (*a, depth))
        (panel or self).polygon(*(p(*c, depth) for c in corners))

    def write(self, name, comment):
        count = len(self.index)
        assert count < 1 << 16
        header = (f"ply\nformat binary_little_endian 1.0\ncomment {comment}\nelement vertex {count}\n"
                  "property float x\nproperty float y\nproperty float z\n"
                  f"element face {len(self.faces)}\nproperty list uchar ushort vertex_indices\nend_header\n")
        data = header.encode() + b"".join(self.index) + b"".join(struct.pack("<B3H", 3, *f) for f in self.faces)
        (meshes / name).write_bytes(data)
        print(name, len(self.faces), "triangles", len(data) // 1000, "kB")


def png(name, width, height, colour):
    """A picture of at most 256 colours: `colour(x, y)` is (r, g, b) of 0..255 at a pixel, y downwards."""
    palette, rows = {}, []
    for y in range(height):
        pixels = (tuple(int(c) for c in colour(x, y)) for x in range(width))
        rows.append(b"\0" + bytes(palette.setdefault(p, len(palette)) for p in pixels))
    chunk = lambda kind, data: struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    data = (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 3, 0, 0, 0))
            + chunk(b"PLTE", b"".join(bytes(p) for p in palette)) + chunk(b"IDAT", zlib.compress(b"".join(rows), 9))
            + chunk(b"IEND", b""))
    (textures / name).write_bytes(data)
    print(name, len(data), "bytes")


# The hall: a nave of |x| < 3.05 between columns at |x| = 3.4, aisles up to |x| = 5.6, 0 < y < LENGTH.
LENGTH, BAY, SPRING, RADIUS, SIDES = 20.4, 3.6, 5.6, 3.12, 9


def columns():
    """Doric: a plinth, a round base, a shaft of 20 flutes, a round capital and its slab."""
    mesh = Mesh()
    for x in (-3.4, 3.4):
        for k in range(6):
            y = 1.2 + BAY * k
            mesh.box((x - 0.45, y - 0.45, 0), (x + 0.45, y + 0.45, 0.2), "-z")
            mesh.ring([(0.45, 0.2), (0.45, 0.32), (0.37, 0.4), (0.28, 0.4)], 20, (x, y))
            for i in range(40):
                r, s = (0.34, 0.305) if i % 2 == 0 else (0.305, 0.34)
                a, b = TURN * i / 40, TURN * (i + 1) / 40
                p = lambda r, a, z: add((x, y, 0), polar(r, a, z))
                mesh.polygon(p(r, a, 0.4), p(s, b, 0.4), p(s, b, 4.05), p(r, a, 4.05))
            mesh.ring([(0.28, 4.05), (0.36, 4.05), (0.36, 4.12), (0.47, 4.32)], 20, (x, y))
            mesh.box((x - 0.48, y - 0.48, 4.32), (x + 0.48, y + 0.48, 4.6))
    # The beam that they carry, with a cornice to the nave.
    for s in (-1, 1):
        low, high = sorted((s * 3.05, s * 3.75))
        mesh.box((low, 0, 4.6), (high, LENGTH, 5.45), "-y +y +z")
        low, high = sorted((s * 2.93, s * 3.75))
        mesh.box((low, 0, 5.45), (high, LENGTH, SPRING), "-y +y")
    mesh.write("hall-columns.ply", "twelve columns and what lies on them")


def vault():
    """A barrel of coffers; those along its crown are the skylights."""
    mesh, panels, lamps = Mesh(), Mesh(), Mesh()
    rows = round(LENGTH / 1.2)
    for i in range(SIDES):
        a, b = (math.pi * (1 - k / SIDES) for k in (i, i + 1))
        o, u = (RADIUS * math.cos(a), 0, SPRING + RADIUS * math.sin(a)), (0, LENGTH / rows, 0)
        v = minus((RADIUS * math.cos(b), 0, SPRING + RADIUS * math.sin(b)), o)
        for j in range(rows):
            at = add(o, u, j)
            if i == SIDES // 2:
                mesh.recess(at, u, v, [0.14] * 4, 0.3, lamps)
            else:
                mesh.recess(at, u, v, [0.17] * 4, 0.16, panels)
    mesh.write("hall-vault.ply", "a barrel vault of coffers, without their bottoms")
    panels.write("hall-coffers.ply", "the bottoms of the coffers")
    lamps.write("hall-skylights.ply", "the skylights in the crown of the vault")


def walls():
    """The end walls of nave and aisles; in the far one is the doorway to the side room, 2.4 wide and 3.8 high."""
    mesh = Mesh()
    e = LENGTH
    quad = mesh.polygon
    quad((5.6, 0, 0), (-5.6, 0, 0), (-5.6, 0, 9), (5.6, 0, 9))
    quad((-5.6, e, 0), (-1.2, e, 0), (-1.2, e, 3.8), (-5.6, e, 3.8))
    quad((1.2, e, 0), (5.6, e, 0), (5.6, e, 3.8), (1.2, e, 3.8))
    quad((-5.6, e, 3.8), (5.6, e, 3.8), (5.6, e, 9), (-5.6, e, 9))
    # The doorway is 0.6 deep.
    f = e + 0.6
    quad((-1.2, e, 0), (-1.2, f, 0), (-1.2, f, 3.8), (-1.2, e, 3.8))
    quad((1.2, f, 0), (1.2, e, 0), (1.2, e, 3.8), (1.2, f, 3.8))
    quad((-1.2, e, 3.8), (-1.2, f, 3.8), (1.2, f, 3.8), (1.2, e, 3.8))
    quad((-1.2, e, 0), (1.2, e, 0), (1.2, f, 0), (-1.2, f, 0))
    mesh.write("hall-walls.ply", "the end walls of the hall, and its doorway")


def side_room():
    """Walls and ceiling of the room beyond the doorway: 6.4 wide, 5 deep, 4.6 high."""
    mesh = Mesh()
    f, g, x, z = LENGTH + 0.6, LENGTH + 5.6, 3.2, 4.6
    quad = mesh.polygon
    quad((-x, g, 0), (x, g, 0), (x, g, z), (-x, g, z))
    quad((-x, f, 0), (-x, g, 0), (-x, g, z), (-x, f, z))
    quad((x, g, 0), (x, f, 0), (x, f, z), (x, g, z))
    quad((-x, f, z), (-x, g, z), (x, g, z), (x, f, z))
    quad((-1.2, f, 0), (-x, f, 0), (-x, f, 3.8), (-1.2, f, 3.8))
    quad((x, f, 0), (1.2, f, 0), (1.2, f, 3.8), (x, f, 3.8))
    quad((x, f, 3.8), (-x, f, 3.8), (-x, f, z), (x, f, z))
    mesh.write("hall-side-room.ply", "a room behind the hall")


def knot():
    """A trefoil knot, about 1.6 across, upright, its centre at the origin."""
    mesh, along, around, r = Mesh(), 108, 12, 0.125
    def curve(t):
        w = 0.42 + 0.23 * math.cos(3 * t)
        return (w * math.cos(2 * t) * 1.05, 0.27 * math.sin(3 * t), w * math.sin(2 * t) * 1.05)
    rings = []
    for i in range(along):
        t = TURN * i / along
        d = unit(minus(curve(t + 1e-4), curve(t - 1e-4)))
        # A frame that closes: the side is away from the axis of the knot.
        side = curve(t)
        side = unit(add(side, d, -sum(x * y for x, y in zip(side, d))))
        up = cross(d, side)
        rings.append([add(add(curve(t), side, r * math.cos(TURN * j / around)), up, r * math.sin(TURN * j / around))
                      for j in range(around)])
    for i in range(along):
        for j in range(around):
            a, b, k = rings[i], rings[(i + 1) % along], (j + 1) % around
            mesh.polygon(a[j], a[k], b[k], b[j])
    mesh.write("knot.ply", "a trefoil knot")


def vase():
    """A vase with a foot and a lip, 0.52 high, on the plane z = 0."""
    outside = [(0, 0), (0.1, 0), (0.105, 0.012), (0.07, 0.035), (0.075, 0.06), (0.135, 0.15), (0.165, 0.25),
               (0.155, 0.33), (0.1, 0.4), (0.062, 0.43), (0.06, 0.47), (0.095, 0.515), (0.1, 0.52)]
    inside = [(0.088, 0.52), (0.05, 0.46), (0.05, 0.43), (0.09, 0.38), (0.14, 0.25), (0.06, 0.06), (0, 0.05)]
    mesh = Mesh()
    mesh.ring(outside + inside, 24)
    mesh.write("vase.ply", "a vase")


def case():
    """Four panes and a lid, 0.64 wide and 0.8 high, on the plane z = 0."""
    mesh = Mesh()
    mesh.box((-0.32, -0.32, 0), (0.32, 0.32, 0.8), "-z")
    mesh.write("case.ply", "a case without a bottom")


def frames():
    """Frames of the pictures on the long walls: boxes, and a recess where the picture goes."""
    mesh = Mesh()
    for s in (-1, 1):
        for k, (w, h) in enumerate([(1.5, 1.1), (2.0, 1.4), (1.5, 1.1), (2.0, 1.4), (1.5, 1.1)]):
            y = 3.0 + BAY * k
            at = (s * 5.54, y + s * (w / 2 + 0.09), 2.35 - h / 2 - 0.09)
            u, v = (0, -s * (w + 0.18), 0), (0, 0, h + 0.18)
            mesh.recess(at, u, v, [0.09] * 4, 0.03, Mesh())
            low, high = sorted((s * 5.54, s * 5.6))
            c = w / 2 + 0.09
            mesh.box((low, y - c, at[2]), (high, y + c, at[2] + h + 0.18), "-x +x")
    mesh.write("hall-frames.ply", "ten frames")


def paintings():
    def hills(x, y):
        # Evening: bands of sky, a low sun and three rows of hills.
        if (x - 66) ** 2 + (y - 30) ** 2 < 90:
            return (250, 226, 150)
        for base, high, phase, c in [(58, 5, 2.0, (44, 40, 66)), (50, 6, 0.5, (92, 62, 88)),
                                     (42, 7, 4.0, (150, 84, 88))]:
            if y > base + high * math.sin(x / 14 + phase):
                return c
        return [(120, 96, 140), (176, 112, 130), (222, 140, 108), (240, 174, 110), (246, 200, 124)][min(y // 9, 4)]

    def sea(x, y):
        if 40 < y < 43 + 0.2 * (x - 50) and 34 < x < 62:
            return (96, 50, 34)
        if x < 50 and y < 39 and x > 50 - (y - 8) * 0.55:
            return (244, 238, 222)
        if x > 51 and 12 < y < 39 and x < 51 + (y - 12) * 0.35:
            return (226, 196, 150)
        if y > 40:
            return [(38, 98, 128), (50, 118, 146), (30, 82, 114)][int((y + 2 * math.sin(x / 6)) / 4) % 3]
        return [(176, 212, 226), (196, 222, 228), (214, 230, 228)][min(y // 14, 2)]

    def disks(x, y):
        for cx, cy, r, c in [(30, 26, 14, (236, 178, 60)), (40, 44, 20, (34, 74, 120)), (66, 30, 24, (196, 58, 44)),
                             (78, 52, 12, (30, 30, 36))]:
            d = math.hypot(x - cx, y - cy)
            if d < r:
                return c if d > 0.45 * r else add(scaled(c, 0.6), (90, 86, 78))
        return (226, 218, 200)

    for k, picture in enumerate([hills, sea, disks]):
        png(f"painting-{k + 1}.png", 96, 70, picture)

    # Two by two floor tiles, light and dark, each with veins of its own.
    rng = random.Random(5)
    waves = [[(rng.uniform(2, 7), rng.uniform(-4, 4), rng.uniform(0, TURN)) for _ in range(5)] for _ in range(4)]
    def tiles(x, y):
        i, j = x // 48, y // 48
        if x % 48 in (0, 47) or y % 48 in (0, 47):
            return (120, 112, 100)
        v = sum(math.sin(TURN * (a * x + b * y) / 96 + c) / (1 + k) for k, (a, b, c) in enumerate(waves[2 * j + i]))
        v = math.floor(3 * max(0.0, 1 - abs(v) * 1.6)) / 3
        light, dark = (214, 200, 176), (120, 72, 56)
        return add(light, (-34, -34, -34), v) if (i + j) % 2 == 0 else add(dark, (44, 34, 30), v)
    png("marble-tiles.png", 96, 96, tiles)


# The stair tower: 24 steps a turn about the z axis, between radius EYE and OUTER; after STEPS steps a landing.
EYE, OUTER, RISE, AROUND, STEPS, LANDING, TOP = 1.35, 3.6, 0.17, 24, 72, 7, 16.0


def level(i):
    """Height of the tread of step i."""
    return RISE * min(i + 1, STEPS)


def angle(i):
    return TURN * i / AROUND


def stairs():
    mesh = Mesh()
    for i in range(STEPS + LANDING):
        a, b, z = angle(i), angle(i + 1), level(i)
        low = max(z - 0.24, 0.0)
        corners = [(EYE, a), (OUTER, a), (OUTER, b), (EYE, b)]
        i_a, o_a, o_b, i_b = (lambda z, r=r, c=c: polar(r, c, z) for r, c in corners)
        mesh.polygon(i_a(z), o_a(z), o_b(z), i_b(z))
        mesh.polygon(i_b(low), i_a(low), i_a(z), i_b(z))
        if low > 0:
            mesh.polygon(i_a(low), i_b(low), o_b(low), o_a(low))
        before = level(i - 1) if i else 0.0
        if before < z:
            mesh.polygon(i_a(before), o_a(before), o_a(z), i_a(z))
        after = max(level(i + 1) - 0.24, 0.0) if i + 1 < STEPS + LANDING else z
        if low < after:
            mesh.polygon(o_b(low), i_b(low), i_b(after), o_b(after))
    mesh.write("stairs-steps.ply", "the steps of a round stair")


def bar(mesh, r, a, low, high, half=0.011):
    """An upright square bar about (r, a), its sides towards the axis."""
    across, along = polar(half, a, 0), polar(half, a + TURN / 4, 0)
    p = lambda x, y, z: add(add(polar(r, a, z), across, x), along, y)
    corners = [(-1, -1), (1, -1), (1, 1), (-1, 1)]
    for c, d in zip(corners, corners[1:] + corners[:1]):
        mesh.polygon(p(*c, low), p(*d, low), p(*d, high), p(*c, high))


def railing():
    """Two bars on each step, and a handrail; at the end of the landing it turns to the wall."""
    mesh, r, rail = Mesh(), EYE + 0.07, Mesh()
    height = lambda i: RISE * min(i + 1, STEPS) + 0.92
    for i in range(STEPS + LANDING):
        for f in (0.25, 0.75):
            bar(mesh, r, angle(i + f), level(i), height(i - 0.5 + f) if i < STEPS else height(i))
        p = lambda k, d, h: polar(r + d, angle(k), height(k - 0.5) + h)
        ring = [(-0.03, 0), (0.03, 0), (0.03, 0.045), (-0.03, 0.045)]
        for c, d in zip(ring, ring[1:] + ring[:1]):
            # Counterclockwise as seen by who climbs; the end of a segment is turned to the right by that.
            rail.polygon(p(i, *d), p(i, *c), p(i + 1, *c), p(i + 1, *d))
    end, z = angle(STEPS + LANDING - 0.06), level(STEPS)
    for k in range(1, 20):
        bar(mesh, r + 0.11 * k, end, z, z + 0.92)
    across, along = polar(1, end, 0), polar(0.03, end + TURN / 4, 0)
    p = lambda x, y, h: add(add((0, 0, z + 0.92 + h), across, x), along, y)
    for (y, h), (v, w) in [((-1, 0), (-1, 0.045)), ((-1, 0.045), (1, 0.045)), ((1, 0.045), (1, 0)), ((1, 0), (-1, 0))]:
        rail.polygon(p(r, v, w), p(r, y, h), p(OUTER, y, h), p(OUTER, v, w))
    mesh.write("stairs-bars.ply", "the bars of the railing")
    rail.write("stairs-rail.ply", "the handrail")


def tower():
    """Walls in three parts: plaster, the painted band over the treads, and what shines in the windows."""
    plaster, band, panes = Mesh(), Mesh(), Mesh()
    turns = STEPS // AROUND
    windows = {(3, 0), (12, 0), (20, 1), (7, 1), (16, 2), (1, 2)}
    for k in range(AROUND):
        a, b = angle(k), angle(k + 1)
        # As seen from the axis, a is at the right.
        def wall(mesh, low, high, window=False):
            o, e = polar(OUTER, a, low), polar(OUTER, b, low)
            u, v = minus(o, e), (0, 0, high - low)
            if window:
                mesh.recess(e, u, v, [0.2, 0.2, 0.35, high - low - 1.95], 0.35, panes)
            else:
                mesh.polygon(e, o, add(o, v), add(e, v))
        wall(plaster, 0, level(k))
        for turn in range(turns + 1):
            i = k + AROUND * turn
            on_stair = i < STEPS + LANDING
            low = level(i) if on_stair else level(i - AROUND) + AROUND * RISE
            high = TOP if turn == turns else level(i) + AROUND * RISE
            if not on_stair:
                wall(plaster, low, high)
                continue
            if i + AROUND >= STEPS + LANDING:
                high = low + AROUND * RISE if turn < turns else TOP
            elif turn == turns - 1:
                high = level(i + AROUND)
            wall(band, low, low + 1.05)
            wall(plaster, low + 1.05, high, (k, turn) in windows)
    # The ceiling and the drum of its skylight.
    for k in range(AROUND):
        a, b = angle(k), angle(k + 1)
        plaster.polygon(polar(1.5, a, TOP), polar(1.5, b, TOP), polar(OUTER, b, TOP), polar(OUTER, a, TOP))
        plaster.polygon(polar(1.5, b, TOP), polar(1.5, a, TOP), polar(1.5, a, TOP + 0.6), polar(1.5, b, TOP + 0.6))
    plaster.write("stairs-walls.ply", "the plaster of the tower")
    band.write("stairs-band.ply", "the painted band along the stair")
    panes.write("stairs-windows.ply", "the windows of the tower")


columns()
vault()
walls()
side_room()
knot()
vase()
case()
frames()
paintings()
stairs()
railing()
tower()
