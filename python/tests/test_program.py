"""The command line that comes with the wheel."""

import shutil
import signal
import subprocess
import sys
import sysconfig

import pytest
from conftest import program

import rtfmesh


def test_it_remeshes_without_the_name_of_a_command(folder, tmp_path):
    out = tmp_path / "out.ply"
    done = program(folder / "torus.ply", out, "-n", "300")
    assert (done.returncode, done.stdout) == (0, "") and "300" in done.stderr
    assert len(rtfmesh.read(out).vertices) == 300


def test_it_is_installed_as_a_command(folder):
    command = shutil.which("rtfmesh", path=sysconfig.get_path("scripts"))
    if command is None:
        pytest.skip("the package was not installed but is used from its sources")
    done = subprocess.run(
        [command, "measure", folder / "torus.ply"], capture_output=True, text=True, timeout=60
    )
    assert done.returncode == 0 and "genus" in done.stdout


@pytest.mark.parametrize(
    ("args", "code", "says"),
    [
        (["--version"], 0, rtfmesh.__version__),
        (["--help"], 0, "Usage: rtfmesh"),
        (["remsh", "a", "b"], 2, "error: unrecognized subcommand 'remsh'"),
        (["missing.ply", "out.ply"], 3, "error: missing.ply: "),
        (["measure"], 2, "error: "),
    ],
)
def test_exit_codes_are_the_programs(args, code, says, tmp_path):
    done = program(*args, cwd=tmp_path)
    assert done.returncode == code and says in done.stdout + done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.skipif(sys.platform == "win32", reason="Ctrl-C goes to all processes of a console there")
def test_ctrl_c_ends_it_with_130(folder, tmp_path):
    # A file with another format's name leads to a note once it is read.
    scan = shutil.copy(folder / "torus.ply", tmp_path / "torus.obj")
    line = [scan, tmp_path / "out.ply", "-n", "1M", "--quality", "best"]
    child = subprocess.Popen(
        [sys.executable, "-m", "rtfmesh", *map(str, line)], stderr=subprocess.PIPE, text=True
    )
    assert child.stderr.readline().startswith("note: ")
    child.send_signal(signal.SIGINT)
    errors = child.communicate(timeout=60)[1]
    assert child.returncode == 130 and "error: cancelled" in errors, errors
    assert not (tmp_path / "out.ply").exists()
