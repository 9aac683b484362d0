"""Renders the references of tests/reference.rs with Mitsuba (pip install mitsuba==3.9.1 numpy OpenEXR):

    python tests/reference/make.py [SCENE...]

For each scene of scenes/ it writes the mean of 8192 samples per pixel, 128 x 80 pixels, and the variance of that
mean, estimated from the spread of 32 independent passes.
"""
import sys
from pathlib import Path

import mitsuba as mi
import numpy as np
import OpenEXR

SCENES = """bump coated depth-of-field environment glass instances lamps mask metal penumbra plastic texture""".split()
PASSES, SPP = 32, 256

mi.set_variant("llvm_ad_rgb")
here = Path(__file__).parent


def write(path, pixels):
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    OpenEXR.File(header, {"RGB": pixels.astype(np.float32)}).write(str(path))


for name in sys.argv[1:] or SCENES:
    scene = mi.load_file(str(here / f"../../scenes/{name}.xml"), width="128", height="80")
    mean, squares = 0.0, 0.0
    for seed in range(PASSES):
        picture = np.array(mi.render(scene, spp=SPP, seed=seed), dtype=np.float64)[..., :3]
        step = picture - mean
        mean = mean + step / (seed + 1)
        squares = squares + step * (picture - mean)
    write(here / f"{name}.exr", mean)
    write(here / f"{name}-variance.exr", squares / (PASSES - 1) / PASSES)
    print(name, mean.mean(), flush=True)
