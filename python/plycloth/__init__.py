"""plycloth: the look of woven cloth, from a weaving draft to a fitted picture."""

from plycloth import datasets, trade
from plycloth._check import ParameterError
from plycloth._json import FormatError, load, save
from plycloth._plycloth import ConvergenceError, __version__
from plycloth.bsdf import DiffuseBsdf, PlyBsdf
from plycloth.camera import OrthographicCamera, PerspectiveCamera
from plycloth.compare import compare
from plycloth.curves import PlyCurves, ply_curves
from plycloth.draft import Draft
from plycloth.fabric import Fabric
from plycloth.fit import fit
from plycloth.fit_result import FitResult
from plycloth.gradient import value_and_gradient
from plycloth.image import Image
from plycloth.image_file import ImageError, ImageWarning
from plycloth.image_read import read_image
from plycloth.lens import Lens
from plycloth.light import (
    ConstantLight,
    DirectionalLight,
    EnvironmentLight,
    PointLight,
    RectangleLight,
)
from plycloth.overlap import Overlaps, OverlapWarning
from plycloth.overview import overview
from plycloth.photo_exposure import GreyCard
from plycloth.photo_fit import PhotoFit, fit_photographs
from plycloth.photo_geometry import Geometry, YarnGuess
from plycloth.presets import preset, presets
from plycloth.relax import Relaxed, relax
from plycloth.render import Renderer, render
from plycloth.rig import PhotoRig, photo_rig
from plycloth.scatter import Interface, PlyLobes, body_reflection
from plycloth.scene import Scene, Swatch
from plycloth.spacing import ConfidenceWarning, Spacing, estimate_spacing
from plycloth.weave import WeavePattern
from plycloth.wif import WifError, WifWarning, read_wif, write_wif
from plycloth.yarn import FlatYarn, RoundYarn

__all__ = [
    "ConfidenceWarning",
    "ConstantLight",
    "ConvergenceError",
    "DiffuseBsdf",
    "DirectionalLight",
    "Draft",
    "EnvironmentLight",
    "Fabric",
    "FitResult",
    "FlatYarn",
    "FormatError",
    "Geometry",
    "GreyCard",
    "Image",
    "ImageError",
    "ImageWarning",
    "Interface",
    "Lens",
    "OrthographicCamera",
    "OverlapWarning",
    "Overlaps",
    "ParameterError",
    "PerspectiveCamera",
    "PhotoFit",
    "PhotoRig",
    "PlyBsdf",
    "PlyCurves",
    "PlyLobes",
    "PointLight",
    "RectangleLight",
    "Relaxed",
    "Renderer",
    "RoundYarn",
    "Scene",
    "Spacing",
    "Swatch",
    "WeavePattern",
    "WifError",
    "WifWarning",
    "YarnGuess",
    "__version__",
    "body_reflection",
    "compare",
    "datasets",
    "estimate_spacing",
    "fit",
    "fit_photographs",
    "load",
    "overview",
    "photo_rig",
    "ply_curves",
    "preset",
    "presets",
    "read_image",
    "read_wif",
    "relax",
    "render",
    "save",
    "trade",
    "value_and_gradient",
    "write_wif",
]
