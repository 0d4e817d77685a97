"""Devices: a native one through the command, and a command that a test plays."""

import itertools
import os
import re
import runpy
import signal
import subprocess
import sys
import textwrap
import time
from pathlib import Path

import numpy as np
import pytest

import hapterra
from hapterra import DeviceError, NotDisarmedError, Surface, Terrain, connect
from hapterra._session import Buffer

posix = pytest.mark.skipif(os.name != "posix", reason="signals and scripts of POSIX")
#: A tour of the virtual hand over this takes longer, s.
TOUR_S = 9.0


def hills():
    y, x = np.mgrid[0:121.0, 0:141.0]
    return Terrain(4 * np.sin(x / 15) * np.cos(y / 20), cell_mm=0.7, origin="lower")


def rows_of(recording):
    """The rows of a CSV recording by column."""
    lines = [line for line in recording.read_text("utf-8").splitlines() if line[:1] != "#"]
    rows = [line.split(",") for line in lines[1:]]
    return {name: [row[at] for row in rows] for at, name in enumerate(lines[0].split(","))}


def test_native_device_from_arming_to_disarmed(tmp_path):
    record = tmp_path / "felt.csv"
    with connect("native", record=record) as device:
        assert not device.is_armed and not device.is_disarmed
        device.load(hills(), Surface(friction=0.3, stiffness=0.4), seconds=60)
        device.arm()
        assert device.is_armed and device.fault is None
        with pytest.raises(DeviceError, match="disarm"):
            device.load(hills())
        device.params.friction = 0.2
        device.params.static_friction = 0.35
        device.params.stiffness = 0.6
        device.params.texture = ("grain", 0.1, 1.5)
        device.params.shading = "smooth"
        with pytest.raises(DeviceError, match="a friction of 20"):
            device.params.friction = 20
        with pytest.raises(DeviceError, match="a stiffness of 7.0"):
            device.params.stiffness = 7
        with pytest.raises(DeviceError, match="no such word"):
            device.command("zom 2")
        with pytest.raises(AttributeError, match="fricton"):
            device.params.fricton = 0.2
        assert "friction=0.2, static_friction=0.35" in repr(device.params)
        mark = device.mark("trial 3")
        with pytest.raises(ValueError):
            device.mark("a\nzoom 2")
        assert abs(mark.host_unix_s - time.time()) < 60
        samples = []
        for sample in device.samples():
            samples.append(sample)
            if sample.t_s > mark.t_s + 0.5:
                break
        kinds = {event["event"] for event, _ in zip(device.events(), range(6))}
        assert {"hello", "view", "limits"} <= kinds
    assert device.is_disarmed and not device.is_armed
    ticks = [sample.tick for sample in samples]
    assert ticks == list(range(ticks[0], ticks[0] + len(ticks))) and device.dropped == 0
    rows, text = rows_of(record), record.read_text("utf-8")
    assert f'tick = {mark.tick}' in text and 'text = "trial 3"' in text
    views = re.findall(r"static_mu = ([\d.]+)\n# dynamic_mu = ([\d.]+)", text)
    assert views[:3] == [("0.3", "0.3"), ("0.2", "0.2"), ("0.35", "0.2")], views
    row_of = {int(tick): at for at, tick in enumerate(rows["tick"])}
    for sample in samples[::97]:
        at = row_of[sample.tick]
        hip = [float(rows[name][at]) for name in ("x_mm", "y_mm", "z_mm")]
        force = [float(rows[f"force_{axis}_n"][at]) for axis in "xyz"]
        assert sample.hip_mm == tuple(hip) and sample.force_n == tuple(force)
        assert (sample.state, sample.view) == (rows["state"][at], int(rows["view"][at]))


def test_array_is_loaded_as_it_lies(tmp_path):
    heights = np.arange(12.0).reshape(3, 4)
    heights[0, 0] = np.nan
    path, scale = Terrain(heights, cell_mm=2, origin="lower")._write(tmp_path / "a.npy")
    assert np.array_equal(np.load(path), heights[::-1], equal_nan=True)
    assert scale == {"cell_mm": 2, "height_mm_per_unit": 1}
    opened = Terrain.open(path, cell_mm=2)
    again, _ = opened._write(tmp_path / "b.npy")
    assert np.array_equal(np.load(again), heights[::-1], equal_nan=True)
    with connect("native") as device:
        with pytest.raises(ValueError, match="materials of a Terrain"):
            device.load(Terrain(heights, cell_mm=2, materials=np.zeros((3, 4), int)))
        with pytest.raises(ValueError, match="materials of a surface"):
            device.load(hills(), Surface(materials=[Surface()]))


def test_exception_leaves_the_arm_disarmed(tmp_path):
    with pytest.raises(ZeroDivisionError):
        with connect("native", record=tmp_path / "felt.csv", sample_every=20) as device:
            device.load(hills())
            device.arm()
            1 / 0
    assert device.is_disarmed and (tmp_path / "felt.csv").exists()


def test_what_does_not_open_is_the_commands_error(tmp_path):
    with connect("native") as device:
        with pytest.raises(DeviceError, match="load"):
            device.arm()
        device.load(tmp_path / "nothing.tif")
        with pytest.raises(DeviceError, match="nothing.tif") as failed:
            device.arm()
        assert failed.value.hint
        device.load(hills(), fricton=1)
        with pytest.raises(DeviceError, match="unexpected argument '--fricton'"):
            device.arm()
    with pytest.raises(ValueError, match="is no device"):
        connect("serial")


def test_emulated_board_without_an_image_says_what_to_type(monkeypatch):
    monkeypatch.delenv("HAPTERRA_MPS2_ELF", raising=False)
    with connect("emulated") as device:
        device.load(hills())
        with pytest.raises(DeviceError, match="image") as failed:
            device.arm()
        assert "cargo xtask" in failed.value.hint


@pytest.mark.skipif(
    not os.environ.get("HAPTERRA_MPS2_ELF"), reason="HAPTERRA_MPS2_ELF names no emulated board"
)
def test_emulated_device_from_arming_to_disarmed(tmp_path):
    with connect("emulated", record=tmp_path / "felt.csv", sample_every=10) as device:
        device.load(hills(), Surface(friction=0.3))
        device.arm(timeout=600)
        device.params.friction = 0.2
        mark = device.mark("here")
        assert next(device.samples()).t_s >= 0
    assert device.is_disarmed
    assert f"tick = {mark.tick}" in (tmp_path / "felt.csv").read_text("utf-8")


def test_buffer_keeps_the_newest_and_counts():
    buffer = Buffer(3)
    for number in range(10):
        buffer.put(number)
    buffer.close()
    assert list(buffer) == [7, 8, 9] and buffer.dropped == 7


# Python that dies.

SCRIPT = """
import os, sys, time, hapterra, numpy as np
if __name__ == "__main__":
    sys.path.insert(0, {tests!r})
    from test_connect import hills
    with hapterra.connect("native", record="felt.csv") as device:
        device.load(hills())
        device.arm()
        if {fork} and os.fork() == 0:
            time.sleep(600)
        try:
            print("armed", flush=True)
            for sample in device.samples():
                pass
        except KeyboardInterrupt:
            print("interrupted", flush=True)
            device.disarm()
            print("disarmed", device.is_disarmed, flush=True)
"""


def script(folder, fork=False):
    """Python that serves a native device, armed; in a process group of its own."""
    text = textwrap.dedent(SCRIPT).format(tests=str(Path(__file__).parent), fork=fork)
    words = [sys.executable, "-c", text]
    child = subprocess.Popen(
        words, cwd=folder, stdout=subprocess.PIPE, text=True, start_new_session=True
    )
    assert child.stdout.readline() == "armed\n"
    return child


def ends_early(record):
    """Waits for a recording to be complete, whose session has not come to the end of its tour."""
    until = time.monotonic() + 120
    while not record.exists():
        assert time.monotonic() < until, "the session goes on"
        time.sleep(0.05)
    rows = rows_of(record)
    assert rows["mode"][-1] == "armed" and float(rows["t_s"][-1]) < TOUR_S


@posix
@pytest.mark.parametrize("fork", [False, True], ids=["alone", "with a fork"])
def test_killed_python_leaves_the_arm_disarmed(tmp_path, fork):
    child = script(tmp_path, fork)
    try:
        child.kill()
        ends_early(tmp_path / "felt.csv")
    finally:
        os.killpg(child.pid, signal.SIGKILL)
        child.wait()


@posix
def test_ctrl_c_leaves_the_arm_disarmed(tmp_path):
    child = script(tmp_path)
    # As a terminal sends it: to all processes of the group.
    os.killpg(child.pid, signal.SIGINT)
    told, _ = child.communicate(timeout=120)
    assert told == "interrupted\ndisarmed True\n" and child.returncode == 0
    ends_early(tmp_path / "felt.csv")


# A command that is played.

PLAYED = """\
#!{python}
import json, select, socket, sys
server = socket.create_server(("127.0.0.1", 0))
print("events         127.0.0.1:%d" % server.getsockname()[1], file=sys.stderr, flush=True)
reader = server.accept()[0].makefile("w")
def tell(event, **fields):
    line = dict(event=event, device=1, tick=7, t_s=0.007, **fields)
    print(json.dumps(line), file=reader, flush=True)
def mode(name):
    tell("limits", limits=[], mode=name, fault=None)
tell("view", view=0)
{play}
"""


@pytest.fixture
def played(tmp_path, monkeypatch):
    """Makes the command a script that plays it."""

    def play(text):
        path = tmp_path / "hapterra"
        path.write_text(PLAYED.format(python=sys.executable, play=textwrap.dedent(text)))
        path.chmod(0o755)
        monkeypatch.setenv("HAPTERRA", str(path))

    return play


ASKS = """
lines = ["put the arm into its zero pose, hold it there and press Enter"]
tell("arming", lines=lines, asks=41)
answer = sys.stdin.readline()
tell("arming", lines=lines, asks=41)
# Another answer would come in this time.
select.select([sys.stdin], [], [], 1)
if answer == "enter 41\\n":
    tell("arming", lines=["  DEAD_MAN_RELEASED: press it"], asks=None)
    mode("armed")
sys.stdin.read()
tell("end", disarmed=True)
"""


@posix
def test_question_of_a_real_arm_is_asked_once_and_answered(played):
    played(ASKS)
    asked = []
    with connect("usb") as device:
        device.load(hills())
        device.arm(ask=lambda said: asked.append(said) or True)
        assert device.is_armed
    assert asked == ["put the arm into its zero pose, hold it there and press Enter"]
    assert device.is_disarmed


@posix
@pytest.mark.parametrize("ask", [None, lambda said: False], ids=["no terminal", "no"])
def test_question_without_a_yes_arms_nothing(played, monkeypatch, ask):
    played(ASKS)
    monkeypatch.setattr(sys, "stdin", open(os.devnull))
    with connect("usb") as device:
        device.load(hills())
        with pytest.raises(DeviceError, match="(?s)not answered.*zero pose"):
            device.arm(ask=ask)
        assert device.is_disarmed


@posix
def test_arm_that_is_not_armed_in_time_is_disarmed(played):
    played(
        'tell("arming", lines=["  DEAD_MAN_RELEASED: press it"], asks=None)\n'
        'sys.stdin.read()\ntell("end", disarmed=True)'
    )
    with connect("usb") as device:
        device.load(hills())
        with pytest.raises(DeviceError, match="(?s)not after 1 s.*DEAD_MAN_RELEASED"):
            device.arm(timeout=1)
        assert device.is_disarmed


@posix
@pytest.mark.parametrize("left", [True, False], ids=["disarm", "an exception"])
def test_board_that_does_not_confirm_is_an_error_that_says_so(played, left):
    end = 'tell("end", disarmed=False)\nprint("error: the board did not confirm", file=sys.stderr)'
    played(f'mode("armed")\nsys.stdin.read()\n{end}\nsys.exit(1)')
    with pytest.raises(NotDisarmedError, match="switch the amplifiers off"):
        with connect("usb") as device:
            device.load(hills())
            device.arm()
            if left:
                device.disarm()
            raise ZeroDivisionError
    assert not device.is_disarmed


@posix
def test_command_that_dies_ends_the_samples(played):
    played('mode("armed")\nsys.stdin.readline()\nsys.exit(3)')
    with pytest.raises(NotDisarmedError, match="switch the amplifiers off"):
        with connect("usb") as device:
            device.load(hills())
            device.arm()
            with pytest.raises(DeviceError, match="marks"):
                device.mark("the last line that is read")
            assert list(device.samples()) == [] and not device.is_armed


@posix
def test_board_that_the_guardian_has_disarmed_is_disarmed(played):
    line = "usb: the board has confirmed that it is disarmed"
    played(f'mode("armed")\nsys.stdin.read()\nprint("{line}", file=sys.stderr)\nsys.exit(137)')
    with connect("usb") as device:
        device.load(hills())
        device.arm()
        with pytest.raises(DeviceError, match="exit code 137") as failed:
            device.disarm()
        assert device.is_disarmed and not isinstance(failed.value, NotDisarmedError)


@posix
def test_staircase_asks_a_person_on_an_arm(played, tmp_path, monkeypatch, capsys):
    played("""
    mode("armed")
    log, view = open("log", "w"), 0
    for line in sys.stdin:
        print(line, end="", file=log, flush=True)
        if line.startswith("mark "):
            tell("mark", marked_tick=7, marked_t_s=0.007, host_unix_s=1.0, text=line[5:-1])
        else:
            view += 1
            tell("view", view=view)
    tell("end", disarmed=True)
    """)
    monkeypatch.chdir(tmp_path)
    words = ["friction_jnd.py", "--device", "usb", "--trials", "40", "--out", "jnd.png"]
    monkeypatch.setattr(sys, "argv", words)
    answers = itertools.cycle(["", "", "neither", "1", "", "", "2"])
    monkeypatch.setattr("builtins.input", lambda said: next(answers))
    example = Path(__file__).parent.parent / "examples" / "friction_jnd.py"
    runpy.run_path(str(example), run_name="__main__")
    assert "Weber fraction" in capsys.readouterr().out
    log = (tmp_path / "log").read_text().splitlines()
    frictions = [float(line.split()[1]) for line in log if line.startswith("friction ")]
    pairs = list(zip(frictions[::2], frictions[1::2]))
    assert len(pairs) == 40 and all(min(pair) == 0.4 < max(pair) <= 1.4 for pair in pairs)
    assert [line for line in log if "answer" in line][:2] == ["mark answer 1", "mark answer 2"]


@posix
def test_recording_that_fails_is_an_error_of_a_disarmed_board(played):
    end = 'tell("end", disarmed=True)\nprint("error: disk full\\nhint: delete", file=sys.stderr)'
    played(f'mode("armed")\nsys.stdin.read()\n{end}\nsys.exit(1)')
    with connect("usb") as device:
        device.load(hills())
        device.arm()
        with pytest.raises(DeviceError, match="disk full") as failed:
            device.disarm()
        assert failed.value.hint == "delete" and device.is_disarmed


@posix
def test_samples_that_nobody_takes_are_dropped_and_counted(played):
    flood = """
    mode("armed")
    for tick in range(5000):
        vector = [0.0, 0.0, 0.0]
        what = dict(hip_mm=vector, proxy_mm=vector, force_n=vector)
        tell("sample", **what, state="free", mode="armed", view=tick)
    tell("end", disarmed=True)
    """
    played(flood)
    with connect("usb", buffer=100) as device:
        device.load(hills())
        device.arm()
        device.disarm()
        assert [sample.view for sample in device.samples()] == list(range(4900, 5000))
        assert device.dropped == 4900
