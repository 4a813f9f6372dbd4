"""Measures plycloth in a process of its own: `python -m benches.ours '{...}'`."""

import json
import sys

import plycloth as pc

from benches.measure import report
from benches.scenes import weave

job = json.loads(sys.argv[1])


def prepare():
    scene = weave(job["yarns"], job["bsdf"], job["size"])
    renderer = pc.Renderer(scene, max_depth=job["depth"])
    return lambda spp: renderer.run(spp, progress=False)


report(prepare, job["size"] ** 2, job["spp"])
