"""The command of the package."""

import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest

from hapterra import CommandError, _command
from hapterra._command import command, run

OWN = [sys.executable, "-m", "hapterra"]


@pytest.fixture
def package_command(monkeypatch):
    """Selects the package's command, even if the environment names another."""
    monkeypatch.delenv("HAPTERRA", raising=False)


def test_console_script_and_module_are_the_command(package_command):
    script = Path(sys.executable).with_name("hapterra")
    for words in (OWN, [script]):
        result = subprocess.run([*words, "--version"], check=True, capture_output=True, text=True)
        assert result.stdout.startswith("hapterra "), result
    assert run("--version") == result.stdout


def test_command_is_named_by_the_environment(monkeypatch, package_command):
    assert command() == OWN
    monkeypatch.setenv("HAPTERRA", "/opt/hapterra")
    assert command() == ["/opt/hapterra"]


def test_command_starts_without_numpy(package_command):
    code = (
        "import sys, runpy; sys.modules['numpy'] = None; sys.argv = ['hapterra', '--version'];"
        "runpy.run_module('hapterra', run_name='__main__')"
    )
    result = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    assert result.stdout.startswith("hapterra ")


def test_failures_have_the_text_and_the_hint(package_command, tmp_path):
    with pytest.raises(CommandError) as failed:
        run("info", tmp_path / "nothing.tif")
    assert "nothing.tif" in failed.value.message and failed.value.hint
    assert str(failed.value) == f"{failed.value.message}\nhint: {failed.value.hint}"
    with pytest.raises(CommandError) as failed:
        run("info", "--bnd", "2", "nothing.tif")
    assert "unexpected argument '--bnd'" in failed.value.message
    assert "Usage" not in failed.value.message and failed.value.hint is None
    wrong = subprocess.run([*OWN, "inf"], capture_output=True)
    assert wrong.returncode == 2


def test_failure_without_an_error_line_has_the_exit_code():
    failed = _command.error("something else\n", 101)
    assert failed.message == "hapterra ended with exit code 101: something else"
    several = _command.error("note: a\nerror: b\nerror: c: d\nhint: e\n", 1)
    assert (several.message, several.hint) == ("c: d", "e")


def test_command_runs_once_in_a_process():
    code = (
        "from hapterra import _native; assert _native.main(['--version'], []) == 0;"
        "_native.main(['--version'], [])"
    )
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert "RuntimeError: the command has run in this process" in result.stderr


def serving(folder):
    """Returns the arguments of a command that serves until it is interrupted, and its recording."""
    np.save(folder / "flat.npy", np.zeros((50, 50)))
    words = ["run", folder / "flat.npy", "--device", "native", "--out", folder / "felt.csv"]
    return list(map(str, words))


def begun(folder, has_ended):
    """Waits until the recording of `serving` grows, or the command has ended."""
    while not any(it.stat().st_size for it in folder.iterdir() if "felt" in it.name):
        if has_ended():
            return
        time.sleep(0.02)


@pytest.mark.skipif(os.name == "nt", reason="no SIGINT there")
def test_ctrl_c_ends_a_command_cleanly(tmp_path):
    with subprocess.Popen(
        [*OWN, *serving(tmp_path)], stdin=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
    ) as child:
        begun(tmp_path, lambda: child.poll() is not None)
        child.send_signal(signal.SIGINT)
        result = child.communicate()[1]
    assert child.returncode == 0, result
    assert "Traceback" not in result
    assert (tmp_path / "felt.csv").read_text("utf-8").count("\n") > 10


@pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="children are listed in /proc")
def test_killed_worker_is_reported_by_its_guardian(tmp_path):
    with subprocess.Popen(
        [*OWN, *serving(tmp_path)], stdin=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
    ) as child:
        begun(tmp_path, lambda: child.poll() is not None)
        workers = Path(f"/proc/{child.pid}/task/{child.pid}/children").read_text().split()
        for worker in workers:
            os.kill(int(worker), signal.SIGKILL)
        result = child.communicate()[1]
    assert len(workers) == 1 and child.returncode == 128 + signal.SIGKILL, result
    assert "felt.csv" in result and "is incomplete" in result


@pytest.mark.skipif(os.name == "nt", reason="no SIGINT there")
def test_ctrl_c_ends_the_command_of_a_run(tmp_path, package_command, monkeypatch):
    children, start = [], subprocess.Popen

    def popen(*words, **how):
        child = start(*words, **how)
        children.append((child, os.getpgid(child.pid)))
        return child

    monkeypatch.setattr(_command.subprocess, "Popen", popen)

    def interrupt():
        begun(tmp_path, lambda: children and children[0][0].poll() is not None)
        os.kill(os.getpid(), signal.SIGINT)

    thread = threading.Thread(target=interrupt)
    thread.start()
    with pytest.raises(KeyboardInterrupt):
        run(*serving(tmp_path))
    thread.join()
    [(child, group)] = children
    # Not in the terminal's process group, whose Ctrl-C would be a second signal.
    assert child.returncode == 0 and group == child.pid
    assert (tmp_path / "felt.csv").exists()
