"""A picture that is there early and gets better."""

import numpy as np
import plycloth as pc
import pytest
from plycloth.gradual import render_to
from samples import plain_fabric

SCENE = pc.overview(plain_fabric(), width=12)


def saving(seen):
    def save(image, path):
        image.save(path)
        seen.append(image.pixels)

    return save


def test_the_file_holds_every_pass_and_ends_as_the_whole(tmp_path):
    path, seen, told = tmp_path / "out.exr", [], []
    renderer = pc.Renderer(SCENE, seed=4)
    image = render_to(path, renderer, 11, saving(seen), progress=lambda *part: told.append(part))
    whole = pc.render(SCENE, spp=11, seed=4, progress=False)
    assert np.array_equal(image.pixels, whole.pixels)
    assert np.array_equal(pc.read_image(path).pixels, whole.pixels)
    for pixels, spp in zip(seen, (1, 2, 4, 8, 11), strict=True):
        expected = pc.render(SCENE, spp=spp, seed=4, progress=False)
        assert np.array_equal(pixels, expected.pixels)
    done = [part[0] for part in told]
    assert done == sorted(done)
    assert told[-1] == (11 * image.width * image.height,) * 2
    assert [each.name for each in tmp_path.iterdir()] == ["out.exr"]


def test_a_picture_is_replaced_as_a_whole(tmp_path):
    """While a new one is written, the file is the old one; and it stays if writing fails."""
    path = tmp_path / "out.png"
    path.write_bytes(b"before")

    def failing(image, part):
        part.write_bytes(b"half of")
        assert path.read_bytes() == b"before"
        raise OSError(28, "No space left on device", str(part))

    with pytest.raises(OSError, match="No space"):
        render_to(path, pc.Renderer(SCENE), 1, failing, progress=False)
    assert path.read_bytes() == b"before"
    assert [each.name for each in tmp_path.iterdir()] == ["out.png"]


def test_ctrl_c_before_the_first_picture_leaves_the_file_as_it_was(tmp_path, monkeypatch):
    path = tmp_path / "out.png"
    path.write_bytes(b"before")

    def interrupted(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr(pc.Renderer, "run", interrupted)
    with pytest.raises(KeyboardInterrupt):
        render_to(path, pc.Renderer(SCENE), 4, pc.Image.save, progress=False)
    assert path.read_bytes() == b"before"
