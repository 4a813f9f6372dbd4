"""Measures Mitsuba in a process of its own, without plycloth: `python -m benches.theirs '{...}'`.

The files with the curves lie in a folder that the job names; reading them is part of its start-up.
"""

import json
import sys

import mitsuba as mi
import numpy as np

from benches.measure import report

job = json.loads(sys.argv[1])
mi.set_variant(job["variant"])


def bsdf():
    color = {"type": "rgb", "value": job["color"]}
    if job["bsdf"] == "ply":
        return {"type": "principled", "base_color": color, "roughness": 0.4}
    return {"type": "diffuse", "reflectance": color}


def sensor():
    origin = [0, 0, job["distance"] * job["yarns"]]
    view = mi.ScalarTransform4f().look_at(origin, [0, 0, 0], [0, 1, 0])
    film = {"type": "hdrfilm", "width": job["size"], "height": job["size"], "pixel_format": "rgb"}
    film["rfilter"] = {"type": "box"}
    near = {"near_clip": 0.1, "far_clip": 1e5}
    return {"type": "perspective", "fov": job["fov"], "to_world": view, "film": film} | near


def prepare():
    scene = {
        "type": "scene",
        "integrator": {"type": "path", "max_depth": job["depth"]},
        "sensor": sensor(),
        "sky": {"type": "constant"},
    }
    for name in ("warp", "weft"):
        file = f"{job['folder']}/{name}.txt"
        scene[name] = {"type": "linearcurve", "filename": file, "bsdf": bsdf()}
    scene = mi.load_dict(scene)

    def render(spp):
        # Looking at the pixels waits for them: the llvm variants work in the background.
        np.asarray(mi.render(scene, spp=spp)).sum()

    return render


report(prepare, job["size"] ** 2, job["spp"])
