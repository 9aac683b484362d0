#!/bin/sh
# The studies that the README shows the figures of: sh scenes/studies/run.sh DIR, some six minutes on two cores.
# A study goes on where it stopped; give LUXEL to use another program than the one that cargo builds.
set -eu
out=${1:?give the folder for the reports}
here=$(cd "$(dirname "$0")" && pwd)
luxel=${LUXEL:-$here/../../target/release/luxel}
mkdir -p "$out"

# Which points: error of soft shadows.
"$luxel" study "$here/samplers.xml" -o "$out/samplers" --vary sampler=independent,sobol --spp 1..256 --runs 8 --reference-time 40s
# Light sampling: 0, 1 or 4 samples of the lamps beside one of the BSDF.
"$luxel" study "$here/light-sampling.xml" -o "$out/light-sampling" --vary lights=0,1,4 --spp 1..64 --runs 8 --reference-time 40s
# Photon counts and radii, against a reference by bidirectional path tracing.
"$luxel" study "$here/photons.xml" -o "$out/photons" --vary photons=1000,10000,100000 --vary radius=0.004,0.01,0.025 \
    --spp 4 --runs 6 --reference-integrator bdpt --reference-time 60s
# The size of radiosity's patches, against path tracing.
"$luxel" study "$here/radiosity.xml" -o "$out/radiosity" --vary patch=0.6,0.3,0.15 --vary show=flat,gouraud \
    --spp 4 --runs 4 --reference-integrator path --reference-time 40s
