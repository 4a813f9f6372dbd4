"""Descriptions that several tests use."""

import numpy as np
import plycloth as pc
import pytest
from plycloth.weave import WeavePattern

PLAIN = WeavePattern([[True, False], [False, True]])
TALL = WeavePattern([[True, False, True], [False, True, False]] * 2)  # 4 picks x 3 ends

# No two of its parameters alike, none at a bound.
TINTED = pc.PlyBsdf(
    eta=1.45,
    specular_tint=0.9,
    transmission_tint=(0.9, 0.7, 0.5),
    base_color=(0.7, 0.4, 0.2),
    transmitted_color=(0.6, 0.3, 0.2),
    extinction=4.0,
    roughness=(0.25, 0.4),
    exit_roughness=(0.3, 0.6),
)


def plain_fabric(**changes):
    # Pressed a little, so that none pass through each other.
    yarn = pc.RoundYarn(0.1, pc.PlyBsdf(), thickness_mm=0.16, collision_radius_mm=0.1)
    given = {"pattern": PLAIN, "warp": yarn, "weft": yarn} | {
        "warp_spacing_mm": 0.25,
        "weft_spacing_mm": 0.5,
    }
    return pc.Fabric(**(given | changes))


def every_description():
    colored = plain_fabric(warp_colors=[[1, 0, 0.5], [0, 1, 0.25]], warp_spacing_mm=[0.2, 0.3])
    camera = pc.PerspectiveCamera((0, 0, 8), (0, 0, 0))
    lights = (
        pc.PointLight((0, 8, 8), 300),
        pc.DirectionalLight((0, 0, -1), (1, 2, 3)),
        pc.RectangleLight((0, 0, 5), (1, 0, 0), (0, -1, 0), 2),
        pc.ConstantLight(0.5),
        pc.EnvironmentLight(np.full((2, 4, 3), 0.1), scale=2, rotation=30),
    )
    return [
        pc.PlyBsdf(eta=1.4, base_color=0.3, body="printed"),
        pc.DiffuseBsdf(0.2),
        pc.RoundYarn(0.2, pc.PlyBsdf(), plies=2, pitch_mm=-1.5, thickness_mm=0.3),
        pc.FlatYarn(0.3, pc.DiffuseBsdf()),
        colored,
        pc.Swatch(colored, (3, 4)),
        camera,
        pc.OrthographicCamera((0, 0, 8), (0, 0, 0), width_mm=3, resolution=(40, 30)),
        *lights,
        pc.Scene(pc.Swatch(colored), camera, lights),
        pc.Scene(pc.Swatch(colored), camera, lights, background=(0.2, 0.3, 0.4)),
    ]


each_description = pytest.mark.parametrize(
    "value", every_description(), ids=lambda value: type(value).__name__
)
