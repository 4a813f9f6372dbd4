"""Memory of a large picture: `python -m benches.picture 6000 4000`."""

import resource
import sys
import tempfile
from dataclasses import replace
from pathlib import Path

import plycloth as pc


def peak() -> int:
    """The most memory that this process has taken so far, in bytes (on Linux)."""
    return 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


def main(width: int, height: int) -> None:
    """Render one sample per pixel and save the picture; print peaks per pixel in between."""
    scene = pc.overview(pc.Fabric.from_draft(pc.read_wif(pc.datasets.example_draft())))
    pc.Renderer(replace(scene, camera=replace(scene.camera, resolution=(1, 1))))
    print(f"program and cloth: {peak() / 1e6:.0f} MB")
    scene = replace(scene, camera=replace(scene.camera, resolution=(width, height)))
    renderer = pc.Renderer(scene, max_depth=2)

    def show(what: str) -> None:
        print(f"{what}: {peak() / 1e6:.0f} MB, {peak() / (width * height):.1f} bytes a pixel")

    renderer.run(1)
    show("rendered")
    image = renderer.image()
    show("with its image")
    del renderer
    with tempfile.TemporaryDirectory() as folder:
        for name in ("a.png", "a.exr"):
            image.save(Path(folder) / name)
            show(f"saved as {name[2:]}")


main(*map(int, sys.argv[1:3]))
