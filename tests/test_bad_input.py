"""Each kind of bad input, and the error that it gets."""

import json
import math
import re

import numpy as np
import plycloth as pc
import pytest
from samples import PLAIN, plain_fabric

NAN = math.nan
BSDF = pc.PlyBsdf()
YARN = pc.RoundYarn(0.1, BSDF)
FABRIC = plain_fabric()
SWATCH = pc.Swatch(FABRIC)
CAMERA = pc.PerspectiveCamera((0, 0, 8), (0, 0, 0))
LIGHT = pc.ConstantLight(1)


LONG = 500 * "x"


def bsdf(**given):
    return lambda: pc.PlyBsdf(**given)


def yarn(**given):
    return lambda: pc.RoundYarn(**({"radius_mm": 0.1, "bsdf": BSDF} | given))


def flat(**given):
    return lambda: pc.FlatYarn(**({"width_mm": 0.2, "bsdf": BSDF} | given))


def fabric(**given):
    return lambda: plain_fabric(**given)


def camera(kind=pc.PerspectiveCamera, **given):
    return lambda: kind(**({"origin": (0, 0, 8), "target": (0, 0, 0)} | given))


def environment(image, **given):
    return lambda: pc.EnvironmentLight(image, **given)


VALUES = [
    # The ply BSDF.
    (bsdf(eta=1.0), r"PlyBsdf\.eta must be in \[1\.01, 3\], not 1\.0"),
    (bsdf(eta=3.5), r"PlyBsdf\.eta must be in \[1\.01, 3\], not 3\.5"),
    (bsdf(eta=NAN), r"PlyBsdf\.eta .* not nan"),
    (bsdf(eta=10**400), r"PlyBsdf\.eta .* not inf"),
    (bsdf(specular_tint=1.5), r"PlyBsdf\.specular_tint must be in \[0, 1\], not 1\.5"),
    (bsdf(transmission_tint=-0.1), r"PlyBsdf\.transmission_tint must be in \[0, 1\], not -0\.1"),
    (bsdf(base_color=(0, 2, 0)), r"PlyBsdf\.base_color\[1\] must be in \[0, 1\], not 2"),
    (bsdf(base_color=(0.5, 0.5)), r"PlyBsdf\.base_color must be 3 numbers, not 2"),
    (bsdf(transmitted_color=(0, NAN, 0)), r"PlyBsdf\.transmitted_color\[1\] .* not nan"),
    (bsdf(body_reflection=1.01), r"PlyBsdf\.body_reflection must be in \[0, 1\], not 1\.01"),
    (bsdf(extinction=-1), r"PlyBsdf\.extinction must be in \[0, 1e\+06\], not -1"),
    (bsdf(extinction=math.inf), r"PlyBsdf\.extinction .* not inf"),
    (bsdf(roughness=0), r"PlyBsdf\.roughness must be in \[0\.001, 1\], not 0"),
    (bsdf(roughness=(0.1, 0.2, 0.3)), r"PlyBsdf\.roughness must be 2 numbers, not 3"),
    (bsdf(exit_roughness=(0.1, 1.5)), r"PlyBsdf\.exit_roughness\[1\] must be in \[0\.001, 1\]"),
    (bsdf(body="conservng"), r"PlyBsdf\.body .* not 'conservng'; the nearest is 'conserving'"),
    (lambda: pc.preset("wool"), r"the preset must be one of 'cotton1', .*, not 'wool'$"),
    (bsdf(body="paper"), r"PlyBsdf\.body .* one of 'conserving', 'printed', not 'paper'$"),
    (lambda: pc.DiffuseBsdf(1.2), r"DiffuseBsdf\.reflectance must be in \[0, 1\], not 1\.2"),
    # Yarns.
    (yarn(radius_mm=0), r"RoundYarn\.radius_mm must be finite and greater than 0, not 0"),
    (yarn(radius_mm=-1), r"RoundYarn\.radius_mm .* not -1"),
    (yarn(radius_mm=NAN), r"RoundYarn\.radius_mm .* not nan"),
    (yarn(radius_mm=math.inf), r"RoundYarn\.radius_mm .* not inf"),
    (yarn(plies=0), r"RoundYarn\.plies must be in \[1, 12\], not 0"),
    (yarn(plies=13), r"RoundYarn\.plies must be in \[1, 12\], not 13"),
    (yarn(pitch_mm=0), r"RoundYarn\.pitch_mm must not be 0; None stands for 8 radii"),
    (yarn(pitch_mm=NAN), r"RoundYarn\.pitch_mm must be finite, not nan"),
    (yarn(ply_radius_mm=0), r"RoundYarn\.ply_radius_mm .* greater than 0, not 0"),
    (yarn(ply_radius_mm=0.06), r"RoundYarn\.ply_radius_mm must be at most 0\.0464.* for 3 plies"),
    (yarn(thickness_mm=0.21), r"RoundYarn\.thickness_mm must be at most twice .* 0\.2, not 0\.21"),
    (yarn(thickness_mm=0), r"RoundYarn\.thickness_mm .* greater than 0, not 0"),
    (yarn(collision_radius_mm=-1), r"RoundYarn\.collision_radius_mm .* greater than 0"),
    (yarn(plies=1, ply_radius_mm=0.2), r"RoundYarn\.ply_radius_mm must be at most 0\.1 for 1 pl"),
    (yarn(stiffness=0), r"RoundYarn\.stiffness must be finite and greater than 0"),
    (flat(width_mm=0), r"FlatYarn\.width_mm must be finite and greater than 0"),
    (flat(thickness_mm=-0.1), r"FlatYarn\.thickness_mm must be finite and greater than 0"),
    (flat(stiffness=NAN), r"FlatYarn\.stiffness .* not nan"),
    (lambda: pc.preset("coton1"), r"preset must be one of .* not 'coton1'; .* 'cotton1'"),
    # Fabrics and swatches.
    (fabric(warp_spacing_mm=0), r"Fabric\.warp_spacing_mm must be finite and greater than 0"),
    (fabric(weft_spacing_mm=[0.3, -1]), r"Fabric\.weft_spacing_mm\[1\] must be .* not -1"),
    (fabric(warp_spacing_mm=[0.3, NAN]), r"Fabric\.warp_spacing_mm\[1\] .* not nan"),
    (fabric(warp_spacing_mm=[1.0] * 3), r"Fabric\.warp_spacing_mm .* pattern's 2 ends, not 3"),
    (fabric(weft_spacing_mm=[1.0]), r"Fabric\.weft_spacing_mm .* pattern's 2 picks, not 1"),
    (fabric(warp_spacing_mm=[]), r"Fabric\.warp_spacing_mm must be an array of n numbers, not 0"),
    (fabric(warp_spacing_mm=[[1.0]]), r"Fabric\.warp_spacing_mm must be an array .* not 1 x 1"),
    (fabric(warp_spacing_mm=0.04), r"Fabric\.warp .* at most 2 spacings, 0\.08 mm, not 0\.1 mm"),
    (fabric(weft=pc.FlatYarn(3, BSDF)), r"Fabric\.weft .* not 1\.5 mm: .* second neighbours"),
    (fabric(warp_colors=np.ones((3, 3))), r"Fabric\.warp_colors .* 2 ends, not 3"),
    (fabric(weft_colors=np.ones((1, 3))), r"Fabric\.weft_colors .* 2 picks, not 1"),
    (fabric(warp_colors=np.ones((2, 4))), r"Fabric\.warp_colors .* n x 3 numbers, not 2 x 4"),
    (fabric(warp_colors=[[1, 1, 1], [1]]), r"Fabric\.warp_colors .* rows differ in length"),
    (fabric(weft_colors=[[1, 1, 1], [0, 0, 255]]), r"Fabric\.weft_colors\[1, 2\] .* \[0, 1\]"),
    (fabric(collision_stiffness=0), r"Fabric\.collision_stiffness .* greater than 0"),
    (lambda: pc.Swatch(FABRIC, 0), r"Swatch\.size_mm must be in \(0, 1e\+08\)"),
    (lambda: pc.Swatch(FABRIC, (1, NAN)), r"Swatch\.size_mm\[1\] .* not nan"),
    (lambda: pc.Swatch(FABRIC, (1, 2, 3)), r"Swatch\.size_mm must be 2 numbers, not 3"),
    # Cameras.
    (camera(target=(0, 0, 8)), r"PerspectiveCamera\.target must differ from PerspectiveCamera\.or"),
    (camera(up=(0, 0, -3)), r"PerspectiveCamera\.up must not be parallel to the view"),
    (camera(up=(0, 0, 0)), r"PerspectiveCamera\.up must have a length greater than 0"),
    (camera(origin=(0, 0)), r"PerspectiveCamera\.origin must be 3 numbers, not 2"),
    (camera(origin=(0, 0, 1e300)), r"PerspectiveCamera\.origin\[2\] must be in \[-1e\+09, 1e"),
    (camera(fov=0), r"PerspectiveCamera\.fov must be in \(0, 180\), not 0"),
    (camera(fov=180), r"PerspectiveCamera\.fov must be in \(0, 180\), not 180"),
    (camera(resolution=(0, 5)), r"PerspectiveCamera\.resolution\[0\] must be in \[1, 65536\]"),
    (camera(resolution=(1, 65537)), r"PerspectiveCamera\.resolution\[1\] must be in \[1, 65536\]"),
    (camera(resolution=(1, 2, 3)), r"PerspectiveCamera\.resolution must be 2 numbers, not 3"),
    (camera(pc.OrthographicCamera, width_mm=0), r"OrthographicCamera\.width_mm .* than 0, not 0"),
    (camera(pc.OrthographicCamera, up=(0, 0, 1)), r"OrthographicCamera\.up must not be parallel"),
    # Lights and scenes.
    (lambda: pc.PointLight((0, 0, NAN), 1), r"PointLight\.position\[2\] .* not nan"),
    (
        lambda: pc.PointLight((0, 0, 1), -1),
        r"PointLight\.intensity must be in \[0, 1e\+15\], not -1",
    ),
    (lambda: pc.PointLight((0, 0, 1), math.inf), r"PointLight\.intensity .* not inf"),
    (lambda: pc.DirectionalLight((0, 0, 0), 1), r"DirectionalLight\.direction .* length greater"),
    (lambda: pc.DirectionalLight((0, 0, 1), (1, -1, 1)), r"DirectionalLight\.irradiance\[1\]"),
    (
        lambda: pc.RectangleLight((0, 0, 1), (1, 2, 0), (2, 4, 0), 1),
        r"RectangleLight\.edge_v must not be parallel to edge_u",
    ),
    (lambda: pc.ConstantLight((1, 2)), r"ConstantLight\.radiance must be 3 numbers, not 2"),
    (environment(np.ones((4, 8))), r"EnvironmentLight\.image .* n x n x 3 numbers, not 4 x 8"),
    (environment(np.ones((0, 8, 3))), r"EnvironmentLight\.image .* not 0 x 8 x 3"),
    (
        environment(np.full((1, 2, 3), -1.0)),
        r"EnvironmentLight\.image\[0, 0, 0\] must be in \[0, 1e\+15\]",
    ),
    (environment(np.full((1, 2, 3), 1e300)), r"EnvironmentLight\.image\[0, 0, 0\] .* not inf"),
    (
        environment(np.ones((1, 2, 3)), scale=-1),
        r"EnvironmentLight\.scale must be in \[0, 1e\+15\], not -1",
    ),
    (environment(np.ones((1, 2, 3)), rotation=NAN), r"EnvironmentLight\.rotation .* not nan"),
    (lambda: pc.Scene(SWATCH, CAMERA, []), r"Scene\.lights must hold at least one light"),
]

TYPES = [
    (bsdf(eta="1.5"), r"PlyBsdf\.eta must be a number, not '1\.5' \(str\)"),
    (bsdf(eta=True), r"PlyBsdf\.eta must be a number, not True"),
    (bsdf(eta=None), r"PlyBsdf\.eta must be a number, not None"),
    (bsdf(eta=1 + 2j), r"PlyBsdf\.eta must be a number, not \(1\+2j\)"),
    (bsdf(base_color="red"), r"PlyBsdf\.base_color must be a number or 3 numbers, not 'red'"),
    (bsdf(base_color=("1", 0, 0)), r"PlyBsdf\.base_color\[0\] must be a number, not '1'"),
    (bsdf(base_color=np.ones((1, 3))), r"PlyBsdf\.base_color .* float64 array of 1 x 3"),
    (bsdf(body=1), r"PlyBsdf\.body must be a name \('conserving', 'printed'\)"),
    (bsdf(beta=0.1), r"unexpected keyword argument 'beta'"),
    (yarn(bsdf="silk"), r"RoundYarn\.bsdf must be a PlyBsdf or DiffuseBsdf, not 'silk'"),
    (yarn(plies=2.5), r"RoundYarn\.plies must be an integer, not a value of type float"),
    (yarn(plies=True), r"RoundYarn\.plies must be an integer, not True"),
    (fabric(pattern=[[True]]), r"Fabric\.pattern must be a WeavePattern, not a value of type list"),
    (fabric(warp=BSDF), r"Fabric\.warp must be a RoundYarn or FlatYarn, not .* PlyBsdf"),
    (fabric(warp_spacing_mm="wide"), r"Fabric\.warp_spacing_mm must hold real numbers, not 'wide'"),
    (fabric(warp_colors=np.ones((2, 3), bool)), r"Fabric\.warp_colors must hold real numbers"),
    (lambda: pc.Swatch(YARN), r"Swatch\.fabric must be a Fabric, not a value of type RoundYarn"),
    (camera(resolution=512), r"PerspectiveCamera\.resolution must be 2 numbers"),
    (camera(resolution=(1.5, 2)), r"PerspectiveCamera\.resolution\[0\] must be an integer"),
    (camera(origin="above"), r"PerspectiveCamera\.origin must be 3 numbers, not 'above'"),
    (lambda: pc.Scene(FABRIC, CAMERA, [LIGHT]), r"Scene\.swatch must be a Swatch, not .* Fabric"),
    (lambda: pc.Scene(SWATCH, LIGHT, [LIGHT]), r"Scene\.camera must be a PerspectiveCamera or Or"),
    (lambda: pc.Scene(SWATCH, CAMERA, LIGHT), r"Scene\.lights must be a sequence of lights"),
    (lambda: pc.Scene(SWATCH, CAMERA, [CAMERA]), r"Scene\.lights\[0\] must be a PointLight or Dir"),
    (environment("sky.exr"), r"EnvironmentLight\.image must hold real numbers, not 'sky\.exr'"),
    (lambda: pc.preset(1), r"the preset must be a name"),
    (
        lambda: pc.save(3, "three.json"),
        r"save takes one of WeavePattern, .*, not a value of type int",
    ),
]


@pytest.mark.parametrize(("make", "message"), VALUES, ids=[message for _, message in VALUES])
def test_values_out_of_range(make, message):
    with pytest.raises(pc.ParameterError, match=message):
        make()


@pytest.mark.parametrize(("make", "message"), TYPES, ids=[message for _, message in TYPES])
def test_wrong_types(make, message):
    with pytest.raises(TypeError, match=message):
        make()


def changed(**changes):
    """Return the text of a pattern's file with keys changed, or left out where None."""
    document = {"plycloth": 1, "type": "WeavePattern", "rows": ["#.", ".#"]} | changes
    return json.dumps({key: value for key, value in document.items() if value is not None})


def yarn_file(bsdf):
    bare = {"type": "RoundYarn", "radius_mm": 0.1, "plies": 3, "pitch_mm": None}
    return json.dumps({"plycloth": 1, "ply_radius_mm": None, "stiffness": 1.0, "bsdf": bsdf} | bare)


DIFFUSE = {"type": "DiffuseBsdf", "reflectance": 0.5}

FILES = [
    ("", r"is not JSON"),
    ("{'plycloth': 1}", r"is not JSON: .* line 1 column 2"),
    ("\ufeff{", r"is not JSON"),
    ("[" * 100_000, r"is not JSON"),
    ("[1, 2]", r"is not a plycloth file: it has no key 'plycloth'"),
    (changed(plycloth=None), r"is not a plycloth file: it has no key 'plycloth'"),
    (changed(plycloth=2), r"plycloth: must be the format 1, not 2"),
    (changed(type=None), r"needs a key 'type', one of WeavePattern, PlyBsdf"),
    (changed(type=3), r"needs a key 'type'"),
    (changed(type="Fabrik"), r"type: 'Fabrik' is unknown; the nearest is 'Fabric'"),
    (changed(type="Wool"), r"type: 'Wool' is unknown; there are 'WeavePattern', .* and \d+ more"),
    (changed(thread=1), r"WeavePattern has no key 'thread'; there are 'rows'"),
    (changed(rows=None), r"WeavePattern lacks the key 'rows'"),
    (changed(row=["#."]), r"WeavePattern has no key 'row'; the nearest is 'rows'"),
    (changed(rows="#."), r"rows must be a list of rows"),
    (changed(rows=[]), r"rows must be a list of rows"),
    (changed(rows=["#.", "#"]), r"rows\[1\] must be 2 of '#' and '\.', not '#'"),
    (changed(rows=["#.", "x#"]), r"rows\[1\] must be 2 of '#' and '\.', not 'x#'"),
    (yarn_file({**DIFFUSE, "reflectance": 2}), r"bsdf: DiffuseBsdf\.reflectance must be in"),
    (yarn_file({**DIFFUSE, "reflectance": NAN}), r"bsdf: DiffuseBsdf\.reflectance .* not nan"),
    (yarn_file({**DIFFUSE, "reflect": 1}), r"bsdf: .* no key 'reflect'; .* 'reflectance'"),
    (yarn_file({"type": "DiffuseBsdf"}), r"bsdf: DiffuseBsdf lacks the key 'reflectance'"),
    (yarn_file({"type": "Diffuse"}), r"bsdf\.type: 'Diffuse' is unknown; .* 'DiffuseBsdf'"),
    (yarn_file(3), r"RoundYarn\.bsdf must be a PlyBsdf or DiffuseBsdf"),
]


@pytest.mark.parametrize(("text", "message"), FILES, ids=[message for _, message in FILES])
def test_broken_files(text, message, tmp_path):
    file = tmp_path / "broken.json"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(pc.FormatError, match=rf"broken\.json: {message}"):
        pc.load(file)


def test_a_file_that_is_not_text(tmp_path):
    (tmp_path / "photo.png").write_bytes(b"\x89PNG\r\n\x1a\n\xff\xfe")
    with pytest.raises(pc.FormatError, match=r"photo\.png: is not JSON"):
        pc.load(tmp_path / "photo.png")


def test_a_file_of_another_kind(tmp_path):
    pc.save(PLAIN, tmp_path / "plain.json")
    with pytest.raises(pc.FormatError, match=r"plain\.json: holds a WeavePattern, not a Fabric"):
        pc.Fabric.load(tmp_path / "plain.json")


def test_no_file(tmp_path):
    with pytest.raises(FileNotFoundError, match="absent"):
        pc.load(tmp_path / "absent.json")


def test_a_draft_too_thick_for_its_spacing():
    with pytest.raises(pc.ParameterError, match=r"Fabric\.warp .* at most 2 spacings"):
        plain_fabric(warp=pc.RoundYarn(1.0, BSDF))


QUOTING = [
    lambda path: pc.preset(LONG),
    lambda path: pc.PlyBsdf(eta=LONG),
    lambda path: pc.RoundYarn(0.1, BSDF, plies=10**400),
    lambda path: pc.overview(FABRIC, LONG),
    lambda path: pc.WeavePattern.from_rows(["#.", LONG]),
    lambda path: pc.WeavePattern.twill(LONG, 1),
    lambda path: pc.datasets.path(LONG),
    lambda path: pc.Draft.from_pattern(PLAIN).recolored({1: LONG}),
    lambda path: pc.render(None, progress=LONG),
    lambda path: pc.fit([LONG], []),
    lambda path: load_text(path, f'{{"plycloth": "{LONG}"}}'),
    lambda path: load_text(path, f'{{"plycloth": 1, "type": "{LONG}"}}'),
    lambda path: load_text(path, f'{{"plycloth": 1, "type": "PlyBsdf", "{LONG}": 1}}'),
    lambda path: load_text(
        path, f'{{"plycloth": 1, "type": "WeavePattern", "rows": ["#.", "{LONG}"]}}'
    ),
]


def load_text(folder, text):
    file = folder / "value.json"
    file.write_text(text)
    return pc.load(file)


@pytest.mark.parametrize("call", QUOTING)
def test_messages_quote_a_part_of_what_is_long(call, tmp_path):
    with pytest.raises((ValueError, TypeError, OSError)) as caught:
        call(tmp_path)
    message = str(caught.value).replace(str(tmp_path), "")
    assert max(map(len, re.findall("x{3,}|0{3,}", message)), default=0) <= 80, message
