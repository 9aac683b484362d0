"""Makes the meshes and pictures of scenes/caustics (pip install numpy scipy pillow):

    python scenes/caustics/make.py

Lathes turn a profile about the z axis; their normals are those of the smooth profile, which caustics need.
"""
from pathlib import Path

import numpy as np
from PIL import Image
from scipy.interpolate import CubicSpline

here = Path(__file__).parent
meshes, textures = here / "../meshes", here / "../textures"


def write(name, comment, parts):
    """A binary PLY of parts (positions, normals, triangles)."""
    first, vertices, faces = 0, [], []
    for p, n, t in parts:
        vertices.append(np.hstack([p, n]).astype("<f4"))
        record = np.zeros(len(t), dtype=[("count", "u1"), ("at", "<u2", 3)])
        record["count"], record["at"] = 3, t + first
        faces.append(record)
        first += len(p)
    assert first < 1 << 16
    count = sum(map(len, faces))
    properties = "".join(f"property float {c}\n" for c in ["x", "y", "z", "nx", "ny", "nz"])
    header = (f"ply\nformat binary_little_endian 1.0\ncomment {comment}\nelement vertex {first}\n{properties}"
              f"element face {count}\nproperty list uchar ushort vertex_indices\nend_header\n")
    data = header.encode() + b"".join(a.tobytes() for a in vertices + faces)
    (meshes / name).write_bytes(data)
    print(name, len(data) // 1000, "kB")


def spline(points):
    """A smooth curve through points (r, z), and its parameter range."""
    points = np.array(points, float)
    s = np.concatenate([[0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
    return CubicSpline(s, points), s[-1]


def lathe(curve, t, around):
    """The surface that curve(t) sweeps about z; its normal is to the right of the curve's direction."""
    p, d = curve(t), curve(t, 1)
    normal = np.stack([d[:, 1], -d[:, 0]], 1) / np.hypot(*d.T)[:, None]
    a = np.arange(around) * 2 * np.pi / around
    turned = lambda v: np.stack([np.outer(v[:, 0], np.cos(a)), np.outer(v[:, 0], np.sin(a)),
                                 np.outer(v[:, 1], np.ones(around))], 2).reshape(-1, 3)
    i, j = np.meshgrid(np.arange(len(t) - 1), np.arange(around), indexing="ij")
    k = (j + 1) % around
    at = lambda row, column: (row * around + column).ravel()
    low, high = np.stack([at(i, j), at(i, k), at(i + 1, k)], 1), np.stack([at(i, j), at(i + 1, k), at(i + 1, j)], 1)
    p[np.abs(p[:, 0]) < 1e-9, 0] = 0
    # At the axis one of the two triangles has no area.
    low = low[np.repeat(p[:-1, 0] > 0, around)]
    high = high[np.repeat(p[1:, 0] > 0, around)]
    return turned(p), turned(normal), np.concatenate([low, high])


def ring():
    # A band with rounded edges: a superellipse between radius 0.96 and 1.08, of height 0.5.
    a = np.linspace(0, 2 * np.pi, 57)
    power = lambda v: np.sign(v) * np.abs(v) ** 0.4
    points = np.stack([1.02 + 0.06 * power(np.cos(a)), 0.26 + 0.25 * power(np.sin(a))], 1)
    curve, end = spline(points)
    write("ring.ply", "a ring of inner radius 0.96", [lathe(curve, np.linspace(0, end, 41), 192)])


def wine_glass():
    outside = [(0, 0.012), (0.5, 0.01), (0.79, 0.006), (0.82, 0.02), (0.79, 0.045), (0.4, 0.085), (0.16, 0.14),
               (0.075, 0.3), (0.06, 0.65), (0.075, 1.05), (0.2, 1.22), (0.52, 1.45), (0.74, 1.85), (0.75, 2.3),
               (0.64, 2.85), (0.625, 2.87)]
    inside = [(0.625, 2.87), (0.61, 2.85), (0.715, 2.3), (0.705, 1.85), (0.5, 1.5), (0.22, 1.31), (0, 1.275)]
    out, end_out = spline(outside)
    into, end_in = spline(inside)
    level = 1.95
    fine = np.linspace(0, end_in, 20000)
    split = fine[np.argmax(into(fine)[:, 1] < level)]
    air = [lathe(out, np.linspace(0, end_out, 64), 64), lathe(into, np.linspace(0, split, 12), 64)]
    write("wine-glass.ply", "what of a glass touches air", air)
    # Seen from the wine, its surface is on the other side.
    p, n, t = lathe(into, np.linspace(split, end_in, 24), 64)
    write("wine.ply", "where wine touches the glass; normals point into the glass", [(p, -n, t[:, ::-1])])
    print(f"wine surface: z {into(split)[1]:.5f}, radius {into(split)[0]:.5f}")


def bulb():
    def profile(radius, neck, top):
        a = np.linspace(-np.pi / 2, 0.75, 12)
        points = [(radius * np.cos(b), radius * np.sin(b)) for b in a]
        points[0] = (0, -radius)
        return points + [(neck + 0.06, 0.72), (neck, 0.95), (neck, top)]
    parts = []
    for radius, neck, top, inwards in [(0.6, 0.24, 1.2, False), (0.57, 0.21, 1.17, True)]:
        curve, end = spline(profile(radius, neck, top))
        p, n, t = lathe(curve, np.linspace(0, end, 40), 64)
        lid = np.arange(64)
        q = np.vstack([p[-64:], [[0, 0, p[-1, 2]]]])
        cover = np.stack([lid, (lid + 1) % 64, np.full(64, 64)], 1)
        up = np.tile([[0.0, 0, 1]], (65, 1))
        for part in [(p, n, t), (q, up, cover)]:
            parts.append((part[0], -part[1], part[2][:, ::-1]) if inwards else part)
    write("bulb.ply", "the glass of a bulb of radius 0.6, outside and inside", parts)


def water():
    nx, ny = 84, 63
    x, y = np.meshgrid(np.linspace(-2.02, 2.02, nx), np.linspace(-1.52, 1.52, ny))
    rng = np.random.default_rng(7)
    z, dx, dy = (np.zeros_like(x) for _ in range(3))
    for _ in range(14):
        length, angle, phase = rng.uniform(0.5, 1.9), rng.uniform(0, 2 * np.pi), rng.uniform(0, 2 * np.pi)
        k = 2 * np.pi / length * np.array([np.cos(angle), np.sin(angle)])
        height = 0.0085 * length
        z += height * np.sin(k[0] * x + k[1] * y + phase)
        dx += height * k[0] * np.cos(k[0] * x + k[1] * y + phase)
        dy += height * k[1] * np.cos(k[0] * x + k[1] * y + phase)
    n = np.stack([-dx, -dy, np.ones_like(x)], 2)
    n /= np.linalg.norm(n, axis=2, keepdims=True)
    i, j = np.meshgrid(np.arange(ny - 1), np.arange(nx - 1), indexing="ij")
    at = lambda row, column: (row * nx + column).ravel()
    t = np.concatenate([np.stack([at(i, j), at(i, j + 1), at(i + 1, j + 1)], 1),
                        np.stack([at(i, j), at(i + 1, j + 1), at(i + 1, j)], 1)])
    write("water.ply", "waves on water", [(np.stack([x, y, z], 2).reshape(-1, 3), n.reshape(-1, 3), t)])


def prism():
    # Equilateral, side 1.3, standing on its triangle.
    a = np.radians([90, 210, 330])
    corner = 1.3 / np.sqrt(3) * np.stack([np.cos(a), np.sin(a)], 1)
    low, high = np.column_stack([corner, [0.004] * 3]), np.column_stack([corner, [0.7] * 3])
    parts = []
    for i in range(3):
        k = (i + 1) % 3
        p = np.array([low[i], low[k], high[k], high[i]])
        n = np.cross(p[1] - p[0], p[3] - p[0])
        parts.append((p, np.tile(n / np.linalg.norm(n), (4, 1)), np.array([[0, 1, 2], [0, 2, 3]])))
    for p, up, t in [(low, -1.0, [[0, 2, 1]]), (high, 1.0, [[0, 1, 2]])]:
        parts.append((p, np.tile([[0, 0, up]], (3, 1)), np.array(t)))
    write("prism.ply", "a prism of side 1.3 and height 0.7", parts)


def pictures():
    # Four pool tiles with joints.
    tiles = np.zeros((64, 64, 3), np.uint8)
    colours = [(118, 190, 200), (140, 204, 208), (132, 198, 210), (110, 182, 198)]
    for c, (x, y) in zip(colours, [(0, 0), (32, 0), (0, 32), (32, 32)]):
        tiles[y:y + 32, x:x + 32] = (214, 226, 224)
        tiles[y + 1:y + 31, x + 1:x + 31] = c
    Image.fromarray(tiles).save(textures / "pool-tiles.png", optimize=True)
    # Three slits for a projector.
    slits = np.zeros((64, 96, 3), np.uint8)
    for x, c in [(30, (255, 70, 40)), (47, (60, 255, 90)), (64, (70, 110, 255))]:
        slits[:, x:x + 3] = c
    Image.fromarray(slits).save(textures / "slits.png", optimize=True)


ring()
wine_glass()
bulb()
water()
prism()
pictures()
