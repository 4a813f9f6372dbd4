"""The stub file of the compiled core says what the core offers: every name and signature."""

import subprocess
import sys


def test_stubs_agree_with_the_module(tmp_path):
    allowed = tmp_path / "allowed"
    # The core makes its own list of public names; a stub needs none.
    allowed.write_text(r"plycloth\._plycloth\.__all__" + "\n", encoding="utf-8")
    command = [sys.executable, "-m", "mypy.stubtest", "plycloth._plycloth", "--concise"]
    result = subprocess.run(
        [*command, "--allowlist", allowed], capture_output=True, text=True, check=False
    )
    assert result.returncode == 0, result.stdout + result.stderr
