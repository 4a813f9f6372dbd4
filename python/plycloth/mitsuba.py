"""The same scene for Mitsuba 3 (https://mitsuba-renderer.org), to hold pictures beside each other.

Needs the package `mitsuba`, with a variant chosen by `mitsuba.set_variant`. Cameras, lights and
diffuse round yarns have a counterpart there; the ply BSDF has none.
"""

from pathlib import Path
from typing import Any, get_args

import numpy as np
from numpy.typing import NDArray

from plycloth._check import ParameterError, instance
from plycloth.bsdf import DiffuseBsdf
from plycloth.camera import Camera, PerspectiveCamera
from plycloth.curves import ply_curves
from plycloth.light import (
    ConstantLight,
    DirectionalLight,
    EnvironmentLight,
    Light,
    PointLight,
    RectangleLight,
)
from plycloth.scene import Scene, Swatch
from plycloth.yarn import RoundYarn, Yarn

Array = NDArray[np.float64]
Plugin = dict[str, Any]

# Mitsuba's word for paths that end by chance alone.
UNLIMITED = -1

_camera = instance(*get_args(Camera))
_light = instance(*get_args(Light))


def to_mitsuba(scene: Scene, folder: str | Path, *, max_depth: int | None = None) -> Plugin:
    """Describe `scene` as a dictionary for `mitsuba.load_dict`.

    Plies become `linearcurve` shapes, whose joints are spheres where those of plycloth are
    elliptical cuts, so pictures agree as far as segments are much longer than their bend.

    Parameters
    ----------
    scene
        Its yarns must be round and diffuse, without colours of their own.
    folder
        Where the files go from which Mitsuba reads curves: `warp.txt` and `weft.txt`, or, where
        yarns of a set differ, `warp_0.txt` and so on, one for each of `Fabric.warp_kinds`.
    max_depth
        Segments of the longest path, counted as by `Renderer`.

    Raises
    ------
    ParameterError
        If a yarn is flat, pressed, coloured, or has the ply BSDF, or the scene has a background.
    ImportError
        If mitsuba is not installed, or no variant is chosen.
    """
    if scene.background is not None:
        raise ParameterError(
            "Scene.background must be None: Mitsuba has no light that is only seen;"
            " overview(..., ground=None) gives none"
        )
    plugin = {
        "type": "scene",
        "integrator": {"type": "path", "max_depth": UNLIMITED if max_depth is None else max_depth},
        "sensor": camera(scene.camera),
    }
    plugin |= {f"light_{i}": light(each) for i, each in enumerate(scene.lights)}
    fabric = scene.swatch.fabric
    for name, kinds, colors in (
        ("warp", fabric.warp_kinds, fabric.warp_colors),
        ("weft", fabric.weft_kinds, fabric.weft_colors),
    ):
        if colors is not None:
            raise ParameterError(f"Fabric.{name}_colors must be None: a curve has one colour")
        for number, yarn in enumerate(kinds):
            shape = name if len(kinds) == 1 else f"{name}_{number}"
            path = Path(folder) / f"{shape}.txt"
            plugin[shape] = _curves(f"Fabric.{name}", yarn, path, scene.swatch, name, number)
    return plugin


def camera(camera: Camera) -> Plugin:
    """Describe a camera: the same pixels see the same points."""
    _camera("camera", camera)
    mi = _mitsuba()
    view = mi.ScalarTransform4f().look_at(camera.origin, camera.target, camera.up)
    distance = float(np.linalg.norm(np.subtract(camera.target, camera.origin)))
    width, height = camera.resolution
    plugin: Plugin = {
        "near_clip": 1e-3 * distance,
        "far_clip": 1e3 * distance,
        "sampler": {"type": "independent"},
        "film": {
            "type": "hdrfilm",
            "width": width,
            "height": height,
            "pixel_format": "rgb",
            "component_format": "float32",
            "rfilter": {"type": "box"},
        },
    }
    if isinstance(camera, PerspectiveCamera):
        return plugin | {
            "type": "perspective",
            "fov": camera.fov,
            "fov_axis": "x",
            "to_world": view,
        }
    half = 0.5 * camera.width_mm
    scale = mi.ScalarTransform4f().scale([half, half, 1.0])
    return plugin | {"type": "orthographic", "to_world": view @ scale}


def light(light: Light) -> Plugin:
    """Describe a light.

    Mitsuba interpolates between the pixels of an environment, which are constant here: the two
    agree to within half a pixel.
    """
    _light("light", light)
    match light:
        case PointLight():
            return {"type": "point", "position": light.position, "intensity": _rgb(light.intensity)}
        case DirectionalLight():
            irradiance = _rgb(light.irradiance)
            return {"type": "directional", "direction": light.direction, "irradiance": irradiance}
        case ConstantLight():
            return {"type": "constant", "radiance": _rgb(light.radiance)}
        case RectangleLight():
            emitter = {"type": "area", "radiance": _rgb(light.radiance)}
            placed = parallelogram(light.center, light.edge_u, light.edge_v)
            return placed | {"emitter": emitter}
        case EnvironmentLight():
            mi = _mitsuba()
            # There a turn is right-handed about +y.
            turn = mi.ScalarTransform4f().rotate([0, 1, 0], light.rotation)
            bitmap = mi.Bitmap(np.array(light.image))
            return {"type": "envmap", "bitmap": bitmap, "scale": light.scale, "to_world": turn}


def parallelogram(center: Any, edge_u: Any, edge_v: Any) -> Plugin:
    """Describe a rectangle by its middle and its full edges."""
    mi = _mitsuba()
    half_u, half_v = 0.5 * np.asarray(edge_u), 0.5 * np.asarray(edge_v)
    normal = np.cross(half_u, half_v)
    matrix = np.eye(4)
    matrix[:3] = np.stack([half_u, half_v, normal / np.linalg.norm(normal), center], axis=1)
    return {"type": "rectangle", "to_world": mi.ScalarTransform4f(matrix)}


def _curves(field: str, yarn: Yarn, path: Path, swatch: Swatch, name: str, kind: int) -> Plugin:
    if not isinstance(yarn, RoundYarn) or not isinstance(yarn.bsdf, DiffuseBsdf):
        raise ParameterError(f"{field} must be a RoundYarn with a DiffuseBsdf, not {yarn!r}")
    if yarn.thickness < 2.0 * yarn.radius_mm:
        raise ParameterError(
            f"{field}.thickness_mm must be None: a curve there is round, not pressed"
        )
    points = ply_curves(swatch, name, kind=kind).points
    write_curves(path, points.reshape(-1, *points.shape[2:]), yarn.ply_radius)
    bsdf = {"type": "diffuse", "reflectance": _rgb(yarn.bsdf.reflectance)}
    return {"type": "linearcurve", "filename": str(path), "bsdf": bsdf}


def write_curves(path: str | Path, curves: Array, radius_mm: float) -> None:
    """Write curves (n x joints x 3) of one radius to a text file that Mitsuba reads."""
    with Path(path).open("w", encoding="ascii") as file:
        for curve in curves:
            np.savetxt(file, np.insert(curve, 3, radius_mm, axis=1), fmt="%.7g")
            file.write("\n")


def _rgb(color: Any) -> Plugin:
    return {"type": "rgb", "value": list(color)}


def _mitsuba() -> Any:
    try:
        import mitsuba
    except ModuleNotFoundError:
        raise ImportError("this needs the package mitsuba: pip install mitsuba") from None
    if mitsuba.variant() is None:
        raise ImportError("choose a variant first, such as mitsuba.set_variant('scalar_rgb')")
    return mitsuba
