"""Large drafts: the memory of their pictures, and what happens where there is not enough of it."""

import subprocess
import sys

import pytest

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="limits memory as Linux does")

# Leaves the process so many bytes more than it has.
LIMIT = """
import re, resource
import numpy as np
import plycloth as pc

def status(key):
    return 1024 * int(re.search(key + r":\\s+(\\d+)", open("/proc/self/status").read())[1])

def leave(bytes):
    has = status("VmSize")
    resource.setrlimit(resource.RLIMIT_AS, (has + bytes, has + bytes))

yarn = pc.RoundYarn(0.4, pc.DiffuseBsdf((0.6, 0.5, 0.4)), plies=3, pitch_mm=4.0)
"""

LARGE = """
fabric = pc.Fabric(pc.WeavePattern(np.ones((9999, 9999), bool)), yarn, yarn, 1.0, 1.0)
scene = pc.overview(fabric, width=64)
"""

# What is done, the bytes there are for it, and who is to say what it takes.
CASES = {
    "relax": ("fabric.relaxed()", 1 << 30, "relaxing 9999 picks x 9999 ends takes 10.0 GB"),
    "render": ("pc.render(scene)", 1 << 30, "relaxing 9999 picks x 9999 ends takes 10.0 GB"),
    "describe": ("pc.render(scene)", 1 << 27, "describing 9999 picks x 9999 ends takes 0.3 GB"),
    "fit yarns": ("fabric.fitted()", 1 << 30, "relaxing 9999 picks x 9999 ends takes 10.0 GB"),
}

# Few crossings to relax, but the twist of its yarns repeats after many.
TWISTED = """
pattern = pc.WeavePattern(np.arange(9999) % 2 == np.arange(2)[:, None])
twisted = pc.RoundYarn(0.4, yarn.bsdf, plies=3, pitch_mm=173.0)
fabric = pc.Fabric(pattern, twisted, yarn, 1.0, 1.0)
scene = pc.overview(fabric, size_mm=(9999.0, 512.0), width=64)
"""


def run(script):
    """What a script prints in a process of its own."""
    command = [sys.executable, "-c", LIMIT + script]
    return subprocess.run(command, check=True, timeout=120, stdout=subprocess.PIPE).stdout


def expect_error(what, bytes_left, message):
    run(f"""
{what[0]}
leave({bytes_left})
try:
    {what[1]}
except MemoryError as error:
    assert {message!r} in str(error), error
else:
    raise AssertionError("no error")
""")


@pytest.mark.parametrize("case", CASES)
def test_memory_that_a_large_draft_cannot_have_is_an_error(case):
    what, bytes_left, message = CASES[case]
    expect_error((LARGE, what), bytes_left, message)


def test_tables_of_blocks_that_there_is_no_room_for_are_an_error():
    expect_error((TWISTED, "pc.render(scene)"), 200 << 20, "rendering")


def test_a_picture_is_the_same_where_no_blocks_can_be_kept():
    run("""
pattern = pc.WeavePattern(np.random.default_rng(3).random((40, 40)) < 0.5)
fabric = pc.Fabric(pattern, yarn, yarn, 1.0, 1.0)
scene = pc.overview(fabric, width=24)
expected = pc.render(scene, spp=2, threads=1, progress=False)
renderer = pc.Renderer(scene, progress=False)
leave(60 << 20)
renderer.run(2, threads=1, progress=False)
np.testing.assert_array_equal(renderer.image().pixels, expected.pixels)
""")


def test_blocks_that_are_kept_take_no_more_than_they_may():
    output = run("""
pattern = pc.WeavePattern(np.random.default_rng(3).random((250, 250)) < 0.5)
fabric = pc.Fabric(pattern, yarn, yarn, 1.0, 1.0)
renderer = pc.Renderer(pc.overview(fabric, width=64), threads=1, progress=False)
before = status("VmHWM")
renderer.run(1, progress=False)
print(status("VmHWM") - before)
""")
    # 96 MB of blocks, and what the one thread remembers.
    assert 60e6 < int(output) < 150e6, output
