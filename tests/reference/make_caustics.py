"""Renders the references of caustics (tests/reference/caustics.rs) with luxel itself, since Mitsuba has none
(pip install numpy OpenEXR):

    python tests/reference/make_caustics.py LUXEL [SCENE...]

For each scene of scenes/caustics it renders two independent halves with the integrator vcm, writes their mean and
the variance of that mean, and says how far they agree; the median of the squared deviations over that of noise, 1 if they differ
by their noise alone.
"""
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import OpenEXR

# With the radius of the first iteration, an eighth of a pixel and less.
SCENES = {"bulb": 0.02, "marbles": 0.015, "ring": 0.015}
SPP, SIZE = 1024, "48x36"
here = Path(__file__).parent


def write(path, pixels):
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    OpenEXR.File(header, {"RGB": pixels.astype(np.float32)}).write(str(path))


def half(luxel, scene, radius, seed, folder):
    xml = (here / f"../../scenes/caustics/{scene}.xml").read_text()
    radius = f'<integrator type="$integrator">\n<float name="initial_radius" value="{radius}"/>'
    copy = here / f"../../scenes/caustics/{scene}-reference.xml"
    copy.write_text(xml.replace('<integrator type="$integrator">', radius))
    out = Path(folder) / f"{scene}-{seed}.exr"
    try:
        options = ["--spp", str(SPP), "--seed", str(seed), "--resolution", SIZE, "--progress", "never", "-o", str(out)]
        subprocess.run([luxel, "render", str(copy), *options], check=True)
    finally:
        copy.unlink()
    parts = {part.name(): part for part in OpenEXR.File(str(out), separate_channels=True).parts}
    layer = lambda name: np.stack([parts[name].channels[c].pixels for c in "RGB"], 2).astype(np.float64)
    return layer("main"), layer("stderr") ** 2


for name in sys.argv[2:] or SCENES:
    with tempfile.TemporaryDirectory() as folder:
        (a, va), (b, vb) = (half(sys.argv[1], name, SCENES[name], seed, folder) for seed in (101, 202))
    z = (a - b) / np.sqrt(va + vb + 1e-30)
    write(here / f"caustics-{name}.exr", (a + b) / 2)
    write(here / f"caustics-{name}-variance.exr", (va + vb) / 4)
    chi = np.median(z**2) / 0.455
    ratio = np.median(np.abs(a - b) / (a + b + 1e-30)) * 2
    apart = (a - b).mean() / np.sqrt((va + vb).sum()) * a.size
    print(f"{name}: means {a.mean():.6g} and {b.mean():.6g}, {apart:.2f} standard errors apart; median difference "
          f"of a pixel {ratio:.2%}; median of the squared deviations over that of noise {chi:.3f}", flush=True)
