"""The same scene for Mitsuba 3 (https://mitsuba-renderer.org), to hold pictures beside each other.

Needs the package `mitsuba`, with a variant chosen by `mitsuba.set_variant`. Cameras, lights and
diffuse round yarns have a counterpart there; the ply BSDF has none.
"""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from plycloth._check import ParameterError
from plycloth.bsdf import DiffuseBsdf
from plycloth.camera import Camera, PerspectiveCamera
from plycloth.fabric import Fabric
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
# As in plycloth's core (src/cloth/twist.rs).
SEGMENTS_PER_TURN = 16
LEAST_SEGMENTS = 8


def to_mitsuba(scene: Scene, folder: str | Path, *, max_depth: int | None = None) -> Plugin:
    """Describe `scene` as a dictionary for `mitsuba.load_dict`.

    Plies become `linearcurve` shapes, whose joints are spheres where those of plycloth are
    elliptical cuts, so pictures agree as far as segments are much longer than their bend.

    Parameters
    ----------
    scene
        Its yarns must be round and diffuse, without colours of their own.
    folder
        Where the files go from which Mitsuba reads curves: `warp.txt` and `weft.txt`.
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
    for name, yarn, colors in (
        ("warp", fabric.warp, fabric.warp_colors),
        ("weft", fabric.weft, fabric.weft_colors),
    ):
        if colors is not None:
            raise ParameterError(f"Fabric.{name}_colors must be None: a curve has one colour")
        path = Path(folder) / f"{name}.txt"
        plugin[name] = _curves(f"Fabric.{name}", yarn, path, ply_curves(scene.swatch, name))
    return plugin


def camera(camera: Camera) -> Plugin:
    """Describe a camera: the same pixels see the same points."""
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


def ply_curves(swatch: Swatch, name: str) -> Array:
    """Compute the centre lines of the plies of all ends, or of all picks, of a swatch.

    The joints are those that plycloth renders (section 3.2), apart from the rounding of heights
    and of the twist that lets it share equal pieces. The swatch holds whole repeats.

    Parameters
    ----------
    swatch
        Its yarns of that name must be round, and not pressed.
    name
        "warp" or "weft".

    Returns
    -------
    ndarray
        Yarns x plies x joints x 3, in millimetres.
    """
    fabric, is_warp = swatch.fabric, name == "warp"
    yarn = fabric.warp if is_warp else fabric.weft
    if not isinstance(yarn, RoundYarn):
        raise ParameterError(f"Fabric.{name} must be a RoundYarn, not a {type(yarn).__name__}")
    if yarn.thickness < 2.0 * yarn.radius_mm:
        raise ParameterError(
            f"Fabric.{name}.thickness_mm must be None: a curve there is round, not pressed"
        )
    repeats = np.round(np.divide(swatch.extent_mm, fabric.repeat_mm)).astype(int)
    # Along the other yarns, from the top or from the left.
    along, across = (repeats[1], repeats[0]) if is_warp else (repeats[0], repeats[1])
    slots, widths = _spacings(fabric, is_warp)
    height, slope = _heights(fabric, is_warp)
    starts = np.append(0.0, np.cumsum(np.tile(slots, along)))
    turns = abs(float(np.mean(slots)) / yarn.pitch) if yarn.plies > 1 else 0.0
    segments = max(LEAST_SEGMENTS, 2 * int(np.ceil(0.5 * SEGMENTS_PER_TURN * turns)))
    s, z, dz = _hermite(np.tile(slots, along), height, slope, along, segments)
    position = np.cumsum(np.tile(widths, across)) - 0.5 * np.tile(widths, across)
    z, dz = np.tile(z, (across, 1)), np.tile(dz, (across, 1))
    angle = 2 * np.pi * (s / yarn.pitch + np.arange(yarn.plies)[:, None] / yarn.plies)
    sideways = yarn.helix_radius * np.cos(angle)
    outwards = -yarn.helix_radius * np.sin(angle)
    # The normal is perpendicular to the tangent (1, dz) in the plane of the yarn and z.
    norm = np.sqrt(1.0 + dz**2)[:, None]
    length, depth = starts[-1], float(np.sum(widths) * across)
    forward = s - outwards * dz[:, None] / norm
    up = z[:, None] + outwards / norm
    aside = position[:, None, None] + sideways - 0.5 * depth
    return _placed(is_warp, forward - 0.5 * length, np.broadcast_to(aside, up.shape), up)


def _placed(is_warp: bool, forward: Array, aside: Array, up: Array) -> Array:
    # Ends run along +y with their side to +x, picks along +x with their side to -y.
    if is_warp:
        return np.stack([aside, forward, up], axis=-1)
    return np.stack([forward, -aside, up], axis=-1)


def _spacings(fabric: Fabric, is_warp: bool) -> tuple[Array, Array]:
    """Return the slots along a yarn of the set, in the direction it runs, and the set's widths."""
    if is_warp:
        return fabric.pick_spacing[::-1], fabric.end_spacing
    return fabric.end_spacing, fabric.pick_spacing


def _heights(fabric: Fabric, is_warp: bool) -> tuple[Array, Array]:
    """Return heights in millimetres and slopes at the knots, in the direction the yarns run."""
    relaxed = fabric.relaxed()
    if is_warp:
        # Knots are counted from the first pick, at the top: turned about, the start becomes the
        # end, which the periodic curve shares.
        height, slope = relaxed.warp_height, -relaxed.warp_slope
        turned = [np.roll(knots[:, ::-1], 1, axis=1) for knots in (height, slope)]
        return turned[0] * fabric.unit_mm, turned[1]
    return relaxed.weft_height * fabric.unit_mm, relaxed.weft_slope


def _hermite(
    slots: Array, height: Array, slope: Array, repeats: int, segments: int
) -> tuple[Array, Array, Array]:
    """Return arc positions and, for each yarn, heights and slopes at all joints."""
    knots = np.append(0.0, np.cumsum(np.repeat(0.5 * slots, 2)))
    height = np.concatenate([np.tile(height, repeats), height[:, :1]], axis=1)
    slope = np.concatenate([np.tile(slope, repeats), slope[:, :1]], axis=1)
    half = segments // 2
    t = np.tile(np.arange(half) / half, len(knots) - 1)
    left = np.repeat(np.arange(len(knots) - 1), half)
    t, left = np.append(t, 1.0), np.append(left, len(knots) - 2)
    step = np.diff(knots)[left]
    h0, h1 = height[:, left], height[:, left + 1]
    m0, m1 = step * slope[:, left], step * slope[:, left + 1]
    rise = h1 - h0
    z = h0 + t * (m0 + t * ((3 * rise - 2 * m0 - m1) + t * (m0 + m1 - 2 * rise)))
    dz = (m0 + t * (2 * (3 * rise - 2 * m0 - m1) + t * 3 * (m0 + m1 - 2 * rise))) / step
    return knots[left] + t * step, z, dz


def _curves(name: str, yarn: Yarn, path: Path, curves: Array) -> Plugin:
    if not isinstance(yarn, RoundYarn) or not isinstance(yarn.bsdf, DiffuseBsdf):
        raise ParameterError(f"{name} must be a RoundYarn with a DiffuseBsdf, not {yarn!r}")
    write_curves(path, curves.reshape(-1, *curves.shape[2:]), yarn.ply_radius)
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
